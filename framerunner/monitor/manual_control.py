"""Who has a drone's sticks, and what the drone is told when that browser falls silent."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from framerunner.monitor.channel import PageModel
from framerunner.monitor.vehicle.commands import Answer, Sticks

if TYPE_CHECKING:
    from framerunner.monitor.fleet import MonitoredFleet

SILENT_S = 0.5  # without sticks from the browser; then the drone holds
ABANDONED_S = 5.0  # of silence, after which another browser may take manual control
STREAM_FIRST_S = 0.4  # sticks are sent before position mode is requested, which requires them
HOLD_AGAIN_S = 1.0
NEUTRAL = Sticks(0.0, 0.0, 0.0, 0.0)

MANUAL_MODES = frozenset(
    {"MANUAL", "STABILIZED", "ACRO", "RATTITUDE", "ALTITUDE", "POSITION", "POSITION SLOW"}
)
_OVERTAKING = frozenset({"hold", "land"})  # they do not wait for the answer to another order
_ENDING = _OVERTAKING | {"give"}  # after these the drone flies by itself
_BRAKING = _ENDING | {"take"}  # while these are carried out, sticks are neutral
_TAKE_OFF, _HOLD = "TAKEOFF", "HOLD"

logger = logging.getLogger(__name__)


class Order(PageModel):
    """An order of a browser to a drone.

    Attributes:
        id: MAVLink system id of the drone.
        confirmed: the person has confirmed it.
    """

    kind: Literal["do"] = "do"
    id: Annotated[int, Field(ge=1, le=255)]
    what: Literal["take", "give", "arm", "disarm", "take_off", "land", "hold", "stop_motors"]
    confirmed: bool = False


class Reply(PageModel):
    """The answer to an order: whether it was done, and one line for people."""

    kind: Literal["reply"] = "reply"
    what: str
    ok: bool
    text: str


class ControlMessage(PageModel):
    """Who has manual control of a drone.

    Attributes:
        id: MAVLink system id of the drone.
        holder: name of the person; "": nobody.
        yours: it is the browser that gets this.
        flying: the holder's sticks reach the drone.
    """

    kind: Literal["control"] = "control"
    id: int
    holder: str
    yours: bool
    flying: bool


@dataclass(eq=False, slots=True)
class Browser:
    """A browser of a person who may fly.

    Attributes:
        name: of the person, for other people.
        may_judge: may take the sticks from anyone.
        send: sends it a message; does not block.
    """

    name: str
    may_judge: bool = False
    send: Callable[[Reply | ControlMessage], None] = lambda _message: None


class Control(Enum):
    """Whether the sticks of this browser control the drone."""

    NONE = "none"
    ACTIVE = "active"
    LOST = "lost"  # it was active, the browser fell silent, and the drone is being told to hold


@dataclass(slots=True)
class Clock:
    """Time, which tests replace: seconds that never go back, and waiting for some seconds."""

    now_s: Callable[[], float]
    wait: Callable[[float], Awaitable[None]] = field(default=asyncio.sleep)


@dataclass(frozen=True, slots=True)
class _DroneView:
    """What manual control needs of a drone's status."""

    mode: str = ""  # in capitals
    armed: bool = False
    live: bool = False  # the link
    waiting_mission: str = ""  # name of a paused mission

    @property
    def is_manual(self) -> bool:
        return self.mode in MANUAL_MODES


class _CurrentOrder:
    """The order that is being carried out.

    Args:
        name: of the drone.
        ended: called when it has ended and no other has replaced it.

    Attributes:
        what: "" without an order.
        browser: that gave it; None: this module.
    """

    def __init__(self, name: str, ended: Callable[[], None]) -> None:
        self.what = ""
        self.browser: Browser | None = None
        self._name = name
        self._ended = ended
        self._task: asyncio.Task[Answer] | None = None

    def cancel(self) -> None:
        if self._task is not None:
            self._task.cancel()

    def start(
        self, what: str, browser: Browser | None, work: Coroutine[Any, Any, Answer]
    ) -> asyncio.Task[Answer]:
        """Start an order; it replaces the present one."""
        self.cancel()
        task = asyncio.get_running_loop().create_task(work, name=f"{self._name}: {what}")
        self._task, self.what, self.browser = task, what, browser
        task.add_done_callback(self._done)
        return task

    async def run(self, what: str, browser: Browser, work: Coroutine[Any, Any, Answer]) -> Answer:
        """Carry out an order; it goes on when the caller is cancelled."""
        task = self.start(what, browser, work)
        await asyncio.wait({task})
        if task.cancelled():
            return Answer(False, f"{_words(what)}: another order came before the answer")
        return task.result()

    def _done(self, task: asyncio.Task[Answer]) -> None:
        if task is self._task:
            self._task, self.what, self.browser = None, "", None
            self._ended()
        if not task.cancelled() and task.exception() is not None:
            logger.error("%s failed", task.get_name(), exc_info=task.exception())


class ManualControl:
    """Manual control of a drone by one browser at a time; `tick` is to be called some twenty times a second.

    While a browser has the sticks and afterwards, until the drone is disarmed, neutral sticks are sent when
    no others are: an autopilot that has received sticks takes their end for a failure.

    Args:
        drone_id: which drone of the fleet.
        fleet: all drones.
        changed: called with `drone_id` when `holder` or `flying` may have changed.
        clock: time.

    Attributes:
        holder: the browser that has it.
        control: whether its sticks control the drone.
    """

    def __init__(
        self, drone_id: int, fleet: MonitoredFleet, changed: Callable[[int], None], clock: Clock
    ) -> None:
        self.holder: Browser | None = None
        self.control = Control.NONE
        self._id = drone_id
        self._name = f"drone {drone_id}"
        self._fleet = fleet
        self._changed = changed
        self._clock = clock
        self._heard_s = clock.now_s()
        self._streaming = False
        self._climbing = False  # after this take-off the sticks control the drone
        self._order = _CurrentOrder(self._name, lambda: self._set_holder(self.holder))

    @property
    def flying(self) -> bool:
        """Whether the holder's sticks reach the drone."""
        return self.holder is not None and self.control is Control.ACTIVE and self._order.what != "take"

    @property
    def idle(self) -> bool:
        """Whether `tick` has nothing to do."""
        return self.holder is None and not self._streaming and not self._order.what

    def sticks(self, browser: Browser, sticks: Sticks) -> None:
        """Take a browser's sticks; ignored if it does not have manual control."""
        if browser is not self.holder:
            return
        self._heard_s = self._clock.now_s()
        if self.control is Control.ACTIVE and self._order.what not in _BRAKING:
            self._stream(sticks)

    async def do(self, browser: Browser, order: Order) -> Answer:
        """Carry out or refuse an order."""
        what, present = order.what, self._order
        refusal = self._refusal(browser, order)
        if refusal:
            return Answer(False, refusal)
        if what == "stop_motors":
            present.cancel()
            return await self._plain(what)
        overtakes = what in _OVERTAKING or (what == "take" and present.browser is not browser)
        if present.what and not overtakes:
            return Answer(False, f"{self._name} has not answered to {_words(present.what)} yet")
        carry_out = {"take": self._take, "give": self._give, "take_off": self._take_off}.get(what)
        work = self._plain(what) if carry_out is None else carry_out(browser)
        return await present.run(what, browser, work)

    def leave(self, browser: Browser) -> None:
        """Take manual control from a browser that has disconnected."""
        if browser is self.holder:
            self._set_holder(None)
            self._fall_silent("is gone")

    def tick(self) -> None:
        """Check whether the holder is silent, and whether neutral sticks are still needed."""
        silent_s = self._clock.now_s() - self._heard_s
        view = self._view()
        if self._climbing:
            self._climb(view, silent_s)
        if self.control is Control.ACTIVE and silent_s > SILENT_S and self._order.what not in _BRAKING:
            self._fall_silent("fell silent")
        elif self.control is Control.LOST and not self._order.what:
            self._order.start("hold", None, self._hold_after_silence())
        done = self.holder is None and self.control is Control.NONE and not self._order.what
        if self._streaming and done and view.live and not view.armed:
            self._streaming = False
            self._fleet.sticks(self._id, None)

    def _view(self) -> _DroneView:
        for status in self._fleet.status_message()["drones"]:
            if status["id"] == self._id:
                mission = status["mission"]
                waits = mission is not None and mission["alive"] and mission["paused"]
                return _DroneView(
                    mode=str(status["mode"]).upper(),
                    armed=bool(status["armed"]),
                    live=status["link"]["state"] == "live",
                    waiting_mission=(mission["name"] or "without a name") if waits else "",
                )
        return _DroneView()

    def _refusal(self, browser: Browser, order: Order) -> str:
        """Why an order is refused; "" if it is not."""
        what, holder = order.what, self.holder
        if what == "stop_motors" and not order.confirmed:
            return "stopping the motors drops the drone: it must be confirmed"
        if holder is browser or holder is None:
            return "you do not have the sticks" if what == "give" and holder is None else ""
        if browser.may_judge and what != "give":
            return ""
        if what != "take":
            return f"{holder.name} has the sticks of {self._name}"
        if self._clock.now_s() - self._heard_s >= ABANDONED_S:
            return ""
        return f"{holder.name} has the sticks; ask for them to be given back"

    async def _take(self, browser: Browser) -> Answer:
        before, self._climbing = self.holder, False
        if before is not None and before is not browser:
            text = f"{browser.name} took the sticks of {self._name} from {before.name}"
            self._fleet.notice(self._id, "warning", text)
        self.control = Control.ACTIVE
        self._stream(NEUTRAL)
        self._set_holder(browser)
        await self._clock.wait(STREAM_FIRST_S)
        ok, text = await self._fleet.do(self._id, "position")
        if ok:
            return Answer(True, f"you have the sticks of {self._name}")
        # In a manual mode the holder before was flying it, and has lost it now.
        self.control = Control.LOST if self._view().is_manual else Control.NONE
        self._set_holder(None)
        return Answer(False, text)

    async def _give(self, _browser: Browser) -> Answer:
        """Resume the mission that waits, if there is one; otherwise the drone holds."""
        self._climbing = False
        self._stream(NEUTRAL)
        view = self._view()
        done, why = "", "no mission waits"
        if view.waiting_mission:
            ok, text = await self._fleet.do(self._id, "offboard")
            if ok:
                done = f"the mission {view.waiting_mission} goes on"
            why = f"the mission {view.waiting_mission} cannot go on ({text})"
        if not done and self.control is Control.NONE:
            done = f"{why}; {self._name} stays in {self._view().mode.lower() or 'its mode'}"
        if not done:
            ok, text = await self._fleet.do(self._id, "hold")
            if not ok:
                return Answer(False, f"{why}, and it does not hold either: {text}; you still have the sticks")
            done = f"{why}; {self._name} holds"
        self._let_go(None)
        return Answer(True, done)

    async def _take_off(self, browser: Browser) -> Answer:
        ok, text = await self._fleet.do(self._id, "take_off")
        if ok:
            self._let_go(self.holder)
            if browser is self.holder:
                self._climbing = True
                text = f"{text}; at its height the sticks are yours"
        return Answer(ok, text)

    async def _plain(self, what: str) -> Answer:
        """Hold, land, arm, disarm or stop the motors."""
        ends = what in _ENDING or what == "stop_motors"
        if ends:
            self._climbing = False
            if self._streaming:
                self._stream(NEUTRAL)
        ok, text = await self._fleet.do(self._id, what)
        if ok and ends:
            self._let_go(self.holder)
        return Answer(ok, text)

    def _let_go(self, holder: Browser | None) -> None:
        """The drone flies by itself; `holder` has manual control."""
        self.control = Control.NONE
        if self._streaming:
            self._stream(NEUTRAL)
        self._set_holder(holder)

    def _climb(self, view: _DroneView, silent_s: float) -> None:
        """Follow a take-off; at its end the sticks control the drone, if the holder is still there."""
        if self.holder is None or silent_s > SILENT_S or not view.armed:
            self._climbing = False
        elif view.mode == _HOLD and not self._order.what:
            self._order.start("take", self.holder, self._take_after_climb(self.holder))
        elif view.mode not in {_TAKE_OFF, _HOLD}:
            self._climbing = False

    async def _take_after_climb(self, browser: Browser) -> Answer:
        answer = await self._take(browser)
        if answer.ok:
            self._fleet.notice(self._id, "info", f"{self._name} is up; it follows the sticks")
        else:
            text = f"{self._name} is up, but follows no sticks: {answer.text}"
            self._fleet.notice(self._id, "warning", text)
        return answer

    def _fall_silent(self, how: str) -> None:
        """The dead man's switch: neutral sticks at once, and a drone that was flown by them holds."""
        self._climbing = False
        if self._streaming:
            self._stream(NEUTRAL)
        taking = self._order.what == "take"
        if self.control is Control.ACTIVE and not self._view().is_manual and not taking:
            self.control = Control.NONE  # it has left the manual mode by itself, for its own reason
            text = f"the pilot's page {how}; {self._name} goes on by itself"
            self._fleet.notice(self._id, "warning", text)
        elif self.control is Control.ACTIVE or taking:
            self.control = Control.LOST
            text = f"the pilot's page {how}; {self._name} is told to hold"
            self._fleet.notice(self._id, "warning", text)
        if self.control is Control.LOST and self._order.what not in _ENDING:
            self._order.start("hold", None, self._hold_after_silence())
        self._set_holder(self.holder)

    async def _hold_after_silence(self) -> Answer:
        while True:
            ok, text = await self._fleet.do(self._id, "hold")
            if ok or not self._view().is_manual:
                break
            self._fleet.notice(self._id, "error", f"{self._name} does not hold: {text}")
            await self._clock.wait(HOLD_AGAIN_S)
        self._let_go(self.holder)
        if ok:
            self._fleet.notice(self._id, "info", f"{self._name} holds")
        return Answer(ok, text)

    def _stream(self, sticks: Sticks) -> None:
        self._streaming = True
        self._fleet.sticks(self._id, sticks)

    def _set_holder(self, browser: Browser | None) -> None:
        if browser is not None and browser is not self.holder:
            self._heard_s = self._clock.now_s()
        self.holder = browser
        self._changed(self._id)


def _words(what: str) -> str:
    return what.replace("_", " ")
