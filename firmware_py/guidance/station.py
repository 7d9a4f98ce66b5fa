"""Brakes, then holds place and yaw: the common part of hold, take-off, land and of sticks let go."""

from __future__ import annotations

from math import hypot, isnan

from firmware_py.guidance.limits import SpeedLimits
from firmware_py.types import NAN3, Vec3, VehicleState

_STOPPED_M_S = 0.2  # slower than this, the present place is the one to hold


class StationKeeper:
    """The place to hold.

    Attributes:
        target_ned_m: the place held, shape (3,); NaN in a component that is still braking.
        yaw_rad: the yaw held.
    """

    __slots__ = ("target_ned_m", "yaw_rad")

    def __init__(self) -> None:
        self.target_ned_m: Vec3 = NAN3
        self.yaw_rad = 0.0

    def release(self, state: VehicleState) -> None:
        """Forget the place and take over the present yaw."""
        self.target_ned_m = NAN3
        self.yaw_rad = state.yaw_rad

    def latch(self, state: VehicleState) -> None:
        """Take over the present place, horizontally and vertically each once it has stopped there."""
        north_m, east_m, down_m = self.target_ned_m
        north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
        if isnan(north_m) and hypot(north_m_s, east_m_s) < _STOPPED_M_S:
            north_m, east_m = state.position_ned_m[0], state.position_ned_m[1]
            self.target_ned_m = (north_m, east_m, down_m)
        if isnan(down_m) and abs(down_m_s) < _STOPPED_M_S:
            self.target_ned_m = (north_m, east_m, state.position_ned_m[2])

    def velocity(self, state: VehicleState, limits: SpeedLimits) -> Vec3:
        """Velocity NED towards the place held, zero in components that are still braking; not limited."""
        return towards(self.target_ned_m, state.position_ned_m, (0.0, 0.0, 0.0), limits)


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
