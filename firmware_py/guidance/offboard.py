"""Offboard setpoints: which are usable, and how they are made safe to follow."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, isnan, nan

from firmware_py.guidance.limits import SpeedLimits, clamp
from firmware_py.types import NAN3, Quaternion, Setpoint, Vec3

_LARGEST = 1e6  # metres or m/s asked for are cut to this, which keeps all arithmetic finite
_LARGEST_ACCELERATION_M_S2 = 50.0
_LARGEST_RATE_RAD_S = 30.0
_NORM_TOLERANCE = 0.1


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
