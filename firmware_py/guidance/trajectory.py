"""Smooth trajectories: a reference point with limited acceleration and jerk, which the vehicle follows.

A mode only gives the next velocity, or a target. The point's acceleration goes to the
stabiliser as feed-forward and its position corrects the remaining error, so nothing overshoots.
"""

from __future__ import annotations

from enum import IntEnum
from math import atan2, hypot, inf, isnan, nan, pi, remainder, sqrt, tau

from firmware_py.guidance.limits import VELOCITY_GAIN, AccelerationLimits, SpeedLimits, clamp
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import rotation, to_world
from framerunner.geometry.vectors import NAN3, ZERO3, Vec3

_STANDING_M_S = 0.02  # below it, the vehicle is at rest
_ARRIVED_M = 1e-3  # and the same number of m/s
_MAX_LEAD_M = 1.0  # farther ahead of the vehicle than this, the point begins to wait
_FACING_M = 1.0  # nearer to a target than this, its direction gives no heading
_FACING_M_S = 0.5  # slower than this, the direction of motion gives none either
_STOPPED_M_S = 0.05
_ALIGNED_RAD = 0.2
_MIN_YAW_GAIN = 0.5


class Reference:
    """The reference point.

    Attributes:
        position_ned_m: shape (3,).
        velocity_ned_m_s: shape (3,).
        acceleration_ned_m_s2: shape (3,).
    """

    def __init__(self) -> None:
        self.position_ned_m = self.velocity_ned_m_s = self.acceleration_ned_m_s2 = ZERO3

    def start(self, state: VehicleState, limits: AccelerationLimits) -> None:
        """Begin at the vehicle's position, velocity and acceleration, so that a change of mode is smooth."""
        self.position_ned_m = state.position_ned_m
        self.velocity_ned_m_s = state.velocity_ned_m_s
        if hypot(*state.velocity_ned_m_s) < _STANDING_M_S:
            self.velocity_ned_m_s = self.acceleration_ned_m_s2 = ZERO3
            return
        north_m_s2, east_m_s2, _ = to_world(rotation(state.attitude), *state.specific_force_frd_m_s2)
        size_m_s2 = hypot(north_m_s2, east_m_s2)
        share = limits.level_m_s2 / size_m_s2 if size_m_s2 > limits.level_m_s2 else 1.0
        self.acceleration_ned_m_s2 = (share * north_m_s2, share * east_m_s2, 0.0)

    def move(
        self,
        state: VehicleState,
        wanted_ned_m_s: Vec3,
        limits: AccelerationLimits,
        period_s: float,
        *,
        level_bound: bool = True,
        height_bound: bool = True,
    ) -> None:
        """Move for one control period towards a velocity.

        Args:
            state: of the vehicle now; the point waits when it is far ahead.
            wanted_ned_m_s: shape (3,).
            limits: of its motion.
            period_s: of control.
            level_bound: integrate the horizontal position; else take the vehicle's.
            height_bound: the same for the height.
        """
        (north_m, east_m, down_m), here = self.position_ned_m, state.position_ned_m
        ahead_north_m, ahead_east_m, ahead_down_m = north_m - here[0], east_m - here[1], down_m - here[2]
        ahead_m = hypot(ahead_north_m, ahead_east_m, ahead_down_m)
        self._accelerate(wanted_ned_m_s, limits, period_s)
        north_m_s, east_m_s, down_m_s = self.velocity_ned_m_s
        time_s = period_s
        # Only a point that leads waits: one that was overtaken would wait for ever.
        if ahead_m > _MAX_LEAD_M and (
            ahead_north_m * north_m_s + ahead_east_m * east_m_s + ahead_down_m * down_m_s > 0.0
        ):
            time_s *= max(0.0, 2.0 - ahead_m / _MAX_LEAD_M)
        self.position_ned_m = (
            north_m + north_m_s * time_s if level_bound else here[0],
            east_m + east_m_s * time_s if level_bound else here[1],
            down_m + down_m_s * time_s if height_bound else here[2],
        )

    def arrive(self, place_ned_m: Vec3) -> bool:
        """Whether it is at rest at a place, which it then takes exactly."""
        north_m, east_m, down_m = self.position_ned_m
        left_m = hypot(place_ned_m[0] - north_m, place_ned_m[1] - east_m, place_ned_m[2] - down_m)
        if not left_m < _ARRIVED_M or hypot(*self.velocity_ned_m_s) > _ARRIVED_M:  # also for NaN
            return False
        self.position_ned_m = place_ned_m
        self.velocity_ned_m_s = self.acceleration_ned_m_s2 = ZERO3
        return True

    def tracking_velocity(
        self, state: VehicleState, gain: float, height_gain: float, max_m_s: float = inf
    ) -> Vec3:
        """The velocity with which the vehicle follows the point, NED, shape (3,), m/s.

        Args:
            state: of the vehicle now.
            gain: velocity per horizontal distance to the point, 1/s.
            height_gain: the same vertically.
            max_m_s: limit of the horizontal speed, unless the point itself is faster.
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

    def _accelerate(self, wanted_ned_m_s: Vec3, limits: AccelerationLimits, period_s: float) -> None:
        north_m_s, east_m_s, down_m_s = self.velocity_ned_m_s
        north_m_s2, east_m_s2, down_m_s2 = self.acceleration_ned_m_s2
        jerk_m_s3 = limits.jerk_m_s3
        step_m_s2 = jerk_m_s3 * period_s

        error_north, error_east = wanted_ned_m_s[0] - north_m_s, wanted_ned_m_s[1] - east_m_s
        error_m_s = hypot(error_north, error_east)
        share = 0.0
        if error_m_s > 0.0:
            share = _acceleration_for(error_m_s, limits.level_m_s2, jerk_m_s3) / error_m_s
        change_north, change_east = share * error_north - north_m_s2, share * error_east - east_m_s2
        change_m_s2 = hypot(change_north, change_east)
        if change_m_s2 > step_m_s2:
            change_north *= step_m_s2 / change_m_s2
            change_east *= step_m_s2 / change_m_s2
        north_m_s2, east_m_s2 = north_m_s2 + change_north, east_m_s2 + change_east

        error_down = wanted_ned_m_s[2] - down_m_s
        wanted_m_s2 = (
            _acceleration_for(error_down, limits.down_m_s2, jerk_m_s3)
            if error_down >= 0.0
            else -_acceleration_for(-error_down, limits.up_m_s2, jerk_m_s3)
        )
        down_m_s2 += max(-step_m_s2, min(wanted_m_s2 - down_m_s2, step_m_s2))

        self.acceleration_ned_m_s2 = (north_m_s2, east_m_s2, down_m_s2)
        self.velocity_ned_m_s = (
            north_m_s + north_m_s2 * period_s,
            east_m_s + east_m_s2 * period_s,
            down_m_s + down_m_s2 * period_s,
        )


def _acceleration_for(error_m_s: float, max_m_s2: float, jerk_m_s3: float) -> float:
    """The acceleration for a velocity error from which the jerk can still bring it to zero in time.

    Linear for small errors, then a^2 = 2 j v, as v^2 = 2 a s for distances.
    """
    near_m_s = jerk_m_s3 / VELOCITY_GAIN**2
    if error_m_s <= near_m_s:
        return min(max_m_s2, VELOCITY_GAIN * error_m_s)
    return min(max_m_s2, sqrt(2.0 * jerk_m_s3 * (error_m_s - 0.5 * near_m_s)))


class YawMode(IntEnum):
    """MPC_YAW_MODE."""

    TO_TARGET = 0
    TO_HOME = 1
    FROM_HOME = 2
    ALONG = 3
    TURN_FIRST = 4
    FIXED = 5


class Trajectory:
    """Leads the reference point to one target, or to a stop.

    Attributes:
        target_ned_m: shape (3,); in a component that is NaN the point brakes, and then stays.
        speed_m_s: horizontal speed; NaN: the cruising speed.
        yaw_rad: where to look; NaN: by `yaw_mode`.
        pass_m_s: speed at which the target may be passed; 0: stop there.
        drift_ned_m_s: velocity of the target itself, shape (3,).
        yaw_mode: where to look when `yaw_rad` is NaN.
        home_ned_m: shape (3,), for yaw modes towards it or away from it.
        reference: the point.
    """

    def __init__(self) -> None:
        self.target_ned_m: Vec3 = (nan, nan, nan)
        self.speed_m_s = nan
        self.yaw_rad = nan
        self.pass_m_s = 0.0
        self.drift_ned_m_s = ZERO3
        self.yaw_mode = YawMode.TO_TARGET
        self.home_ned_m: Vec3 = ZERO3
        self.reference = Reference()
        self._yaw_rad = 0.0
        self._turning = False
        self._arrived_ned_m = NAN3  # the target at which the point rests
        self._restarts = True  # the next step puts the point where the vehicle is

    def start(self, state: VehicleState, limits: SpeedLimits) -> None:
        """Begin with the next step, from the vehicle's motion then: brake and stay until `go`."""
        self._restarts = True
        turn_rad_s = state.angular_rate_frd_rad_s[2]
        self._yaw_rad = state.yaw_rad
        if abs(turn_rad_s) > limits.auto_yaw_rate_rad_s:  # it would swing back
            self._yaw_rad += turn_rad_s / max(limits.yaw_gain, _MIN_YAW_GAIN)
        self.go((nan, nan, nan), self._yaw_rad)

    def go(self, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan) -> None:
        """Change the target; the motion stays smooth."""
        self.target_ned_m, self.yaw_rad, self.speed_m_s = target_ned_m, yaw_rad, speed_m_s
        self.pass_m_s = 0.0
        self.drift_ned_m_s = ZERO3
        self._arrived_ned_m = NAN3
        self._turning = self.yaw_mode is YawMode.TURN_FIRST and isnan(yaw_rad)

    def resume(self) -> None:
        """Continue to the same target, from where the vehicle is at the next step."""
        self._restarts = True

    def distance_m(self, state: VehicleState) -> float:
        """Horizontal distance to the target."""
        return hypot(
            self.target_ned_m[0] - state.position_ned_m[0], self.target_ned_m[1] - state.position_ned_m[1]
        )

    def climb_m(self, state: VehicleState) -> float:
        """How far the target is above the vehicle."""
        return state.position_ned_m[2] - self.target_ned_m[2]

    @property
    def is_at_rest(self) -> bool:
        """Whether the point has stopped."""
        return not self._restarts and hypot(*self.reference.velocity_ned_m_s) < _STOPPED_M_S

    def started(self, state: VehicleState, limits: SpeedLimits) -> Reference:
        """The point; at the first call since `start` it is put where the vehicle is."""
        if self._restarts:
            self._restarts = False
            self.reference.start(state, limits.acceleration)
        return self.reference

    def step(
        self, state: VehicleState, limits: SpeedLimits, period_s: float, *, height_bound: bool = True
    ) -> tuple[Vec3, float]:
        """Velocity NED (m/s) and yaw (rad) for one control period; the acceleration is in `reference`.

        Without `height_bound` the vertical velocity is that of `drift_ned_m_s`.
        """
        if self.target_ned_m is self._arrived_ned_m and self.drift_ned_m_s is ZERO3 and not self._restarts:
            return self._stay(state, limits)
        reference, acceleration = self.started(state, limits), limits.acceleration
        place = reference.position_ned_m
        north_m, east_m, down_m = (
            self.target_ned_m[0] - place[0],
            self.target_ned_m[1] - place[1],
            self.target_ned_m[2] - place[2],
        )
        wanted_north, wanted_east, wanted_down = self.drift_ned_m_s
        cruise_m_s = limits.cruise_m_s
        if not isnan(self.speed_m_s):
            cruise_m_s = min(self.speed_m_s, limits.horizontal_m_s)
        if not isnan(north_m):
            distance_m = hypot(north_m, east_m)
            speed_m_s = min(cruise_m_s, acceleration.stopping_level(distance_m, self.pass_m_s))
            if self._turning and self._turns(state, north_m, east_m, distance_m):
                speed_m_s = 0.0
            share = speed_m_s / distance_m if distance_m > 0.0 else 0.0
            wanted_north, wanted_east = wanted_north + share * north_m, wanted_east + share * east_m
        if not isnan(down_m):
            wanted_down += clamp(
                acceleration.stopping_down(down_m), -limits.auto_up_m_s, limits.auto_down_m_s
            )
        wanted_ned_m_s = (wanted_north, wanted_east, wanted_down)
        reference.move(state, wanted_ned_m_s, acceleration, period_s, height_bound=height_bound)
        self._settle(height_bound=height_bound)
        if reference.arrive(self.target_ned_m):
            self._arrived_ned_m = self.target_ned_m
        if not isnan(self.yaw_rad):
            self._yaw_rad = self.yaw_rad
        else:
            self._look(state, north_m, east_m)
        velocity = reference.tracking_velocity(state, limits.position_gain, limits.height_gain, cruise_m_s)
        return velocity, self._yaw_rad

    def _stay(self, state: VehicleState, limits: SpeedLimits) -> tuple[Vec3, float]:
        """`step` where the point is at rest at its target."""
        if isnan(self.yaw_rad):
            self._look(state, 0.0, 0.0)
        else:
            self._yaw_rad = self.yaw_rad
        velocity = self.reference.tracking_velocity(state, limits.position_gain, limits.height_gain)
        return velocity, self._yaw_rad

    def _settle(self, *, height_bound: bool) -> None:
        """Set components of the target that are NaN once the point has stopped."""
        north_m, east_m, down_m = self.target_ned_m
        if not isnan(north_m) and not (isnan(down_m) and height_bound):
            return
        reference = self.reference
        north_m_s, east_m_s, down_m_s = reference.velocity_ned_m_s
        if isnan(north_m) and hypot(north_m_s, east_m_s) < _STOPPED_M_S:
            north_m, east_m = reference.position_ned_m[0], reference.position_ned_m[1]
        if isnan(down_m) and height_bound and abs(down_m_s) < _STOPPED_M_S:
            down_m = reference.position_ned_m[2]
        if (isnan(north_m), isnan(down_m)) != (isnan(self.target_ned_m[0]), isnan(self.target_ned_m[2])):
            self.target_ned_m = (north_m, east_m, down_m)

    def _turns(self, state: VehicleState, north_m: float, east_m: float, distance_m: float) -> bool:
        """Whether the vehicle still turns towards the target before it flies there."""
        error_rad = remainder(atan2(east_m, north_m) - state.yaw_rad, tau)
        self._turning = distance_m > _FACING_M and abs(error_rad) > _ALIGNED_RAD
        return self._turning

    def _look(self, state: VehicleState, north_m: float, east_m: float) -> None:
        """Set the yaw by `yaw_mode`."""
        mode, home = self.yaw_mode, self.home_ned_m
        nearest = _FACING_M
        if mode is YawMode.FIXED:
            return
        if mode in (YawMode.TO_HOME, YawMode.FROM_HOME):
            north_m, east_m = home[0] - state.position_ned_m[0], home[1] - state.position_ned_m[1]
        elif mode is YawMode.ALONG:
            north_m, east_m, _ = self.reference.velocity_ned_m_s
            nearest = _FACING_M_S
        if hypot(north_m, east_m) > nearest:  # false for NaN too
            self._yaw_rad = atan2(east_m, north_m) + (pi if mode is YawMode.FROM_HOME else 0.0)


def passing_speed(here: Vec3, target: Vec3, onward: Vec3, cruise_m_s: float) -> float:
    """Speed at which to pass a target on the path to the next: full straight ahead, none at a right angle."""
    north_m, east_m = target[0] - here[0], target[1] - here[1]
    next_north_m, next_east_m = onward[0] - target[0], onward[1] - target[1]
    length_m = hypot(north_m, east_m) * hypot(next_north_m, next_east_m)
    if length_m == 0.0:
        return 0.0
    return cruise_m_s * max(0.0, (north_m * next_north_m + east_m * next_east_m) / length_m)
