"""Guidance: what each flight mode asks of the stabiliser.

Every mode turns the vehicle's state into a velocity and a yaw rate. Positions are reached by a proportional
loop to velocity, as PX4's position controller does it; the stabiliser does the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, hypot, isfinite, isnan, nan, remainder, sin, tau

from firmware_py.airframe import Airframe
from firmware_py.parameters import Parameters
from firmware_py.types import NAN3, RateCommand, Setpoint, Vec3, VehicleState

_POSITION_GAIN = 1.0  # 1/s, as PX4's MPC_XY_P and MPC_Z_P
_YAW_GAIN = 2.5  # 1/s, near PX4's MC_YAW_P
_STOPPED_M_S = 0.2  # slower than this, the present place is the one to hold
_REACHED_M = 0.15
_LARGEST = 1e6  # metres or m/s asked for are cut to this, which keeps all arithmetic finite


@dataclass(slots=True)
class SpeedLimits:
    """What guidance never asks for more of, all positive."""

    horizontal_m_s: float
    up_m_s: float
    down_m_s: float
    yaw_rate_rad_s: float
    takeoff_m_s: float
    land_m_s: float

    def clip(self, north_m_s: float, east_m_s: float, down_m_s: float) -> Vec3:
        """Shorten a velocity to the limits; its horizontal part keeps its direction."""
        speed_m_s = hypot(north_m_s, east_m_s)
        if speed_m_s > self.horizontal_m_s:
            scale = self.horizontal_m_s / speed_m_s
            north_m_s, east_m_s = north_m_s * scale, east_m_s * scale
        return (north_m_s, east_m_s, _clamp(down_m_s, -self.up_m_s, self.down_m_s))


def speed_limits(airframe: Airframe, parameters: Parameters) -> SpeedLimits:
    """The smaller of what the airframe can do and what the parameters allow."""
    can, value = airframe.limits, parameters.value
    up_m_s = min(can.speed_up_m_s, value("MPC_Z_VEL_MAX_UP"))
    down_m_s = min(can.speed_down_m_s, value("MPC_Z_VEL_MAX_DN"))
    return SpeedLimits(
        horizontal_m_s=min(can.speed_horizontal_m_s, value("MPC_XY_VEL_MAX")),
        up_m_s=up_m_s,
        down_m_s=down_m_s,
        yaw_rate_rad_s=can.yaw_rate_rad_s,
        takeoff_m_s=min(up_m_s, value("MPC_TKO_SPEED")),
        land_m_s=min(down_m_s, value("MPC_LAND_SPEED")),
    )


class StationKeeper:
    """Brakes, then holds place and yaw; the common part of hold, take-off and land.

    Attributes:
        target_ned_m: the place held, shape (3,); NaN in a component that is still braking.
        yaw_rad: the yaw held.
    """

    __slots__ = ("target_ned_m", "yaw_rad")

    def __init__(self) -> None:
        self.target_ned_m: Vec3 = NAN3
        self.yaw_rad = 0.0

    def release(self, state: VehicleState) -> None:
        """Forget the place and take over the present yaw."""
        self.target_ned_m = NAN3
        self.yaw_rad = state.yaw_rad

    def latch(self, state: VehicleState) -> None:
        """Take over the present place, horizontally and vertically each once it has stopped there."""
        north_m, east_m, down_m = self.target_ned_m
        north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
        if isnan(north_m) and hypot(north_m_s, east_m_s) < _STOPPED_M_S:
            north_m, east_m = state.position_ned_m[0], state.position_ned_m[1]
            self.target_ned_m = (north_m, east_m, down_m)
        if isnan(down_m) and abs(down_m_s) < _STOPPED_M_S:
            self.target_ned_m = (north_m, east_m, state.position_ned_m[2])

    def velocity(self, state: VehicleState) -> Vec3:
        """Velocity NED towards the place held, zero in components that are still braking; not limited."""
        return _towards(self.target_ned_m, state.position_ned_m, (0.0, 0.0, 0.0))


class Guidance:
    """All flight modes' guidance with what they remember.

    Attributes:
        setpoint: what is followed now, for telemetry.
        target_reached: whether the take-off is at its height.
        command_down_m_s: vertical speed now asked for.
    """

    __slots__ = (
        "_keeper",
        "_offboard",
        "_step",
        "_turning",
        "command_down_m_s",
        "limits",
        "setpoint",
        "target_reached",
    )

    def __init__(self, limits: SpeedLimits) -> None:
        self.limits = limits
        self.setpoint = Setpoint(0)
        self.target_reached = False
        self.command_down_m_s = 0.0
        self._keeper = StationKeeper()
        self._offboard = Setpoint(0)
        self._turning: RateCommand | None = None  # the same for every tick of a setpoint
        self._step: Callable[[VehicleState], RateCommand] = self._hold

    def enter_hold(self, state: VehicleState, *, keep_target: bool = False) -> None:
        """Hold place and yaw, or go on to the present target (after a take-off)."""
        self._step = self._hold
        if not keep_target:
            self._keeper.release(state)
        self._show_target(state)

    def enter_takeoff(self, state: VehicleState, target_down_m: float) -> None:
        """Climb straight up to a height; one below the present height means to stay."""
        self._step = self._takeoff
        north_m, east_m, down_m = state.position_ned_m
        self._keeper.yaw_rad = state.yaw_rad
        self._keeper.target_ned_m = (north_m, east_m, min(down_m, target_down_m))
        self.target_reached = False
        self._show_target(state)

    def enter_land(self, state: VehicleState) -> None:
        """Descend; horizontally brake and hold."""
        self._step = self._land
        self._keeper.release(state)
        self._show_target(state)

    def enter_offboard(self) -> None:
        """Follow the setpoints of `accept`."""
        self._step = self._follow_setpoint
        self.setpoint = self._offboard

    def accept(self, setpoint: Setpoint) -> None:
        """Take the next offboard setpoint; see `usable` and `bounded`."""
        self._offboard = wanted = bounded(setpoint, self.limits)
        self._turning = None
        if not isnan(wanted.velocity_level_m_s[0]) and isnan(wanted.yaw_rad):
            yaw_rate_rad_s = self._yaw_rate(0.0, nan, wanted.yaw_rate_rad_s)
            self._turning = RateCommand(wanted.velocity_level_m_s, yaw_rate_rad_s)
        if self._step == self._follow_setpoint:
            self.setpoint = self._offboard

    def step(self, state: VehicleState) -> RateCommand:
        """What the stabiliser has to follow in this tick."""
        command = self._step(state)
        self.command_down_m_s = command.velocity_level_m_s[2]
        return command

    def _hold(self, state: VehicleState) -> RateCommand:
        keeper = self._keeper
        before = keeper.target_ned_m
        keeper.latch(state)
        if keeper.target_ned_m is not before:
            self._show_target(state)
        return self._command(state, keeper.velocity(state), keeper.yaw_rad)

    def _takeoff(self, state: VehicleState) -> RateCommand:
        keeper = self._keeper
        north_m_s, east_m_s, down_m_s = keeper.velocity(state)
        self.target_reached = abs(keeper.target_ned_m[2] - state.position_ned_m[2]) < _REACHED_M
        down_m_s = max(down_m_s, -self.limits.takeoff_m_s)
        return self._command(state, (north_m_s, east_m_s, down_m_s), keeper.yaw_rad)

    def _land(self, state: VehicleState) -> RateCommand:
        keeper = self._keeper
        keeper.latch(state)
        north_m_s, east_m_s, _ = keeper.velocity(state)
        return self._command(state, (north_m_s, east_m_s, self.limits.land_m_s), keeper.yaw_rad)

    def _follow_setpoint(self, state: VehicleState) -> RateCommand:
        if self._turning is not None:
            return self._turning
        wanted = self._offboard
        if not isnan(wanted.velocity_level_m_s[0]):
            yaw_rate_rad_s = self._yaw_rate(state.yaw_rad, wanted.yaw_rad, wanted.yaw_rate_rad_s)
            return RateCommand(wanted.velocity_level_m_s, yaw_rate_rad_s)
        velocity_ned_m_s = _towards(wanted.position_ned_m, state.position_ned_m, wanted.velocity_ned_m_s)
        return self._command(state, velocity_ned_m_s, wanted.yaw_rad, wanted.yaw_rate_rad_s)

    def _command(
        self, state: VehicleState, velocity_ned_m_s: Vec3, yaw_rad: float, yaw_rate_rad_s: float = nan
    ) -> RateCommand:
        """Limit a velocity, turn it into level axes, and find the yaw rate that turns the shortest way."""
        north_m_s, east_m_s, down_m_s = self.limits.clip(*velocity_ned_m_s)
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        return RateCommand(
            (cos_yaw * north_m_s + sin_yaw * east_m_s, cos_yaw * east_m_s - sin_yaw * north_m_s, down_m_s),
            self._yaw_rate(state.yaw_rad, yaw_rad, yaw_rate_rad_s),
        )

    def _yaw_rate(self, yaw_now_rad: float, yaw_rad: float, yaw_rate_rad_s: float) -> float:
        rate_rad_s = 0.0 if isnan(yaw_rate_rad_s) else yaw_rate_rad_s
        if not isnan(yaw_rad):
            rate_rad_s += _YAW_GAIN * remainder(yaw_rad - yaw_now_rad, tau)
        limit_rad_s = self.limits.yaw_rate_rad_s
        return _clamp(rate_rad_s, -limit_rad_s, limit_rad_s)

    def _show_target(self, state: VehicleState) -> None:
        keeper = self._keeper
        self.setpoint = Setpoint(state.time_us, position_ned_m=keeper.target_ned_m, yaw_rad=keeper.yaw_rad)


def usable(setpoint: Setpoint) -> bool:
    """Whether a setpoint says where or how fast to fly; acceleration alone is not followed here."""
    return not all(map(isnan, setpoint.position_ned_m + setpoint.velocity_ned_m_s))


def bounded(setpoint: Setpoint, limits: SpeedLimits) -> Setpoint:
    """A setpoint made safe to follow.

    An infinite component counts as not controlled, and a velocity that is not controlled is zero: the
    vehicle brakes and hovers on that axis, as PX4's does. Speeds are cut to the limits. The yaw rate is
    passed on as asked for, which is what PX4 echoes; it is limited when flown.
    """
    north_m, east_m, down_m = setpoint.position_ned_m
    north_m_s, east_m_s, down_m_s = setpoint.velocity_ned_m_s
    level = setpoint.velocity_level_m_s
    return Setpoint(
        setpoint.time_us,
        position_ned_m=(_near(north_m), _near(east_m), _near(down_m)),
        velocity_ned_m_s=limits.clip(_or_zero(north_m_s), _or_zero(east_m_s), _or_zero(down_m_s)),
        yaw_rad=setpoint.yaw_rad if isfinite(setpoint.yaw_rad) else nan,
        yaw_rate_rad_s=setpoint.yaw_rate_rad_s if isfinite(setpoint.yaw_rate_rad_s) else nan,
        velocity_level_m_s=NAN3 if isnan(level[0]) else limits.clip(*level),
    )


def _towards(target: Vec3, place: Vec3, velocity: Vec3) -> Vec3:
    """Velocity plus a proportional pull to the target in the components that have one."""
    tx, ty, tz = target
    vx, vy, vz = velocity
    if not isnan(tx):
        vx += _POSITION_GAIN * (tx - place[0])
    if not isnan(ty):
        vy += _POSITION_GAIN * (ty - place[1])
    if not isnan(tz):
        vz += _POSITION_GAIN * (tz - place[2])
    return (vx, vy, vz)


def _clamp(value: float, low: float, high: float) -> float:
    return low if value < low else high if value > high else value


def _near(metres: float) -> float:
    return _clamp(metres, -_LARGEST, _LARGEST) if isfinite(metres) else nan


def _or_zero(value: float) -> float:
    return _clamp(value, -_LARGEST, _LARGEST) if isfinite(value) else 0.0
