"""The circle of an orbit: the velocity to it and along it, and the yaw."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import atan2, hypot, nan, pi

from firmware_py.guidance.limits import AccelerationLimits, clamp
from firmware_py.types import VehicleState
from framerunner.geometry.vectors import Vec3

_MIN_DISTANCE_M = 0.5  # nearer to the centre than this, its direction is not used
_MAX_CENTRIPETAL_M_S2 = 2.0  # as in PX4
_NEAR_M = 3.0  # nearer to the circle than this, the velocity has a part along it


class OrbitYaw(IntEnum):
    """ORBIT_YAW_BEHAVIOUR: where the nose points."""

    CENTRE = 0
    INITIAL = 1
    UNCONTROLLED = 2
    TANGENT = 3
    STICKS = 4


@dataclass(frozen=True, slots=True)
class Orbit:
    """A circle around a point.

    Attributes:
        centre_ned_m: shape (3,); its height is the height flown.
        radius_m: of the circle.
        speed_m_s: along it; positive is clockwise seen from above.
        yaw: where the nose points.
        initial_yaw_rad: at the start, for `OrbitYaw.INITIAL`.
    """

    centre_ned_m: Vec3 = (0.0, 0.0, 0.0)
    radius_m: float = 1.0
    speed_m_s: float = 1.0
    yaw: OrbitYaw = OrbitYaw.CENTRE
    initial_yaw_rad: float = 0.0

    def speed_within(self, max_m_s2: float) -> float:
        """The speed along it within a limit of centripetal acceleration, m/s."""
        max_m_s = (min(max_m_s2, _MAX_CENTRIPETAL_M_S2) * self.radius_m) ** 0.5
        return clamp(self.speed_m_s, -max_m_s, max_m_s)

    def velocity(
        self, place_ned_m: Vec3, limits: AccelerationLimits, cruise_m_s: float
    ) -> tuple[float, float]:
        """Velocity north and east (m/s) at a place: towards the circle, and near it along it."""
        north_m, east_m, distance_m = self._from_centre(place_ned_m)
        outside_m = distance_m - self.radius_m
        gap_m = abs(outside_m)
        inward_m_s = min(cruise_m_s, limits.stopping_level(gap_m)) * (1.0 if outside_m > 0.0 else -1.0)
        along_m_s = self.speed_within(limits.level_m_s2) * max(0.0, 1.0 - gap_m / min(self.radius_m, _NEAR_M))
        if distance_m == 0.0:
            return -inward_m_s, 0.0  # away from the centre in any direction
        north, east = north_m / distance_m, east_m / distance_m
        return -inward_m_s * north - along_m_s * east, -inward_m_s * east + along_m_s * north

    def look(self, state: VehicleState, stick_rad_s: float) -> tuple[float, float]:
        """Yaw (rad; NaN: not controlled) and yaw rate (rad/s) at the vehicle's place and velocity."""
        if self.yaw is OrbitYaw.INITIAL:
            return self.initial_yaw_rad, 0.0
        if self.yaw in (OrbitYaw.UNCONTROLLED, OrbitYaw.STICKS):
            return nan, stick_rad_s if self.yaw is OrbitYaw.STICKS else 0.0
        north_m, east_m, distance_m = self._from_centre(state.position_ned_m)
        if distance_m < _MIN_DISTANCE_M:
            return nan, 0.0
        north_m_s, east_m_s, _ = state.velocity_ned_m_s
        rate_rad_s = (north_m * east_m_s - east_m * north_m_s) / (distance_m * distance_m)
        outward_rad = atan2(east_m, north_m)
        if self.yaw is OrbitYaw.CENTRE:
            return outward_rad + pi, rate_rad_s
        return outward_rad + (pi / 2 if self.speed_m_s >= 0 else -pi / 2), rate_rad_s

    def _from_centre(self, place_ned_m: Vec3) -> Vec3:
        """North and east from the centre, and the horizontal distance."""
        north_m, east_m = place_ned_m[0] - self.centre_ned_m[0], place_ned_m[1] - self.centre_ned_m[1]
        return north_m, east_m, hypot(north_m, east_m)
