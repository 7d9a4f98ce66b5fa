"""`/ws/pilot`: checks browsers' sticks and orders, gives them to the drones' manual controls, answers."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from framerunner.errors import UserError
from framerunner.monitor.access import refuse
from framerunner.monitor.manual_control import ORDERS, Browser, Clock, JsonMessage, ManualControl, Order
from framerunner.monitor.vehicle.commands import Answer, Sticks

if TYPE_CHECKING:
    from framerunner.monitor.fleet import Fleet
    from framerunner.monitor.server import Monitor

BAD_MESSAGE_CODE, TOO_MANY_CODE = 4400, 4429  # as HTTP's
UNNAMED = "another window"
MAX_MESSAGE_BYTES = 1000  # a page sends some 80
MESSAGES_PER_SECOND = 60.0  # a page sends 25 with sticks and some orders
MAX_BURST = 240.0  # what a page sends in 10 s, if a network or this machine delays it
WATCH_PERIOD_S = 0.05
_MAX_QUEUE = 200  # messages to a browser; one that is so slow is disconnected
_MAX_REASON_BYTES = 120  # WebSockets allow 123
_CLOSE_S = 2.0
_MAX_ORDERS = 8  # of one browser at the same time
_ALWAYS = frozenset({"hold", "land", "stop_motors"})  # these bring a drone down, and are never refused
_AXES = ("forward", "right", "up", "yaw")
_MAX_SYSTEM = 255
_NOBODY = ("", None, False)

logger = logging.getLogger(__name__)


class PilotMessageError(UserError):
    """A message that none of the monitor's pages sends; its text is one line for people."""


def register(monitor: Monitor) -> None:
    """Add the WebSocket."""
    controls = ManualControls(monitor.fleet)

    @monitor.web.websocket("/ws/pilot")
    async def pilot(websocket: WebSocket) -> None:
        visitor = monitor.access.visitor(websocket)
        if not visitor.may_fly:
            await refuse(websocket, "only judges and organisers may fly; log in at /login")
            return
        await websocket.accept()

        def may_fly() -> bool:
            return monitor.access.visitor(websocket).may_fly

        await _Connection(websocket, controls, visitor.name or UNNAMED, may_fly, visitor.may_judge).serve()


class _Connection:
    """One browser's WebSocket."""

    def __init__(
        self,
        websocket: WebSocket,
        controls: ManualControls,
        name: str,
        may_fly: Callable[[], bool],
        may_judge: bool,
    ) -> None:
        self._may_fly = may_fly
        self._websocket = websocket
        self._controls = controls
        self._outbox: asyncio.Queue[JsonMessage] = asyncio.Queue(_MAX_QUEUE)
        self._browser = Browser(name, may_judge, self._queue)
        self._allowance = Allowance(time.monotonic)
        self._orders: set[asyncio.Task[None]] = set()
        self._overrun = asyncio.Event()

    async def serve(self) -> None:
        """Receive and send until the browser disconnects or is disconnected."""
        self._controls.add(self._browser)
        tasks = [asyncio.create_task(each) for each in (self._receive(), self._send(), self._overrun.wait())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._controls.remove(self._browser)
            for task in tasks:
                task.cancel()
            for failure in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(failure, Exception):
                    logger.error("a pilot's WebSocket failed", exc_info=failure)
        if self._overrun.is_set():
            await self._close(TOO_MANY_CODE, "this page does not keep up")

    async def _receive(self) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if not self._allowance.spend():
                await self._close(TOO_MANY_CODE, "too many messages a second")
                return
            try:
                self._take(read_message(message.get("text") or message.get("bytes") or ""))
            except PilotMessageError as error:
                await self._close(BAD_MESSAGE_CODE, str(error))
                return

    def _take(self, message: Sticks | Order) -> None:
        if isinstance(message, Sticks):
            if self._may_fly():  # else it falls silent, and the drone holds
                self._controls.sticks(self._browser, message)
        elif message.what not in _ALWAYS and not self._may_fly():
            self._reply(message.what, False, "you are logged out; log in again at /login")
        elif len(self._orders) >= _MAX_ORDERS and message.what not in _ALWAYS:
            self._reply(message.what, False, "too many orders at once; wait for an answer")
        else:
            task = asyncio.create_task(self._carry_out(message))
            self._orders.add(task)  # a disconnected browser's orders, such as landing, are still carried out
            task.add_done_callback(self._orders.discard)

    async def _carry_out(self, order: Order) -> None:
        try:
            answer = await self._controls.do(self._browser, order)
        except Exception:
            logger.exception("order %s to drone %d", order.what, order.drone_id)
            self._reply(order.what, False, "the monitor failed at this; its log says more")
        else:
            self._reply(order.what, answer.ok, answer.text)

    def _reply(self, what: str, ok: bool, text: str) -> None:
        self._queue({"kind": "reply", "what": what, "ok": ok, "text": text})

    def _queue(self, message: JsonMessage) -> None:
        try:
            self._outbox.put_nowait(message)
        except asyncio.QueueFull:
            self._overrun.set()

    async def _send(self) -> None:
        while True:
            message = await self._outbox.get()
            try:
                await self._websocket.send_json(message)
            except (WebSocketDisconnect, RuntimeError, OSError):
                return  # disconnected

    async def _close(self, code: int, reason: str) -> None:
        short = reason.encode()[:_MAX_REASON_BYTES].decode(errors="ignore")
        if self._websocket.application_state is WebSocketState.CONNECTED:
            with contextlib.suppress(RuntimeError, OSError, TimeoutError):
                async with asyncio.timeout(_CLOSE_S):
                    await self._websocket.close(code, short)


class ManualControls:
    """The controls of all drones and the browsers that are informed of them.

    Args:
        fleet: the drones.
        clock: time; that of the machine by default.
    """

    def __init__(self, fleet: Fleet, clock: Clock | None = None) -> None:
        self._fleet = fleet
        self._clock = clock or Clock(time.monotonic)
        self._controls: dict[int, ManualControl] = {}
        self._browsers: list[Browser] = []
        self._announced: dict[int, tuple[str, Browser | None, bool]] = {}
        self._watch: asyncio.Task[None] | None = None

    def add(self, browser: Browser) -> None:
        """Add a browser and send it the state of all controls."""
        self._browsers.append(browser)
        for drone_id in self._controls:
            browser.send(self._control_message(drone_id, browser))
        if self._watch is None or self._watch.done():
            self._watch = asyncio.get_running_loop().create_task(self._keep_watch(), name="pilot's dead man")

    def remove(self, browser: Browser) -> None:
        """Remove a browser; a drone that it flew holds."""
        self._browsers.remove(browser)
        for control in self._controls.values():
            control.leave(browser)

    def sticks(self, browser: Browser, sticks: Sticks) -> None:
        """Take a browser's sticks, for the drone that it controls."""
        for control in self._controls.values():
            control.sticks(browser, sticks)

    async def do(self, browser: Browser, order: Order) -> Answer:
        """Carry out or refuse an order."""
        drone_id = order.drone_id
        if drone_id not in self._fleet.drone_ids():
            return Answer(False, f"no drone {drone_id} is heard")
        for other_id, other in self._controls.items():
            if order.what == "take" and other_id != drone_id and other.holder is browser:
                return Answer(False, f"you have the sticks of drone {other_id}; give them back first")
        if drone_id not in self._controls:
            self._controls[drone_id] = ManualControl(drone_id, self._fleet, self._announce, self._clock)
        return await self._controls[drone_id].do(browser, order)

    def tick(self) -> None:
        """Update all drones' controls; one that fails does not stop the others."""
        for drone_id, control in self._controls.items():
            try:
                control.tick()
            except Exception:
                logger.exception("drone %d: the update of its manual control failed", drone_id)

    async def _keep_watch(self) -> None:
        while self._browsers or not all(control.idle for control in self._controls.values()):
            self.tick()
            await asyncio.sleep(WATCH_PERIOD_S)

    def _announce(self, drone_id: int) -> None:
        """Tell all browsers and the fleet who has manual control, if that changed."""
        control = self._controls.get(drone_id)
        if control is None:
            return
        name = "" if control.holder is None else control.holder.name
        now = (name, control.holder, control.flying)
        if self._announced.get(drone_id, _NOBODY) == now:
            return
        self._announced[drone_id] = now
        self._fleet.set_pilot(drone_id, name)
        for browser in self._browsers:
            browser.send(self._control_message(drone_id, browser))

    def _control_message(self, drone_id: int, browser: Browser) -> JsonMessage:
        control = self._controls[drone_id]
        return {
            "kind": "seat",
            "id": drone_id,
            "pilot": "" if control.holder is None else control.holder.name,
            "yours": control.holder is browser,
            "flying": control.flying,
        }


def read_message(text: str | bytes) -> Sticks | Order:
    """Read a message as it was received. Raises `PilotMessageError`."""
    size = len(text) if isinstance(text, bytes) else len(text.encode(errors="replace"))
    if size > MAX_MESSAGE_BYTES:
        raise PilotMessageError(f"a message of {size} bytes; at most {MAX_MESSAGE_BYTES} are taken")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise PilotMessageError("a message that is not JSON") from None
    if not isinstance(message, dict):
        raise PilotMessageError("a message that is not a JSON object")
    kind = message.get("kind")
    if kind == "sticks":
        return Sticks(*(_deflection(message, axis) for axis in _AXES))
    if kind == "do":
        return _order(message)
    raise PilotMessageError(f"kind: {_short(kind)}; it must be sticks or do")


def _deflection(message: Mapping[str, Any], axis: str) -> float:
    value = message.get(axis)
    if isinstance(value, bool) or not isinstance(value, int | float) or not -1.0 <= value <= 1.0:
        raise PilotMessageError(f"{axis}: {_short(value)}; it must be a number from -1 to 1")
    return float(value)


def _order(message: Mapping[str, Any]) -> Order:
    drone_id, what, confirmed = message.get("id"), message.get("what"), message.get("confirmed", False)
    if isinstance(drone_id, bool) or not isinstance(drone_id, int) or not 1 <= drone_id <= _MAX_SYSTEM:
        raise PilotMessageError(f"id: {_short(drone_id)}; it must be a whole number from 1 to {_MAX_SYSTEM}")
    if what not in ORDERS:
        raise PilotMessageError(f"what: {_short(what)}; it must be one of {', '.join(ORDERS)}")
    if not isinstance(confirmed, bool):
        raise PilotMessageError(f"confirmed: {_short(confirmed)}; it must be true or false")
    return Order(drone_id, what, confirmed)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:40]}…"


class Allowance:
    """Limits messages to a rate, with a burst after a pause (a token bucket).

    Args:
        clock: seconds that never go back.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._left = MAX_BURST
        self._counted_s = clock()

    def spend(self) -> bool:
        """Count one message; False if it is one too many."""
        now_s = self._clock()
        self._left = min(MAX_BURST, self._left + (now_s - self._counted_s) * MESSAGES_PER_SECOND)
        self._counted_s = now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
