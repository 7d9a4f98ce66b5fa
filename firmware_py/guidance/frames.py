"""Small pieces that all modes share: turning vectors, turning the nose."""

from __future__ import annotations

from math import cos, isnan, nan, remainder, sin, tau

from firmware_py.guidance.limits import SpeedLimits, clamp
from firmware_py.types import RateCommand, VehicleState
from geometry.vectors import Vec3


def level(state: VehicleState, vector_ned: Vec3) -> Vec3:
    """A vector NED in level axes turned with the yaw: forward, right, down."""
    north, east, down = vector_ned
    cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
    return (cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north, down)


def yaw_rate(yaw_now_rad: float, yaw_rad: float, yaw_rate_rad_s: float, limits: SpeedLimits) -> float:
    """The yaw rate that turns the shortest way to a yaw, and a yaw rate beside it; NaN: not asked for."""
    rate_rad_s = 0.0 if isnan(yaw_rate_rad_s) else yaw_rate_rad_s
    if not isnan(yaw_rad):
        rate_rad_s += limits.yaw_gain * remainder(yaw_rad - yaw_now_rad, tau)
    limit_rad_s = limits.yaw_rate_rad_s
    return clamp(rate_rad_s, -limit_rad_s, limit_rad_s)


def rate_command(
    state: VehicleState,
    velocity_ned_m_s: Vec3,
    yaw_rad: float,
    limits: SpeedLimits,
    yaw_rate_rad_s: float = nan,
) -> RateCommand:
    """Limit a velocity, turn it into level axes, and find the yaw rate."""
    velocity_m_s = level(state, limits.clip(*velocity_ned_m_s))
    return RateCommand(velocity_m_s, yaw_rate(state.yaw_rad, yaw_rad, yaw_rate_rad_s, limits))


def towards(target: Vec3, place: Vec3, velocity: Vec3, limits: SpeedLimits) -> Vec3:
    """Velocity plus a proportional pull to the target in the components that have one."""
    tx, ty, tz = target
    vx, vy, vz = velocity
    if not isnan(tx):
        vx += limits.position_gain * (tx - place[0])
    if not isnan(ty):
        vy += limits.position_gain * (ty - place[1])
    if not isnan(tz):
        vz += limits.height_gain * (tz - place[2])
    return (vx, vy, vz)
