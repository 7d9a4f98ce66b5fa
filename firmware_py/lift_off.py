"""From standing to flying: motors idle until a mode that may take off wants to climb, then they lift."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isnan
from typing import Protocol

from firmware_py.control.limits import FlightLimits
from firmware_py.parameters import Parameters
from firmware_py.types import (
    AccelerationCommand,
    ActuatorCommand,
    BodyRateCommand,
    Command,
    MotorOutput,
    RateCommand,
    TiltCommand,
    VehicleState,
)

_LEAST_SHARE = 0.02  # of the climb wanted, whatever the ramp says, once it works to leave the ground
_LIFT_M_S = 0.04  # asked to climb faster than this, it leaves the ground
_LIFT_HELD_TICKS = 125  # half a second: integrals rest while the contact still carries the weight


@dataclass(frozen=True, slots=True)
class ClimbRamp:
    """What climb is allowed while taking off, m/s; as PX4's, it leads to a limit and not to the climb wanted.

    Attributes:
        from_m_s: at its beginning; below zero.
        to_m_s: at its end, after MPC_TKO_RAMP_T.
    """

    from_m_s: float
    to_m_s: float


class RateStabiliser(Protocol):
    """What the autopilot needs of a stabiliser.

    Attributes:
        limits: of the tilt; may be set in flight.
    """

    limits: FlightLimits

    def reset(self) -> None:
        """Forget all integrals."""

    def idle(self) -> MotorOutput:
        """Motors turning slowly, standing on the ground."""
        ...

    def step(self, state: VehicleState, command: Command, *, grounded: bool = False) -> MotorOutput:
        """Motor commands for one control period."""
        ...


class LiftOff:
    """Stands between guidance and stabiliser while the vehicle is on the ground, and just after.

    Attributes:
        ticks: for how many ticks the motors have been working to leave the ground; 0: they idle.
        spool_up_us: motors idle this long after arming (COM_SPOOLUP_TIME).
        ramp_us: the climb allowed grows this long from when it is wanted (MPC_TKO_RAMP_T).
    """

    __slots__ = ("_armed_us", "_climb_ramp", "_ramp_start_us", "_wanted", "ramp_us", "spool_up_us", "ticks")

    def __init__(self) -> None:
        self.ticks = 0
        self.spool_up_us = 0
        self.ramp_us = 0
        self._climb_ramp = ClimbRamp(0.0, 0.0)
        self._armed_us = 0
        self._wanted = False  # to lift
        self._ramp_start_us = -(10**15)

    def configure(self, parameters: Parameters) -> None:
        """Take over changed parameters."""
        self.spool_up_us = round(parameters.value("COM_SPOOLUP_TIME") * 1e6)
        self.ramp_us = round(parameters.value("MPC_TKO_RAMP_T") * 1e6)

    def arm(self, time_us: int) -> None:
        """The motors may turn from now on."""
        self.ticks = 0
        self._wanted = False
        self._armed_us = time_us

    def rest(self) -> None:
        """The motors stand."""
        self.ticks = 0

    def fly(self, stabiliser: RateStabiliser, state: VehicleState, command: Command) -> MotorOutput:
        """Motors for a command in the air."""
        self.ticks = 0
        self._wanted = False
        if state.time_us - self._ramp_start_us < self.ramp_us:
            command = self._ramped(command, state.time_us)
        return stabiliser.step(state, command)

    def stand(
        self,
        stabiliser: RateStabiliser,
        state: VehicleState,
        command: Command,
        down_m_s: float,
        *,
        may_lift: bool,
        climb_ramp: ClimbRamp,
    ) -> MotorOutput:
        """Motors for a command on the ground.

        Args:
            stabiliser: that flies.
            state: the vehicle now.
            command: of guidance.
            down_m_s: what it means vertically; below zero: up.
            may_lift: the mode flown is one that takes off.
            climb_ramp: of the mode flown.
        """
        self._climb_ramp = climb_ramp
        climbs = isinstance(command, RateCommand) or (
            isinstance(command, TiltCommand) and isnan(command.thrust)
        )
        if not self._lifts(state.time_us, down_m_s, may_lift=may_lift, ramped=climbs and self.ramp_us > 0):
            self.ticks = 0
            stabiliser.reset()
            return stabiliser.idle()
        self.ticks += 1
        if self.ramp_us > 0:
            command = self._ramped(command, state.time_us)
        return stabiliser.step(state, _straight_up(command), grounded=self.ticks <= _LIFT_HELD_TICKS)

    def _lifts(self, time_us: int, down_m_s: float, *, may_lift: bool, ramped: bool) -> bool:
        """Whether the motors work to leave the ground: it is wanted, and the ramp allows a climb."""
        if time_us - self._armed_us < self.spool_up_us or not may_lift or down_m_s > -_LIFT_M_S:
            self._wanted = False
            return False
        if not self._wanted:
            self._wanted = True
            self._ramp_start_us = time_us
        return self.ticks > 0 or not ramped or self._ramp(down_m_s, time_us) < 0.0

    def _ramp(self, down_m_s: float, time_us: int) -> float:
        """The vertical velocity allowed on the way to one wanted, below zero: up."""
        ramp = self._climb_ramp
        share = min((time_us - self._ramp_start_us) / self.ramp_us, 1.0)
        return max(down_m_s, -ramp.from_m_s - share * (ramp.to_m_s - ramp.from_m_s))

    def _ramped(self, command: Command, time_us: int) -> Command:
        """Less climb in the first moments."""
        if isinstance(command, RateCommand) and command.velocity_level_m_s[2] < 0.0:
            forward_m_s, right_m_s, down_m_s = command.velocity_level_m_s
            down_m_s = min(self._ramp(down_m_s, time_us), _LEAST_SHARE * down_m_s)
            return RateCommand((forward_m_s, right_m_s, down_m_s), command.yaw_rate_rad_s)
        if isinstance(command, TiltCommand) and isnan(command.thrust) and command.down_m_s < 0.0:
            down_m_s = min(self._ramp(command.down_m_s, time_us), _LEAST_SHARE * command.down_m_s)
            return replace(command, down_m_s=down_m_s)
        return command


def _straight_up(command: Command) -> Command:
    """What of a command may be followed while the ground still touches."""
    if isinstance(command, RateCommand):
        return RateCommand((0.0, 0.0, command.velocity_level_m_s[2]), 0.0)
    if isinstance(command, AccelerationCommand):
        return AccelerationCommand((0.0, 0.0, command.acceleration_level_m_s2[2]))
    if isinstance(command, TiltCommand):
        return TiltCommand(0.0, 0.0, 0.0, command.thrust, command.down_m_s)
    if isinstance(command, BodyRateCommand):
        return BodyRateCommand((0.0, 0.0, 0.0), command.thrust)
    return command


def goes_straight_through(command: Command) -> bool:
    """Whether a command is for the motors themselves, on the ground as in the air."""
    return isinstance(command, ActuatorCommand)


class Undesigned:
    """Stands in until the stabiliser is designed; never flown."""

    def __init__(self) -> None:
        self.limits = FlightLimits(1.0)

    def reset(self) -> None:
        """Nothing to forget."""

    def idle(self) -> MotorOutput:
        """Not to be called."""
        raise RuntimeError("the stabiliser is not designed yet; call prepare()")

    def step(self, state: VehicleState, command: Command, *, grounded: bool = False) -> MotorOutput:
        """Not to be called."""
        raise RuntimeError("the stabiliser is not designed yet; call prepare()")
