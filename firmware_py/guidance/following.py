"""The follow mode: stays beside a target that reports itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import atan2, cos, hypot, isnan, radians, remainder, sin, tau

from firmware_py.airframe import Airframe
from firmware_py.commands import ControlCommand
from firmware_py.guidance.limits import clamp
from firmware_py.guidance.mode import JourneyMode, ModeContext, ModeEntry
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from geometry.vectors import ZERO3, Vec3

_COURSE_M_S = 1.0  # slower than this, the target's course is noise
_MAX_DELAY_S = 5.0  # how long FLW_TGT_RS = 1 takes to believe a change of velocity
_MAX_AHEAD_S = 1.0  # a target that is silent for longer is thought to stand from then on
_LOST_US = 3_000_000
_MIN_HEIGHT_M = 1.0  # over home; PX4 climbs again when it is lower over the ground
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
        settings: how it is followed.
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

    def __init__(self, settings: FollowSettings) -> None:
        self.settings = settings
        self.seen_us = _NEVER_US
        self.velocity_ned_m_s: Vec3 = ZERO3
        self._position_ned_m: Vec3 = ZERO3
        self._course_rad = 0.0
        self._angle_rad: float | None = None
        self._turned_us = 0

    def report(self, time_us: int, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report; a velocity with NaN in it counts as standing."""
        standing = any(isnan(component) for component in velocity_ned_m_s)
        told = ZERO3 if standing else velocity_ned_m_s
        share = 1.0
        if not self.is_lost(time_us):
            since_s = (time_us - self.seen_us) / 1e6
            share = since_s / (since_s + self.settings.slowness * _MAX_DELAY_S) if since_s > 0.0 else 0.0
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
        ahead_s = min(max(now_us - self.seen_us, 0) / 1e6, _MAX_AHEAD_S)
        north_m, east_m, down_m = self._position_ned_m
        north_m_s, east_m_s, _ = self.velocity_ned_m_s
        return (north_m + ahead_s * north_m_s, east_m + ahead_s * east_m_s, down_m)

    def place(self, state: VehicleState, home_down_m: float) -> tuple[Vec3, float]:
        """Where to be (NED, metres) and where to look (rad) now."""
        settings = self.settings
        north_m, east_m, down_m = self.position(state.time_us)
        angle_rad = self._turn(state.time_us)
        floor_m = down_m if settings.height is FollowHeight.TARGET else home_down_m
        place = (
            north_m + settings.distance_m * cos(angle_rad),
            east_m + settings.distance_m * sin(angle_rad),
            min(floor_m - settings.height_m, home_down_m - _MIN_HEIGHT_M),
        )
        return place, atan2(east_m - state.position_ned_m[1], north_m - state.position_ned_m[0])

    def _turn(self, now_us: int) -> float:
        """The side to be on; it goes round the target no faster than allowed."""
        settings = self.settings
        wanted_rad = self._course_rad + settings.angle_rad
        before = self._angle_rad
        if before is None:
            angle_rad = wanted_rad
        else:
            max_rad = settings.around_m_s / settings.distance_m * (now_us - self._turned_us) / 1e6
            angle_rad = before + clamp(remainder(wanted_rad - before, tau), -max_rad, max_rad)
        self._angle_rad, self._turned_us = angle_rad, now_us
        return angle_rad


class FollowMode(JourneyMode):
    """Follows the target that reports itself; until it does, and when it is lost, stays.

    Attributes:
        follower: knows the target.
    """

    def __init__(self, context: ModeContext, airframe: Airframe, parameters: Parameters) -> None:
        self.follower = TargetFollower(follow_settings(parameters))
        super().__init__(context, airframe, parameters)

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Take over how it is followed."""
        self.follower.settings = follow_settings(parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin here."""
        self._begin(state)
        self.follower.start()
        self._show_journey(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Lead the point to the place beside the target, moving as the target does."""
        context, follower = self._context, self.follower
        traveller, limits = context.traveller, context.limits
        if follower.is_lost(state.time_us):
            if not isnan(traveller.speed_m_s):
                traveller.start(state, limits)
            return self._travel(state)
        place, yaw_rad = follower.place(state, context.home_ned_m[2])
        north_m_s, east_m_s, _ = follower.velocity_ned_m_s
        traveller.target_ned_m, traveller.yaw_rad = place, yaw_rad
        traveller.speed_m_s = limits.cruise_m_s
        traveller.drift_ned_m_s = (north_m_s, east_m_s, 0.0)
        velocity_ned_m_s, yaw_rad = traveller.step(state, limits, context.period_s)
        return self._chase(state, velocity_ned_m_s, yaw_rad)
