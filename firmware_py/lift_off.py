"""From standing to flying: motors idle until a mode that may take off wants to climb, then they lift."""

from __future__ import annotations

from typing import Protocol

from firmware_py.control.limits import TiltLimit
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

_LIFT_M_S = 0.04  # asked to climb faster than this, it leaves the ground
_LIFT_HELD_TICKS = 125  # half a second: integrals rest while the contact still carries the weight


class RateStabiliser(Protocol):
    """What the autopilot needs of a stabiliser.

    Attributes:
        limits: of the tilt; may be set in flight.
    """

    limits: TiltLimit

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
        ramp_us: the climb asked for grows this long after lift-off (MPC_TKO_RAMP_T).
    """

    __slots__ = ("_armed_us", "_lifted_us", "ramp_us", "spool_up_us", "ticks")

    def __init__(self) -> None:
        self.ticks = 0
        self.spool_up_us = 0
        self.ramp_us = 0
        self._armed_us = 0
        self._lifted_us = -(10**15)

    def arm(self, time_us: int) -> None:
        """The motors may turn from now on."""
        self.ticks = 0
        self._armed_us = time_us

    def rest(self) -> None:
        """The motors stand."""
        self.ticks = 0

    def fly(self, stabiliser: RateStabiliser, state: VehicleState, command: Command) -> MotorOutput:
        """Motors for a command in the air."""
        self.ticks = 0
        if state.time_us - self._lifted_us < self.ramp_us:
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
    ) -> MotorOutput:
        """Motors for a command on the ground.

        Args:
            stabiliser: that flies.
            state: the vehicle now.
            command: of guidance.
            down_m_s: what it means vertically; below zero: up.
            may_lift: the mode flown is one that takes off.
        """
        waits = state.time_us - self._armed_us < self.spool_up_us
        if waits or not may_lift or down_m_s > -_LIFT_M_S:
            self.ticks = 0
            stabiliser.reset()
            return stabiliser.idle()
        if self.ticks == 0:
            self._lifted_us = state.time_us
        self.ticks += 1
        if self.ramp_us > 0:
            command = self._ramped(command, state.time_us)
        return stabiliser.step(state, _straight_up(command), grounded=self.ticks <= _LIFT_HELD_TICKS)

    def _ramped(self, command: Command, time_us: int) -> Command:
        """Less climb in the first moments."""
        if not isinstance(command, RateCommand):
            return command
        share = min(max((time_us - self._lifted_us) / self.ramp_us, 0.02), 1.0)
        forward_m_s, right_m_s, down_m_s = command.velocity_level_m_s
        if down_m_s >= 0.0:
            return command
        return RateCommand((forward_m_s, right_m_s, share * down_m_s), command.yaw_rate_rad_s)


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
        self.limits = TiltLimit(1.0)

    def reset(self) -> None:
        """Nothing to forget."""

    def idle(self) -> MotorOutput:
        """Not to be called."""
        raise RuntimeError("the stabiliser is not designed yet; call prepare()")

    def step(self, state: VehicleState, command: Command, *, grounded: bool = False) -> MotorOutput:
        """Not to be called."""
        raise RuntimeError("the stabiliser is not designed yet; call prepare()")
