"""Who has a drone's sticks, and what becomes of the drone when they fall silent."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

from monitor.pilot_messages import Order
from monitor.sticks import Sticks

SILENT_S = 0.5  # without sticks from the browser for so long, the drone holds
FORSAKEN_S = 5.0  # silent for so long, somebody else may have the seat
STREAM_FIRST_S = 0.4  # sticks come for so long before position mode is asked for; it needs them
ASK_AGAIN_S = 1.0
NEUTRAL = Sticks(0.0, 0.0, 0.0, 0.0)

BY_HAND = frozenset({"MANUAL", "STABILIZED", "ACRO", "RATTITUDE", "ALTITUDE", "POSITION", "POSITION SLOW"})
_OVERTAKING = frozenset({"hold", "land"})  # they wait for no other order's answer
_ENDING = _OVERTAKING | {"give"}  # after these the drone flies by itself
_BRAKING = _ENDING | {"take"}  # while these are under way, sticks are neutral
_TAKE_OFF, _HOLD = "TAKEOFF", "HOLD"

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Answer:
    """What became of an order.

    Attributes:
        ok: it was done.
        text: one line for people.
    """

    ok: bool
    text: str


@dataclass(frozen=True, slots=True)
class DroneView:
    """What a seat looks at.

    Attributes:
        mode: as in the live channel's status, in capitals.
        armed: motors may turn.
        alive: the link is live.
        waiting_mission: name of a mission that waits for the sticks to be given back; "" if there is none.
    """

    mode: str = ""
    armed: bool = False
    alive: bool = False
    waiting_mission: str = ""


class Drone(Protocol):
    """One drone, as a seat needs it."""

    def view(self) -> DroneView:
        """How it is."""
        ...

    async def do(self, what: str) -> tuple[bool, str]:
        """See `Fleet.do`."""
        ...

    def sticks(self, sticks: Sticks | None) -> None:
        """See `Fleet.sticks`."""

    def seat_changed(self) -> None:
        """Look again who sits there and who flies."""

    def notice(self, level: str, text: str) -> None:
        """Tell everybody."""


@dataclass(eq=False, slots=True)
class Person:
    """Somebody at a browser.

    Attributes:
        name: for other people.
        may_judge: may take the sticks from anybody.
    """

    name: str
    may_judge: bool = False


class Hands(Enum):
    """Whether the drone is flown by this seat."""

    OFF = "off"  # it flies by itself, or somebody else's hands fly it
    ON = "on"
    SILENT = "silent"  # it was flown by hand, the browser fell silent, and it is being told to hold


@dataclass(slots=True)
class Clock:
    """Time, so that tests can have their own.

    Attributes:
        now_s: seconds that only grow.
        wait: lets time pass, seconds.
    """

    now_s: Callable[[], float]
    wait: Callable[[float], Awaitable[None]] = field(default=asyncio.sleep)


class PilotSeat:
    """A drone's seat. All of it lives on one loop; `tick` is to be called some twenty times a second.

    While somebody has the sticks and afterwards, until it is disarmed, the drone is sent neutral sticks:
    an autopilot that has had sticks takes their end for a failure.

    Args:
        drone_id: for people.
        drone: what is flown.
        clock: time.

    Attributes:
        person: who sits here; None: nobody.
        hands: whether they fly it.
    """

    def __init__(self, drone_id: int, drone: Drone, clock: Clock) -> None:
        self.person: Person | None = None
        self.hands = Hands.OFF
        self._name = f"drone {drone_id}"
        self._drone = drone
        self._clock = clock
        self._heard_s = clock.now_s()
        self._streaming = False
        self._climbing = ""  # after this mode of a take-off the sticks are the pilot's
        self._order = ""
        self._orderer: Person | None = None
        self._task: asyncio.Task[Answer] | None = None

    @property
    def flying(self) -> bool:
        """The sticks of who sits here reach the drone."""
        return self.person is not None and self.hands is Hands.ON and self._order != "take"

    @property
    def idle(self) -> bool:
        """Nothing here needs `tick`."""
        return self.person is None and not self._streaming and self._task is None

    def sticks(self, person: Person, sticks: Sticks) -> None:
        """Take a pilot's sticks; those of others are not looked at."""
        if person is not self.person:
            return
        self._heard_s = self._clock.now_s()
        if self.hands is Hands.ON and self._order not in _BRAKING:
            self._stream(sticks)

    async def do(self, person: Person, order: Order) -> Answer:
        """Carry out an order, or say why not."""
        what = order.what
        refusal = self._refusal(person, order)
        if refusal:
            return Answer(False, refusal)
        if what == "stop_motors":
            return await self._stop_motors()
        if self._task is not None:
            if self._must_wait(person, what):
                return Answer(False, f"{self._name} has not answered to {_words(self._order)} yet")
            self._task.cancel()
        carry_out = {"take": self._take, "give": self._give, "take_off": self._take_off}.get(what)
        work = self._plain(what) if carry_out is None else carry_out(person)
        return await self._run(what, person, work)

    def leave(self, person: Person) -> None:
        """A browser is gone."""
        if person is self.person:
            self._seat(None)
            self._fall_silent("is gone")

    def tick(self) -> None:
        """Look whether the pilot is still there, and whether neutral sticks are still needed."""
        silent_s = self._clock.now_s() - self._heard_s
        view = self._drone.view()
        if self._climbing:
            self._climb(view, silent_s)
        if self.hands is Hands.ON and silent_s > SILENT_S and self._order not in _BRAKING:
            self._fall_silent("fell silent")
        elif self.hands is Hands.SILENT and self._task is None:
            self._ask_to_hold()
        done = self.person is None and self.hands is Hands.OFF and self._task is None
        if self._streaming and done and view.alive and not view.armed:
            self._streaming = False
            self._drone.sticks(None)

    def _refusal(self, person: Person, order: Order) -> str:
        what, holder = order.what, self.person
        if what == "stop_motors" and not order.confirmed:
            return "stopping the motors drops the drone: it must be confirmed"
        if holder is person or holder is None:
            return "you do not have the sticks" if what == "give" and holder is None else ""
        if person.may_judge and what != "give":
            return ""
        forsaken = self._clock.now_s() - self._heard_s >= FORSAKEN_S
        if what == "take" and forsaken:
            return ""
        if what == "take":
            return f"{holder.name} has the sticks; ask for them to be given back"
        return f"{holder.name} has the sticks of {self._name}"

    def _must_wait(self, person: Person, what: str) -> bool:
        """Whether an order has to wait for the answer to the one before."""
        if what in _OVERTAKING:
            return False
        return what != "take" or self._orderer is person

    async def _run(self, what: str, person: Person | None, work: Coroutine[Any, Any, Answer]) -> Answer:
        """Carry out one order; a later one may cut it short, but nobody's going away does."""
        task = self._begin(what, person, work)
        await asyncio.wait({task})
        if task.cancelled():
            return Answer(False, f"{_words(what)}: another order came before the answer")
        return task.result()

    def _begin(
        self, what: str, person: Person | None, work: Coroutine[Any, Any, Answer]
    ) -> asyncio.Task[Answer]:
        task = asyncio.get_running_loop().create_task(work, name=f"{self._name}: {what}")
        self._task, self._order, self._orderer = task, what, person
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[Answer]) -> None:
        if task is self._task:
            self._task, self._order, self._orderer = None, "", None
            self._seat(self.person)
        if not task.cancelled() and task.exception() is not None:
            logger.error("%s failed", task.get_name(), exc_info=task.exception())

    async def _take(self, person: Person) -> Answer:
        before, self._climbing = self.person, ""
        if before is not None and before is not person:
            self._drone.notice("warning", f"{person.name} took the sticks of {self._name} from {before.name}")
        self.hands = Hands.ON
        self._stream(NEUTRAL)
        self._seat(person)
        await self._clock.wait(STREAM_FIRST_S)
        ok, text = await self._drone.do("position")
        if ok:
            return Answer(True, f"you have the sticks of {self._name}")
        self.hands = Hands.SILENT if self._by_hand() else Hands.OFF  # whose it was has just lost it
        self._seat(None)
        return Answer(False, text)

    async def _give(self, _person: Person) -> Answer:
        """Back to the mission that waits, if one does; else the drone holds."""
        self._climbing = ""
        self._stream(NEUTRAL)
        mission, why = self._drone.view().waiting_mission, "no mission waits"
        if mission:
            ok, text = await self._drone.do("offboard")
            if ok:
                return self._gave(f"the mission {mission} goes on")
            why = f"the mission {mission} cannot go on ({text})"
        if self.hands is Hands.OFF:
            return self._gave(f"{why}; {self._name} stays in {self._drone.view().mode.lower() or 'its mode'}")
        ok, text = await self._drone.do("hold")
        if ok:
            return self._gave(f"{why}; {self._name} holds")
        return Answer(False, f"{why}, and it does not hold either: {text}; you still have the sticks")

    def _gave(self, text: str) -> Answer:
        self.hands = Hands.OFF
        self._seat(None)
        return Answer(True, text)

    async def _take_off(self, person: Person) -> Answer:
        ok, text = await self._drone.do("take_off")
        if ok:
            self._let_go()
            if person is self.person:
                self._climbing = _TAKE_OFF
                text = f"{text}; at its height the sticks are yours"
        return Answer(ok, text)

    async def _plain(self, what: str) -> Answer:
        """Hold, land, arm or disarm; after the first two the drone flies by itself."""
        if what in _BRAKING:
            self._climbing = ""
            if self._streaming:
                self._stream(NEUTRAL)
        ok, text = await self._drone.do(what)
        if ok and what in _BRAKING:
            self._let_go()
        return Answer(ok, text)

    async def _stop_motors(self) -> Answer:
        if self._task is not None:
            self._task.cancel()
        self._climbing = ""
        if self._streaming:
            self._stream(NEUTRAL)
        ok, text = await self._drone.do("stop_motors")
        if ok:
            self._let_go()
        return Answer(ok, text)

    def _let_go(self) -> None:
        """The drone flies by itself, while the seat stays whose it was."""
        self.hands = Hands.OFF
        if self._streaming:
            self._stream(NEUTRAL)
        self._seat(self.person)

    def _climb(self, view: DroneView, silent_s: float) -> None:
        """Follow a take-off; at its end the pilot flies on, if still there."""
        person = self.person
        if person is None or silent_s > SILENT_S or not view.armed:
            self._climbing = ""
        elif view.mode == _HOLD and self._task is None:
            self._begin("take", person, self._take_after_climb(person))
        elif view.mode not in {_TAKE_OFF, _HOLD}:
            self._climbing = ""

    async def _take_after_climb(self, person: Person) -> Answer:
        answer = await self._take(person)
        if answer.ok:
            self._drone.notice("info", f"{self._name} is up; it follows the sticks")
        else:
            self._drone.notice("warning", f"{self._name} is up, but follows no sticks: {answer.text}")
        return answer

    def _fall_silent(self, how: str) -> None:
        """The dead man: neutral sticks at once, and a drone that was flown by hand holds."""
        self._climbing = ""
        if self._streaming:
            self._stream(NEUTRAL)
        taking = self._order == "take"
        if self.hands is Hands.ON and not self._by_hand() and not taking:
            self.hands = Hands.OFF  # it has left the pilot's mode by itself, and not in vain
            self._drone.notice("warning", f"the pilot's page {how}; {self._name} goes on by itself")
        elif self.hands is Hands.ON or taking:
            self.hands = Hands.SILENT
            self._drone.notice("warning", f"the pilot's page {how}; {self._name} is told to hold")
        if self.hands is Hands.SILENT and self._order not in _ENDING:
            self._ask_to_hold()
        self._seat(self.person)

    def _ask_to_hold(self) -> None:
        if self._task is not None:
            self._task.cancel()
        self._begin("hold", None, self._hold_after_silence())

    async def _hold_after_silence(self) -> Answer:
        while True:
            ok, text = await self._drone.do("hold")
            if ok or not self._by_hand():
                break
            self._drone.notice("error", f"{self._name} does not hold: {text}")
            await self._clock.wait(ASK_AGAIN_S)
        self._let_go()
        if ok:
            self._drone.notice("info", f"{self._name} holds")
        return Answer(ok, text)

    def _by_hand(self) -> bool:
        return self._drone.view().mode in BY_HAND

    def _stream(self, sticks: Sticks) -> None:
        self._streaming = True
        self._drone.sticks(sticks)

    def _seat(self, person: Person | None) -> None:
        if person is not None and person is not self.person:
            self._heard_s = self._clock.now_s()
        self.person = person
        self._drone.seat_changed()


def _words(what: str) -> str:
    return what.replace("_", " ")
