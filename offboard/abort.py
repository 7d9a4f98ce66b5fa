"""Brings a drone down when its flight is aborted: hold or a landing, and an operator's stop of the motors."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable

from offboard.drone import Drone, DroneError, DroneState
from offboard.safety.operator import Phase
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
        self._landings = 0  # that were requested
        self._hold_s: float | None = None  # for which it holds, then lands; None: it does not hold
        self._held_mode = ""  # in which it was first seen after hold was requested
        self._hold_end_us: int | None = None

    async def bring_down(self) -> str:
        """Hold or land, as the rules and the operator say.

        An operator's first stop lands whatever the rules say, the second one stops the motors. With an
        operator this returns when the drone is disarmed, when the link stays lost, or after `ATTEND_US`, and
        a drone that holds lands after the rules' time. A landing that fails is requested again.

        Returns:
            What is to be told beside the reason of the abort; empty if nothing.
        """
        operator = self._safety.operator
        if operator is None:
            return await self._end()
        while not operator.kills:
            if operator.stops:
                logger.warning("the operator stops the flight: the drone lands; K stops its motors")
            stops = operator.stops
            work = asyncio.ensure_future(self._end_and_attend())
            operator.on_stop(work.cancel)  # not this task: a stop while the work ends must not be lost
            try:
                return await work
            except asyncio.CancelledError:
                if operator.stops == stops:  # Ctrl-C
                    raise
        operator.on_stop(None)  # a third press must not interrupt this
        return await self._kill()

    async def _end_and_attend(self) -> str:
        problem, held_s = await self._end(), None
        while await self._attend():
            held_s = self._hold_s
            logger.warning("held for %g s; it lands now", held_s)
            self._end_us = None
            # It is still in the hold that was requested here; a pilot's mode is left alone.
            problem = await self._land(demanded=True) or problem
        if held_s is None or self._armed:  # a pilot may have it
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
        try:
            await self._drone.land_now(demanded=demanded)
        except DroneError as error:
            if self._landings < LAND_ATTEMPTS:
                self._hold_for(LAND_AGAIN_S)
            return f"land: {error}"
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
        ticks = self._drone.ticks()
        try:
            async for state in ticks:
                if self._end_us is None:
                    self._end_us = state.time_us + ATTEND_US
                if self._hold_s is not None and self._hold_end_us is None:
                    self._held_mode = state.mode
                    self._hold_end_us = state.time_us + round(self._hold_s * 1e6)
                self._armed = state.armed
                if not state.armed or state.time_us > self._end_us:
                    return False
                # A failsafe or a pilot who has taken it keeps it.
                ends_us = self._hold_end_us
                if ends_us is not None and state.mode == self._held_mode and state.time_us > ends_us:
                    return True
                self._see(state)
        finally:
            close = getattr(ticks, "aclose", None)
            if close is not None:
                await close()
        return False

    async def _kill(self) -> str:
        problem = ""
        self._show("motors stopped")
        for _ in range(KILL_ATTEMPTS):
            try:
                await self._drone.motors_off()
            except DroneError as error:
                problem = f"stopping the motors: {error}"
            else:
                logger.warning("the operator stopped the motors")
                return "the operator stopped the motors"
        return problem
