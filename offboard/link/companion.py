"""What the app tells over MAVLink, as a component of the vehicle's system: onboard computer, component 191.

MAVSDK speaks as a ground station and forwards between its connections, so the companion has a local one of
its own: what it sends there goes on to the vehicle, which passes it on to the links of ground stations.

MAVSDK counts every heartbeat of the vehicle's system as a sign of life. So that the companion's never hide
that the autopilot's have ended, each is sent only upon one of the autopilot's.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import time
from collections import deque
from math import inf
from typing import Any

from wire.dialect import AUTOPILOT_COMPONENT_ID, companion_heartbeat, mavlink
from wire.mission_tunnel import (
    COMPONENT_ID,
    DETECTIONS_TYPE,
    DOCUMENT_TYPE,
    STATE_TYPE,
    DocumentKind,
    MissionDetections,
    MissionState,
    PayloadError,
    encode_detections,
    encode_state,
)

BEAT_S = 0.05  # wall time; what is not told at a tick is told at a beat
PIECES_A_BEAT = 2  # of new documents: 6 kB/s at most, so that a slow link has room for setpoints
REPEAT_BEATS = 10  # between two pieces of the round of all documents
SILENT_S = 0.25  # wall time; a state is repeated while no tick brings another
FAREWELL_GAP_S = 0.15
_TEXT_BYTES = 50  # of one STATUSTEXT
_MOST_CHUNKS = 4
_TUNNEL_BYTES = 128
_PACKETS_A_BEAT = 1000
_MAVLINK_2 = 0xFD  # the first byte of a packet

logger = logging.getLogger(__name__)


class Companion:
    """Sends without ever waiting. What cannot be sent is lost: to be heard must not matter to the flight.

    Attributes:
        sent: packets handed to MAVSDK.
    """

    def __init__(self) -> None:
        """Nothing is opened yet; documents and a state may be told already."""
        self.sent = 0
        self._port: socket.socket | None = None
        self._peer: Any = None
        self._sender: Any = None
        self._autopilot = b""  # its system and component id
        self._task: asyncio.Task[None] | None = None
        self._documents: dict[DocumentKind, list[bytes]] = {}
        self._fresh: dict[DocumentKind, deque[bytes]] = {}
        self._turn = 0
        self._beats = 0
        self._state = b""
        self._state_s = -inf
        self._text_id = 0

    def listen(self) -> str:
        """Open a local UDP port.

        Returns:
            The URL for MAVSDK to forward to.

        Raises:
            OSError: there is none.
        """
        self._port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._port.setblocking(False)
        self._port.bind(("127.0.0.1", 0))
        return f"udpout://127.0.0.1:{self._port.getsockname()[1]}"

    def announce(self, system_id: int) -> None:
        """Speak as a component of this vehicle from now on (within a running event loop)."""
        self._sender = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=COMPONENT_ID)
        self._autopilot = bytes((system_id, AUTOPILOT_COMPONENT_ID))
        if self._task is None:
            self._task = asyncio.create_task(self._beat_on(), name="companion")

    async def close(self) -> None:
        """Fall silent."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None
        if self._port is not None:
            self._port.close()
            self._port = None

    def tell_state(self, state: MissionState) -> None:
        """Send where the mission is; it is repeated at the beats while nothing newer is told."""
        try:
            self._state = encode_state(state)
        except PayloadError as error:
            logger.warning("not told: %s", error)
            return
        self._send_state()

    def tell_detections(self, detections: MissionDetections) -> None:
        """Send what an image showed."""
        try:
            payload = encode_detections(detections)
        except PayloadError as error:
            logger.warning("not told: %s", error)
            return
        self._send_tunnel(DETECTIONS_TYPE, payload)

    def tell_document(self, kind: DocumentKind, pieces: list[bytes]) -> None:
        """Send a document of `split_document` at the next beats, then again and again in the round of all."""
        self._documents[kind] = pieces
        self._fresh[kind] = deque(pieces)

    def say(self, text: str) -> None:
        """Send a text for people, severity INFO; one that is too long for one message goes in several."""
        words = text.encode("utf-8", "replace")[: _MOST_CHUNKS * _TEXT_BYTES]
        if len(words) <= _TEXT_BYTES:
            self._send(mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_INFO, words))
            return
        self._text_id = self._text_id % 0xFFFF + 1
        # The last one must end with a zero, so there is one more if the text fills them exactly.
        for number in range(len(words) // _TEXT_BYTES + 1):
            chunk = words[number * _TEXT_BYTES : (number + 1) * _TEXT_BYTES]
            self._send(
                mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_INFO, chunk, self._text_id, number)
            )

    def beat(self) -> None:
        """Send what is due besides the ticks: heartbeat, pieces of documents, a state that has grown old."""
        if self._hear_autopilot():
            self._send(companion_heartbeat())
        if self._peer is None:
            return
        if self._state and time.monotonic() - self._state_s > SILENT_S:
            self._send_state()
        for _ in range(PIECES_A_BEAT):
            piece = self._next_fresh()
            if piece is None:
                break
            self._send_tunnel(DOCUMENT_TYPE, piece)
        if self._beats % REPEAT_BEATS == 0:
            self._repeat_piece()
        self._beats += 1

    async def farewell(self, kind: DocumentKind) -> None:
        """Send all of a document twice and let it arrive: the link is about to be closed. Takes 0.3 s."""
        for _ in range(2):
            for piece in self._documents.get(kind, ()):
                self._send_tunnel(DOCUMENT_TYPE, piece)
            await asyncio.sleep(FAREWELL_GAP_S)

    async def _beat_on(self) -> None:
        while True:
            try:
                self.beat()
            except Exception as error:  # the flight goes on whatever happens here
                logger.warning("nothing is told of the mission any more: %r", error)
                return
            await asyncio.sleep(BEAT_S)

    def _hear_autopilot(self) -> bool:
        """Take all that MAVSDK forwarded; whether a heartbeat of the vehicle's autopilot was among it."""
        heard = False
        if self._port is None:
            return False
        with contextlib.suppress(OSError):  # there is no more
            for _ in range(_PACKETS_A_BEAT):
                data, peer = self._port.recvfrom(512)
                self._peer = self._peer or peer
                heard = heard or self._is_heartbeat(data)
        return heard

    def _is_heartbeat(self, data: bytes) -> bool:
        if len(data) < 10:
            return False
        source, message_id = (data[5:7], data[7:10]) if data[0] == _MAVLINK_2 else (data[3:5], data[5:6])
        return source == self._autopilot and not any(message_id)

    def _next_fresh(self) -> bytes | None:
        """A piece not sent yet: of the newest kinds first, as the mission's own document is the longest."""
        for kind in reversed(DocumentKind):
            if self._fresh.get(kind):
                return self._fresh[kind].popleft()
        return None

    def _repeat_piece(self) -> None:
        pieces = [piece for kind in sorted(self._documents) for piece in self._documents[kind]]
        if pieces:
            self._send_tunnel(DOCUMENT_TYPE, pieces[self._turn % len(pieces)])
            self._turn += 1

    def _send_state(self) -> None:
        self._state_s = time.monotonic()
        self._send_tunnel(STATE_TYPE, self._state)

    def _send_tunnel(self, payload_type: int, payload: bytes) -> None:
        padded = payload.ljust(_TUNNEL_BYTES, b"\0")
        self._send(mavlink.MAVLink_tunnel_message(0, 0, payload_type, len(payload), padded))

    def _send(self, message: Any) -> None:  # noqa: ANN401 - pymavlink is untyped
        sender, port = self._sender, self._port
        if sender is None or port is None or self._peer is None:
            return
        data = message.pack(sender)
        sender.seq = (sender.seq + 1) % 256
        with contextlib.suppress(OSError):
            port.sendto(data, self._peer)
            self.sent += 1
