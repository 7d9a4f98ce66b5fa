"""Offboard setpoints: which are usable, how they are made safe to follow, and following them."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, isfinite, isnan, nan, sqrt

from firmware_py.guidance.frames import level, rate_command, towards, yaw_rate
from firmware_py.guidance.limits import SpeedLimits, clamp
from firmware_py.types import (
    AccelerationCommand,
    ActuatorCommand,
    BodyRateCommand,
    Command,
    RateCommand,
    Setpoint,
    TiltCommand,
    VehicleState,
)
from geometry.rotations import euler_from_quaternion
from geometry.vectors import NAN3, Quaternion, Vec3

_LARGEST = 1e6  # metres or m/s asked for are cut to this, which keeps all arithmetic finite
_LARGEST_ACCELERATION_M_S2 = 50.0
_LARGEST_RATE_RAD_S = 30.0
_NORM_TOLERANCE = 0.1
_BRAKING_SHARE = 0.6  # of the acceleration allowed, for slowing down before a place: the vehicle lags behind


class OffboardFlight:
    """Follows setpoints.

    Attributes:
        setpoint: the one followed, as `bounded` made it.
        turning: the command of a setpoint that is the same in every tick; None: `step` says it.
    """

    __slots__ = ("setpoint", "turning")

    def __init__(self) -> None:
        self.setpoint = Setpoint(0)
        self.turning: RateCommand | None = None

    def accept(self, setpoint: Setpoint, limits: SpeedLimits) -> None:
        """Take the next setpoint; see `usable` and `bounded`."""
        self.setpoint = wanted = bounded(setpoint, limits)
        self.turning = None
        if is_acceleration_only(setpoint):
            self.setpoint = Setpoint(
                setpoint.time_us,
                acceleration_ned_m_s2=acceleration_or_zero(wanted),
                yaw_rad=wanted.yaw_rad,
                yaw_rate_rad_s=wanted.yaw_rate_rad_s,
            )
        elif not isnan(wanted.velocity_level_m_s[0]) and isnan(wanted.yaw_rad):
            turn_rad_s = yaw_rate(0.0, nan, wanted.yaw_rate_rad_s, limits)
            self.turning = RateCommand(wanted.velocity_level_m_s, turn_rad_s)

    def step(self, state: VehicleState, limits: SpeedLimits) -> Command:
        """What the stabiliser has to follow in this tick."""
        wanted = self.setpoint
        if not isnan(wanted.velocity_level_m_s[0]):
            turn_rad_s = yaw_rate(state.yaw_rad, wanted.yaw_rad, wanted.yaw_rate_rad_s, limits)
            return RateCommand(wanted.velocity_level_m_s, turn_rad_s)
        if not isnan(wanted.thrust) or wanted.outputs:
            return _thrusting(state, wanted, limits)
        if isnan(wanted.velocity_ned_m_s[0]):
            return AccelerationCommand(
                level(state, acceleration_or_zero(wanted)),
                yaw_rate(state.yaw_rad, wanted.yaw_rad, wanted.yaw_rate_rad_s, limits),
            )
        if isnan(wanted.position_ned_m[0]) or isnan(wanted.position_ned_m[1]):
            velocity_ned_m_s = towards(
                wanted.position_ned_m, state.position_ned_m, wanted.velocity_ned_m_s, limits
            )
        else:
            velocity_ned_m_s = _approach(state, wanted, limits)
        return rate_command(state, velocity_ned_m_s, wanted.yaw_rad, limits, wanted.yaw_rate_rad_s)


def _approach(state: VehicleState, wanted: Setpoint, limits: SpeedLimits) -> Vec3:
    """Velocity NED to a place: proportional near by, and never faster than it can brake."""
    north_m, east_m, down_m = wanted.position_ned_m
    distance_m = hypot(north_m - state.position_ned_m[0], east_m - state.position_ned_m[1])
    north_m_s, east_m_s, down_m_s = towards(
        (nan, nan, down_m), state.position_ned_m, wanted.velocity_ned_m_s, limits
    )
    if distance_m > 0.0:
        share = braking_speed(distance_m, limits) / distance_m
        north_m_s += share * (north_m - state.position_ned_m[0])
        east_m_s += share * (east_m - state.position_ned_m[1])
    return (north_m_s, east_m_s, down_m_s)


def braking_speed(distance_m: float, limits: SpeedLimits) -> float:
    """The speed from which one can stop in a distance.

    Near the target it is proportional, farther away it follows v^2 = 2 a s; where the slopes meet it changes
    over, so that the deceleration never exceeds a.
    """
    gain, most_m_s2 = limits.position_gain, _BRAKING_SHARE * limits.pace.level_m_s2
    if distance_m * gain * gain <= most_m_s2:
        return gain * distance_m
    return sqrt(2.0 * most_m_s2 * distance_m - (most_m_s2 / gain) ** 2)


def _thrusting(state: VehicleState, wanted: Setpoint, limits: SpeedLimits) -> Command:
    """Setpoints below the velocity: attitude, rates, motors."""
    if wanted.outputs:
        return ActuatorCommand(wanted.outputs)
    if wanted.rate_frd_rad_s is not None and wanted.attitude is None:
        return BodyRateCommand(wanted.rate_frd_rad_s, wanted.thrust)
    roll_rad, pitch_rad, yaw_rad = euler_from_quaternion(wanted.attitude or state.attitude)
    turn_rad_s = yaw_rate(state.yaw_rad, yaw_rad, wanted.yaw_rate_rad_s, limits)
    return TiltCommand(roll_rad, pitch_rad, turn_rad_s, wanted.thrust)


def usable(setpoint: Setpoint) -> bool:
    """Whether a setpoint says anything that can be flown."""
    if setpoint.outputs:
        return all(map(isfinite, setpoint.outputs))
    if setpoint.attitude is not None:
        return isfinite(setpoint.thrust) and _is_attitude(setpoint.attitude)
    if setpoint.rate_frd_rad_s is not None:
        return isfinite(setpoint.thrust)
    values = setpoint.position_ned_m + setpoint.velocity_ned_m_s + setpoint.acceleration_ned_m_s2
    return not all(map(isnan, values))


def bounded(setpoint: Setpoint, limits: SpeedLimits) -> Setpoint:
    """A setpoint made safe to follow.

    An infinite component counts as not controlled, and a velocity that is not controlled is zero: the
    vehicle brakes and hovers on that axis, as PX4's does. Speeds are cut to the limits. The yaw rate is
    passed on as asked for, which is what PX4 echoes; it is limited when flown.
    """
    north_m, east_m, down_m = setpoint.position_ned_m
    north_m_s, east_m_s, down_m_s = setpoint.velocity_ned_m_s
    north_m_s2, east_m_s2, down_m_s2 = setpoint.acceleration_ned_m_s2
    level = setpoint.velocity_level_m_s
    rates = setpoint.rate_frd_rad_s
    return replace(
        setpoint,
        position_ned_m=(_near(north_m), _near(east_m), _near(down_m)),
        velocity_ned_m_s=limits.clip(_or_zero(north_m_s), _or_zero(east_m_s), _or_zero(down_m_s)),
        acceleration_ned_m_s2=(_pull(north_m_s2), _pull(east_m_s2), _pull(down_m_s2)),
        yaw_rad=setpoint.yaw_rad if isfinite(setpoint.yaw_rad) else nan,
        yaw_rate_rad_s=setpoint.yaw_rate_rad_s if isfinite(setpoint.yaw_rate_rad_s) else nan,
        velocity_level_m_s=NAN3 if isnan(level[0]) else limits.clip(*level),
        rate_frd_rad_s=None if rates is None else (_turn(rates[0]), _turn(rates[1]), _turn(rates[2])),
        thrust=clamp(setpoint.thrust, 0.0, 1.0) if isfinite(setpoint.thrust) else nan,
        outputs=tuple([clamp(output, 0.0, 1.0) for output in setpoint.outputs]),
    )


def is_acceleration_only(setpoint: Setpoint) -> bool:
    """Whether neither a position nor a velocity was asked for, but an acceleration."""
    asked = setpoint.position_ned_m + setpoint.velocity_ned_m_s
    return all(map(isnan, asked)) and not all(map(isnan, setpoint.acceleration_ned_m_s2))


def acceleration_or_zero(setpoint: Setpoint) -> Vec3:
    """The acceleration NED asked for, zero where it is not controlled."""
    north, east, down = setpoint.acceleration_ned_m_s2
    return (
        0.0 if isnan(north) else north,
        0.0 if isnan(east) else east,
        0.0 if isnan(down) else down,
    )


def _is_attitude(attitude: Quaternion) -> bool:
    square = sum(component * component for component in attitude)
    return abs(square - 1.0) < _NORM_TOLERANCE  # false for NaN too


def _near(metres: float) -> float:
    return clamp(metres, -_LARGEST, _LARGEST) if isfinite(metres) else nan


def _or_zero(value: float) -> float:
    return clamp(value, -_LARGEST, _LARGEST) if isfinite(value) else 0.0


def _pull(value: float) -> float:
    bound = _LARGEST_ACCELERATION_M_S2
    return clamp(value, -bound, bound) if isfinite(value) else nan


def _turn(value: float) -> float:
    return clamp(value, -_LARGEST_RATE_RAD_S, _LARGEST_RATE_RAD_S) if isfinite(value) else 0.0
