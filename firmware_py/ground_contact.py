"""Between ground and air: whether the vehicle stands on something, and how the motors take it off the ground.

Without a range finder the ground shows itself by what the vehicle does not do: told to descend, with
little thrust, it stays where it is. The same signs as PX4's multicopter land detector, with shorter
times because the vehicle is light and its state clean.
"""

from __future__ import annotations

from math import hypot, inf, radians
from typing import TYPE_CHECKING

from firmware_py.commands import ControlCommand
from firmware_py.guidance.mode import ClimbRamp
from firmware_py.parameters import Parameters
from firmware_py.types import MotorOutput, VehicleState

if TYPE_CHECKING:
    from firmware_py.control.stabiliser import Stabiliser  # it imports SciPy

_FALL_US = 100_000  # unasked motion longer than this is not standing
_MOVING_M_S = 0.3  # while it stands
_DESCENT_COMMAND_M_S = 0.05
_DESCENT_SHARE = 0.3  # less than this share of the commanded descent is "not descending"
_LOW_THRUST_SHARE = 0.9  # of hover; slow descent in the air needs nearly all of it
_LIFTED_SPEED_M_S = 0.1
_LIFTED_HEIGHT_M = 0.03
_MIN_CLIMB_SHARE = 0.02  # of the climb wanted, whatever the ramp says, once it works to leave the ground
_LIFT_M_S = 0.04  # asked to climb faster than this, it leaves the ground
_LIFT_HELD_TICKS = 125  # half a second: integrals rest while the contact still carries the weight


class LandDetector:
    """Follows the vehicle from ground to air and back.

    Attributes:
        landed: whether it stands on something.
        trigger_us: the signs of ground must hold this long (LNDMC_TRIG_TIME).
        vertical_m_s: standing means less (LNDMC_Z_VEL_MAX).
        level_m_s: standing means less (LNDMC_XY_VEL_MAX).
        turning_rad_s: of roll and pitch; standing means less (LNDMC_ROT_MAX).
    """

    __slots__ = (
        "_hover_throttle",
        "_last_still_us",
        "_last_unlike_us",
        "_stand_down_m",
        "landed",
        "level_m_s",
        "trigger_us",
        "turning_rad_s",
        "vertical_m_s",
    )

    def __init__(self, hover_throttle: float) -> None:
        """Start on the ground.

        Args:
            hover_throttle: mean squared share of rotor speed that carries the weight, 0..1.
        """
        self.landed = True
        self.trigger_us = 300_000
        self.vertical_m_s = self.level_m_s = _MOVING_M_S
        self.turning_rad_s = inf
        self._hover_throttle = hover_throttle
        self._stand_down_m = 0.0
        self._last_still_us = 0
        self._last_unlike_us = 0

    def configure(self, parameters: Parameters) -> None:
        """Take over changed parameters."""
        value = parameters.value
        self.trigger_us = round(value("LNDMC_TRIG_TIME") * 1e6)
        self.vertical_m_s = value("LNDMC_Z_VEL_MAX")
        self.level_m_s = value("LNDMC_XY_VEL_MAX")
        self.turning_rad_s = radians(value("LNDMC_ROT_MAX"))

    def update(
        self, state: VehicleState, *, armed: bool, lifting: bool, command_down_m_s: float, throttle: float
    ) -> bool:
        """Take one tick, and say whether the vehicle stands on something.

        Args:
            state: the vehicle now.
            armed: motors may turn.
            lifting: the motors work to leave the ground.
            command_down_m_s: vertical speed now asked of the stabiliser, positive down.
            throttle: mean squared share of rotor speed, 0..1.
        """
        if self.landed:
            self._watch_for_air(state, lifting)
        elif armed and command_down_m_s <= _DESCENT_COMMAND_M_S:
            self._last_unlike_us = state.time_us
        else:
            self._watch_for_ground(state, armed, command_down_m_s, throttle)
        return self.landed

    def _watch_for_air(self, state: VehicleState, lifting: bool) -> None:
        down_m = state.position_ned_m[2]
        climb_m_s = -state.velocity_ned_m_s[2]
        if not lifting:
            self._stand_down_m = down_m
            if abs(climb_m_s) < _MOVING_M_S:
                self._last_still_us = state.time_us
            left = state.time_us - self._last_still_us > _FALL_US
        else:
            self._last_still_us = state.time_us
            left = climb_m_s > _LIFTED_SPEED_M_S or self._stand_down_m - down_m > _LIFTED_HEIGHT_M
        if left:
            self.landed = False
            self._last_unlike_us = state.time_us

    def _watch_for_ground(
        self, state: VehicleState, armed: bool, command_down_m_s: float, throttle: float
    ) -> None:
        north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
        roll_rad_s, pitch_rad_s, _ = state.angular_rate_frd_rad_s
        like_ground = (
            abs(down_m_s) < self.vertical_m_s
            and hypot(north_m_s, east_m_s) < self.level_m_s
            and hypot(roll_rad_s, pitch_rad_s) < self.turning_rad_s
            and (
                not armed
                or (
                    down_m_s < _DESCENT_SHARE * command_down_m_s
                    and throttle < _LOW_THRUST_SHARE * self._hover_throttle
                )
            )
        )
        if not like_ground:
            self._last_unlike_us = state.time_us
        elif state.time_us - self._last_unlike_us > self.trigger_us:
            self.landed = True
            self._stand_down_m = state.position_ned_m[2]
            self._last_still_us = state.time_us


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

    def fly(self, stabiliser: Stabiliser, state: VehicleState, command: ControlCommand) -> MotorOutput:
        """Motors for a command in the air."""
        self.ticks = 0
        self._wanted = False
        if state.time_us - self._ramp_start_us < self.ramp_us:
            command = self._ramped(command, state.time_us)
        return stabiliser.step(state, command)

    def stand(
        self,
        stabiliser: Stabiliser,
        state: VehicleState,
        command: ControlCommand,
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
        ramped = command.controls_climb and self.ramp_us > 0
        if not self._lifts(state.time_us, down_m_s, may_lift=may_lift, ramped=ramped):
            self.ticks = 0
            stabiliser.reset()
            return stabiliser.idle()
        self.ticks += 1
        if self.ramp_us > 0:
            command = self._ramped(command, state.time_us)
        return stabiliser.step(state, command.straight_up(), grounded=self.ticks <= _LIFT_HELD_TICKS)

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

    def _ramped(self, command: ControlCommand, time_us: int) -> ControlCommand:
        """Less climb in the first moments."""
        return command.with_limited_climb(
            lambda down_m_s: min(self._ramp(down_m_s, time_us), _MIN_CLIMB_SHARE * down_m_s)
        )
