"""`/ws/live`: what the drones do, written once and sent to all who watch; nobody gets a backlog."""

from __future__ import annotations

import asyncio
import json
import logging
from collections import deque
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from monitor.addresses import Places, client_address
from wire import finite_json

if TYPE_CHECKING:
    from monitor.fleet import Fleet
    from monitor.server import Monitor

POSE_HZ = 20
STATUS_EVERY = 4  # poses
STATUS_AT_LEAST_EVERY = 40  # poses; so a browser knows that the link is not dead
MOST_VIEWERS = 200
MOST_VIEWERS_PER_ADDRESS = 60  # a page has two; a class may share one address
MOST_PENDING = 200
TOO_SLOW_CODE = 1013  # "try again later"
# Of these only the newest counts: one that was not sent yet is replaced.
_REPLACED = ("pose", "status", "detections")
_POSE_DECIMALS = 4  # a tenth of a millimetre; in a quaternion 0.2 mrad
_log = logging.getLogger(__name__)


class Viewer:
    """What one browser is still to be sent.

    Args:
        kinds: of messages it wants; empty: all.
        address: where it is.
    """

    def __init__(self, kinds: Iterable[str] = (), address: str = "") -> None:
        self.address = address
        self._kinds = frozenset(kinds)
        self._events: deque[str] = deque()
        self._newest: dict[tuple[str, object], str] = {}
        self._arrived = asyncio.Event()
        self.too_slow = False

    def wants(self, kind: str) -> bool:
        """Whether it asked for messages of a kind."""
        return not self._kinds or kind in self._kinds

    def put(self, kind: str, drone_id: object, text: str) -> None:
        """Queue a message; never waits."""
        if not self.wants(kind):
            return
        if kind in _REPLACED:
            self._newest[kind, drone_id] = text
        elif len(self._events) < MOST_PENDING:
            self._events.append(text)
        else:
            self.too_slow = True
        self._arrived.set()

    async def next(self) -> str | None:
        """Wait for the next message, events first; None when it is too slow to go on."""
        while not (self._events or self._newest or self.too_slow):
            self._arrived.clear()
            await self._arrived.wait()
        if self.too_slow:
            return None
        if self._events:
            return self._events.popleft()
        return self._newest.pop(next(iter(self._newest)))


class LiveChannel:
    """All viewers, and the task that keeps them up to date.

    Args:
        fleet: what is shown.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._viewers: set[Viewer] = set()
        self._places = Places(MOST_VIEWERS, MOST_VIEWERS_PER_ADDRESS)
        self._somebody = asyncio.Event()
        self._last_status = ""
        self._histories: dict[int, tuple[tuple[int, float | None], str]] = {}

    def enter(self, viewer: Viewer) -> bool:
        """Let a viewer watch, beginning with the welcome; False if there is no place for it."""
        if self._places.take(viewer.address):
            return False
        for message in self._fleet.welcome():
            if viewer.wants(message["kind"]):
                viewer.put(message["kind"], message.get("id"), self._encode_welcome(message))
        self._viewers.add(viewer)
        self._somebody.set()
        return True

    def _encode_welcome(self, message: Mapping[str, Any]) -> str:
        """Write a message; a history is long, so those who come within a tenth of a second share it."""
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
        """Forget a viewer that entered."""
        self._viewers.remove(viewer)
        self._places.give_back(viewer.address)
        if not self._viewers:
            self._somebody.clear()

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send a message to all who want its kind."""
        kind = message["kind"]
        if any(viewer.wants(kind) for viewer in self._viewers):
            text = encode(message)
            for viewer in self._viewers:
                viewer.put(kind, message.get("id"), text)

    async def run(self) -> None:
        """Send poses and status while somebody watches, until cancelled."""
        unsubscribe = self._fleet.subscribe(self.tell)
        try:
            loop = asyncio.get_running_loop()
            due_s, count = loop.time(), 0
            while True:
                await self._somebody.wait()
                try:
                    self._update(count)
                except Exception:  # a fault in one message must not end the others
                    _log.exception("the live channel skips an update")
                count += 1
                # Skips what it cannot keep up with instead of hurrying after it.
                due_s = max(due_s + 1 / POSE_HZ, loop.time())
                await asyncio.sleep(due_s - loop.time())
        finally:
            unsubscribe()

    def _update(self, count: int) -> None:
        self.tell(self._fleet.pose_message())
        if count % STATUS_EVERY == 0:
            message = self._fleet.status_message()
            text = encode(message)
            if text != self._last_status or count % STATUS_AT_LEAST_EVERY == 0:
                self._last_status = text
                for viewer in self._viewers:
                    viewer.put("status", None, text)


def register(monitor: Monitor) -> None:
    """Add `/ws/live`. A page that does not want everything says so: `/ws/live?kinds=status,notice`."""
    channel = LiveChannel(monitor.fleet)
    monitor.jobs.append(channel.run)

    @monitor.web.websocket("/ws/live")
    async def live(websocket: WebSocket, kinds: str = "") -> None:
        await websocket.accept()
        viewer = Viewer((kind for kind in kinds.split(",") if kind), client_address(websocket.scope))
        if not channel.enter(viewer):
            await websocket.close(TOO_SLOW_CODE, "too many are watching")
            return
        sending = asyncio.create_task(_send(websocket, viewer))
        try:
            while True:  # ends when the browser goes; what it sends is ignored
                await websocket.receive()
                if websocket.client_state.name == "DISCONNECTED":
                    break
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            channel.leave(viewer)
            sending.cancel()


async def _send(websocket: WebSocket, viewer: Viewer) -> None:
    try:
        while (text := await viewer.next()) is not None:
            await websocket.send_text(text)
        await websocket.close(TOO_SLOW_CODE, "too slow")
    except (WebSocketDisconnect, RuntimeError, OSError):
        pass  # it has gone


def encode(message: Mapping[str, Any]) -> str:
    """Write a message as JSON; numbers that are not finite become null, poses lose needless digits."""
    return finite_json.encode(message, decimals=_POSE_DECIMALS if message["kind"] == "pose" else None)
