"""`/ws/live`: the state of the drones, encoded once for all viewers; a slow viewer gets no backlog."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket

from framerunner.monitor.addresses import Places, client_address
from framerunner.monitor.channel import TRY_LATER_CODE, Channel, ChannelTerms, close
from framerunner.monitor.live_messages import LiveMessage
from framerunner.wire import finite_json

if TYPE_CHECKING:
    from framerunner.monitor.fleet import MonitoredFleet
    from framerunner.monitor.server import Monitor

POSE_HZ = 20
STATUS_EVERY = 4  # poses
STATUS_AT_LEAST_EVERY = 40  # poses; shows a browser that the connection is alive
MAX_VIEWERS = 200
MAX_VIEWERS_PER_ADDRESS = 60  # a page has two; a class may share one address
MAX_PENDING = 200
# Kinds of which only the newest counts: one that was not sent yet is replaced.
_REPLACED = ("pose", "status", "detections", "map", "guards")
_POSE_DECIMALS = 4  # a tenth of a millimetre; in a quaternion 0.2 mrad
_log = logging.getLogger(__name__)


class Viewer(Channel[None, LiveMessage]):
    """A browser that is sent what the drones do; what it sends is ignored.

    Args:
        websocket: of the browser.
        kinds: of messages it requested; empty: all.

    Attributes:
        address: of the browser.
    """

    def __init__(self, websocket: WebSocket, kinds: Iterable[str] = ()) -> None:
        super().__init__(websocket, ChannelTerms(None, max_waiting=MAX_PENDING))
        self.address = client_address(websocket.scope)
        self._kinds = frozenset(kinds)

    def takes(self, kind: str) -> bool:
        """Whether it requested messages of a kind."""
        return not self._kinds or kind in self._kinds

    def show(self, kind: str, drone_id: object, text: str) -> None:
        """Queue a message, if it is of a kind that was requested."""
        if self.takes(kind):
            self.put(text, (kind, drone_id) if kind in _REPLACED else None)


class LiveChannel:
    """All viewers of a fleet, and the task that sends them its state."""

    def __init__(self, fleet: MonitoredFleet) -> None:
        self._fleet = fleet
        self._viewers: set[Viewer] = set()
        self._places = Places(MAX_VIEWERS, MAX_VIEWERS_PER_ADDRESS)
        self._has_viewers = asyncio.Event()
        self._last_status = ""
        self._histories: dict[int, tuple[tuple[int, float | None], str]] = {}

    def enter(self, viewer: Viewer) -> bool:
        """Add a viewer and queue the welcome for it; False if there is no place for it."""
        if self._places.take(viewer.address):
            return False
        for message in self._fleet.welcome():
            if viewer.takes(message["kind"]):
                viewer.show(message["kind"], message.get("id"), self._encode_welcome(message))
        self._viewers.add(viewer)
        self._has_viewers.set()
        return True

    def _encode_welcome(self, message: Mapping[str, Any]) -> str:
        """Encode a message; a history is long, so viewers share it until a sample is added."""
        if message["kind"] != "history":
            return encode(message)
        rows = message["poses"]
        key = (len(rows), rows[-1][0] if rows else None)
        known = self._histories.get(message["id"])
        if known is None or known[0] != key:
            known = (key, json.dumps(message, separators=(",", ":"), allow_nan=False))
            self._histories[message["id"]] = known
        return known[1]

    def leave(self, viewer: Viewer) -> None:
        """Remove a viewer that entered."""
        self._viewers.remove(viewer)
        self._places.give_back(viewer.address)
        if not self._viewers:
            self._has_viewers.clear()

    def send(self, message: Mapping[str, Any]) -> None:
        """Send a message to all viewers that requested its kind."""
        kind = message["kind"]
        if any(viewer.takes(kind) for viewer in self._viewers):
            text = encode(message)
            for viewer in self._viewers:
                viewer.show(kind, message.get("id"), text)

    async def run(self) -> None:
        """Send poses and status while there are viewers, until cancelled."""
        unsubscribe = self._fleet.subscribe(self.send)
        try:
            loop = asyncio.get_running_loop()
            due_s, count = loop.time(), 0
            while True:
                await self._has_viewers.wait()
                try:
                    self._update(count)
                except Exception:  # the next message may be all right
                    _log.exception("the live channel skips an update")
                count += 1
                due_s = max(due_s + 1 / POSE_HZ, loop.time())  # after a delay it does not catch up
                await asyncio.sleep(due_s - loop.time())
        finally:
            unsubscribe()

    def _update(self, count: int) -> None:
        self.send(self._fleet.pose_message())
        if count % STATUS_EVERY == 0:
            message = self._fleet.status_message()
            text = encode(message)
            if text != self._last_status or count % STATUS_AT_LEAST_EVERY == 0:
                self._last_status = text
                for viewer in self._viewers:
                    viewer.show("status", None, text)


def register(monitor: Monitor) -> None:
    """Add `/ws/live`; `/ws/live?kinds=status,notice` sends only these kinds."""
    channel = LiveChannel(monitor.fleet)
    monitor.jobs.append(channel.run)

    @monitor.web.websocket("/ws/live")
    async def live(websocket: WebSocket, kinds: str = "") -> None:
        await websocket.accept()
        viewer = Viewer(websocket, (kind for kind in kinds.split(",") if kind))
        if not channel.enter(viewer):
            await close(websocket, TRY_LATER_CODE, "too many are watching")
            return
        monitor.on_viewer()
        await viewer.serve(left=lambda: channel.leave(viewer))


def encode(message: Mapping[str, Any]) -> str:
    """A message as JSON: numbers that are not finite become null, those of poses are rounded."""
    return finite_json.encode(message, decimals=_POSE_DECIMALS if message["kind"] == "pose" else None)
