"""Orbit around a point, and following a target that moves."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import atan2, cos, hypot, isnan, nan, pi, radians, sin

from firmware_py.parameters import Parameters
from firmware_py.types import Vec3, VehicleState

_PULL = 1.0  # 1/s, back onto the circle
_SMALLEST_M = 0.1
_FASTEST_TURN_M_S2 = 2.0  # PX4 limits the centripetal acceleration of an orbit so


class OrbitYaw(IntEnum):
    """ORBIT_YAW_BEHAVIOUR: where the nose points."""

    CENTRE = 0
    INITIAL = 1
    UNCONTROLLED = 2
    TANGENT = 3
    STICKS = 4


@dataclass(slots=True)
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

    def step(self, state: VehicleState) -> tuple[float, float, float]:
        """Velocity north and east (m/s) and yaw (rad)."""
        north_m = state.position_ned_m[0] - self.centre_ned_m[0]
        east_m = state.position_ned_m[1] - self.centre_ned_m[1]
        distance_m = hypot(north_m, east_m)
        angle_rad = atan2(east_m, north_m) if distance_m > _SMALLEST_M else state.yaw_rad + pi
        most_m_s = (_FASTEST_TURN_M_S2 * self.radius_m) ** 0.5
        speed_m_s = max(-most_m_s, min(self.speed_m_s, most_m_s))
        outside_m = distance_m - self.radius_m
        # Far from the circle it is flown to first; the nearer, the more along it.
        inward_m_s = max(-abs(speed_m_s) - 1.0, min(_PULL * outside_m, abs(speed_m_s) + 1.0))
        along_m_s = speed_m_s * max(0.0, 1.0 - abs(outside_m) / max(self.radius_m, 1.0))
        north_m_s = -inward_m_s * cos(angle_rad) - along_m_s * sin(angle_rad)
        east_m_s = -inward_m_s * sin(angle_rad) + along_m_s * cos(angle_rad)
        return north_m_s, east_m_s, self._yaw(angle_rad, speed_m_s)

    def _yaw(self, angle_rad: float, speed_m_s: float) -> float:
        if self.yaw is OrbitYaw.CENTRE:
            return angle_rad + pi
        if self.yaw is OrbitYaw.TANGENT:
            return angle_rad + (pi / 2 if speed_m_s >= 0 else -pi / 2)
        return self.initial_yaw_rad if self.yaw is OrbitYaw.INITIAL else nan


@dataclass(frozen=True, slots=True)
class FollowSettings:
    """How a target is followed: metres, radians."""

    distance_m: float
    height_m: float
    angle_rad: float


def follow_settings(parameters: Parameters) -> FollowSettings:
    """What the FLW_TGT_ parameters say."""
    value = parameters.value
    return FollowSettings(value("FLW_TGT_DST"), value("FLW_TGT_HT"), radians(value("FLW_TGT_FA")))


class TargetFollower:
    """Keeps a place relative to a target that reports itself.

    Attributes:
        seen_us: when the target last reported; far in the past before.
    """

    __slots__ = ("_course_rad", "_position_ned_m", "_velocity_ned_m_s", "seen_us")

    def __init__(self) -> None:
        self.seen_us = -(10**15)
        self._position_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self._velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self._course_rad = 0.0

    def report(self, time_us: int, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report; a velocity with NaN in it counts as standing."""
        self.seen_us = time_us
        self._position_ned_m = position_ned_m
        standing = any(isnan(component) for component in velocity_ned_m_s)
        self._velocity_ned_m_s = (0.0, 0.0, 0.0) if standing else velocity_ned_m_s
        north_m_s, east_m_s, _ = self._velocity_ned_m_s
        if hypot(north_m_s, east_m_s) > 1.0:  # slower, its course is noise
            self._course_rad = atan2(east_m_s, north_m_s)

    def place(self, now_us: int, settings: FollowSettings, home_down_m: float) -> tuple[Vec3, float]:
        """Where to be (NED, metres) and where to look (rad) now; the height counts from home."""
        ahead_s = min(max(now_us - self.seen_us, 0) / 1e6, 1.0)
        north_m = self._position_ned_m[0] + ahead_s * self._velocity_ned_m_s[0]
        east_m = self._position_ned_m[1] + ahead_s * self._velocity_ned_m_s[1]
        angle_rad = self._course_rad + settings.angle_rad
        place = (
            north_m + settings.distance_m * cos(angle_rad),
            east_m + settings.distance_m * sin(angle_rad),
            home_down_m - settings.height_m,
        )
        return place, angle_rad + pi

    @property
    def velocity_ned_m_s(self) -> Vec3:
        """The target's own, shape (3,)."""
        return self._velocity_ned_m_s
