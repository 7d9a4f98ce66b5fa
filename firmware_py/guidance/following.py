"""The follow mode: follows a target that reports its position."""

from __future__ import annotations

from enum import IntEnum
from math import atan2, cos, hypot, isnan, radians, remainder, sin, tau

from firmware_py.commands import ControlCommand
from firmware_py.guidance.limits import clamp
from firmware_py.guidance.mode import ModeContext, ModeEntry, TrajectoryMode
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.airframe import Airframe

_COURSE_M_S = 1.0  # slower than this, the target's course is noise
_MAX_DELAY_S = 5.0  # filter time of the target's velocity for FLW_TGT_RS = 1
_MAX_AHEAD_S = 1.0  # a target not heard for longer is assumed to stand from then on
_LOST_US = 3_000_000
_MIN_HEIGHT_M = 1.0  # above home
_NEVER_US = -(10**15)


class FollowHeight(IntEnum):
    """FLW_TGT_ALT_M: what the height is above."""

    HOME = 0
    TERRAIN = 1
    TARGET = 2


class FollowSettings:
    """How a target is followed: the FLW_TGT_ parameters.

    Attributes:
        distance_m: horizontal distance to it.
        height_m: above home or the target.
        angle_rad: clockwise from its course: pi is behind it.
        height: what `height_m` is above.
        slowness: how slowly its velocity is filtered, 0..1.
        around_m_s: speed around it when its course changes.
    """

    def __init__(self, parameters: Parameters) -> None:
        value = parameters.value
        self.distance_m = value("FLW_TGT_DST")
        self.height_m = value("FLW_TGT_HT")
        self.angle_rad = radians(value("FLW_TGT_FA"))
        self.height = FollowHeight(parameters.integer("FLW_TGT_ALT_M"))
        self.slowness = value("FLW_TGT_RS")
        self.around_m_s = value("FLW_TGT_MAX_VEL")


class TargetFollower:
    """Estimates the target's motion, and gives the place from which to follow it.

    Attributes:
        settings: how it is followed.
        velocity_ned_m_s: the target's filtered velocity, shape (3,).
        seen_us: vehicle time of the target's last report; far in the past before the first.
    """

    def __init__(self, settings: FollowSettings) -> None:
        self.settings = settings
        self.seen_us = _NEVER_US
        self.velocity_ned_m_s: Vec3 = ZERO3
        self._position_ned_m: Vec3 = ZERO3
        self._course_rad = 0.0
        self._angle_rad: float | None = None
        self._turned_us = 0

    def report(self, time_us: int, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report; a velocity with NaN in it counts as zero."""
        standing = any(isnan(component) for component in velocity_ned_m_s)
        reported = ZERO3 if standing else velocity_ned_m_s
        share = 1.0
        if not self.is_lost(time_us):
            since_s = (time_us - self.seen_us) / 1e6
            share = since_s / (since_s + self.settings.slowness * _MAX_DELAY_S) if since_s > 0.0 else 0.0
        before = self.velocity_ned_m_s
        self.velocity_ned_m_s = (
            before[0] + share * (reported[0] - before[0]),
            before[1] + share * (reported[1] - before[1]),
            before[2] + share * (reported[2] - before[2]),
        )
        self.seen_us, self._position_ned_m = time_us, position_ned_m
        north_m_s, east_m_s, _ = self.velocity_ned_m_s
        if hypot(north_m_s, east_m_s) > _COURSE_M_S:
            self._course_rad = atan2(east_m_s, north_m_s)

    def is_lost(self, now_us: int) -> bool:
        """Whether the last report is too old, or there is none."""
        return now_us - self.seen_us > _LOST_US

    def start(self) -> None:
        """Begin to follow, directly at the configured angle."""
        self._angle_rad = None

    def position(self, now_us: int) -> Vec3:
        """Where the target is now, NED metres, extrapolated from its last report."""
        ahead_s = min(max(now_us - self.seen_us, 0) / 1e6, _MAX_AHEAD_S)
        north_m, east_m, down_m = self._position_ned_m
        north_m_s, east_m_s, _ = self.velocity_ned_m_s
        return (north_m + ahead_s * north_m_s, east_m + ahead_s * east_m_s, down_m)

    def place(self, state: VehicleState, home_down_m: float) -> tuple[Vec3, float]:
        """The place from which to follow (NED, metres) and the yaw (rad) now."""
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
        """The angle around the target, which changes no faster than allowed."""
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


class FollowMode(TrajectoryMode):
    """Follows the target; stays where it is before the first report, and when the target is lost.

    Attributes:
        follower: takes the target's reports.
    """

    def __init__(self, context: ModeContext, airframe: Airframe, parameters: Parameters) -> None:
        self.follower = TargetFollower(FollowSettings(parameters))
        super().__init__(context, airframe, parameters)

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply the FLW_TGT_ parameters."""
        self.follower.settings = FollowSettings(parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin here."""
        self._start(state)
        self.follower.start()
        self._show_target(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Fly to the place beside the target, which moves with it."""
        context, follower = self._context, self.follower
        trajectory, limits = context.trajectory, context.limits
        if follower.is_lost(state.time_us):
            if not isnan(trajectory.speed_m_s):
                trajectory.start(state, limits)
            return self._fly_to_target(state)
        place, yaw_rad = follower.place(state, context.home_ned_m[2])
        north_m_s, east_m_s, _ = follower.velocity_ned_m_s
        trajectory.target_ned_m, trajectory.yaw_rad = place, yaw_rad
        trajectory.speed_m_s = limits.cruise_m_s
        trajectory.drift_ned_m_s = (north_m_s, east_m_s, 0.0)
        velocity_ned_m_s, yaw_rad = trajectory.step(state, limits, context.period_s)
        return self._follow(state, velocity_ned_m_s, yaw_rad)
