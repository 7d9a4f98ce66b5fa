"""Manual modes: what an operator's sticks command in each."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, radians, sin

from firmware_py.commands import (
    AttitudeCommand,
    BodyRateCommand,
    ControlCommand,
    TiltCommand,
    VelocityFrdCommand,
)
from firmware_py.guidance.limits import acceleration_limits, level_pair
from firmware_py.guidance.mode import Mode, ModeEntry
from firmware_py.guidance.trajectory import Reference
from firmware_py.parameters import Parameters
from firmware_py.setpoints import TrajectorySetpoint
from firmware_py.types import ManualInput, VehicleState
from framerunner.vehicle.airframe import Airframe

_FULL_THRUST = 1.0


class StickSettings:
    """What full sticks command; thrusts are shares of full thrust.

    Attributes:
        forward_m_s: horizontal speed in position mode.
        back_m_s: the same backwards.
        side_m_s: the same sideways.
        tilt_rad: in modes that control the tilt.
        yaw_rate_rad_s: except in acro mode.
        acro_rate_frd_rad_s: body rates in acro mode, shape (3,).
        min_thrust: at the lowest throttle, where height is not controlled.
        hover_thrust: at centred throttle.
        dead: deflection below which a stick counts as centred.
        hold_level_m_s: horizontal speed below which the position is held at centred sticks; 0: any.
        hold_vertical_m_s: the same for the height.
        moving: acceleration limits towards a commanded velocity.
        braking: the same at centred sticks.
    """

    def __init__(self, airframe: Airframe, parameters: Parameters) -> None:
        value, can = parameters.value, airframe.limits
        back_m_s, side_m_s = value("MPC_VEL_MAN_BACK"), value("MPC_VEL_MAN_SIDE")
        self.forward_m_s = forward_m_s = min(can.speed_horizontal_m_s, value("MPC_VEL_MANUAL"))
        self.back_m_s = forward_m_s if back_m_s < 0.0 else min(forward_m_s, back_m_s)
        self.side_m_s = forward_m_s if side_m_s < 0.0 else min(forward_m_s, side_m_s)
        self.tilt_rad = min(can.tilt_rad, radians(value("MPC_MAN_TILT_MAX")))
        self.yaw_rate_rad_s = min(can.yaw_rate_rad_s, radians(value("MPC_MAN_Y_MAX")))
        self.acro_rate_frd_rad_s = (
            radians(value("MC_ACRO_R_MAX")),
            radians(value("MC_ACRO_P_MAX")),
            radians(value("MC_ACRO_Y_MAX")),
        )
        self.min_thrust = value("MPC_MANTHR_MIN")
        self.hover_thrust = value("MPC_THR_HOVER")
        self.dead = value("MAN_DEADZONE")
        self.hold_level_m_s = value("MPC_HOLD_MAX_XY")
        self.hold_vertical_m_s = value("MPC_HOLD_MAX_Z")
        self.moving = acceleration_limits(parameters, value("MPC_JERK_MAX"))
        self.braking = replace(self.moving, level_m_s2=value("MPC_ACC_HOR_MAX"))

    def without_dead_zone(self, stick: float) -> float:
        """A stick's value without the dead zone around its centre, -1..1."""
        dead = self.dead
        if -dead <= stick <= dead:
            return 0.0
        return (stick - dead) / (1.0 - dead) if stick > 0.0 else (stick + dead) / (1.0 - dead)

    def tilt(self, sticks: ManualInput) -> tuple[float, float, float]:
        """Roll and pitch (rad) and yaw rate (rad/s) in modes that control the tilt."""
        return (
            sticks.right * self.tilt_rad,
            -sticks.forward * self.tilt_rad,
            self.without_dead_zone(sticks.yaw) * self.yaw_rate_rad_s,
        )

    def thrust(self, sticks: ManualInput) -> float:
        """The thrust in modes that do not control the height; the middle carries the weight."""
        low, middle = self.min_thrust, self.hover_thrust
        if sticks.up < 0.0:
            return middle + sticks.up * (middle - low)
        return middle + sticks.up * (_FULL_THRUST - middle)


class ManualMode(Mode):
    """A mode flown by the sticks; telemetry shows no setpoint."""

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply the meaning of full sticks."""
        self._settings = StickSettings(airframe, parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin with the present motion."""
        self.setpoint = TrajectorySetpoint(state.time_us)


class StabilizedMode(ManualMode):
    """Tilt and thrust by the sticks."""

    def step(self, state: VehicleState) -> ControlCommand:
        """The sticks' tilt and thrust."""
        sticks, settings = self._context.sticks, self._settings
        roll_rad, pitch_rad, yaw_rate_rad_s = settings.tilt(sticks)
        return AttitudeCommand(roll_rad, pitch_rad, yaw_rate_rad_s, settings.thrust(sticks))


class AcroMode(ManualMode):
    """Body rates and thrust by the sticks."""

    def step(self, state: VehicleState) -> ControlCommand:
        """The sticks' rates and thrust."""
        sticks, settings = self._context.sticks, self._settings
        roll_rad_s, pitch_rad_s, yaw_rad_s = settings.acro_rate_frd_rad_s
        rates = (sticks.right * roll_rad_s, -sticks.forward * pitch_rad_s, sticks.yaw * yaw_rad_s)
        return BodyRateCommand(rates, settings.thrust(sticks))


class AltitudeMode(ManualMode):
    """Tilt by the sticks, height held."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin with the present motion."""
        super().enter(state, entry)
        self._reference = Reference()
        self._reference.start(state, self._settings.moving)

    def step(self, state: VehicleState) -> ControlCommand:
        """The sticks' tilt, and the vertical velocity of the throttle."""
        context = self._context
        limits = context.limits
        self._move_reference(state, (0.0, 0.0), level_bound=False)
        velocity_ned_m_s = self._reference.tracking_velocity(state, limits.position_gain, limits.height_gain)
        roll_rad, pitch_rad, yaw_rate_rad_s = self._settings.tilt(context.sticks)
        return TiltCommand(roll_rad, pitch_rad, yaw_rate_rad_s, limits.clip(*velocity_ned_m_s)[2])

    def _move_reference(
        self, state: VehicleState, level_ned_m_s: tuple[float, float], *, level_bound: bool
    ) -> None:
        """Move the reference point by the throttle and a horizontal velocity."""
        context, settings = self._context, self._settings
        limits = context.limits
        up = settings.without_dead_zone(context.sticks.up)
        if up > 0.0:
            wanted_down_m_s = -up * limits.up_m_s
        else:  # slower near the ground, as a landing
            height_m = context.home_ned_m[2] - state.position_ned_m[2]
            wanted_down_m_s = -up * limits.landing_m_s(height_m, limits.down_m_s)
        bound = settings.hold_vertical_m_s
        height_bound = up == 0.0 and (bound <= 0.0 or abs(state.velocity_ned_m_s[2]) < bound)
        acceleration = settings.braking if level_ned_m_s == (0.0, 0.0) else settings.moving
        self._reference.move(
            state,
            (*level_ned_m_s, wanted_down_m_s),
            acceleration,
            context.period_s,
            level_bound=level_bound,
            height_bound=height_bound,
        )


class PositionMode(AltitudeMode):
    """Velocities in level axes by the sticks; with centred sticks the vehicle brakes and stays."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin with the present motion."""
        super().enter(state, entry)
        self._level_held = False

    def step(self, state: VehicleState) -> ControlCommand:
        """The sticks' velocity, or the position held."""
        settings, reference = self._settings, self._reference
        sticks, limits = self._context.sticks, self._context.limits
        forward, right = settings.without_dead_zone(sticks.forward), settings.without_dead_zone(sticks.right)
        size = hypot(forward, right)
        if size > 1.0:
            forward, right = forward / size, right / size
        forward_m_s = forward * (settings.forward_m_s if forward >= 0.0 else settings.back_m_s)
        right_m_s = right * settings.side_m_s
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        north_m_s, east_m_s, _ = limits.clip(
            cos_yaw * forward_m_s - sin_yaw * right_m_s, sin_yaw * forward_m_s + cos_yaw * right_m_s, 0.0
        )
        speed_m_s = hypot(state.velocity_ned_m_s[0], state.velocity_ned_m_s[1])
        if size > 0.0:
            self._level_held = False
        elif not self._level_held:
            self._level_held = settings.hold_level_m_s <= 0.0 or speed_m_s < settings.hold_level_m_s
        self._move_reference(state, (north_m_s, east_m_s), level_bound=self._level_held)
        velocity_ned_m_s = reference.tracking_velocity(state, limits.position_gain, limits.height_gain)
        velocity, acceleration = level_pair(
            state, limits.clip(*velocity_ned_m_s), reference.acceleration_ned_m_s2
        )
        return VelocityFrdCommand(
            velocity, settings.without_dead_zone(sticks.yaw) * settings.yaw_rate_rad_s, acceleration
        )
