"""Reports the mission over MAVLink, as a component of the vehicle's system: onboard computer, component 191.

MAVSDK is a ground station and forwards between its connections, so the companion has a local connection of
its own: what it sends there is forwarded to the vehicle, which forwards it to the links of ground stations.

MAVSDK takes every heartbeat of the vehicle's system as a sign that the vehicle is there. So that the
companion's never hide that the autopilot's have ended, it sends one only after each of the autopilot's.
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

from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, companion_heartbeat, mavlink
from framerunner.wire.framing import HEADER_BYTES_V2, message_id_of, packed, source_of
from framerunner.wire.mission_tunnel import (
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
from framerunner.wire.status_text import PIECE_BYTES, statustexts

BEAT_S = 0.05  # wall time between two calls of `beat`
PIECES_A_BEAT = 2  # of new documents: 6 kB/s at most, so that a slow link has room for setpoints
REPEAT_BEATS = 10  # between two pieces of the repeated documents
SILENT_S = 0.25  # wall time without a new state after which the last one is repeated
FINAL_GAP_S = 0.15
_MAX_TEXT_CHUNKS = 4
_TUNNEL_BYTES = 128
_MAX_PACKETS_A_BEAT = 1000
_HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT

_URGENT = (DocumentKind.HISTORY,)
# Pieces not sent yet: the mission's own document is the longest, and maps are many.
_IN_ORDER = (*_URGENT, DocumentKind.RESULT, DocumentKind.MISSION, DocumentKind.MAP, DocumentKind.GUARDS)

logger = logging.getLogger(__name__)


class Companion:
    """Sends without waiting. What cannot be sent is dropped: reporting must not disturb the flight.

    Documents and a state may be given before anything is open.

    Attributes:
        sent: packets handed to MAVSDK.
    """

    def __init__(self) -> None:
        self.sent = 0
        self._port: socket.socket | None = None
        self._peer: Any = None
        self._sender: Any = None
        self._autopilot = (0, 0)  # its system and component id
        self._task: asyncio.Task[None] | None = None
        self._documents: dict[DocumentKind, list[bytes]] = {}
        self._unsent: dict[DocumentKind, deque[bytes]] = {}
        self._next_repeated = 0
        self._beats = 0
        self._early = 0  # pieces that were sent before their beat
        self._state = b""
        self._state_s = -inf
        self._text_id = 0

    def listen(self) -> str:
        """Open a local UDP port; returns the URL for MAVSDK to forward to.

        Raises:
            OSError: no port can be opened.
        """
        self._port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._port.setblocking(False)
        self._port.bind(("127.0.0.1", 0))
        return f"udpout://127.0.0.1:{self._port.getsockname()[1]}"

    def announce(self, system_id: int) -> None:
        """Send as a component of this vehicle from now on (within a running event loop)."""
        self._sender = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=COMPONENT_ID)
        self._autopilot = (system_id, AUTOPILOT_COMPONENT_ID)
        if self._task is None:
            self._task = asyncio.create_task(self._keep_beating(), name="companion")

    async def close(self) -> None:
        """Stop sending and close the port."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None
        if self._port is not None:
            self._port.close()
            self._port = None

    def send_state(self, state: MissionState) -> None:
        """Send the mission's state; `beat` repeats it until there is a newer one."""
        try:
            self._state = encode_state(state)
        except PayloadError as error:
            logger.warning("not sent: %s", error)
        else:
            self._send_state()

    def send_detections(self, detections: MissionDetections) -> None:
        """Send what an image showed."""
        try:
            self._send_tunnel(DETECTIONS_TYPE, encode_detections(detections))
        except PayloadError as error:
            logger.warning("not sent: %s", error)

    def send_document(self, kind: DocumentKind, pieces: list[bytes]) -> None:
        """Send a document of `split_document` at the next beats, then repeat it in turn with the others.

        A history's first pieces are sent at once, so that a transition is known 0.1 s after it was taken; the
        other documents wait for as many pieces longer.
        """
        self._documents[kind] = pieces
        self._unsent[kind] = deque(pieces)
        if kind is DocumentKind.HISTORY and not self._early:
            self._early = self._send_new_pieces(_URGENT)

    def is_sending(self, kind: DocumentKind) -> bool:
        """Whether pieces of a new document of this kind still wait."""
        return bool(self._unsent.get(kind))

    def send_text(self, text: str) -> None:
        """Send a STATUSTEXT of severity INFO, in several messages if it is too long for one."""
        data = text.encode("utf-8", "replace")[: _MAX_TEXT_CHUNKS * PIECE_BYTES]
        if len(data) > PIECE_BYTES:
            self._text_id = self._text_id % 0xFFFF + 1
        for message in statustexts(mavlink.MAV_SEVERITY_INFO, data, self._text_id):
            self._send(message)

    def beat(self) -> None:
        """Send what is due between ticks: heartbeat, pieces of documents, the last state again."""
        if self._autopilot_heartbeat_received():
            self._send(companion_heartbeat())
        if self._peer is None:
            return
        if self._state and time.monotonic() - self._state_s > SILENT_S:
            self._send_state()
        sent = self._send_new_pieces(_URGENT if self._early else _IN_ORDER)
        self._early = max(0, self._early + sent - PIECES_A_BEAT)
        if self._beats % REPEAT_BEATS == 0:
            self._repeat_piece()
        self._beats += 1

    def _send_new_pieces(self, kinds: tuple[DocumentKind, ...]) -> int:
        """Send a beat's pieces of new documents of some kinds; returns how many there were."""
        for number in range(PIECES_A_BEAT):
            piece = None if self._peer is None else self._next_unsent(kinds)
            if piece is None:
                return number
            self._send_tunnel(DOCUMENT_TYPE, piece)
        return PIECES_A_BEAT

    async def send_finally(self, kind: DocumentKind) -> None:
        """Send all of a document twice, before the link is closed. Takes 0.3 s."""
        for _ in range(2):
            for piece in self._documents.get(kind, ()):
                self._send_tunnel(DOCUMENT_TYPE, piece)
            await asyncio.sleep(FINAL_GAP_S)

    async def _keep_beating(self) -> None:
        while True:
            try:
                self.beat()
            except Exception as error:  # the flight continues whatever happens here
                logger.warning("the mission is not reported any more: %r", error)
                return
            await asyncio.sleep(BEAT_S)

    def _autopilot_heartbeat_received(self) -> bool:
        """Read all that MAVSDK forwarded; whether it contained a heartbeat of the vehicle's autopilot."""
        found = False
        if self._port is None:
            return False
        with contextlib.suppress(OSError):  # there is no more
            for _ in range(_MAX_PACKETS_A_BEAT):
                data, peer = self._port.recvfrom(512)
                self._peer = self._peer or peer
                found = found or self._is_heartbeat(data)
        return found

    def _is_heartbeat(self, data: bytes) -> bool:
        is_whole = len(data) >= HEADER_BYTES_V2
        return is_whole and source_of(data) == self._autopilot and message_id_of(data) == _HEARTBEAT

    def _next_unsent(self, kinds: tuple[DocumentKind, ...]) -> bytes | None:
        for kind in kinds:
            if self._unsent.get(kind):
                return self._unsent[kind].popleft()
        return None

    def _repeat_piece(self) -> None:
        pieces = [piece for kind in sorted(self._documents) for piece in self._documents[kind]]
        if pieces:
            self._send_tunnel(DOCUMENT_TYPE, pieces[self._next_repeated % len(pieces)])
            self._next_repeated += 1

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
        data = packed(message, sender)
        with contextlib.suppress(OSError):
            port.sendto(data, self._peer)
            self.sent += 1
