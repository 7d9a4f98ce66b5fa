"""Guidance: all flight modes, and the mode of each state of the commander."""

from __future__ import annotations

from math import nan

from firmware_py.commander_table import CommanderState
from firmware_py.commands import ControlCommand
from firmware_py.guidance.auto_modes import (
    DescendMode,
    HoldMode,
    LandMode,
    OrbitMode,
    ReturnMode,
    TakeoffMode,
)
from firmware_py.guidance.following import FollowMode
from firmware_py.guidance.limits import SpeedLimits
from firmware_py.guidance.mode import Mode, ModeContext, ModeEntry
from firmware_py.guidance.orbit import Orbit
from firmware_py.guidance.sticks import AcroMode, AltitudeMode, PositionMode, StabilizedMode
from firmware_py.guidance.trajectory import YawMode
from firmware_py.missions.flight import LegKind, MissionLeg
from firmware_py.parameters import Parameters
from firmware_py.setpoints import Setpoint
from firmware_py.types import VehicleState
from framerunner.geometry.vectors import NAN3, Vec3
from framerunner.vehicle.airframe import Airframe


class OffboardMode(Mode):
    """Follows the setpoints of an offboard controller."""

    _constant: ControlCommand | None = None  # the command, if it is the same in every tick

    def accept(self, setpoint: Setpoint) -> None:
        """Take a usable setpoint; it is followed while the mode is flown."""
        limits = self._context.limits
        self.setpoint = setpoint = setpoint.bounded(limits)
        self._constant = setpoint.constant_command(limits)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Nothing to prepare."""

    def step(self, state: VehicleState) -> ControlCommand:
        """The setpoint's command."""
        return self._constant or self.setpoint.command(state, self._context.limits)


class Guidance:
    """Flies one mode at a time.

    Args:
        airframe: what flies.
        parameters: of limits and modes.
        period_s: of control.

    Attributes:
        context: what all modes share; sticks, region of interest and trajectory may be changed in flight.
        follow: the follow mode, whose follower takes reports of the target.
        mode: the one flown now or last.
        command_down_m_s: vertical velocity of the last command; for a thrust, its sign.
    """

    def __init__(self, airframe: Airframe, parameters: Parameters, period_s: float = 0.004) -> None:
        self.context = context = ModeContext(SpeedLimits(airframe, parameters), period_s)
        self._hold = hold = HoldMode(context, airframe, parameters)
        land = LandMode(context, airframe, parameters)
        self.follow = FollowMode(context, airframe, parameters)
        self._offboard = OffboardMode(context, airframe, parameters)
        stabilized = StabilizedMode(context, airframe, parameters)
        returning = ReturnMode(context, airframe, parameters)
        self._modes: dict[CommanderState, Mode] = {
            CommanderState.MANUAL: stabilized,
            CommanderState.STABILIZED: stabilized,
            CommanderState.ACRO: AcroMode(context, airframe, parameters),
            CommanderState.ALTITUDE: AltitudeMode(context, airframe, parameters),
            CommanderState.POSITION: PositionMode(context, airframe, parameters),
            CommanderState.HOLD: hold,
            CommanderState.FAILSAFE_HOLD: hold,
            CommanderState.MISSION: hold,  # until its first leg
            CommanderState.TAKEOFF: TakeoffMode(context, airframe, parameters),
            CommanderState.LAND: land,
            CommanderState.FAILSAFE_LAND: land,
            CommanderState.FAILSAFE_DESCEND: DescendMode(context, airframe, parameters),
            CommanderState.RETURN: returning,
            CommanderState.FAILSAFE_RETURN: returning,
            CommanderState.ORBIT: OrbitMode(context, airframe, parameters),
            CommanderState.FOLLOW: self.follow,
            CommanderState.OFFBOARD: self._offboard,
        }
        self.mode: Mode = hold
        self.command_down_m_s = 0.0
        self._configure_shared(parameters)

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply changed parameters."""
        self.context.limits = SpeedLimits(airframe, parameters)
        for mode in dict.fromkeys(self._modes.values()):
            mode.configure(airframe, parameters)
        self._configure_shared(parameters)

    def _configure_shared(self, parameters: Parameters) -> None:
        self.context.trajectory.yaw_mode = YawMode(parameters.integer("MPC_YAW_MODE"))
        self._hover_thrust = parameters.value("MPC_THR_HOVER")

    def set_home(self, home_ned_m: Vec3) -> None:
        """Set the place from which heights of return, landing and following count, shape (3,)."""
        self.context.home_ned_m = self.context.trajectory.home_ned_m = home_ned_m

    def enter(
        self,
        flown: CommanderState,
        state: VehicleState,
        *,
        target_ned_m: Vec3 = NAN3,
        keep_target: bool = False,
        orbit: Orbit | None = None,
    ) -> None:
        """Start the mode of a state of the commander; see `ModeEntry`."""
        entry = ModeEntry(self.mode, target_ned_m, keep_target, orbit or Orbit())
        self.mode = self._modes[flown]
        self.mode.enter(state, entry)

    def fly_to(
        self, state: VehicleState, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan
    ) -> None:
        """Fly to a place and hold there; see `HoldMode.go_to`."""
        begins, self.mode = self.mode is not self._hold, self._hold
        self._hold.go_to(state, target_ned_m, yaw_rad, speed_m_s, begins=begins)

    def fly_leg(self, state: VehicleState, leg: MissionLeg) -> None:
        """Fly a leg of a mission."""
        if leg.kind is LegKind.TAKEOFF:
            self.enter(CommanderState.TAKEOFF, state, target_ned_m=leg.target_ned_m)
        elif leg.kind is LegKind.LAND:
            self.enter(CommanderState.LAND, state, target_ned_m=leg.target_ned_m)
        else:
            begins, self.mode = self.mode is not self._hold, self._hold
            self._hold.fly_leg(state, leg, begins=begins)

    def step(self, state: VehicleState) -> ControlCommand:
        """The command of this tick."""
        command = self.mode.step(state)
        self.command_down_m_s = command.vertical_intent(self._hover_thrust)
        return command

    def accept(self, setpoint: Setpoint | None) -> None:
        """Take a usable offboard setpoint; None changes nothing."""
        if setpoint is not None:
            self._offboard.accept(setpoint)
