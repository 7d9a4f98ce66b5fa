"""Pauses, steps, slows, changes and stops a flight in lockstep, between ticks of its mission.

A flight in lockstep advances only while it runs, so waiting changes nothing: with the same seed, a flight
that was paused and stepped is the same to the last bit as one that was not.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf, isfinite

from framerunner.wire.mission_report import TransitionTaken
from offboard.chart.spec import state_path
from offboard.drone import DroneState
from offboard.engine import MissionEngine
from offboard.mission import Mission
from offboard.observation import ChangeRefusedError, carried_ids

MAX_DELAY_S = 0.2
"""A flight that is so much behind its speed does not catch up."""


@dataclass(frozen=True, slots=True)
class RunStanding:
    """How a flight is controlled now.

    Attributes:
        paused: it waits before its next tick.
        stopped_in: full id of the state whose entry paused it; "" if something else did.
        speed: vehicle seconds a second; None: as fast as possible.
    """

    paused: bool
    stopped_in: str
    speed: float | None


Listener = Callable[[MissionEngine, DroneState, RunStanding], None]
Changed = Callable[[str, Mapping[str, str]], None]
"""Called with "" and the ids that transitions have now, by their ids before; or with why it was refused."""


class RunControl:
    """Controls one flight; its orders may come from any thread and are carried out between two ticks.

    Args:
        speed: vehicle seconds a second; None: as fast as possible.
        paused: wait before the first tick.
        break_on: full ids of states whose entry pauses the flight.
        listener: called in the flight's own thread before each tick, and when an order changed something
            during a pause; must be quick and only look.

    Raises:
        ValueError: the speed is not a positive number.
    """

    def __init__(
        self,
        *,
        speed: float | None = None,
        paused: bool = False,
        break_on: Iterable[str] = (),
        listener: Listener | None = None,
    ) -> None:
        self._speed = _checked(speed)
        self._paused = paused
        self._break_on = frozenset(break_on)
        self._listener = listener
        self._stopped_in = ""
        self._steps = 0
        self._stopped = False
        self._orders: deque[Callable[[MissionEngine], None]] = deque()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._woken: asyncio.Event | None = None
        self._anchor: tuple[float, int] | None = None  # loop's time and vehicle time from which speed counts
        self._state = ""
        self._transition: TransitionTaken | None = None

    def pause(self) -> None:
        """Wait before the next tick."""
        self._order(lambda _: self._set_paused(True))

    def go_on(self) -> None:
        """End a pause."""
        self._order(lambda _: self._set_paused(False))

    def step(self, ticks: int = 1) -> None:
        """Let some ticks of the mission pass and pause again; a running flight pauses first."""

        def step(_: MissionEngine) -> None:
            self._paused = True
            self._steps += ticks

        self._order(step)

    def set_speed(self, speed: float | None) -> None:
        """Fly so many vehicle seconds a second, None: as fast as possible. ValueError: it is not > 0."""
        checked = _checked(speed)

        def change(_: MissionEngine) -> None:
            self._speed, self._anchor = checked, None

        self._order(change)

    def break_on(self, states: Iterable[str]) -> None:
        """Pause from now on when one of these states is entered, by full id; a superstate from outside it."""
        wanted = frozenset(states)

        def change(_: MissionEngine) -> None:
            self._break_on = wanted

        self._order(change)

    def change(self, mission: Mission, changed: Changed) -> None:
        """Go on with a changed chart, in the same active state; see `MissionEngine.change`."""

        def change(engine: MissionEngine) -> None:
            before = engine.mission
            try:
                engine.change(mission)
            except ChangeRefusedError as error:
                changed(str(error), {})
            else:
                changed("", carried_ids(before, mission))

        self._order(change)

    def tell(self) -> None:
        """Have the listener called, in a pause too."""
        self._order(lambda _: None)

    def stop(self) -> None:
        """End the flight, as Ctrl-C does."""

        def stop(_: MissionEngine) -> None:
            self._stopped = True

        self._order(stop)

    async def before_tick(self, engine: MissionEngine, state: DroneState) -> None:
        """Wait until the next tick is due; see `offboard.app.TickHook`.

        Raises:
            asyncio.CancelledError: the flight was stopped.
        """
        if self._woken is None:
            self._loop, self._woken = asyncio.get_running_loop(), asyncio.Event()
        self._break(engine)
        self._carry_out(engine)
        self._tell(engine, state)
        await asyncio.sleep(0)  # others in the event loop may give orders
        while (due_s := self._due_s(state.time_us)) > asyncio.get_running_loop().time():
            await self._wait(due_s)
            if self._carry_out(engine):
                self._tell(engine, state)
        if self._paused:
            self._steps -= 1

    def _due_s(self, time_us: int) -> float:
        """When the tick at a vehicle time may pass, by the loop's clock; infinite in a pause."""
        if self._stopped:
            raise asyncio.CancelledError
        if self._paused:
            self._anchor = None
            return -inf if self._steps else inf
        if self._speed is None:
            return -inf
        now_s = asyncio.get_running_loop().time()
        if self._anchor is None:
            self._anchor = (now_s, time_us)
        due_s = self._anchor[0] + (time_us - self._anchor[1]) / 1e6 / self._speed
        if now_s - due_s > MAX_DELAY_S:
            self._anchor = (now_s, time_us)
        return due_s

    async def _wait(self, due_s: float) -> None:
        """Until an order arrives or a time has come."""
        assert self._woken is not None
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout_at(due_s if isfinite(due_s) else None):
                await self._woken.wait()
        self._woken.clear()

    def _order(self, order: Callable[[MissionEngine], None]) -> None:
        self._orders.append(order)
        loop, woken = self._loop, self._woken
        if loop is not None and woken is not None:
            with contextlib.suppress(RuntimeError):  # the flight is over and its loop closed
                loop.call_soon_threadsafe(woken.set)

    def _carry_out(self, engine: MissionEngine) -> bool:
        """Carry out all orders; whether there were any."""
        found = False
        while self._orders:
            self._orders.popleft()(engine)
            found = True
        return found

    def _set_paused(self, paused: bool) -> None:
        if not paused:
            self._stopped_in = ""
        self._paused, self._steps = paused, 0

    def _break(self, engine: MissionEngine) -> None:
        """Pause if the last tick entered one of the states."""
        began = not self._state and engine.state
        taken = engine.transition if engine.transition is not self._transition else None
        self._state, self._transition = engine.state, engine.transition
        if not self._break_on or not (began or taken):
            return
        entered = [*state_path(engine.state)]
        if taken is not None:  # the state that was left may be within the same superstates
            left = set(state_path(taken.source)) - {taken.target}
            entered = [each for each in entered if each not in left]
        hit = next((each for each in entered if each in self._break_on), "")
        if hit:
            self._set_paused(True)
            self._stopped_in = hit

    def _tell(self, engine: MissionEngine, state: DroneState) -> None:
        if self._listener is not None:
            paused = self._paused and not self._steps
            self._listener(engine, state, RunStanding(paused, self._stopped_in, self._speed))


def _checked(speed: float | None) -> float | None:
    if speed is not None and not (speed > 0 and isfinite(speed)):
        raise ValueError(f"speed {speed}: must be a positive number, or None for as fast as possible")
    return speed
