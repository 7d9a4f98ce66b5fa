"""Limits and gains of guidance, and the velocities and turns made within them."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, inf, isnan, nan, radians, remainder, sin, tau

from firmware_py.airframe import Airframe
from firmware_py.commands import VelocityCommand
from firmware_py.guidance.reference import Pace
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from geometry.vectors import Vec3


@dataclass(slots=True)
class SpeedLimits:
    """Limits and gains of guidance, all positive.

    Attributes:
        horizontal_m_s: any horizontal velocity.
        up_m_s: any climb.
        down_m_s: any descent.
        yaw_rate_rad_s: any turn.
        takeoff_m_s: climb of a take-off.
        takeoff_m_s2: how fast that climb is built up; infinite: at once.
        land_m_s: descent near the ground.
        cruise_m_s: of a journey by itself.
        auto_up_m_s: climb of a journey.
        auto_down_m_s: descent of a journey, and of a landing high up.
        pace: accelerations and jerk of a journey.
        auto_yaw_rate_rad_s: turn of a journey.
        position_gain: horizontal velocity per distance, 1/s.
        height_gain: vertical velocity per height, 1/s.
        yaw_gain: turn per angle, 1/s.
        land_slow_below_m: height above home from which a landing is slow.
        land_fast_above_m: height above home down to which it is fast.
    """

    horizontal_m_s: float
    up_m_s: float
    down_m_s: float
    yaw_rate_rad_s: float
    takeoff_m_s: float
    land_m_s: float
    takeoff_m_s2: float = inf
    cruise_m_s: float = 5.0
    auto_up_m_s: float = 3.0
    auto_down_m_s: float = 1.5
    pace: Pace = field(default_factory=Pace)
    auto_yaw_rate_rad_s: float = 1.0
    position_gain: float = 1.0
    height_gain: float = 1.0
    yaw_gain: float = 2.5
    land_slow_below_m: float = 5.0
    land_fast_above_m: float = 10.0

    def clip(self, north_m_s: float, east_m_s: float, down_m_s: float) -> Vec3:
        """Shorten a velocity to the limits; its horizontal part keeps its direction."""
        speed_m_s = hypot(north_m_s, east_m_s)
        if speed_m_s > self.horizontal_m_s:
            scale = self.horizontal_m_s / speed_m_s
            north_m_s, east_m_s = north_m_s * scale, east_m_s * scale
        return (north_m_s, east_m_s, clamp(down_m_s, -self.up_m_s, self.down_m_s))

    def landing_m_s(self, height_m: float, high_up_m_s: float) -> float:
        """Descent at a height above home: slow near the ground, and as told high up, as PX4's."""
        if high_up_m_s <= self.land_m_s:
            return high_up_m_s
        if height_m <= self.land_slow_below_m:
            return self.land_m_s
        span_m = max(self.land_fast_above_m - self.land_slow_below_m, 0.1)
        share = min((height_m - self.land_slow_below_m) / span_m, 1.0)
        return self.land_m_s + share * (high_up_m_s - self.land_m_s)


def speed_limits(airframe: Airframe, parameters: Parameters) -> SpeedLimits:
    """The smaller of what the airframe can do and what the parameters allow."""
    can, value = airframe.limits, parameters.value
    up_m_s = min(can.speed_up_m_s, value("MPC_Z_VEL_MAX_UP"))
    down_m_s = min(can.speed_down_m_s, value("MPC_Z_VEL_MAX_DN"))
    horizontal_m_s = min(can.speed_horizontal_m_s, value("MPC_XY_VEL_MAX"))
    takeoff_m_s = min(up_m_s, value("MPC_TKO_SPEED"))
    ramp_s = value("MPC_TKO_RAMP_T")
    return SpeedLimits(
        horizontal_m_s=horizontal_m_s,
        up_m_s=up_m_s,
        down_m_s=down_m_s,
        yaw_rate_rad_s=min(can.yaw_rate_rad_s, radians(value("MC_YAWRATE_MAX"))),
        takeoff_m_s=takeoff_m_s,
        takeoff_m_s2=takeoff_m_s / ramp_s if ramp_s > 0.0 else inf,
        land_m_s=min(down_m_s, value("MPC_LAND_SPEED")),
        cruise_m_s=min(horizontal_m_s, value("MPC_XY_CRUISE")),
        auto_up_m_s=min(up_m_s, value("MPC_Z_V_AUTO_UP")),
        auto_down_m_s=min(down_m_s, value("MPC_Z_V_AUTO_DN")),
        pace=Pace(
            min(value("MPC_ACC_HOR"), value("MPC_ACC_HOR_MAX")),
            value("MPC_ACC_UP_MAX"),
            value("MPC_ACC_DOWN_MAX"),
            value("MPC_JERK_AUTO"),
        ),
        auto_yaw_rate_rad_s=radians(value("MPC_YAWRAUTO_MAX")),
        position_gain=value("MPC_XY_P"),
        height_gain=value("MPC_Z_P"),
        yaw_gain=value("MC_YAW_P"),
        land_slow_below_m=value("MPC_LAND_ALT2"),
        land_fast_above_m=value("MPC_LAND_ALT1"),
    )


def clamp(value: float, low: float, high: float) -> float:
    """The nearest value within limits."""
    return low if value < low else high if value > high else value


def level(state: VehicleState, vector_ned: Vec3) -> Vec3:
    """A vector NED in level axes turned with the yaw: forward, right, down."""
    north, east, down = vector_ned
    cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
    return (cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north, down)


def level_pair(state: VehicleState, one_ned: Vec3, other_ned: Vec3) -> tuple[Vec3, Vec3]:
    """The same for two vectors."""
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
    """The yaw rate that turns the shortest way to a yaw, and a yaw rate beside it; NaN: not asked for."""
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
) -> VelocityCommand:
    """Limit a velocity, turn it into level axes, and find the yaw rate."""
    velocity_m_s = level(state, limits.clip(*velocity_ned_m_s))
    return VelocityCommand(velocity_m_s, yaw_rate(state.yaw_rad, yaw_rad, yaw_rate_rad_s, limits))


def velocity_towards(target: Vec3, place: Vec3, velocity: Vec3, limits: SpeedLimits) -> Vec3:
    """Velocity plus a proportional pull to the target in the components that have one."""
    tx, ty, tz = target
    vx, vy, vz = velocity
    if not isnan(tx):
        vx += limits.position_gain * (tx - place[0])
    if not isnan(ty):
        vy += limits.position_gain * (ty - place[1])
    if not isnan(tz):
        vz += limits.height_gain * (tz - place[2])
    return (vx, vy, vz)
