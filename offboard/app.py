"""Flies a mission: drone and camera in, an outcome with its reason out. Whatever happens, it ends safely."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from offboard.drone import Drone, DroneError, DroneState, VelocityCommand
from offboard.engine import MissionEngine, MissionRunError, TransitionTaken
from offboard.eyes import Camera, CameraEyes, CameraLostError, ClosedEyes, Eyes
from offboard.keep_in_box import Box, KeepInBox, OutsideBoxError
from offboard.mission import Mission
from offboard.pilot import Imu
from vision.types import Detections

INTERRUPTED = "interrupted"
MICROSECONDS = 1_000_000
STILL = VelocityCommand()
REST_US = 3 * MICROSECONDS  # time to fall onto the base, and to be seen at rest there


@dataclass(frozen=True, slots=True)
class Moment:
    """One tick of a flight, for displays and records.

    Attributes:
        state: of the drone.
        command: as sent.
        detections: of the latest image.
        mission_state: such as "red.turning".
        flight_time_s: vehicle time since motors on; 0 before.
        transition: the one taken in this tick, if any.
        paused: a pilot has the sticks; the mission waits.
        remark: in a pause, why the mission did not go on when the pilot last gave the drone back; otherwise
            what keeping the drone in its box made of the mission's command. Empty if nothing.
    """

    state: DroneState
    command: VelocityCommand
    detections: Detections
    mission_state: str
    flight_time_s: float
    transition: TransitionTaken | None = None
    paused: bool = False
    remark: str = ""


Observer = Callable[[Moment], None]
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class MissionEnd:
    """How a flight ended.

    Attributes:
        ended: "finished" if the mission reached its end.
        reason: why it did not; empty if it did.
        mission_state: the state it was in.
        flight_time_s: vehicle time from motors on to its end.
        ticks: how many were flown.
        pauses: how often a pilot took the drone.
        kept_in_box_s: vehicle time for which the command was changed to keep the drone in its box.
    """

    ended: Literal["finished", "timed out", "aborted"]
    reason: str
    mission_state: str
    flight_time_s: float
    ticks: int
    pauses: int = 0
    kept_in_box_s: float = 0.0

    @property
    def interrupted(self) -> bool:
        """Somebody stopped it with Ctrl-C."""
        return self.reason.startswith(INTERRUPTED)


async def fly_mission(
    drone: Drone,
    camera: Camera | None,
    mission: Mission,
    *,
    limit_s: float = 180.0,
    observer: Observer | None = None,
    eyes: Eyes | None = None,
    box: Box | None = None,
) -> MissionEnd:
    """Connect, fly the mission, let go.

    If anything goes wrong after the start (drone, camera, mission, time limit, Ctrl-C), commanding stops,
    hold is asked for, and the outcome says why. A pilot who takes the drone pauses the mission; it goes on
    when he gives the drone back where that is safe.

    Args:
        drone: not yet connected; closed at the end.
        camera: source of images; None for a mission that does not look.
        mission: checked.
        limit_s: vehicle time from motors on, seconds.
        observer: called at every tick; must be quick.
        eyes: instead of `camera`: other means to see, such as those of a lockstep simulation.
        box: in which the drone is kept, whatever the mission says; None: it is not.

    Returns:
        How it ended.

    Raises:
        DroneError: the drone cannot be reached or is not ready.
        CameraLostError: the camera gives no image at the start.
    """
    if eyes is None:
        eyes = ClosedEyes() if camera is None else CameraEyes(camera)
    keeper = None if box is None else KeepInBox(box)
    flight = _Flight(drone, eyes, MissionEngine(mission), limit_s, observer, keeper=keeper)
    try:
        await drone.connect()
        await eyes.open()
        await drone.ready()
        return await flight.run()
    finally:
        await eyes.close()
        await drone.close()


class _Flight:
    """One flight under way."""

    def __init__(
        self,
        drone: Drone,
        eyes: Eyes,
        engine: MissionEngine,
        limit_s: float,
        observer: Observer | None,
        *,
        keeper: KeepInBox | None,
    ) -> None:
        self._drone = drone
        self._eyes = eyes
        self._engine = engine
        self._limit_us = round(limit_s * MICROSECONDS)
        self._observer = observer
        self._keeper = keeper
        self._flying = False
        self._motors_asked = False
        self._landed = False
        self._first_us: int | None = None
        self._started_us: int | None = None
        self._now_us = 0
        self._ticks = 0
        self._paused = False
        self._pauses = 0
        self._remark = ""

    async def run(self) -> MissionEnd:
        """Fly to the end, whichever it is."""
        try:
            timed_out = await self._fly()
        except (DroneError, CameraLostError, MissionRunError, OutsideBoxError) as error:
            return await self._stop("aborted", str(error))
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is not None:
                task.uncancel()  # the outcome tells of it
            return await self._stop("aborted", INTERRUPTED)
        except BaseException:
            await self._stop("aborted", "unexpected error")
            raise
        if timed_out:
            return await self._stop("timed out", f"not finished within {self._limit_us / MICROSECONDS:g} s")
        await self._watch_come_to_rest()
        return self._outcome("finished", "")

    async def _fly(self) -> bool:
        """Tick until the mission is finished; True if time was up before."""
        ticks = self._drone.ticks()
        try:
            async for state in ticks:
                if self._time_is_up(state.time_us):
                    return True
                await self._tick(state)
                if self._engine.finished:
                    await self._come_down()
                    return False
        finally:
            await _close(ticks)
        raise DroneError("the drone's ticks ended")

    async def _tick(self, state: DroneState) -> None:
        if self._flying and (self._paused or not state.offboard) and await self._stay_paused(state):
            return
        detections = self._eyes.latest(state.time_us)
        imu = Imu(state.x, state.y, state.z, state.yaw)
        command = self._kept_in(self._engine.tick(imu, detections, state.time_us), state)
        wanted = self._engine.pilot.cmd.on
        switches = wanted != self._flying
        self._motors_asked = self._motors_asked or wanted
        if switches:  # this takes seconds; those who watch shall know at once why
            self._observe(state, command, detections)
        if wanted and not self._flying:
            await self._drone.motors_on()
            self._flying = True
            self._started_us = None  # counts from the next tick, the first with motors on
        elif self._flying and not wanted:
            await self._come_down()
        if self._flying:
            self._drone.command(command)
        self._ticks += 1
        if not switches:
            self._observe(state, command, detections)

    def _observe(self, state: DroneState, command: VelocityCommand, detections: Detections) -> None:
        if self._observer is not None:
            flight_time_s = self._flight_time_s()
            place, transition = self._engine.state, self._engine.transition
            remark = "" if self._keeper is None else self._keeper.remark
            self._observer(
                Moment(state, command, detections, place, flight_time_s, transition, remark=remark)
            )

    def _kept_in(self, command: VelocityCommand, state: DroneState) -> VelocityCommand:
        """What of a command may be flown; the first change in a flight is logged."""
        keeper = self._keeper
        if keeper is None or not self._flying:
            return command
        first = not keeper.limited_us
        kept = keeper.limit(command, state)
        if first and keeper.remark:
            logger.warning("%s (x %.1f, y %.1f, z %.1f m)", keeper.remark, state.x, state.y, state.z)
        return kept

    async def _stay_paused(self, state: DroneState) -> bool:
        """Begin, go on with or end a pause; True if the mission waits in this tick."""
        if not self._paused:
            self._paused = True
            self._pauses += 1
            self._remark = ""
            logger.info("paused: the pilot has the sticks (%s)", state.mode)
        self._engine.pause(state.time_us)
        if not state.armed:
            raise DroneError(
                "the pilot landed and stopped the motors"
                if state.landed
                else "the motors were stopped in the air while the pilot had the sticks"
            )
        try:
            detections, blind = self._eyes.latest(state.time_us), ""
        except CameraLostError as error:  # no harm to a pilot, and it may come back
            detections, blind = Detections(), str(error)
        if state.offboard:
            self._remark = _hindrance(state) or blind
            if not self._remark:
                self._paused = False
                logger.info("the pilot gave the drone back: the mission goes on")
                return False
            logger.warning("the mission does not go on: %s", self._remark)
            await self._drone.refuse()
        self._ticks += 1
        if self._observer is not None:
            place, flight_time_s = self._engine.state, self._flight_time_s()
            self._observer(Moment(state, STILL, detections, place, flight_time_s, None, True, self._remark))
        return True

    def _time_is_up(self, time_us: int) -> bool:
        """Whether the limit is over; it counts from motors on, and before that from the first tick."""
        self._now_us = time_us
        if self._first_us is None:
            self._first_us = time_us
        if self._flying and self._started_us is None:
            self._started_us = time_us
        since_us = self._first_us if self._started_us is None else self._started_us
        return time_us - since_us > self._limit_us

    async def _come_down(self) -> None:
        """Motors off or, if the mission says so or ends in the air, land."""
        if not self._flying:
            return
        cmd = self._engine.pilot.cmd
        self._flying = False
        if cmd.land or cmd.on:
            await self._drone.land()
            self._landed = True
        else:
            await self._drone.motors_off()

    async def _watch_come_to_rest(self) -> None:
        """Go on observing after motors off, for the records and for a referee who lives on telemetry.

        A landing takes many seconds, in which no tick is observed; the time counts from its end.
        """
        ticks = self._drone.ticks()
        end_us = None if self._landed else self._now_us + REST_US
        try:
            async for state in ticks:
                if end_us is None:
                    end_us = state.time_us + REST_US
                if self._observer is not None:
                    since_us = state.time_us if self._started_us is None else self._started_us
                    flight_time_s = (state.time_us - since_us) / MICROSECONDS
                    blind = Detections()
                    self._observer(Moment(state, STILL, blind, self._engine.state, flight_time_s))
                if state.time_us >= end_us:
                    break
        except DroneError:
            return  # the flight is over; a link lost now changes nothing
        finally:
            await _close(ticks)

    async def _stop(self, ended: Literal["timed out", "aborted"], reason: str) -> MissionEnd:
        """Stop commanding and ask for hold."""
        if self._motors_asked:
            self._flying = False
            try:
                await self._drone.hold()
            except DroneError as error:
                reason = f"{reason}; hold: {error}"
        return self._outcome(ended, reason)

    def _outcome(self, ended: Literal["finished", "timed out", "aborted"], reason: str) -> MissionEnd:
        place, flight_time_s = self._engine.state, self._flight_time_s()
        kept_s = 0.0 if self._keeper is None else self._keeper.limited_us / MICROSECONDS
        return MissionEnd(ended, reason, place, flight_time_s, self._ticks, self._pauses, kept_s)

    def _flight_time_s(self) -> float:
        return 0.0 if self._started_us is None else (self._now_us - self._started_us) / MICROSECONDS


def _hindrance(state: DroneState) -> str:
    """Why the drone's state forbids to fly on after a pause; empty if it does not."""
    if state.landed:
        return "the drone stands on the ground"
    if not all(map(isfinite, (state.x, state.y, state.z, state.yaw))):
        return "its position is not finite"
    return ""


async def _close(ticks: AsyncIterator[DroneState]) -> None:
    close = getattr(ticks, "aclose", None)
    if close is not None:
        await close()
