"""Flying by hand: what a pilot's sticks mean in each manual mode."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, nan, radians, sin

from firmware_py.airframe import Airframe
from firmware_py.guidance.frames import level
from firmware_py.guidance.limits import SpeedLimits
from firmware_py.guidance.reference import Pace, Reference
from firmware_py.parameters import Parameters
from firmware_py.types import BodyRateCommand, ManualInput, RateCommand, Setpoint, TiltCommand, VehicleState
from geometry.vectors import Vec3

_FULL_THRUST = 1.0


@dataclass(frozen=True, slots=True)
class StickSettings:
    """What full sticks mean: m/s, rad, rad/s; thrusts as shares of the most there is.

    Attributes:
        forward_m_s: horizontal speed in position mode.
        back_m_s: the same backwards.
        side_m_s: the same sideways.
        tilt_rad: in modes that control the tilt.
        yaw_rate_rad_s: acro mode apart.
        acro_rate_frd_rad_s: body rates in acro mode, shape (3,).
        least_thrust: throttle down, where height is not controlled.
        hover_thrust: throttle in the middle.
        dead: nearer to its middle than this, a stick is let go.
        hold_level_m_s: let go, it keeps its place from below this horizontal speed; 0: at once.
        hold_vertical_m_s: the same for its height.
        moving: how hard it speeds up.
        braking: how hard it stops.
    """

    forward_m_s: float
    back_m_s: float
    side_m_s: float
    tilt_rad: float
    yaw_rate_rad_s: float
    acro_rate_frd_rad_s: tuple[float, float, float]
    least_thrust: float
    hover_thrust: float
    dead: float
    hold_level_m_s: float
    hold_vertical_m_s: float
    moving: Pace
    braking: Pace


def stick_settings(airframe: Airframe, parameters: Parameters) -> StickSettings:
    """What airframe and parameters say."""
    value, can = parameters.value, airframe.limits
    forward_m_s = min(can.speed_horizontal_m_s, value("MPC_VEL_MANUAL"))
    back_m_s, side_m_s = value("MPC_VEL_MAN_BACK"), value("MPC_VEL_MAN_SIDE")
    most_m_s2 = value("MPC_ACC_HOR_MAX")
    moving = Pace(
        min(value("MPC_ACC_HOR"), most_m_s2),
        value("MPC_ACC_UP_MAX"),
        value("MPC_ACC_DOWN_MAX"),
        value("MPC_JERK_MAX"),
    )
    return StickSettings(
        forward_m_s,
        forward_m_s if back_m_s < 0.0 else min(forward_m_s, back_m_s),
        forward_m_s if side_m_s < 0.0 else min(forward_m_s, side_m_s),
        min(can.tilt_rad, radians(value("MPC_MAN_TILT_MAX"))),
        min(can.yaw_rate_rad_s, radians(value("MPC_MAN_Y_MAX"))),
        (radians(value("MC_ACRO_R_MAX")), radians(value("MC_ACRO_P_MAX")), radians(value("MC_ACRO_Y_MAX"))),
        value("MPC_MANTHR_MIN"),
        value("MPC_THR_HOVER"),
        value("MAN_DEADZONE"),
        value("MPC_HOLD_MAX_XY"),
        value("MPC_HOLD_MAX_Z"),
        moving,
        replace(moving, level_m_s2=most_m_s2),
    )


class StickFlight:
    """Turns sticks into commands.

    Args:
        settings: what full sticks mean.
        period_s: of control.

    Attributes:
        settings: see above.
        home_ned_m: near its height a descent is slow, shape (3,).
        reference: the point that the sticks lead.
    """

    __slots__ = ("_level_held", "_period_s", "home_ned_m", "reference", "settings")

    def __init__(self, settings: StickSettings, period_s: float) -> None:
        self.settings = settings
        self.home_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self.reference = Reference()
        self._period_s = period_s
        self._level_held = False

    def start(self, state: VehicleState) -> None:
        """Begin as it moves now."""
        self.reference.start(state, self.settings.moving)
        self._level_held = False

    def position(self, state: VehicleState, sticks: ManualInput, limits: SpeedLimits) -> RateCommand:
        """Velocities in level axes; let go, it brakes and stays."""
        settings, reference = self.settings, self.reference
        forward, right = self.released(sticks.forward), self.released(sticks.right)
        size = hypot(forward, right)
        if size > 1.0:
            forward, right = forward / size, right / size
        forward_m_s = forward * (settings.forward_m_s if forward >= 0.0 else settings.back_m_s)
        right_m_s = right * settings.side_m_s
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        north_m_s, east_m_s, _ = limits.clip(
            cos_yaw * forward_m_s - sin_yaw * right_m_s, sin_yaw * forward_m_s + cos_yaw * right_m_s, 0.0
        )
        moves = size > 0.0
        speed_m_s = hypot(state.velocity_ned_m_s[0], state.velocity_ned_m_s[1])
        if moves:
            self._level_held = False
        elif not self._level_held:
            self._level_held = settings.hold_level_m_s <= 0.0 or speed_m_s < settings.hold_level_m_s
        self._lead(state, sticks, limits, (north_m_s, east_m_s), level_bound=self._level_held)
        velocity_ned_m_s = reference.chase(state, limits.position_gain, limits.height_gain)
        return RateCommand(
            level(state, limits.clip(*velocity_ned_m_s)),
            self.released(sticks.yaw) * settings.yaw_rate_rad_s,
            level(state, reference.acceleration_ned_m_s2),
        )

    def altitude(self, state: VehicleState, sticks: ManualInput, limits: SpeedLimits) -> TiltCommand:
        """Tilt by hand, height held."""
        self._lead(state, sticks, limits, (0.0, 0.0), level_bound=False)
        down_m_s = limits.clip(*self.reference.chase(state, limits.position_gain, limits.height_gain))[2]
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

    def released(self, stick: float) -> float:
        """A stick's value with the dead zone around its centre taken out, -1..1."""
        dead = self.settings.dead
        if -dead <= stick <= dead:
            return 0.0
        return (stick - dead) / (1.0 - dead) if stick > 0.0 else (stick + dead) / (1.0 - dead)

    def _lead(
        self,
        state: VehicleState,
        sticks: ManualInput,
        limits: SpeedLimits,
        level_ned_m_s: tuple[float, float],
        *,
        level_bound: bool,
    ) -> None:
        """Move the point by the throttle and a horizontal velocity."""
        settings, reference = self.settings, self.reference
        up = self.released(sticks.up)
        if up > 0.0:
            wanted_down_m_s = -up * limits.up_m_s
        else:  # slower near the ground, as a landing
            height_m = self.home_ned_m[2] - state.position_ned_m[2]
            wanted_down_m_s = -up * limits.landing_m_s(height_m, limits.down_m_s)
        bound = settings.hold_vertical_m_s
        height_bound = up == 0.0 and (bound <= 0.0 or abs(state.velocity_ned_m_s[2]) < bound)
        pace = settings.braking if level_ned_m_s == (0.0, 0.0) else settings.moving
        reference.move(
            state,
            (*level_ned_m_s, wanted_down_m_s),
            pace,
            self._period_s,
            level_bound=level_bound,
            height_bound=height_bound,
        )

    def _tilt(self, sticks: ManualInput) -> tuple[float, float, float]:
        settings = self.settings
        return (
            sticks.right * settings.tilt_rad,
            -sticks.forward * settings.tilt_rad,
            self.released(sticks.yaw) * settings.yaw_rate_rad_s,
        )

    def _thrust(self, sticks: ManualInput) -> float:
        low, middle = self.settings.least_thrust, self.settings.hover_thrust
        if sticks.up < 0.0:
            return middle + sticks.up * (middle - low)
        return middle + sticks.up * (_FULL_THRUST - middle)

    def shown(self, time_us: int) -> Setpoint:
        """What is followed, for telemetry."""
        reference = self.reference
        return Setpoint(time_us, reference.position_ned_m, reference.velocity_ned_m_s)
