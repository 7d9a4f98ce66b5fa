"""A point that moves with limited acceleration and jerk; the vehicle follows it.

So a mode only says which velocity it wants next. The point's own acceleration goes to the stabiliser as
feed-forward, its place takes out what is left of an error, and so nothing overshoots or drifts back.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf, sqrt

from firmware_py.types import VehicleState
from geometry.vectors import Vec3

_VELOCITY_GAIN = 5.0  # 1/s, acceleration per velocity error when that is small
_STANDING_M_S = 0.02  # slower than this, the vehicle stands
_REST: Vec3 = (0.0, 0.0, 0.0)
_ARRIVED_M = 1e-3  # and as many metres a second
_MAX_LEAD_M = 1.0  # farther ahead of the vehicle than this, the point begins to wait


@dataclass(frozen=True, slots=True)
class Pace:
    """How hard the point is driven: m/s^2 and m/s^3, all positive.

    Attributes:
        level_m_s2: horizontal acceleration.
        up_m_s2: acceleration upwards.
        down_m_s2: acceleration downwards.
        jerk_m_s3: change of acceleration.
    """

    level_m_s2: float = 3.0
    up_m_s2: float = 4.0
    down_m_s2: float = 3.0
    jerk_m_s3: float = 4.0

    def stopping_level(self, distance_m: float, passing_m_s: float = 0.0) -> float:
        """The horizontal speed from which it can slow down to another within a distance, m/s."""
        return stopping_speed(distance_m, self.level_m_s2, self.jerk_m_s3, passing_m_s)

    def stopping_down(self, depth_m: float) -> float:
        """The vertical velocity from which it can stop at a place so far below (below zero: above), m/s."""
        if depth_m == 0.0:
            return 0.0
        if depth_m > 0.0:
            return stopping_speed(depth_m, self.up_m_s2, self.jerk_m_s3)
        return -stopping_speed(-depth_m, self.down_m_s2, self.jerk_m_s3)


class Reference:
    """The point.

    Attributes:
        position_ned_m: where it is, shape (3,).
        velocity_ned_m_s: shape (3,).
        acceleration_ned_m_s2: shape (3,).
    """

    __slots__ = ("acceleration_ned_m_s2", "position_ned_m", "velocity_ned_m_s")

    def __init__(self) -> None:
        self.position_ned_m: Vec3 = _REST
        self.velocity_ned_m_s: Vec3 = _REST
        self.acceleration_ned_m_s2: Vec3 = _REST

    def start(self, state: VehicleState, pace: Pace) -> None:
        """Begin where the vehicle is, moving as it moves: a change of mode jerks nothing."""
        self.position_ned_m = state.position_ned_m
        self.velocity_ned_m_s = state.velocity_ned_m_s
        if hypot(*state.velocity_ned_m_s) < _STANDING_M_S:
            self.velocity_ned_m_s = self.acceleration_ned_m_s2 = _REST
            return
        w, x, y, z = state.attitude
        forward, right, down = state.specific_force_frd_m_s2
        north_m_s2 = (
            (1 - 2 * (y * y + z * z)) * forward + 2 * (x * y - w * z) * right + 2 * (x * z + w * y) * down
        )
        east_m_s2 = (
            2 * (x * y + w * z) * forward + (1 - 2 * (x * x + z * z)) * right + 2 * (y * z - w * x) * down
        )
        size_m_s2 = hypot(north_m_s2, east_m_s2)
        share = pace.level_m_s2 / size_m_s2 if size_m_s2 > pace.level_m_s2 else 1.0
        self.acceleration_ned_m_s2 = (share * north_m_s2, share * east_m_s2, 0.0)

    def move(
        self,
        state: VehicleState,
        wanted_ned_m_s: Vec3,
        pace: Pace,
        period_s: float,
        *,
        level_bound: bool = True,
        height_bound: bool = True,
    ) -> None:
        """Move for one control period towards a velocity.

        Args:
            state: the vehicle now; the point waits when it is left far behind.
            wanted_ned_m_s: shape (3,).
            pace: how hard.
            period_s: of control.
            level_bound: keep an own horizontal place; else it is the vehicle's.
            height_bound: the same for the height.
        """
        (north_m, east_m, down_m), here = self.position_ned_m, state.position_ned_m
        ahead_north_m, ahead_east_m, ahead_down_m = north_m - here[0], east_m - here[1], down_m - here[2]
        ahead_m = hypot(ahead_north_m, ahead_east_m, ahead_down_m)
        self._speed_up(wanted_ned_m_s, pace, period_s)
        north_m_s, east_m_s, down_m_s = self.velocity_ned_m_s
        walk_s = period_s
        # Only a point that leads waits: one that has been overtaken would wait for ever.
        if ahead_m > _MAX_LEAD_M and (
            ahead_north_m * north_m_s + ahead_east_m * east_m_s + ahead_down_m * down_m_s > 0.0
        ):
            walk_s *= max(0.0, 2.0 - ahead_m / _MAX_LEAD_M)
        self.position_ned_m = (
            north_m + north_m_s * walk_s if level_bound else here[0],
            east_m + east_m_s * walk_s if level_bound else here[1],
            down_m + down_m_s * walk_s if height_bound else here[2],
        )

    def arrive(self, place_ned_m: Vec3) -> bool:
        """Stand at a place from which nothing is left to go; False if there is."""
        north_m, east_m, down_m = self.position_ned_m
        left_m = hypot(place_ned_m[0] - north_m, place_ned_m[1] - east_m, place_ned_m[2] - down_m)
        if not left_m < _ARRIVED_M or hypot(*self.velocity_ned_m_s) > _ARRIVED_M:  # NaN: has not
            return False
        self.position_ned_m = place_ned_m
        self.velocity_ned_m_s = self.acceleration_ned_m_s2 = _REST
        return True

    def chase(self, state: VehicleState, gain: float, height_gain: float, max_m_s: float = inf) -> Vec3:
        """The velocity NED that follows the point, shape (3,), m/s.

        Args:
            state: the vehicle now.
            gain: velocity per horizontal distance to the point, 1/s.
            height_gain: the same vertically.
            max_m_s: horizontal speed not exceeded to catch up with the point.
        """
        north_m, east_m, down_m = self.position_ned_m
        here_north_m, here_east_m, here_down_m = state.position_ned_m
        north_m_s, east_m_s, down_m_s = self.velocity_ned_m_s
        max_m_s = max(max_m_s, hypot(north_m_s, east_m_s))
        north_m_s += gain * (north_m - here_north_m)
        east_m_s += gain * (east_m - here_east_m)
        speed_m_s = hypot(north_m_s, east_m_s)
        share = max_m_s / speed_m_s if speed_m_s > max_m_s else 1.0
        return (share * north_m_s, share * east_m_s, down_m_s + height_gain * (down_m - here_down_m))

    def _speed_up(self, wanted_ned_m_s: Vec3, pace: Pace, period_s: float) -> None:
        north_m_s, east_m_s, down_m_s = self.velocity_ned_m_s
        north_m_s2, east_m_s2, down_m_s2 = self.acceleration_ned_m_s2
        jerk_m_s3 = pace.jerk_m_s3
        step_m_s2 = jerk_m_s3 * period_s

        more_north, more_east = wanted_ned_m_s[0] - north_m_s, wanted_ned_m_s[1] - east_m_s
        missing_m_s = hypot(more_north, more_east)
        share = _pull(missing_m_s, pace.level_m_s2, jerk_m_s3) / missing_m_s if missing_m_s > 0.0 else 0.0
        change_north, change_east = share * more_north - north_m_s2, share * more_east - east_m_s2
        change_m_s2 = hypot(change_north, change_east)
        if change_m_s2 > step_m_s2:
            change_north *= step_m_s2 / change_m_s2
            change_east *= step_m_s2 / change_m_s2
        north_m_s2, east_m_s2 = north_m_s2 + change_north, east_m_s2 + change_east

        more_down = wanted_ned_m_s[2] - down_m_s
        pull_m_s2 = (
            _pull(more_down, pace.down_m_s2, jerk_m_s3)
            if more_down >= 0.0
            else -_pull(-more_down, pace.up_m_s2, jerk_m_s3)
        )
        down_m_s2 += max(-step_m_s2, min(pull_m_s2 - down_m_s2, step_m_s2))

        self.acceleration_ned_m_s2 = (north_m_s2, east_m_s2, down_m_s2)
        self.velocity_ned_m_s = (
            north_m_s + north_m_s2 * period_s,
            east_m_s + east_m_s2 * period_s,
            down_m_s + down_m_s2 * period_s,
        )


def _pull(missing_m_s: float, max_m_s2: float, jerk_m_s3: float) -> float:
    """The acceleration towards a velocity: so much that with its jerk it fades out in time.

    Linear near by, then a^2 = 2 j v, as `v^2 = 2 a s` is for places.
    """
    near_m_s = jerk_m_s3 / _VELOCITY_GAIN**2
    if missing_m_s <= near_m_s:
        return min(max_m_s2, _VELOCITY_GAIN * missing_m_s)
    return min(max_m_s2, sqrt(2.0 * jerk_m_s3 * (missing_m_s - 0.5 * near_m_s)))


def stopping_speed(
    distance_m: float, acceleration_m_s2: float, jerk_m_s3: float, passing_m_s: float = 0.0
) -> float:
    """The speed from which another (by default: none) can be reached within a distance.

    Braking with a takes v^2 / 2a, and building the braking up takes a time t more, in which it goes on: the
    distance is d = (v^2 - w^2) / 2a + (v - w) t, solved for v. t is a / j and what the gain adds; half
    as much again, because a short journey still speeds up when it should begin to brake.
    """
    delay_s = acceleration_m_s2 / jerk_m_s3 + 1.5 / _VELOCITY_GAIN
    root_s = passing_m_s / acceleration_m_s2 + delay_s
    return acceleration_m_s2 * (sqrt(root_s * root_s + 2.0 * distance_m / acceleration_m_s2) - delay_s)
