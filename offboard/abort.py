"""Brings a drone down when its flight is aborted: hold or a landing, and an operator's stop of the motors."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable

from offboard.drone import Drone, DroneError, DroneState
from offboard.safety.operator import Operator, Phase
from offboard.safety.rules import SafetyRules

ATTEND_US = 120_000_000  # vehicle time for which an operator may stop the motors after an abort
LINK_LOSSES = 10  # a second each, after which the drone is not watched any more
KILL_ATTEMPTS = 3  # a link may lose the request or its answer
LAND_ATTEMPTS = 5  # likewise
LAND_AGAIN_S = 2.0  # vehicle time for which a drone holds whose landing has failed
logger = logging.getLogger(__name__)


class FlightAbort:
    """Ends the commanding of one drone that is in the air.

    Args:
        drone: whose motors were requested.
        safety: the rules of the flight.
        see: called with the drone's states afterwards, while an operator may still stop the motors.
    """

    def __init__(self, drone: Drone, safety: SafetyRules, see: Callable[[DroneState], None]) -> None:
        self._drone = drone
        self._safety = safety
        self._see = see
        self._end_us: int | None = None  # vehicle time until which the drone is watched
        self._armed = True  # when it was seen last
        self._landings = 0  # that were requested since the operator's last demand
        self._is_landing = False  # a landing that the operator demands is under way
        self._hold_s: float | None = None  # for which it holds, then lands; None: it does not hold
        self._held_mode = ""  # in which it was first seen after hold was requested
        self._hold_end_us: int | None = None

    async def bring_down(self) -> str:
        """Hold or land, as the rules and the operator say.

        When an operator demands a landing it lands whatever the rules say, and stops the motors when that is
        demanded. Both are requested again when they are demanded again, as long as this runs: until the drone
        is disarmed, the link stays lost, or nothing was demanded for `ATTEND_US`. A drone that holds lands
        after the rules' time, and a landing that fails is requested again by itself.

        Returns:
            What is to be told beside the reason of the abort; empty if nothing.
        """
        operator = self._safety.operator
        if operator is None:
            return await self._end()
        motor_stops, problem = 0, ""  # that were requested; of the last request
        while True:
            if operator.motor_stops > motor_stops:
                motor_stops = operator.motor_stops
                operator.on_stop(None)  # a further demand must not interrupt this
                problem = await self._stop_motors()
                if not problem:
                    return "the operator stopped the motors"
                logger.warning("%s; K requests it again", problem)
                continue
            if operator.stops:
                logger.warning("the operator stops the flight: the drone lands; K stops its motors")
            landed = await self._until_next_demand(operator)
            if landed is not None:
                return "; ".join(filter(None, (problem, landed)))

    async def _until_next_demand(self, operator: Operator) -> str | None:
        """Bring it down until the operator demands something; what is to be told, None after a demand."""
        motor_stops, is_interrupted = operator.motor_stops, False
        self._landings, self._end_us = 0, None
        work = asyncio.ensure_future(self._end_and_attend())

        def interrupt() -> None:
            nonlocal is_interrupted
            if operator.motor_stops > motor_stops or not self._is_landing:
                is_interrupted = True
                work.cancel()  # not this task: a demand while the work ends must not be lost

        operator.on_stop(interrupt)
        try:
            told = await work
        except asyncio.CancelledError:
            if not is_interrupted:  # Ctrl-C
                raise
        return None if is_interrupted else told

    async def _end_and_attend(self) -> str:
        problem, held_s = await self._end(), None
        while await self._attend():
            held_s = self._hold_s
            logger.warning("held for %g s; it lands now", held_s)
            self._end_us = None
            # It is still in the hold that was requested here; an operator's mode is left alone.
            problem = await self._land(demanded=True) or problem
        if held_s is None or self._armed:  # an operator may have it
            return problem
        return f"{problem}; it landed later" if problem else f"it held for {held_s:g} s, then landed"

    async def _end(self) -> str:
        operator, abort = self._safety.operator, self._safety.abort
        demanded = operator is not None and operator.stops > 0
        if abort == "land" or demanded:
            return await self._land(demanded=demanded)
        self._show("holding")
        self._hold_for(self._safety.hold_s)
        try:
            await self._drone.hold()
        except DroneError as error:
            return f"hold: {error}"
        return ""

    async def _land(self, *, demanded: bool) -> str:
        """Request a landing; the drone holds for a while if that fails, then it is requested again."""
        self._show("landing")
        self._hold_for(None)
        self._landings += 1
        self._is_landing = demanded
        try:
            await self._drone.land_now(demanded=demanded)
        except DroneError as error:
            if self._landings < LAND_ATTEMPTS:
                self._hold_for(LAND_AGAIN_S)
            return f"land: {error}"
        finally:
            self._is_landing = False
        return ""

    def _hold_for(self, seconds: float | None) -> None:
        self._hold_s, self._hold_end_us = seconds, None

    def _show(self, phase: Phase) -> None:
        if self._safety.operator is not None:
            self._safety.operator.phase = phase

    async def _attend(self) -> bool:
        """Watch the drone until it is disarmed; a link that is lost may come back.

        Returns:
            Whether it still holds after the time for which it may.
        """
        for _ in range(LINK_LOSSES):
            with contextlib.suppress(DroneError):
                return await self._watch()
        return False

    async def _watch(self) -> bool:
        """See the ticks to the end; True: it has held for as long as it may."""
        async with contextlib.aclosing(self._drone.ticks()) as ticks:
            async for state in ticks:
                if self._end_us is None:
                    self._end_us = state.time_us + ATTEND_US
                if self._hold_s is not None and self._hold_end_us is None:
                    self._held_mode = state.mode
                    self._hold_end_us = state.time_us + round(self._hold_s * 1e6)
                self._armed = state.armed
                if not state.armed or state.time_us > self._end_us:
                    return False
                # A failsafe or an operator who has taken it keeps it.
                ends_us = self._hold_end_us
                if ends_us is not None and state.mode == self._held_mode and state.time_us > ends_us:
                    return True
                self._see(state)
        return False

    async def _stop_motors(self) -> str:
        """Request it some times; why it failed, empty if it did not."""
        problem = ""
        self._show("stopping motors")
        for _ in range(KILL_ATTEMPTS):
            try:
                await self._drone.motors_off()
            except DroneError as error:
                problem = f"stopping the motors: {error}"
            else:
                self._show("motors stopped")
                logger.warning("the operator stopped the motors")
                return ""
        return problem
