"""Flying to a place by itself: fast on the way, in time slow before it, never jerking the velocity."""

from __future__ import annotations

from math import atan2, hypot, isnan, nan, sqrt

from firmware_py.guidance.limits import SpeedLimits, clamp
from firmware_py.types import Vec3, VehicleState

_FACING_M = 1.0  # nearer than this, the way to the target says nothing about where to look


class Traveller:
    """A journey to one target.

    Attributes:
        target_ned_m: where to, shape (3,).
        speed_m_s: horizontal speed on the way; NaN: the cruising speed.
        yaw_rad: where to look; NaN: along the way.
        pass_m_s: speed with which the target may be passed; 0: stop there.
    """

    __slots__ = ("_velocity_ned_m_s", "_yaw_rad", "pass_m_s", "speed_m_s", "target_ned_m", "yaw_rad")

    def __init__(self) -> None:
        self.target_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self.speed_m_s = nan
        self.yaw_rad = nan
        self.pass_m_s = 0.0
        self._velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self._yaw_rad = 0.0

    def start(self, state: VehicleState) -> None:
        """Begin with the velocity and yaw there are."""
        self._velocity_ned_m_s = state.velocity_ned_m_s
        self._yaw_rad = state.yaw_rad

    def distance_m(self, state: VehicleState) -> float:
        """Horizontal distance to the target."""
        return hypot(
            self.target_ned_m[0] - state.position_ned_m[0], self.target_ned_m[1] - state.position_ned_m[1]
        )

    def climb_m(self, state: VehicleState) -> float:
        """How far the target is above."""
        return state.position_ned_m[2] - self.target_ned_m[2]

    def step(self, state: VehicleState, limits: SpeedLimits, period_s: float) -> tuple[Vec3, float]:
        """Velocity NED (m/s) and yaw (rad) for one control period."""
        north_m = self.target_ned_m[0] - state.position_ned_m[0]
        east_m = self.target_ned_m[1] - state.position_ned_m[1]
        distance_m = hypot(north_m, east_m)
        cruise_m_s = (
            limits.cruise_m_s if isnan(self.speed_m_s) else min(self.speed_m_s, limits.horizontal_m_s)
        )
        stopping_m_s = braking_speed(distance_m, limits.position_gain, limits.acceleration_m_s2)
        speed_m_s = min(cruise_m_s, hypot(stopping_m_s, self.pass_m_s))
        share = speed_m_s / distance_m if distance_m > 0.0 else 0.0
        climb_m = self.climb_m(state)
        if climb_m > 0.0:
            acceleration_m_s2 = limits.acceleration_down_m_s2  # what brakes a climb
            down_m_s = -min(limits.auto_up_m_s, braking_speed(climb_m, limits.height_gain, acceleration_m_s2))
        else:
            acceleration_m_s2 = limits.acceleration_up_m_s2
            down_m_s = min(
                limits.auto_down_m_s, braking_speed(-climb_m, limits.height_gain, acceleration_m_s2)
            )
        wanted = (share * north_m, share * east_m, down_m_s)
        self._velocity_ned_m_s = velocity = slewed(self._velocity_ned_m_s, wanted, limits, period_s)
        if not isnan(self.yaw_rad):
            self._yaw_rad = self.yaw_rad
        elif distance_m > _FACING_M:
            self._yaw_rad = atan2(east_m, north_m)
        return velocity, self._yaw_rad


def passing_speed(here: Vec3, target: Vec3, onward: Vec3, cruise_m_s: float) -> float:
    """Speed to pass a place with on the way to the next: full straight on, none round a corner."""
    north_m, east_m = target[0] - here[0], target[1] - here[1]
    next_north_m, next_east_m = onward[0] - target[0], onward[1] - target[1]
    length_m = hypot(north_m, east_m) * hypot(next_north_m, next_east_m)
    if length_m == 0.0:
        return 0.0
    return cruise_m_s * max(0.0, (north_m * next_north_m + east_m * next_east_m) / length_m)


def braking_speed(distance_m: float, gain: float, acceleration_m_s2: float) -> float:
    """The speed from which one can stop in a distance.

    Near the target it is proportional (`gain`), farther away it follows v^2 = 2 a s; where the slopes meet it
    changes over, so that the deceleration never exceeds `acceleration_m_s2`.
    """
    near_m = acceleration_m_s2 / (gain * gain)
    if distance_m <= near_m:
        return gain * distance_m
    return sqrt(2.0 * acceleration_m_s2 * (distance_m - 0.5 * near_m))


def slewed(before: Vec3, wanted: Vec3, limits: SpeedLimits, period_s: float) -> Vec3:
    """A velocity that leaves the last one no faster than the accelerations allow."""
    north_m_s, east_m_s = wanted[0] - before[0], wanted[1] - before[1]
    change_m_s = hypot(north_m_s, east_m_s)
    most_m_s = limits.acceleration_m_s2 * period_s
    if change_m_s > most_m_s:
        share = most_m_s / change_m_s
        north_m_s, east_m_s = share * north_m_s, share * east_m_s
    down_m_s = clamp(
        wanted[2] - before[2],
        -limits.acceleration_up_m_s2 * period_s,
        limits.acceleration_down_m_s2 * period_s,
    )
    return (before[0] + north_m_s, before[1] + east_m_s, before[2] + down_m_s)
