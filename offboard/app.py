"""Flies a mission with a drone and a camera, and ends safely whatever happens."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import aclosing
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from framerunner.wire.mission_report import TransitionTaken
from offboard.abort import FlightAbort
from offboard.drone import Drone, DroneError, DroneState, LimitedCommand, PlaceEstimate, VelocityFluCommand
from offboard.engine import MissionEngine, MissionRunError
from offboard.limits import CONTEST, STILL, CommandLimits
from offboard.mission import Mission
from offboard.navigation.view import NavigationView, Surroundings
from offboard.perception import CameraLostError, CameraSilentError, Perception
from offboard.pilot import Imu
from offboard.safety.operator import GO_WORDS
from offboard.safety.rules import SIMULATED, SafetyRules
from vision.types import Detections

INTERRUPTED = "interrupted"
MICROSECONDS = 1_000_000
NAVIGATION_US = 200_000  # vehicle time between two views of the navigator's map
CAMERA_WAIT_US = 4 * MICROSECONDS  # for which a mission with a map hovers when there are no images
REST_US = 3 * MICROSECONDS  # time to fall onto the base, and for telemetry to show the drone at rest
NO_COMMAND = LimitedCommand(STILL)
MAX_STEP_US = 200_000  # counted between two ticks
GO_LIMIT_US = 600 * MICROSECONDS  # vehicle time for which an operator's go is waited for


@dataclass(frozen=True, slots=True)
class Moment:
    """One tick of a flight, for displays and records.

    Attributes:
        remark: in a pause, why the mission did not continue when the operator last gave the drone back;
            otherwise how box and caps have limited the mission's command, or that it hovers because there are
            no images; empty if it flies as commanded.
        navigation: the navigator's map and plan, renewed five times a second; None without a navigator.
        place: where the app itself has estimated the drone to be; None if it believes its `state`, or the
            mission did nothing in this tick.
    """

    state: DroneState
    command: VelocityFluCommand  # as sent
    detections: Detections  # of the latest image
    mission_state: str  # such as "red.turning"
    flight_time_s: float  # vehicle time since motors on; 0 before
    transition: TransitionTaken | None = None  # the one taken in this tick
    paused: bool = False  # an operator has the sticks; the mission waits
    remark: str = ""
    navigation: NavigationView | None = None
    place: PlaceEstimate | None = None


Observer = Callable[[Moment], None]
TickHook = Callable[[MissionEngine, DroneState], Awaitable[None]]
"""Awaited before each tick with the drone's state at it. It may look at the engine, wait, and change its
chart; `asyncio.CancelledError` ends the flight. It may wait only if the vehicle's time waits for the app."""
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class MissionEnd:
    """How a flight ended."""

    ended: Literal["finished", "timed out", "aborted"]
    reason: str  # why it did not finish; empty if it did
    mission_state: str  # the state it was in
    flight_time_s: float  # vehicle time from motors on to its end
    ticks: int  # how many were flown
    pauses: int = 0  # how often an operator took the drone
    kept_in_box_s: float = 0.0  # vehicle time for which the command was changed to keep the drone in its box

    @property
    def interrupted(self) -> bool:
        """Whether a user stopped it with Ctrl-C."""
        return self.reason.startswith(INTERRUPTED)


async def fly_mission(
    drone: Drone,
    perception: Perception,
    mission: Mission,
    *,
    limit_s: float = 180.0,
    observer: Observer | None = None,
    limits: CommandLimits = CONTEST,
    surroundings: Surroundings | None = None,
    before_tick: TickHook | None = None,
    safety: SafetyRules = SIMULATED,
) -> MissionEnd:
    """Connect, fly the mission, disconnect.

    If anything fails after the start (drone, camera, mission, time limit, Ctrl-C, the operator's stop),
    commanding stops, hold or a landing is requested, as the rules say, and the outcome says why. An operator
    who takes the drone pauses the mission; it continues when he gives the drone back where that is safe.

    Args:
        drone: not yet connected; closed at the end.
        perception: opened and closed here.
        mission: checked.
        limit_s: vehicle time from motors on, seconds.
        observer: called at every tick; must be quick.
        limits: of the mission's commands, with which it plans; the drone limits what it is sent by itself.
        surroundings: what is known of the arena; a mission with `vision: frames` needs it.
        before_tick: see `TickHook`; None costs nothing.
        safety: how the flight ends if it is aborted, and the operator who gives the go and may stop it.

    Raises:
        DroneError: the drone cannot be reached or is not ready.
        CameraLostError: the camera gives no image at the start.
    """
    engine = MissionEngine(mission, surroundings=surroundings, limits=limits)
    if engine.has_navigator:
        perception.expect_base(engine.expected_base)
    flight = _Flight(
        drone, perception, engine, limit_s, observer, limits=limits, before_tick=before_tick, safety=safety
    )
    try:
        await drone.connect()
        await perception.open()
        await drone.ready()
        return await flight.run()
    finally:
        await perception.close()
        await drone.close()


@dataclass(slots=True)
class _Flight:
    """One flight in progress; the first fields are as for `fly_mission`."""

    drone: Drone
    perception: Perception
    engine: MissionEngine
    limit_s: float
    observer: Observer | None
    limits: CommandLimits
    before_tick: TickHook | None
    safety: SafetyRules
    flying: bool = False
    motors_requested: bool = False
    landed: bool = False
    first_us: int | None = None
    started_us: int | None = None
    now_us: int = 0
    ticks: int = 0
    sent: VelocityFluCommand | None = None
    kept_in_box_us: int = 0
    commanded_us: int = 0
    paused: bool = False
    silent_us: int | None = None
    pauses: int = 0
    remark: str = ""
    navigation: NavigationView | None = None
    navigation_us: int | None = None

    async def run(self) -> MissionEnd:
        """Fly until the flight ends, for whatever reason."""
        operator, task = self.safety.operator, asyncio.current_task()
        if operator is None or task is None:
            return await self._run()
        operator.on_first_stop(task.cancel)
        try:
            if operator.stops:
                return self._outcome("aborted", operator.stop_words)
            return await self._run()
        finally:
            operator.on_stop(None)
            operator.phase = "ended"

    async def _run(self) -> MissionEnd:
        try:
            await self._wait_for_go()
            timed_out = await self._fly()
        except (DroneError, CameraLostError, MissionRunError) as error:
            return await self._stop("aborted", str(error))
        except asyncio.CancelledError:
            _uncancel()  # the outcome reports it
            return await self._stop("aborted", self._interruption)
        except BaseException:
            await self._stop("aborted", "unexpected error")
            raise
        if timed_out:
            return await self._stop("timed out", f"not finished within {self.limit_s:g} s")
        try:
            await self._observe_rest()
        except asyncio.CancelledError:  # what was flown is not lost; the motors are off already
            _uncancel()
            return self._outcome("aborted", self._interruption)
        return self._outcome("finished", "")

    @property
    def _interruption(self) -> str:
        """Who has cancelled the flight."""
        operator = self.safety.operator
        return operator.stop_words if operator is not None and operator.stops else INTERRUPTED

    async def _wait_for_go(self) -> None:
        """Wait for the operator's go, while link and camera are watched."""
        operator = self.safety.operator
        if operator is None:
            return
        operator.ask_for_go()
        if operator.has_go:
            operator.phase = "flying"
            return
        operator.phase = "waiting"
        began_us = None
        async with aclosing(self._ticks()) as ticks:
            async for state in ticks:
                if state.armed:
                    raise DroneError("the vehicle was armed by others while it waited for the go; disarm it")
                if operator.has_go:
                    operator.phase = "flying"
                    return
                began_us = state.time_us if began_us is None else began_us
                if state.time_us - began_us > GO_LIMIT_US:
                    minutes = GO_LIMIT_US / MICROSECONDS / 60
                    raise DroneError(f"no go within {minutes:g} min; the checks are too old, so start again")
                detections = self.perception.latest(state.time_us)
                self.remark = f"{GO_WORDS}: {operator.hint}"
                self._observe(state, NO_COMMAND, detections)
                self.remark = ""

    async def _fly(self) -> bool:
        """Tick until the mission is finished; True if the time limit ended before."""
        async with aclosing(self._ticks()) as ticks:
            async for state in ticks:
                if self._update_time(state.time_us):
                    return True
                await self._tick(state)
                if self.engine.finished:
                    await self._stop_motors()
                    return False
        raise DroneError("the drone's ticks ended")

    async def _ticks(self) -> AsyncGenerator[DroneState, None]:
        """The drone's states, each after the flight's hook."""
        async with aclosing(self.drone.ticks()) as ticks:
            async for state in ticks:
                if self.before_tick is not None:
                    await self.before_tick(self.engine, state)
                yield state

    async def _tick(self, state: DroneState) -> None:
        if self.flying and (self.paused or not state.offboard) and await self._update_pause(state):
            return
        try:
            detections = self.perception.latest(state.time_us)
        except CameraSilentError as error:
            self._hover(state, error)
            return
        if self.silent_us is not None:
            self.silent_us, self.remark = None, ""
        images = self.perception.take() if self.engine.has_navigator else ()
        imu = Imu(state.x, state.y, state.z, state.yaw)
        command = self.engine.tick(imu, detections, state.time_us, state, images=images, sent=self.sent)
        if self.engine.has_navigator:
            self.perception.space_images(self.engine.image_period_s)
        if self.flying and self.engine.drone is not None:
            self.drone.report_place(self.engine.drone)
        motors_on = self.engine.pilot.cmd.on
        self.motors_requested = self.motors_requested or motors_on
        self.sent = None
        if motors_on and self.flying:
            limited = self._command(command, self.engine.drone or state)
            self.sent = limited.command
        else:
            limited = LimitedCommand(self.limits.limited(command))
        self._observe(state, limited, detections)
        if motors_on and not self.flying:  # this takes seconds; observers have the reason already
            await self.drone.motors_on(confirmed=not self.engine.has_navigator)
            self.flying = True
            self.started_us = None  # counts from the next tick, the first with motors on
            self._command(command, self.engine.drone or state)
        elif self.flying and not motors_on:
            await self._stop_motors()
        self.ticks += 1

    def _hover(self, state: DroneState, error: CameraSilentError) -> None:
        """Let the mission wait for an image, if it can: what is on a map stays known meanwhile."""
        if not (self.flying and self.engine.has_navigator):
            raise error
        if self.silent_us is None:
            self.silent_us = state.time_us
            logger.warning("%s; the drone hovers", error)
        if state.time_us - self.silent_us > CAMERA_WAIT_US:
            raise error
        self.remark = f"hovers: no image for {error.age_s:.1f} s"
        self.engine.pause(state.time_us)
        limited = self._command(STILL, state)
        self.sent = limited.command
        self.ticks += 1
        self._observe(state, limited, Detections())

    def _command(self, command: VelocityFluCommand, state: DroneState) -> LimitedCommand:
        """Let the drone fly a command, as far as its limits allow."""
        limited = self.drone.command(command, state)
        if limited.kept_in_box:
            self.kept_in_box_us += min(state.time_us - self.commanded_us, MAX_STEP_US)
        self.commanded_us = state.time_us
        return limited

    def _observe(self, state: DroneState, limited: LimitedCommand, detections: Detections) -> None:
        if self.observer is None:
            return
        engine, drone = self.engine, self.engine.drone
        self.observer(
            Moment(
                state,
                limited.command,
                detections,
                mission_state=engine.state,
                flight_time_s=self._flight_time_s(),
                transition=engine.transition,
                paused=self.paused,
                remark="; ".join(filter(None, (self.remark, limited.remark))),
                navigation=self._navigation_at(state.time_us),
                place=drone.estimate if drone is not None and drone.time_us == state.time_us else None,
            )
        )

    def _navigation_at(self, time_us: int) -> NavigationView | None:
        """The navigator's map and plan, at most `NAVIGATION_US` old."""
        made_us = self.navigation_us
        if made_us is None or time_us - made_us >= NAVIGATION_US:
            self.navigation, self.navigation_us = self.engine.navigation, time_us
        return self.navigation

    async def _update_pause(self, state: DroneState) -> bool:
        """Start, continue or end a pause; True if the mission waits in this tick."""
        if not self.paused:
            self.paused = True
            self.pauses += 1
            self.remark = ""
            logger.info("paused: the pilot has the sticks (%s)", state.mode)
        self.engine.pause(state.time_us)
        self.sent = None
        if not state.armed:
            raise DroneError(
                "the pilot landed and stopped the motors"
                if state.landed
                else "the motors were stopped in the air while the pilot had the sticks"
            )
        try:
            detections, camera_problem = self.perception.latest(state.time_us), ""
        except CameraLostError as error:  # an operator can fly without it, and it may return
            detections, camera_problem = Detections(), str(error)
        if state.offboard:
            self.remark = _why_not_continued(state) or camera_problem
            if not self.remark:
                self.paused = False
                logger.info("the pilot gave the drone back: the mission continues")
                return False
            logger.warning("the mission does not continue: %s", self.remark)
            await self.drone.refuse()
        self.ticks += 1
        self._observe(state, NO_COMMAND, detections)
        return True

    def _update_time(self, time_us: int) -> bool:
        """Note the time; True past the limit, which counts from motors on; before, from the first tick."""
        self.now_us = time_us
        if self.first_us is None:
            self.first_us = time_us
        if self.flying and self.started_us is None:
            self.started_us = time_us
        since_us = self.first_us if self.started_us is None else self.started_us
        return time_us - since_us > round(self.limit_s * MICROSECONDS)

    async def _stop_motors(self) -> None:
        """Motors off or, if the mission says so or ends with motors on, land."""
        if not self.flying:
            return
        cmd = self.engine.pilot.cmd
        self.flying = False
        if cmd.land or cmd.on:
            await self.drone.land()
            self.landed = True
        else:
            await self.drone.motors_off()

    async def _observe_rest(self) -> None:
        """Observe for a while after motors off, for the records and for a referee that uses telemetry.

        A landing takes many seconds, in which no tick is observed; the time counts from its end.
        """
        end_us = None if self.landed else self.now_us + REST_US
        try:
            async with aclosing(self._ticks()) as ticks:
                async for state in ticks:
                    if end_us is None:
                        end_us = state.time_us + REST_US
                    if self.observer is not None:
                        since_us = state.time_us if self.started_us is None else self.started_us
                        self.observer(
                            Moment(
                                state,
                                STILL,
                                Detections(),
                                mission_state=self.engine.state,
                                flight_time_s=(state.time_us - since_us) / MICROSECONDS,
                                navigation=self.navigation,
                            )
                        )
                    if state.time_us >= end_us:
                        break
        except DroneError:
            return  # the flight has ended; a link lost now changes nothing

    async def _stop(self, ended: Literal["timed out", "aborted"], reason: str) -> MissionEnd:
        """Stop commanding, and hold or land."""
        if gone := self.drone.gone:
            logger.warning("the flight ends: %s", gone)
            return self._outcome("aborted", gone)
        if self.motors_requested:
            self.flying = False
            operator = self.safety.operator
            if operator is not None and operator.needs_go and not operator.stops:
                logger.warning("the flight is aborted: %s; SPACE lands, then K stops the motors", reason)

            def see(state: DroneState) -> None:
                self._observe(state, NO_COMMAND, Detections())

            more = await FlightAbort(self.drone, self.safety, see).bring_down()
            reason = f"{reason}; {more}" if more else reason
        return self._outcome(ended, reason)

    def _outcome(self, ended: Literal["finished", "timed out", "aborted"], reason: str) -> MissionEnd:
        state, flight_time_s = self.engine.state, self._flight_time_s()
        kept_s = self.kept_in_box_us / MICROSECONDS
        return MissionEnd(ended, reason, state, flight_time_s, self.ticks, self.pauses, kept_s)

    def _flight_time_s(self) -> float:
        return 0.0 if self.started_us is None else (self.now_us - self.started_us) / MICROSECONDS


def _why_not_continued(state: DroneState) -> str:
    """Why the drone's state forbids the mission to continue after a pause; empty if it does not."""
    if state.landed:
        return "the drone stands on the ground"
    if not all(map(isfinite, (state.x, state.y, state.z, state.yaw))):
        return "its position is not finite"
    return ""


def _uncancel() -> None:
    """Take back the cancellation of this task, which is reported instead."""
    task = asyncio.current_task()
    if task is not None:
        task.uncancel()
