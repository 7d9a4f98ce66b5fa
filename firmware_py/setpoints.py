"""Setpoints: types for all that modes and offboard controllers can give, and the command of each.

A NaN component means "not controlled" (PX4's convention).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import hypot, isfinite, isnan, nan, sqrt

from firmware_py.commands import (
    AccelerationCommand,
    AttitudeCommand,
    BodyRateCommand,
    ControlCommand,
    MotorCommand,
    VelocityFrdCommand,
)
from firmware_py.guidance.limits import (
    SpeedLimits,
    clamp,
    level,
    velocity_command,
    velocity_towards,
    yaw_rate,
)
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import euler_from_quaternion
from framerunner.geometry.vectors import NAN3, ZERO3, Quaternion, Vec3

_MAX = 1e6  # limit of metres and m/s, which keeps all arithmetic finite
_MAX_ACCELERATION_M_S2 = 50.0
_NORM_TOLERANCE = 0.1
_BRAKING_SHARE = 0.6  # of the acceleration limit, for braking before a place: the vehicle lags


@dataclass(frozen=True, slots=True)
class Setpoint(ABC):
    """What a mode follows, or an offboard controller requests.

    Attributes:
        time_us: vehicle time of reception, microseconds.
    """

    time_us: int

    @property
    @abstractmethod
    def is_usable(self) -> bool:
        """Whether it can be flown."""

    def bounded(self, limits: SpeedLimits) -> Setpoint:
        """The same with components that are finite, or not controlled, and within limits.

        A yaw rate is only limited when flown; telemetry shows it as requested, as PX4's does.
        """
        return self

    @abstractmethod
    def command(self, state: VehicleState, limits: SpeedLimits) -> ControlCommand:
        """The command of this tick; for a setpoint that is `bounded`."""

    def constant_command(self, limits: SpeedLimits) -> ControlCommand | None:
        """The command, if it is the same in every tick."""
        return None

    @property
    def trajectory(self) -> TrajectorySetpoint:
        """The setpoint in telemetry: by default a velocity of zero."""
        return TrajectorySetpoint(self.time_us, velocity_ned_m_s=ZERO3)


@dataclass(frozen=True, slots=True)
class TrajectorySetpoint(Setpoint):
    """A place, a velocity or an acceleration in the local frame.

    Attributes:
        position_ned_m: shape (3,).
        velocity_ned_m_s: alone, or as feed-forward of a position, shape (3,).
        acceleration_ned_m_s2: flown without position and velocity, shape (3,).
        yaw_rad: clockwise from north.
        yaw_rate_rad_s: clockwise.
    """

    position_ned_m: Vec3 = NAN3
    velocity_ned_m_s: Vec3 = NAN3
    acceleration_ned_m_s2: Vec3 = NAN3
    yaw_rad: float = nan
    yaw_rate_rad_s: float = nan

    @property
    def is_usable(self) -> bool:
        """Whether any component is controlled."""
        values = self.position_ned_m + self.velocity_ned_m_s + self.acceleration_ned_m_s2
        return not all(map(isnan, values))

    def bounded(self, limits: SpeedLimits) -> TrajectorySetpoint:
        """An infinite component counts as not controlled, and a velocity that is not controlled is zero.

        So the vehicle brakes and hovers on that axis, as PX4's does. An acceleration alone leaves the
        velocity uncontrolled.
        """
        yaw_rad, yaw_rate_rad_s = _finite(self.yaw_rad), _finite(self.yaw_rate_rad_s)
        acceleration_only = all(map(isnan, self.position_ned_m + self.velocity_ned_m_s)) and self.is_usable
        north_m_s2, east_m_s2, down_m_s2 = self.acceleration_ned_m_s2
        acceleration = (_acceleration(north_m_s2), _acceleration(east_m_s2), _acceleration(down_m_s2))
        if acceleration_only:
            north, east, down = acceleration
            acceleration = (_or_zero(north), _or_zero(east), _or_zero(down))
            return TrajectorySetpoint(self.time_us, NAN3, NAN3, acceleration, yaw_rad, yaw_rate_rad_s)
        north_m, east_m, down_m = self.position_ned_m
        return TrajectorySetpoint(
            self.time_us,
            (_place(north_m), _place(east_m), _place(down_m)),
            _velocity(self.velocity_ned_m_s, limits),
            acceleration,
            yaw_rad,
            yaw_rate_rad_s,
        )

    def command(self, state: VehicleState, limits: SpeedLimits) -> ControlCommand:
        """The velocity towards the place, the velocity, or the acceleration."""
        if isnan(self.velocity_ned_m_s[0]):
            return AccelerationCommand(
                level(state, self.acceleration_ned_m_s2),
                yaw_rate(state.yaw_rad, self.yaw_rad, self.yaw_rate_rad_s, limits),
            )
        if isnan(self.position_ned_m[0]) or isnan(self.position_ned_m[1]):
            velocity_ned_m_s = velocity_towards(
                self.position_ned_m, state.position_ned_m, self.velocity_ned_m_s, limits
            )
        else:
            velocity_ned_m_s = self._approach(state, limits)
        return velocity_command(state, velocity_ned_m_s, self.yaw_rad, limits, self.yaw_rate_rad_s)

    @property
    def trajectory(self) -> TrajectorySetpoint:
        """Itself."""
        return self

    def _approach(self, state: VehicleState, limits: SpeedLimits) -> Vec3:
        """Velocity NED to a place: proportional to the distance, and not faster than it can brake."""
        north_m, east_m, down_m = self.position_ned_m
        distance_m = hypot(north_m - state.position_ned_m[0], east_m - state.position_ned_m[1])
        north_m_s, east_m_s, down_m_s = velocity_towards(
            (nan, nan, down_m), state.position_ned_m, self.velocity_ned_m_s, limits
        )
        if distance_m > 0.0:
            share = braking_speed(distance_m, limits) / distance_m
            north_m_s += share * (north_m - state.position_ned_m[0])
            east_m_s += share * (east_m - state.position_ned_m[1])
        return (north_m_s, east_m_s, down_m_s)


@dataclass(frozen=True, slots=True)
class BodyVelocitySetpoint(Setpoint):
    """A velocity in level axes that turn with the yaw.

    Attributes:
        velocity_level_m_s: forward, right, down; shape (3,), finite.
        yaw_rad: clockwise from north.
        yaw_rate_rad_s: clockwise.
        velocity_ned_m_s: the velocity at reception, for telemetry, shape (3,).
        acceleration_ned_m_s2: requested with it, for telemetry; not flown; shape (3,).
    """

    velocity_level_m_s: Vec3
    yaw_rad: float = nan
    yaw_rate_rad_s: float = nan
    velocity_ned_m_s: Vec3 = NAN3
    acceleration_ned_m_s2: Vec3 = NAN3

    @property
    def is_usable(self) -> bool:
        """Whether the velocity is finite."""
        forward, right, down = self.velocity_level_m_s
        return isfinite(forward + right + down)

    def bounded(self, limits: SpeedLimits) -> BodyVelocitySetpoint:
        """The same within the limits."""
        north_m_s2, east_m_s2, down_m_s2 = self.acceleration_ned_m_s2
        return BodyVelocitySetpoint(
            self.time_us,
            limits.clip(*self.velocity_level_m_s),
            _finite(self.yaw_rad),
            _finite(self.yaw_rate_rad_s),
            _velocity(self.velocity_ned_m_s, limits),
            (_acceleration(north_m_s2), _acceleration(east_m_s2), _acceleration(down_m_s2)),
        )

    def command(self, state: VehicleState, limits: SpeedLimits) -> ControlCommand:
        """The velocity, with the yaw rate towards its yaw."""
        turn_rad_s = yaw_rate(state.yaw_rad, self.yaw_rad, self.yaw_rate_rad_s, limits)
        return VelocityFrdCommand(self.velocity_level_m_s, turn_rad_s)

    def constant_command(self, limits: SpeedLimits) -> ControlCommand | None:
        """The command, unless a yaw is given."""
        if not isnan(self.yaw_rad):
            return None
        return VelocityFrdCommand(self.velocity_level_m_s, yaw_rate(0.0, nan, self.yaw_rate_rad_s, limits))

    @property
    def trajectory(self) -> TrajectorySetpoint:
        """The velocity in NED at reception."""
        return TrajectorySetpoint(
            self.time_us,
            NAN3,
            self.velocity_ned_m_s,
            self.acceleration_ned_m_s2,
            self.yaw_rad,
            self.yaw_rate_rad_s,
        )


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint(Setpoint):
    """An attitude (body FRD to world NED), a thrust as a share of full thrust, and an added yaw rate."""

    attitude: Quaternion
    thrust: float
    yaw_rate_rad_s: float = nan

    @property
    def is_usable(self) -> bool:
        """Whether the quaternion is of unit length and the thrust finite."""
        square = sum(component * component for component in self.attitude)
        return isfinite(self.thrust) and abs(square - 1.0) < _NORM_TOLERANCE  # false for NaN too

    def command(self, state: VehicleState, limits: SpeedLimits) -> ControlCommand:
        """Its tilt, and the yaw rate towards its yaw."""
        roll_rad, pitch_rad, yaw_rad = euler_from_quaternion(self.attitude)
        turn_rad_s = yaw_rate(state.yaw_rad, yaw_rad, self.yaw_rate_rad_s, limits)
        return AttitudeCommand(roll_rad, pitch_rad, turn_rad_s, self.thrust)

    @property
    def trajectory(self) -> TrajectorySetpoint:
        """A velocity of zero, and the yaw rate."""
        return TrajectorySetpoint(self.time_us, velocity_ned_m_s=ZERO3, yaw_rate_rad_s=self.yaw_rate_rad_s)


@dataclass(frozen=True, slots=True)
class BodyRateSetpoint(Setpoint):
    """Body rates, shape (3,), and a thrust as a share of full thrust."""

    rate_frd_rad_s: Vec3
    thrust: float

    @property
    def is_usable(self) -> bool:
        """Whether the thrust is finite."""
        return isfinite(self.thrust)

    def command(self, state: VehicleState, limits: SpeedLimits) -> ControlCommand:
        """The command with the same values."""
        return BodyRateCommand(self.rate_frd_rad_s, self.thrust)


@dataclass(frozen=True, slots=True)
class MotorSetpoint(Setpoint):
    """Motor outputs, 0..1 of a rotor's full thrust, in the airframe's order."""

    outputs: tuple[float, ...]

    @property
    def is_usable(self) -> bool:
        """Whether there are outputs and all are finite."""
        return bool(self.outputs) and all(map(isfinite, self.outputs))

    def command(self, state: VehicleState, limits: SpeedLimits) -> ControlCommand:
        """The command with the same values."""
        return MotorCommand(self.outputs)


def braking_speed(distance_m: float, limits: SpeedLimits) -> float:
    """The speed from which the vehicle can stop within a distance.

    Near the target it is proportional to the distance, farther away it follows v^2 = 2 a s; it changes where
    the slopes are equal, so that the deceleration never exceeds a.
    """
    gain, max_m_s2 = limits.position_gain, _BRAKING_SHARE * limits.acceleration.level_m_s2
    if distance_m * gain * gain <= max_m_s2:
        return gain * distance_m
    return sqrt(2.0 * max_m_s2 * distance_m - (max_m_s2 / gain) ** 2)


def _finite(value: float) -> float:
    return value if isfinite(value) else nan


def _or_zero(value: float) -> float:
    return clamp(value, -_MAX, _MAX) if isfinite(value) else 0.0


def _place(metres: float) -> float:
    return clamp(metres, -_MAX, _MAX) if isfinite(metres) else nan


def _velocity(velocity_m_s: Vec3, limits: SpeedLimits) -> Vec3:
    north_m_s, east_m_s, down_m_s = velocity_m_s
    return limits.clip(_or_zero(north_m_s), _or_zero(east_m_s), _or_zero(down_m_s))


def _acceleration(value: float) -> float:
    bound = _MAX_ACCELERATION_M_S2
    return clamp(value, -bound, bound) if isfinite(value) else nan
