"""Flying to a place by itself, or stopping and staying: smooth all the way."""

from __future__ import annotations

from enum import IntEnum
from math import atan2, hypot, isnan, nan, pi, remainder, tau

from firmware_py.guidance.limits import SpeedLimits, clamp
from firmware_py.guidance.reference import Reference
from firmware_py.types import VehicleState
from geometry.vectors import NAN3, ZERO3, Vec3

_FACING_M = 1.0  # nearer than this, the way to a place says nothing about where to look
_FACING_M_S = 0.5  # slower than this, the way it moves says nothing either
_STOPPED_M_S = 0.05
_ALIGNED_RAD = 0.2
_MIN_GAIN = 0.5


class YawMode(IntEnum):
    """MPC_YAW_MODE."""

    TO_PLACE = 0
    TO_HOME = 1
    FROM_HOME = 2
    ALONG = 3
    TURN_FIRST = 4
    FIXED = 5


class Traveller:
    """A journey to one target, or a halt.

    Attributes:
        target_ned_m: where to, shape (3,); a component that is NaN is braked and then stays as it is.
        speed_m_s: horizontal speed on the way; NaN: the cruising speed.
        yaw_rad: where to look; NaN: as `yaw_mode` says.
        pass_m_s: speed with which the target may be passed; 0: stop there.
        drift_ned_m_s: velocity of the target itself, shape (3,).
        yaw_mode: where to look when `yaw_rad` is open.
        home_ned_m: shape (3,), for yaw modes that look to it or away from it.
        reference: the point that is followed.
    """

    __slots__ = (
        "_arrived_ned_m",
        "_restarts",
        "_turning",
        "_yaw_rad",
        "drift_ned_m_s",
        "home_ned_m",
        "pass_m_s",
        "reference",
        "speed_m_s",
        "target_ned_m",
        "yaw_mode",
        "yaw_rad",
    )

    def __init__(self) -> None:
        self.target_ned_m: Vec3 = (nan, nan, nan)
        self.speed_m_s = nan
        self.yaw_rad = nan
        self.pass_m_s = 0.0
        self.drift_ned_m_s = ZERO3
        self.yaw_mode = YawMode.TO_PLACE
        self.home_ned_m: Vec3 = ZERO3
        self.reference = Reference()
        self._yaw_rad = 0.0
        self._turning = False
        self._arrived_ned_m = NAN3  # the target at which the point stands
        self._restarts = True  # the point is put where the vehicle is in the next step

    def start(self, state: VehicleState, limits: SpeedLimits) -> None:
        """Begin, with the next step, as it moves then: brake and stay, until told where to."""
        self._restarts = True
        turn_rad_s = state.angular_rate_frd_rad_s[2]
        self._yaw_rad = state.yaw_rad
        if abs(turn_rad_s) > limits.auto_yaw_rate_rad_s:  # it would swing back
            self._yaw_rad += turn_rad_s / max(limits.yaw_gain, _MIN_GAIN)
        self.go((nan, nan, nan), self._yaw_rad)

    def go(self, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan) -> None:
        """Change where it goes; the velocity goes on smoothly."""
        self.target_ned_m, self.yaw_rad, self.speed_m_s = target_ned_m, yaw_rad, speed_m_s
        self.pass_m_s = 0.0
        self.drift_ned_m_s = ZERO3
        self._arrived_ned_m = NAN3
        self._turning = self.yaw_mode is YawMode.TURN_FIRST and isnan(yaw_rad)

    def resume(self) -> None:
        """Go on to the same target from where the vehicle is then."""
        self._restarts = True

    def distance_m(self, state: VehicleState) -> float:
        """Horizontal distance to the target."""
        return hypot(
            self.target_ned_m[0] - state.position_ned_m[0], self.target_ned_m[1] - state.position_ned_m[1]
        )

    def climb_m(self, state: VehicleState) -> float:
        """How far the target is above."""
        return state.position_ned_m[2] - self.target_ned_m[2]

    @property
    def is_at_rest(self) -> bool:
        """Whether the point stands."""
        return not self._restarts and hypot(*self.reference.velocity_ned_m_s) < _STOPPED_M_S

    def led(self, state: VehicleState, limits: SpeedLimits) -> Reference:
        """The point to lead; at the first call since `start` it is where the vehicle is."""
        if self._restarts:
            self._restarts = False
            self.reference.start(state, limits.pace)
        return self.reference

    def step(
        self, state: VehicleState, limits: SpeedLimits, period_s: float, *, height_bound: bool = True
    ) -> tuple[Vec3, float]:
        """Velocity NED (m/s) and yaw (rad) for one control period; the rest is in `reference`.

        Without `height_bound` the height is left to the vertical `drift_ned_m_s`.
        """
        if self.target_ned_m is self._arrived_ned_m and self.drift_ned_m_s is ZERO3 and not self._restarts:
            return self._stay(state, limits)
        reference, pace = self.led(state, limits), limits.pace
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
            speed_m_s = min(cruise_m_s, pace.stopping_level(distance_m, self.pass_m_s))
            if self._turning and self._turns(state, north_m, east_m, distance_m):
                speed_m_s = 0.0
            share = speed_m_s / distance_m if distance_m > 0.0 else 0.0
            wanted_north, wanted_east = wanted_north + share * north_m, wanted_east + share * east_m
        if not isnan(down_m):
            wanted_down += clamp(pace.stopping_down(down_m), -limits.auto_up_m_s, limits.auto_down_m_s)
        wanted_ned_m_s = (wanted_north, wanted_east, wanted_down)
        reference.move(state, wanted_ned_m_s, pace, period_s, height_bound=height_bound)
        self._settle(height_bound=height_bound)
        if reference.arrive(self.target_ned_m):
            self._arrived_ned_m = self.target_ned_m
        if not isnan(self.yaw_rad):
            self._yaw_rad = self.yaw_rad
        else:
            self._look(state, north_m, east_m)
        velocity = reference.chase(state, limits.position_gain, limits.height_gain, cruise_m_s)
        return velocity, self._yaw_rad

    def _stay(self, state: VehicleState, limits: SpeedLimits) -> tuple[Vec3, float]:
        """The same where nothing moves."""
        if isnan(self.yaw_rad):
            self._look(state, 0.0, 0.0)
        else:
            self._yaw_rad = self.yaw_rad
        return self.reference.chase(state, limits.position_gain, limits.height_gain), self._yaw_rad

    def _settle(self, *, height_bound: bool) -> None:
        """What was open has a place once it stands."""
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
        """Whether it still turns towards the place before it flies there."""
        error_rad = remainder(atan2(east_m, north_m) - state.yaw_rad, tau)
        self._turning = distance_m > _FACING_M and abs(error_rad) > _ALIGNED_RAD
        return self._turning

    def _look(self, state: VehicleState, north_m: float, east_m: float) -> None:
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
    """Speed to pass a place with on the way to the next: full straight on, none round a corner."""
    north_m, east_m = target[0] - here[0], target[1] - here[1]
    next_north_m, next_east_m = onward[0] - target[0], onward[1] - target[1]
    length_m = hypot(north_m, east_m) * hypot(next_north_m, next_east_m)
    if length_m == 0.0:
        return 0.0
    return cruise_m_s * max(0.0, (north_m * next_north_m + east_m * next_east_m) / length_m)
