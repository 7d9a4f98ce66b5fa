"""Flying by hand: what a pilot's sticks mean in each manual mode."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, nan, radians, sin

from firmware_py.airframe import Airframe
from firmware_py.guidance.limits import SpeedLimits
from firmware_py.guidance.station import StationKeeper
from firmware_py.parameters import Parameters
from firmware_py.types import BodyRateCommand, ManualInput, RateCommand, TiltCommand, Vec3, VehicleState

_DEAD = 0.1  # nearer to the centre than this, a stick is let go
_FULL_THRUST = 1.0


@dataclass(frozen=True, slots=True)
class StickSettings:
    """What full sticks mean: m/s, rad, rad/s; thrusts as shares of the most there is."""

    velocity_m_s: float
    tilt_rad: float
    yaw_rate_rad_s: float
    acro_rate_frd_rad_s: Vec3
    least_thrust: float
    hover_thrust: float


def stick_settings(airframe: Airframe, parameters: Parameters) -> StickSettings:
    """What airframe and parameters say."""
    value = parameters.value
    return StickSettings(
        min(airframe.limits.speed_horizontal_m_s, value("MPC_VEL_MANUAL")),
        min(airframe.limits.tilt_rad, radians(value("MPC_MAN_TILT_MAX"))),
        min(airframe.limits.yaw_rate_rad_s, radians(value("MPC_MAN_Y_MAX"))),
        (radians(value("MC_ACRO_R_MAX")), radians(value("MC_ACRO_P_MAX")), radians(value("MC_ACRO_Y_MAX"))),
        value("MPC_MANTHR_MIN"),
        (airframe.hover_speed_rad_s / airframe.motor.max_speed_rad_s) ** 2,
    )


class StickFlight:
    """Turns sticks into commands.

    Attributes:
        settings: what full sticks mean.
        keeper: holds what is let go.
    """

    __slots__ = ("keeper", "settings")

    def __init__(self, keeper: StationKeeper, settings: StickSettings) -> None:
        self.keeper = keeper
        self.settings = settings

    def position(self, state: VehicleState, sticks: ManualInput, limits: SpeedLimits) -> RateCommand:
        """Velocities in level axes; let go, it brakes and stays."""
        forward, right = released(sticks.forward), released(sticks.right)
        moving = forward != 0.0 or right != 0.0
        down_m_s, held_m_s = self._vertical(state, sticks, limits, moving=moving)
        yaw_rate_rad_s = released(sticks.yaw) * self.settings.yaw_rate_rad_s
        if moving:
            speed_m_s = self.settings.velocity_m_s
            forward_m_s, right_m_s, down_m_s = limits.clip(forward * speed_m_s, right * speed_m_s, down_m_s)
            return RateCommand((forward_m_s, right_m_s, down_m_s), yaw_rate_rad_s)
        north_m_s, east_m_s, down_m_s = limits.clip(held_m_s[0], held_m_s[1], down_m_s)
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        return RateCommand(
            (cos_yaw * north_m_s + sin_yaw * east_m_s, cos_yaw * east_m_s - sin_yaw * north_m_s, down_m_s),
            yaw_rate_rad_s,
        )

    def altitude(self, state: VehicleState, sticks: ManualInput, limits: SpeedLimits) -> TiltCommand:
        """Tilt by hand, height held."""
        down_m_s, _ = self._vertical(state, sticks, limits, moving=True)
        roll_rad, pitch_rad, yaw_rate_rad_s = self._tilt(sticks)
        return TiltCommand(roll_rad, pitch_rad, yaw_rate_rad_s, nan, down_m_s)

    def stabilized(self, sticks: ManualInput) -> TiltCommand:
        """Tilt and thrust by hand; the middle of the throttle carries the weight."""
        roll_rad, pitch_rad, yaw_rate_rad_s = self._tilt(sticks)
        return TiltCommand(roll_rad, pitch_rad, yaw_rate_rad_s, self._thrust(sticks))

    def acro(self, sticks: ManualInput) -> BodyRateCommand:
        """Body rates and thrust by hand."""
        roll_rad_s, pitch_rad_s, yaw_rad_s = self.settings.acro_rate_frd_rad_s
        rates = (sticks.right * roll_rad_s, -sticks.forward * pitch_rad_s, sticks.yaw * yaw_rad_s)
        return BodyRateCommand(rates, self._thrust(sticks))

    def _tilt(self, sticks: ManualInput) -> Vec3:
        settings = self.settings
        return (
            sticks.right * settings.tilt_rad,
            -sticks.forward * settings.tilt_rad,
            released(sticks.yaw) * settings.yaw_rate_rad_s,
        )

    def _thrust(self, sticks: ManualInput) -> float:
        low, middle = self.settings.least_thrust, self.settings.hover_thrust
        if sticks.up < 0.0:
            return middle + sticks.up * (middle - low)
        return middle + sticks.up * (_FULL_THRUST - middle)

    def _vertical(
        self, state: VehicleState, sticks: ManualInput, limits: SpeedLimits, *, moving: bool
    ) -> tuple[float, Vec3]:
        """Vertical velocity, and the velocity NED that holds what is let go."""
        keeper = self.keeper
        up = released(sticks.up)
        north_m, east_m, down_m = keeper.target_ned_m
        if moving:
            north_m = east_m = nan
        if up != 0.0:
            down_m = nan
        keeper.target_ned_m = (north_m, east_m, down_m)
        keeper.latch(state)
        held_m_s = keeper.velocity(state, limits)
        if up == 0.0:
            return held_m_s[2], held_m_s
        return (-up * limits.up_m_s if up > 0.0 else -up * limits.down_m_s), held_m_s


def released(stick: float) -> float:
    """A stick's value with the dead zone around its centre taken out, -1..1."""
    if -_DEAD < stick < _DEAD:
        return 0.0
    return (stick - _DEAD) / (1.0 - _DEAD) if stick > 0.0 else (stick + _DEAD) / (1.0 - _DEAD)
