"""Following a target that reports itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import atan2, cos, hypot, isnan, radians, remainder, sin, tau

from firmware_py.guidance.limits import clamp
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from geometry.vectors import Vec3

_COURSE_M_S = 1.0  # slower than this, the target's course is noise
_SLOWEST_S = 5.0  # how long FLW_TGT_RS = 1 takes to believe a change of velocity
_LONGEST_AHEAD_S = 1.0  # a target that is silent for longer is thought to stand from then on
_LOST_US = 3_000_000
_LEAST_HEIGHT_M = 1.0  # over home; PX4 climbs again when it is lower over the ground
_NEVER_US = -(10**15)


class FollowHeight(IntEnum):
    """FLW_TGT_ALT_M: what the height counts from."""

    HOME = 0
    TERRAIN = 1
    TARGET = 2


@dataclass(frozen=True, slots=True)
class FollowSettings:
    """How a target is followed.

    Attributes:
        distance_m: horizontal, from it.
        height_m: above home or target.
        angle_rad: clockwise from its course: pi is behind it.
        height: what the height counts from.
        slowness: 0 believes its reports at once, 1 takes long.
        around_m_s: how fast to fly around it when its course changes.
    """

    distance_m: float
    height_m: float
    angle_rad: float
    height: FollowHeight
    slowness: float
    around_m_s: float


def follow_settings(parameters: Parameters) -> FollowSettings:
    """What the FLW_TGT_ parameters say."""
    value = parameters.value
    return FollowSettings(
        value("FLW_TGT_DST"),
        value("FLW_TGT_HT"),
        radians(value("FLW_TGT_FA")),
        FollowHeight(parameters.integer("FLW_TGT_ALT_M")),
        value("FLW_TGT_RS"),
        value("FLW_TGT_MAX_VEL"),
    )


class TargetFollower:
    """Knows where the target is, and where to be beside it.

    Attributes:
        settings: how it is followed; None before they are known: reports are believed at once.
        velocity_ned_m_s: the target's, as it is believed, shape (3,).
        seen_us: when the target last reported; far in the past before.
    """

    __slots__ = (
        "_angle_rad",
        "_course_rad",
        "_position_ned_m",
        "_turned_us",
        "seen_us",
        "settings",
        "velocity_ned_m_s",
    )

    def __init__(self) -> None:
        self.settings: FollowSettings | None = None
        self.seen_us = _NEVER_US
        self.velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self._position_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self._course_rad = 0.0
        self._angle_rad: float | None = None
        self._turned_us = 0

    def report(self, time_us: int, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report; a velocity with NaN in it counts as standing."""
        standing = any(isnan(component) for component in velocity_ned_m_s)
        told = (0.0, 0.0, 0.0) if standing else velocity_ned_m_s
        share = 1.0
        if not self.is_lost(time_us) and self.settings is not None:
            since_s = (time_us - self.seen_us) / 1e6
            share = since_s / (since_s + self.settings.slowness * _SLOWEST_S) if since_s > 0.0 else 0.0
        before = self.velocity_ned_m_s
        self.velocity_ned_m_s = (
            before[0] + share * (told[0] - before[0]),
            before[1] + share * (told[1] - before[1]),
            before[2] + share * (told[2] - before[2]),
        )
        self.seen_us, self._position_ned_m = time_us, position_ned_m
        north_m_s, east_m_s, _ = self.velocity_ned_m_s
        if hypot(north_m_s, east_m_s) > _COURSE_M_S:
            self._course_rad = atan2(east_m_s, north_m_s)

    def is_lost(self, now_us: int) -> bool:
        """Whether it was not heard for too long, or never."""
        return now_us - self.seen_us > _LOST_US

    def start(self) -> None:
        """Begin to follow: at once on the side wanted."""
        self._angle_rad = None

    def position(self, now_us: int) -> Vec3:
        """Where the target is now, NED metres, counted on from its last report."""
        ahead_s = min(max(now_us - self.seen_us, 0) / 1e6, _LONGEST_AHEAD_S)
        north_m, east_m, down_m = self._position_ned_m
        north_m_s, east_m_s, _ = self.velocity_ned_m_s
        return (north_m + ahead_s * north_m_s, east_m + ahead_s * east_m_s, down_m)

    def place(self, state: VehicleState, settings: FollowSettings, home_down_m: float) -> tuple[Vec3, float]:
        """Where to be (NED, metres) and where to look (rad) now."""
        north_m, east_m, down_m = self.position(state.time_us)
        angle_rad = self._turn(state.time_us, settings)
        floor_m = down_m if settings.height is FollowHeight.TARGET else home_down_m
        place = (
            north_m + settings.distance_m * cos(angle_rad),
            east_m + settings.distance_m * sin(angle_rad),
            min(floor_m - settings.height_m, home_down_m - _LEAST_HEIGHT_M),
        )
        return place, atan2(east_m - state.position_ned_m[1], north_m - state.position_ned_m[0])

    def _turn(self, now_us: int, settings: FollowSettings) -> float:
        """The side to be on; it goes round the target no faster than allowed."""
        wanted_rad = self._course_rad + settings.angle_rad
        before = self._angle_rad
        if before is None:
            angle_rad = wanted_rad
        else:
            most_rad = settings.around_m_s / settings.distance_m * (now_us - self._turned_us) / 1e6
            angle_rad = before + clamp(remainder(wanted_rad - before, tau), -most_rad, most_rad)
        self._angle_rad, self._turned_us = angle_rad, now_us
        return angle_rad
