"""Limits and gains of guidance, and the velocities and yaw rates computed within them."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, inf, isnan, nan, radians, remainder, sin, sqrt, tau

from firmware_py.commands import VelocityFrdCommand
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.airframe import Airframe

VELOCITY_GAIN = 5.0
"""Acceleration of a reference point per velocity error where that is small, 1/s."""


@dataclass(frozen=True, slots=True)
class AccelerationLimits:
    """Limits of a reference point's motion, all positive.

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
        """The horizontal speed from which another speed can be reached within a distance, m/s."""
        return stopping_speed(distance_m, self.level_m_s2, self.jerk_m_s3, passing_m_s)

    def stopping_down(self, depth_m: float) -> float:
        """The vertical velocity from which a stop is possible so far below (below zero: above), m/s."""
        if depth_m == 0.0:
            return 0.0
        if depth_m > 0.0:
            return stopping_speed(depth_m, self.up_m_s2, self.jerk_m_s3)
        return -stopping_speed(-depth_m, self.down_m_s2, self.jerk_m_s3)


def acceleration_limits(parameters: Parameters, jerk_m_s3: float) -> AccelerationLimits:
    """The parameters' limits with a jerk."""
    value = parameters.value
    level_m_s2 = min(value("MPC_ACC_HOR"), value("MPC_ACC_HOR_MAX"))
    return AccelerationLimits(level_m_s2, value("MPC_ACC_UP_MAX"), value("MPC_ACC_DOWN_MAX"), jerk_m_s3)


class SpeedLimits:
    """Limits and gains of guidance, all positive: the smaller of the airframe's and the parameters'.

    Attributes:
        horizontal_m_s: maximum horizontal speed.
        up_m_s: maximum climb.
        down_m_s: maximum descent.
        yaw_rate_rad_s: maximum yaw rate.
        takeoff_m_s: climb of a take-off.
        takeoff_m_s2: how fast that climb is built up; infinite: at once.
        land_m_s: descent near the ground.
        cruise_m_s: horizontal speed of automatic modes.
        auto_up_m_s: climb of automatic modes.
        auto_down_m_s: descent of automatic modes, and of a landing far above the ground.
        acceleration: in automatic modes.
        auto_yaw_rate_rad_s: yaw rate of automatic modes.
        position_gain: horizontal velocity per distance, 1/s.
        height_gain: vertical velocity per height, 1/s.
        yaw_gain: yaw rate per angle, 1/s.
        land_slow_below_m: height above home below which a landing has `land_m_s`.
        land_fast_above_m: height above home down to which it has its full speed.
    """

    def __init__(self, airframe: Airframe, parameters: Parameters) -> None:
        own, value = airframe.limits, parameters.value
        ramp_s = value("MPC_TKO_RAMP_T")
        self.horizontal_m_s = min(own.speed_horizontal_m_s, value("MPC_XY_VEL_MAX"))
        self.up_m_s = min(own.speed_up_m_s, value("MPC_Z_VEL_MAX_UP"))
        self.down_m_s = min(own.speed_down_m_s, value("MPC_Z_VEL_MAX_DN"))
        self.yaw_rate_rad_s = min(own.yaw_rate_rad_s, radians(value("MC_YAWRATE_MAX")))
        self.takeoff_m_s = min(self.up_m_s, value("MPC_TKO_SPEED"))
        self.takeoff_m_s2 = self.takeoff_m_s / ramp_s if ramp_s > 0.0 else inf
        self.land_m_s = min(self.down_m_s, value("MPC_LAND_SPEED"))
        self.cruise_m_s = min(self.horizontal_m_s, value("MPC_XY_CRUISE"))
        self.auto_up_m_s = min(self.up_m_s, value("MPC_Z_V_AUTO_UP"))
        self.auto_down_m_s = min(self.down_m_s, value("MPC_Z_V_AUTO_DN"))
        self.acceleration = acceleration_limits(parameters, value("MPC_JERK_AUTO"))
        self.auto_yaw_rate_rad_s = radians(value("MPC_YAWRAUTO_MAX"))
        self.position_gain = value("MPC_XY_P")
        self.height_gain = value("MPC_Z_P")
        self.yaw_gain = value("MC_YAW_P")
        self.land_slow_below_m = value("MPC_LAND_ALT2")
        self.land_fast_above_m = value("MPC_LAND_ALT1")

    def clip(self, north_m_s: float, east_m_s: float, down_m_s: float) -> Vec3:
        """Shorten a velocity to the limits; its horizontal part keeps its direction."""
        speed_m_s = hypot(north_m_s, east_m_s)
        if speed_m_s > self.horizontal_m_s:
            scale = self.horizontal_m_s / speed_m_s
            north_m_s, east_m_s = north_m_s * scale, east_m_s * scale
        return (north_m_s, east_m_s, clamp(down_m_s, -self.up_m_s, self.down_m_s))

    def landing_m_s(self, height_m: float, full_m_s: float) -> float:
        """Descent at a height above home: slow near the ground, `full_m_s` far above it, as PX4's."""
        if full_m_s <= self.land_m_s:
            return full_m_s
        if height_m <= self.land_slow_below_m:
            return self.land_m_s
        span_m = max(self.land_fast_above_m - self.land_slow_below_m, 0.1)
        share = min((height_m - self.land_slow_below_m) / span_m, 1.0)
        return self.land_m_s + share * (full_m_s - self.land_m_s)


def stopping_speed(
    distance_m: float, acceleration_m_s2: float, jerk_m_s3: float, passing_m_s: float = 0.0
) -> float:
    """The speed from which another (by default: none) can be reached within a distance.

    Braking with a needs v^2 / 2a, and building up a needs a time t more, at unreduced speed: the distance is
    d = (v^2 - w^2) / 2a + (v - w) t, solved for v. t is a / j and what `VELOCITY_GAIN` adds; half as much
    again, because on a short path the point still accelerates when it should begin to brake.
    """
    delay_s = acceleration_m_s2 / jerk_m_s3 + 1.5 / VELOCITY_GAIN
    root_s = passing_m_s / acceleration_m_s2 + delay_s
    return acceleration_m_s2 * (sqrt(root_s * root_s + 2.0 * distance_m / acceleration_m_s2) - delay_s)


def clamp(value: float, low: float, high: float) -> float:
    """The nearest value within limits."""
    return low if value < low else high if value > high else value


def level(state: VehicleState, vector_ned: Vec3) -> Vec3:
    """A vector in level axes, which turn with the yaw: forward, right, down."""
    north, east, down = vector_ned
    cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
    return (cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north, down)


def level_pair(state: VehicleState, one_ned: Vec3, other_ned: Vec3) -> tuple[Vec3, Vec3]:
    """The same for two vectors, in less time than twice."""
    north, east, down = one_ned
    other_north, other_east, other_down = other_ned
    cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
    return (
        (cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north, down),
        (
            cos_yaw * other_north + sin_yaw * other_east,
            cos_yaw * other_east - sin_yaw * other_north,
            other_down,
        ),
    )


def yaw_rate(yaw_now_rad: float, yaw_rad: float, yaw_rate_rad_s: float, limits: SpeedLimits) -> float:
    """The yaw rate towards a yaw by the shorter turn, plus a yaw rate; NaN: not given."""
    rate_rad_s = 0.0 if isnan(yaw_rate_rad_s) else yaw_rate_rad_s
    if not isnan(yaw_rad):
        rate_rad_s += limits.yaw_gain * remainder(yaw_rad - yaw_now_rad, tau)
    limit_rad_s = limits.yaw_rate_rad_s
    return clamp(rate_rad_s, -limit_rad_s, limit_rad_s)


def velocity_command(
    state: VehicleState,
    velocity_ned_m_s: Vec3,
    yaw_rad: float,
    limits: SpeedLimits,
    yaw_rate_rad_s: float = nan,
) -> VelocityFrdCommand:
    """The command for a velocity, which is limited, and a yaw."""
    velocity_m_s = level(state, limits.clip(*velocity_ned_m_s))
    return VelocityFrdCommand(velocity_m_s, yaw_rate(state.yaw_rad, yaw_rad, yaw_rate_rad_s, limits))


def velocity_towards(target: Vec3, place: Vec3, velocity: Vec3, limits: SpeedLimits) -> Vec3:
    """A velocity plus one proportional to the distance to the target, in components that are not NaN."""
    tx, ty, tz = target
    vx, vy, vz = velocity
    if not isnan(tx):
        vx += limits.position_gain * (tx - place[0])
    if not isnan(ty):
        vy += limits.position_gain * (ty - place[1])
    if not isnan(tz):
        vz += limits.height_gain * (tz - place[2])
    return (vx, vy, vz)
