"""The `Drone` port onto a simulation in the same process: simulated time only, no sockets, no waiting.

The timing of a link is kept, so that a mission flies as it does in real time: telemetry arrives a little
later than the state it reports, mode and arming are known from heartbeats once a second, and the motors are
switched on in the same order. Requests call the functions that handle the packets of a link.

Numbers are rounded as on a link: MAVLink carries single precision, MAVSDK converts to degrees. The paper's
navigator decides by single pixels, so even a ten-millionth of a metre may change a flight. With the link's
rounding, a lockstep flight is the same as one over UDP until something else differs.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Sequence
from dataclasses import dataclass
from math import degrees, pi, radians
from struct import Struct

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.external_pose import pose_of_odometry, usable_pose
from firmware_py.mavlink.telemetry.motion import odometry
from firmware_py.offboard_requests import SetpointRefusal, setpoint_from_body_velocity
from firmware_py.status import CommandResult, FlightMode, LandedState
from firmware_py.types import CRITICAL
from framerunner.flying.response import LateResponse
from framerunner.geometry.axes import ArenaAlignment, Pose, flip_vector
from framerunner.geometry.rotations import normalized, quaternion_from_euler
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.measurements import ImuSample
from framerunner.wire.dialect import Message
from offboard.arming import Arming
from offboard.drone import (
    DroneError,
    DroneState,
    ImuInterval,
    LimitedCommand,
    ReportedAccuracy,
    VelocityFluCommand,
)
from offboard.limits import STILL, VelocityLimits
from offboard.link.gimbal import GimbalAttitude
from offboard.link.inertial import reported_accuracy
from offboard.link.place_feedback import PERIOD_US as PLACE_US
from offboard.link.place_feedback import PlaceFeedback
from scenarios.models import TrueState
from sitl.faults.link import LinkFault, Way
from sitl.payload.gimbal import SimulatedGimbal
from sitl.simulation import Simulation

TICK_US = 50_000
HEARTBEAT_US = 1_000_000
POSITION_US = 20_000
"""Between two messages of position, or of the landed state; a tick, made by an attitude message, has the last
one before it."""
POSITION_PHASE_US = 16_000
"""Off the ticks' grid, for the same reason as the camera's exposures."""
ACCURACY_US = 100_000
"""Between two messages of the errors of the vehicle's estimate, which have the positions' phase."""
GIMBAL_US = 100_000
"""Between two messages of a gimbal, which come after the attitude of the same time."""
TELEMETRY_DELAY_US = 4_000
"""From a state to the setpoint that answers it: one control tick, as measured over UDP and MAVSDK."""
STREAM_BEFORE_OFFBOARD_US = 300_000
RESEND_US = 60_000
"""A velocity holds until changed, so it is sent again, just later than the next tick's would be."""
LINK_LOST_US = 1_000_000
READY_LIMIT_US = 30_000_000
CONFIRM_LIMIT_US = 6_000_000
LAND_LIMIT_US = 120_000_000
SETTLE_LIMIT_US = 3_000_000
_NEVER_US = 1 << 62
_TEXTS_KEPT = 8
_ONE = Struct("<f")
_THREE = Struct("<3f")

TruthObserver = Callable[[TrueState], None]
SentVelocity = tuple[Vec3, float]
"""Forward, right, down (m/s) and the yaw rate, clockwise (rad/s)."""


@dataclass(slots=True)
class _Received:
    """What the vehicle has sent between ticks."""

    position_us: int = 0  # vehicle time of the last position; 0: there is none
    position_ned_m: Vec3 = (0.0, 0.0, 0.0)
    velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
    landed: bool = True
    accuracy: ReportedAccuracy | None = None

    def update(self, autopilot: Autopilot, now_us: int) -> None:
        """Receive what is sent now; a position only if the vehicle knows its own."""
        status, state = autopilot.status, autopilot.state
        self.landed = status.landed_state is LandedState.ON_GROUND
        if status.origin is not None:
            self.position_ned_m = single(state.position_ned_m)
            self.velocity_ned_m_s = single(state.velocity_ned_m_s)
            self.position_us = now_us

    def update_accuracy(self, autopilot: Autopilot) -> None:
        """Receive an ODOMETRY."""
        message = odometry(autopilot)
        if message is not None:
            self.accuracy = reported_accuracy(message) or self.accuracy


class LockstepDrone:
    """A simulated vehicle whose time advances only while something is awaited of it.

    Its coroutines never wait for an event, so a flight runs straight through. Only when its task has been
    cancelled (Ctrl-C) do its ticks yield to the event loop, so that the flight is cancelled. Its methods
    raise DroneError if the vehicle refuses a request, or if telemetry does not confirm it in time.

    Args:
        simulation: just made, disarmed.
        start_arena: where the drone stands: x, y, z (metres) and yaw (radians), arena axes.
        observers: called with the true state of every control tick.
        telemetry_delay_us: see `TELEMETRY_DELAY_US`; ValueError if not below the 50 ms between ticks.
        response: the vehicle answers late; None: as its autopilot does.
        limits: of each command that is sent; None: there are none.
        reports_place: the vehicle is sent where it is, at first where it stands.
    """

    gone = ""

    def __init__(
        self,
        simulation: Simulation,
        start_arena: tuple[float, float, float, float],
        *,
        observers: Sequence[TruthObserver] = (),
        telemetry_delay_us: int = TELEMETRY_DELAY_US,
        response: LateResponse | None = None,
        limits: VelocityLimits | None = None,
        reports_place: bool = False,
    ) -> None:
        if not 0 <= telemetry_delay_us < TICK_US:
            raise ValueError(f"telemetry_delay_us {telemetry_delay_us}: must be from 0 to below {TICK_US}")
        self._simulation = simulation
        self._autopilot = simulation.autopilot
        self._start_arena = Pose(start_arena[:3], start_arena[3])
        self._feedback = PlaceFeedback(self._start_arena) if reports_place else None
        self._feedback_us = POSITION_PHASE_US if reports_place else _NEVER_US
        self._observers = tuple(observers)
        self._delay_us = telemetry_delay_us
        self._response = response
        self._limits = limits or VelocityLimits()
        self._latest: DroneState | None = None
        self._alignment: ArenaAlignment | None = None
        self._heartbeat_us = 0
        self._position_us = POSITION_PHASE_US
        self._accuracy_us = POSITION_PHASE_US
        self._received = _Received()
        self._gimbal_us = 0 if simulation.gimbal is not None else _NEVER_US
        self._gimbal_attitude: GimbalAttitude | None = None
        self._tick_us = TICK_US
        self._sample: DroneState | None = None
        self._arming = Arming()
        self._mode = FlightMode.HOLD
        self._command = VelocityFluCommand()
        self._commanding = False
        self._resend_us = _NEVER_US
        self._imu: list[ImuInterval] = []  # since the last tick
        self._imu_us = -1
        self._link = FaultyLink(simulation)

    async def connect(self) -> None:
        """Nothing to find."""

    async def ready(self) -> None:
        """Let time pass until the vehicle, which must be disarmed, can be armed; then fix the axes."""
        status = self._autopilot.status
        if status.armed:
            raise DroneError("the vehicle is armed already; land and disarm it, then put it on its start")
        if not self._pass(READY_LIMIT_US, until=lambda: status.ready):
            raise DroneError(
                f"not ready within {READY_LIMIT_US / 1e6:g} s: "
                f"pre-arm checks not passed{_vehicle_texts(self._autopilot)}"
            )
        if not self._received.position_us:
            self._received.update(self._autopilot, self._autopilot.state.time_us)
        self._alignment = ArenaAlignment(
            self._start_arena,
            Pose(self._received.position_ned_m, _received_angle(self._autopilot.state.yaw_rad)),
        )

    async def ticks(self) -> AsyncGenerator[DroneState, None]:
        """States at 20 Hz of vehicle time; see `next_state`."""
        task = asyncio.current_task()
        while True:
            if task is not None and task.cancelling():
                await asyncio.sleep(0)
            yield self.next_state()

    def next_state(self) -> DroneState:
        """Let time pass until the next tick, and return its state; for callers without an event loop.

        Raises:
            DroneError: not ready yet, values not finite, a failsafe took over or disarmed the vehicle.
        """
        if self._alignment is None:
            raise DroneError("the drone's ticks were asked for before it was ready; call ready() first")
        self._sample = None
        lost_us = self._simulation.time_us + LINK_LOST_US
        while (state := self._sample) is None:
            if self._simulation.time_us >= lost_us:
                raise DroneError("link lost: the vehicle's clock stands still")
            self._advance(lost_us)
        self._pass(self._delay_us)
        if not state.is_finite:
            raise DroneError("the vehicle's position, velocity or attitude is not finite")
        if self._commanding and self._arming.is_overdue(state.time_us):
            raise _not_shown("arming", self._mode, self._arming, self._autopilot)
        if self._commanding and not (state.armed and state.offboard):
            what = (
                f"the pilot or a failsafe took over: mode {state.mode}"
                if self._arming.shown
                else "the vehicle was disarmed by others"
            )
            raise DroneError(what + _vehicle_texts(self._autopilot))
        self._latest = state
        return state

    async def motors_on(self, *, confirmed: bool = True) -> None:
        """Enter offboard with zero setpoints, which a heartbeat confirms, then arm; see `Drone.motors_on`."""
        self._send(VelocityFluCommand())
        self._pass(STREAM_BEFORE_OFFBOARD_US)
        self._confirm(
            "offboard mode",
            self._autopilot.set_mode(FlightMode.OFFBOARD),
            lambda: self._mode is FlightMode.OFFBOARD,
        )
        self._confirm("arming", self._autopilot.arm(), lambda: bool(self._arming.shown) or not confirmed)
        self._arming.acknowledge(self._autopilot.state.time_us + CONFIRM_LIMIT_US)
        self._commanding = True

    async def motors_off(self) -> None:
        """Stop the motors at once (forced disarm), in the air too."""
        self._stop_commanding()
        self._arming.forget()
        answer = self._autopilot.disarm(force=True)
        self._confirm("stopping the motors", answer, lambda: self._arming.shown is False)

    async def land(self) -> None:
        """Let the vehicle land until it has disarmed itself; DroneError if the landing is aborted."""

        def armed() -> bool:
            return self._arming.is_armed(self._autopilot.state.time_us)

        self._stop_commanding()
        landing = self._autopilot.land()
        self._confirm("landing", landing, lambda: self._mode is FlightMode.LAND or not armed())
        ended = self._pass(LAND_LIMIT_US, until=lambda: not armed() or self._mode is not FlightMode.LAND)
        if armed() and ended:
            texts = _vehicle_texts(self._autopilot)
            raise DroneError(f"landing was interrupted: mode {self._mode.name}{texts}")
        if not ended:
            texts = _vehicle_texts(self._autopilot)
            raise DroneError(f"still not landed after {LAND_LIMIT_US / 1e6:g} s{texts}")

    async def hold(self) -> None:
        """Stop commanding and request hold, unless another mode than offboard is active already."""
        self._stop_commanding()
        if self._mode is FlightMode.OFFBOARD:
            answer = self._autopilot.set_mode(FlightMode.HOLD)
            self._confirm("hold", answer, lambda: self._mode is FlightMode.HOLD)

    async def land_now(self, *, demanded: bool = False) -> None:
        """Stop commanding and land, unless a failsafe has the vehicle; see `Drone.land_now`."""
        self._stop_commanding()
        if self._mode in (FlightMode.OFFBOARD, FlightMode.LAND) or demanded:
            await self.land()

    refuse = hold  # no operator takes this drone, so none gives it back

    def command(self, command: VelocityFluCommand, at: DroneState | None = None) -> LimitedCommand:
        """Set the velocity to fly from now on. Without motors on it is ignored."""
        if not self._commanding:
            return LimitedCommand(STILL)
        limited = self._limits.limit(command, at or self._latest)
        self._send(limited.command)
        return limited

    def report_place(self, state: DroneState) -> None:
        """See `Drone.report_place`."""
        if self._feedback is not None and self._commanding:
            _take_place(self._simulation, self._feedback.flying(state))

    async def close(self) -> None:
        """Stop commanding."""
        self._stop_commanding()

    def settle(self) -> None:
        """Let the drone come to rest, if its motors are off, so that the referee can judge.

        With a fault, a failsafe first ends the flight.
        """
        simulation, status = self._simulation, self._autopilot.status
        if simulation.faults.begun and status.failsafe:
            self._pass(LAND_LIMIT_US, until=lambda: simulation.referee.over or not status.armed)
        self._pass(SETTLE_LIMIT_US, until=lambda: simulation.referee.settled or status.armed)

    def _stop_commanding(self) -> None:
        self._commanding = False
        self._resend_us = _NEVER_US
        if self._response is not None:
            self._response.reset()

    def _send(self, command: VelocityFluCommand) -> None:
        self._command = command
        state = self._autopilot.state
        self._resend_us = state.time_us + RESEND_US
        velocity_m_s = single((command.forward_m_s, -command.left_m_s, -command.up_m_s))
        yaw_rate_rad_s = sent_yaw_rate(-command.yaw_rate_rad_s)
        if self._link.active:
            self._link.send((velocity_m_s, yaw_rate_rad_s))
        elif self._response is None:
            _request(self._autopilot, velocity_m_s, yaw_rate_rad_s)
        else:
            self._response.take(velocity_m_s, yaw_rate_rad_s, state.yaw_rad, state.time_us)

    def _advance(self, until_us: int = 0) -> None:
        """Let a control tick pass, and more until a time or until the link sends something by itself."""
        simulation, observers, state = self._simulation, self._observers, self._autopilot.state
        link, estimator = self._link, self._autopilot.estimator
        until_us = min(
            until_us,
            self._resend_us,
            self._heartbeat_us,
            self._tick_us,
            self._position_us,
            self._gimbal_us,
            self._feedback_us,
        )
        while True:
            simulation.tick()
            truth = simulation.truth
            for observe in observers:
                observe(truth)
            imu = estimator.imu
            if imu is not None and imu.time_us > self._imu_us:
                self._imu_us = imu.time_us
                self._imu.append(_received_imu(imu))
            if self._response is not None and self._resend_us != _NEVER_US:
                airborne = self._autopilot.status.landed_state is not LandedState.ON_GROUND
                late = self._response.step(state.yaw_rad, state.time_us, airborne=airborne)
                _request(self._autopilot, *late)
            if link.active and (arrived := link.arrived()) is not None:
                _request(self._autopilot, *arrived)
            if state.time_us >= until_us or simulation.time_us >= until_us + TICK_US:  # its clock may stand
                break
        self._exchange(state.time_us)

    def _exchange(self, now_us: int) -> None:
        """Do what a link does by itself at this time."""
        if now_us >= self._resend_us:
            self._send(self._command)
        if now_us >= self._heartbeat_us:
            self._heartbeat_us += HEARTBEAT_US
            self._arming.see_heartbeat(self._autopilot.status.armed)
            self._mode = self._autopilot.status.mode
        if now_us >= self._tick_us:
            self._tick_us += TICK_US
            if self._alignment is not None:
                state = self._reported_state(self._alignment)
                self._sample = self._link.receive(state) if self._link.active else state
        if self._feedback is not None and self._simulation.time_us >= self._feedback_us:
            self._feedback_us += PLACE_US  # a vehicle's clock stands until it knows its place
            if self._feedback.stands:
                _take_place(self._simulation, self._feedback.standing(self._simulation.time_us))
            else:
                self._feedback_us = _NEVER_US
        if now_us >= self._gimbal_us:
            self._gimbal_us += GIMBAL_US
            self._gimbal_attitude = _received_gimbal(self._simulation.gimbal)
        if now_us >= self._position_us:
            self._position_us += POSITION_US
            if not self._link.loses():
                self._received.update(self._autopilot, now_us)
                if now_us >= self._accuracy_us and self._imu_us >= 0:  # else nobody uses it
                    self._received.update_accuracy(self._autopilot)
            if now_us >= self._accuracy_us:
                self._accuracy_us += ACCURACY_US

    def _pass(self, limit_us: int, until: Callable[[], bool] = lambda: False) -> bool:
        """Let time pass until a condition holds; False if it does not within the limit."""
        end_us = self._simulation.time_us + limit_us
        while not until():
            if self._simulation.time_us >= end_us:
                return False
            self._advance()
        return True

    def _confirm(self, what: str, answer: CommandResult, shown: Callable[[], bool]) -> None:
        """Wait until telemetry shows what was requested; DroneError if it was refused or is not shown."""
        if answer is not CommandResult.ACCEPTED:
            raise DroneError(f"{what} was refused: {answer.name}{_vehicle_texts(self._autopilot)}")
        self._pass(self._delay_us)
        if not self._pass(CONFIRM_LIMIT_US, until=shown):
            raise _not_shown(what, self._mode, self._arming, self._autopilot)

    def _reported_state(self, alignment: ArenaAlignment) -> DroneState:
        """The state as telemetry shows it: heading now, position and mode as of their last messages."""
        state = self._autopilot.state
        yaw_rad = _received_angle(state.yaw_rad)
        pose = alignment.pose(Pose(self._received.position_ned_m, yaw_rad))
        roll_rad, pitch_rad = _received_angle(state.roll_rad), _received_angle(state.pitch_rad)
        camera_attitude = None
        if self._gimbal_attitude is not None:
            camera_attitude = alignment.attitude(self._gimbal_attitude.ned(yaw_rad))
        imu, self._imu = self._imu, []
        if imu and imu[-1].time_us >= state.time_us:  # one of the tick's own time belongs to the next
            self._imu.append(imu.pop())
        return DroneState(
            state.time_us,
            *pose.position_m,
            pose.yaw_rad,
            alignment.vector(self._received.velocity_ned_m_s),
            self._arming.is_armed(state.time_us),
            self._mode is FlightMode.OFFBOARD,
            self._mode.name,
            self._received.landed,
            (state.time_us - self._received.position_us) * 1e-6,
            alignment.attitude(quaternion_from_euler(roll_rad, pitch_rad, yaw_rad)),
            camera_attitude,
            imu=tuple(imu),
            accuracy=self._received.accuracy,
        )


def _take_place(simulation: Simulation, message: Message) -> None:
    """Let the vehicle receive an ODOMETRY, whose time is that of its arrival."""
    autopilot = simulation.autopilot
    received = pose_of_odometry(message, simulation.time_us)
    pose = usable_pose(received, message.quality, autopilot.parameters)
    if pose is not None:
        autopilot.estimator.take_external_pose(pose)


def _received_imu(sample: ImuSample) -> ImuInterval:
    """A sample as HIGHRES_IMU carries it, at the rate of the autopilot's ticks."""
    return ImuInterval(
        sample.time_us,
        flip_vector(single(sample.angular_rate_frd_rad_s)),
        flip_vector(single(sample.specific_force_frd_m_s2)),
    )


def _request(autopilot: Autopilot, velocity_level_m_s: Vec3, yaw_rate_rad_s: float) -> None:
    """Request a velocity (forward, right, down) and a yaw rate, clockwise."""
    state = autopilot.state
    setpoint = setpoint_from_body_velocity(velocity_level_m_s, yaw_rate_rad_s, state, state.time_us)
    if isinstance(setpoint, SetpointRefusal):
        autopilot.say(CRITICAL, setpoint.text)
    else:
        autopilot.accept_setpoint(setpoint)


def _not_shown(what: str, mode: FlightMode, arming: Arming, autopilot: Autopilot) -> DroneError:
    """The error of a request that was acknowledged and had no effect within the limit."""
    armed = "armed" if arming.shown else "disarmed"
    return DroneError(
        f"{what} was acknowledged, but telemetry still shows mode {mode.name}, {armed} "
        f"after {CONFIRM_LIMIT_US / 1e6:g} s{_vehicle_texts(autopilot)}"
    )


def _vehicle_texts(autopilot: Autopilot) -> str:
    """The vehicle's status texts since the last call, for the end of an error message."""
    texts = list(dict.fromkeys(text.text for text in autopilot.take_texts()))[-_TEXTS_KEPT:]
    return f"; the vehicle says: {' | '.join(texts)}" if texts else ""


def single(vector: Vec3) -> Vec3:
    """A vector, shape (3,), rounded to single precision."""
    x, y, z = _THREE.unpack(_THREE.pack(*vector))
    return (x, y, z)


def _received_gimbal(gimbal: SimulatedGimbal | None) -> GimbalAttitude | None:
    """What a gimbal reports of its camera, rounded as on a link."""
    if gimbal is None:
        return None
    w, x, y, z = map(_rounded, quaternion_from_euler(0.0, gimbal.pitch_rad, gimbal.yaw_rad))
    return GimbalAttitude(normalized((w, x, y, z)), to_north=False)


def _received_angle(angle_rad: float) -> float:
    """An angle of the attitude, radians, as it is after ATTITUDE and MAVSDK's degrees.

    MAVSDK multiplies by 180/pi in single precision. A product of two singles is exact in double precision,
    so rounding it once gives the same.
    """
    return radians(_rounded(_DEGREES * _rounded(angle_rad)))


def sent_yaw_rate(yaw_rate_rad_s: float) -> float:
    """A yaw rate, rad/s, as it is on the wire after MAVSDK has converted it from degrees."""
    return _rounded(_RADIANS * _rounded(degrees(yaw_rate_rad_s)))


def _rounded(value: float) -> float:
    rounded: float = _ONE.unpack(_ONE.pack(value))[0]
    return rounded


_DEGREES = _rounded(180.0 / _rounded(pi))
_RADIANS = _rounded(_rounded(pi) / 180.0)


class FaultyLink:
    """Velocities up and states down the link; to be used while it is active.

    Args:
        simulation: whose link may fail.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    @property
    def active(self) -> bool:
        """Whether the link has a fault now."""
        return self._simulation.faults.link is not None

    def loses(self) -> bool:
        """Whether the next packet is lost."""
        fault = self._simulation.faults.link
        return fault is not None and fault.loses()

    def send(self, velocity: SentVelocity) -> None:
        """Send a velocity to the vehicle."""
        self._fault.up.send(self._simulation.time_us, velocity)

    def arrived(self) -> SentVelocity | None:
        """The newest velocity that has reached the vehicle since the last call."""
        up: Way[SentVelocity] = self._fault.up
        return up.newest(self._simulation.time_us)

    def receive(self, state: DroneState) -> DroneState | None:
        """What arrives at the app of a state that is sent now; None: nothing."""
        down: Way[DroneState] = self._fault.down
        down.send(self._simulation.time_us, state)
        return down.newest(self._simulation.time_us)

    @property
    def _fault(self) -> LinkFault:
        fault = self._simulation.faults.link
        assert fault is not None, "it is active"
        return fault
