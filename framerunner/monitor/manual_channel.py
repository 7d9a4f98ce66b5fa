"""`/ws/pilot`: gives browsers' sticks and orders to the drones' manual controls, and answers."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, TypeAdapter
from starlette.websockets import WebSocket

from framerunner.monitor.channel import Channel, ChannelTerms, PageModel, refuse
from framerunner.monitor.manual_control import Browser, Clock, ControlMessage, ManualControl, Order, Reply
from framerunner.monitor.vehicle.commands import Answer, Sticks

if TYPE_CHECKING:
    from framerunner.monitor.fleet import MonitoredFleet
    from framerunner.monitor.server import Monitor

UNNAMED = "another window"
WATCH_PERIOD_S = 0.05
_MAX_ORDERS = 8  # of one browser at the same time
_ALWAYS = frozenset({"hold", "land", "stop_motors"})  # these bring a drone down, and are never refused
_NOBODY = ("", None, False)
_Deflection = Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False)]

logger = logging.getLogger(__name__)


class SticksMessage(PageModel):
    """Where a browser's sticks are, each -1 to 1; see `Sticks`."""

    kind: Literal["sticks"]
    forward: _Deflection
    right: _Deflection
    up: _Deflection
    yaw: _Deflection


FromPage = Annotated[SticksMessage | Order, Field(discriminator="kind")]
ToPage = Reply | ControlMessage
FROM_PAGE: ChannelTerms[FromPage] = ChannelTerms(
    TypeAdapter(FromPage), max_bytes=1000
)  # a page sends some 80


def register(monitor: Monitor) -> None:
    """Add the WebSocket."""
    controls = ManualControls(monitor.fleet)

    @monitor.web.websocket("/ws/pilot")
    async def manual_control(websocket: WebSocket) -> None:
        visitor = monitor.access.visitor(websocket)
        if not visitor.may_fly:
            await refuse(websocket, "only judges and organisers may fly; log in at /login")
            return
        await websocket.accept()
        channel: Channel[FromPage, ToPage] = Channel(websocket, FROM_PAGE)
        browser = Browser(visitor.name or UNNAMED, visitor.may_judge, channel.send)
        takes = _Orders(controls, browser, lambda: monitor.access.visitor(websocket).may_fly)
        controls.add(browser)
        await channel.serve(takes.take, left=lambda: controls.remove(browser))


class _Orders:
    """Takes the messages of one browser."""

    def __init__(self, controls: ManualControls, browser: Browser, may_fly: Callable[[], bool]) -> None:
        self._controls = controls
        self._browser = browser
        self._may_fly = may_fly
        self._orders: set[asyncio.Task[None]] = set()

    def take(self, message: FromPage) -> None:
        if isinstance(message, SticksMessage):
            if self._may_fly():  # else it falls silent, and the drone holds
                sticks = Sticks(message.forward, message.right, message.up, message.yaw)
                self._controls.sticks(self._browser, sticks)
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
            logger.exception("order %s to drone %d", order.what, order.id)
            self._reply(order.what, False, "the monitor failed at this; its log says more")
        else:
            self._reply(order.what, answer.ok, answer.text)

    def _reply(self, what: str, ok: bool, text: str) -> None:
        self._browser.send(Reply(what=what, ok=ok, text=text))


class ManualControls:
    """The controls of all drones and the browsers that are informed of them.

    Args:
        fleet: the drones.
        clock: time; that of the machine by default.
    """

    def __init__(self, fleet: MonitoredFleet, clock: Clock | None = None) -> None:
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
            self._watch = asyncio.get_running_loop().create_task(self._keep_watch(), name="dead man's switch")

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
        drone_id = order.id
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

    def _control_message(self, drone_id: int, browser: Browser) -> ControlMessage:
        control = self._controls[drone_id]
        holder = "" if control.holder is None else control.holder.name
        return ControlMessage(
            id=drone_id, holder=holder, yours=control.holder is browser, flying=control.flying
        )
