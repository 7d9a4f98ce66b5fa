"""Contact with the ground: detection of take-off and landing, and the motors' output before and at lift-off.

Without a range finder the ground is detected by motion: with a descent commanded and little thrust, the
vehicle does not move. The conditions are those of PX4's multicopter land detector, with shorter times
because the vehicle is light and its state without noise.
"""

from __future__ import annotations

from math import hypot, inf, radians

from firmware_py.commands import ControlCommand
from firmware_py.guidance.limits import SpeedLimits
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from framerunner.vehicle.airframe import GRAVITY_M_S2, Airframe

_FALL_US = 100_000  # longer vertical motion without lift-off means that the vehicle is in the air
_MOVING_M_S = 0.3  # on the ground
_DESCENT_COMMAND_M_S = 0.05
_DESCENT_SHARE = 0.3  # less than this share of the commanded descent is "not descending"
_LOW_THRUST_SHARE = 0.9  # of hover; slow descent in the air needs nearly all of it
_LIFTED_SPEED_M_S = 0.1
_LIFTED_HEIGHT_M = 0.03
_MIN_CLIMB_SHARE = 0.02  # of the commanded climb, also where the ramp allows less
_LIFT_M_S = 0.04  # a commanded climb above this starts a lift-off
_LIFT_HELD_TICKS = 125  # half a second in which integrals are held: the ground may carry the weight
_GAIN_1_S, _INTEGRAL_GAIN_1_S2 = 4.0, 2.0  # PX4's defaults of MPC_Z_VEL_P_ACC and MPC_Z_VEL_I_ACC
_FIRST_CLIMB_M_S = -0.7  # of PX4's trajectory on the ground


class LandDetector:
    """Detects take-off and landing.

    Attributes:
        landed: whether the vehicle is on the ground.
        trigger_us: the conditions must hold this long (LNDMC_TRIG_TIME).
        vertical_m_s: maximum vertical speed on the ground (LNDMC_Z_VEL_MAX).
        level_m_s: maximum horizontal speed (LNDMC_XY_VEL_MAX).
        turning_rad_s: maximum rate of roll and pitch (LNDMC_ROT_MAX).
    """

    def __init__(self, hover_throttle: float) -> None:
        """Start on the ground.

        Args:
            hover_throttle: mean of (rotor speed / maximum)^2 at hover, 0..1.
        """
        self.landed = True
        self.trigger_us = 300_000
        self.vertical_m_s = self.level_m_s = _MOVING_M_S
        self.turning_rad_s = inf
        self._hover_throttle = hover_throttle
        self._ground_down_m = 0.0
        self._last_still_us = 0
        self._last_not_ground_us = 0

    def configure(self, parameters: Parameters) -> None:
        """Apply changed parameters."""
        value = parameters.value
        self.trigger_us = round(value("LNDMC_TRIG_TIME") * 1e6)
        self.vertical_m_s = value("LNDMC_Z_VEL_MAX")
        self.level_m_s = value("LNDMC_XY_VEL_MAX")
        self.turning_rad_s = radians(value("LNDMC_ROT_MAX"))

    def update(
        self,
        state: VehicleState,
        *,
        armed: bool,
        lifting: bool,
        command_down_m_s: float,
        throttle: float,
        has_position: bool = True,
    ) -> bool:
        """Take one tick; return whether the vehicle is on the ground.

        Args:
            state: of the vehicle now.
            armed: motors may turn.
            lifting: a lift-off has begun.
            command_down_m_s: commanded vertical velocity, positive down.
            throttle: mean of (rotor speed / maximum)^2, 0..1.
            has_position: the horizontal velocity is known; without a position it drifts, also on the ground.
        """
        if self.landed:
            self._watch_for_air(state, lifting)
        elif armed and command_down_m_s <= _DESCENT_COMMAND_M_S:
            self._last_not_ground_us = state.time_us
        else:
            self._watch_for_ground(state, armed, command_down_m_s, throttle, has_position)
        return self.landed

    def _watch_for_air(self, state: VehicleState, lifting: bool) -> None:
        down_m = state.position_ned_m[2]
        climb_m_s = -state.velocity_ned_m_s[2]
        if not lifting:
            self._ground_down_m = down_m
            if abs(climb_m_s) < _MOVING_M_S:
                self._last_still_us = state.time_us
            left = state.time_us - self._last_still_us > _FALL_US
        else:
            self._last_still_us = state.time_us
            left = climb_m_s > _LIFTED_SPEED_M_S or self._ground_down_m - down_m > _LIFTED_HEIGHT_M
        if left:
            self.landed = False
            self._last_not_ground_us = state.time_us

    def _watch_for_ground(
        self,
        state: VehicleState,
        armed: bool,
        command_down_m_s: float,
        throttle: float,
        has_position: bool,
    ) -> None:
        north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
        roll_rad_s, pitch_rad_s, _ = state.angular_rate_frd_rad_s
        is_ground = (
            abs(down_m_s) < self.vertical_m_s
            and (hypot(north_m_s, east_m_s) < self.level_m_s or not has_position)
            and hypot(roll_rad_s, pitch_rad_s) < self.turning_rad_s
            and (
                not armed
                or (
                    down_m_s < _DESCENT_SHARE * command_down_m_s
                    and throttle < _LOW_THRUST_SHARE * self._hover_throttle
                )
            )
        )
        if not is_ground:
            self._last_not_ground_us = state.time_us
        elif state.time_us - self._last_not_ground_us > self.trigger_us:
            self.landed = True
            self._ground_down_m = state.position_ned_m[2]
            self._last_still_us = state.time_us


class _ClimbRamp:
    """The climb during a take-off, as PX4's vertical velocity loop answers to its ramp.

    The loop's setpoint is limited, at first to a descent at which it gives no thrust; over the ramp the limit
    rises to the maximum climb. Meanwhile the integral winds up below zero, so the vehicle lifts off later
    than the limit allows a climb, and climbs slowly at first (PX4 v1.17, mc_pos_control: Takeoff.cpp and
    PositionControl.cpp, at the default gains).

    Attributes:
        climb_m_s: allowed now; zero until it lifts.
        climb_m_s2: its acceleration.
        running: the climb commanded is not reached yet.
    """

    def __init__(self) -> None:
        self.running = False
        self.climb_m_s = self.climb_m_s2 = self._integral_m_s2 = 0.0
        self._time_us = 0

    def start(self, time_us: int) -> None:
        """Begin on the ground."""
        self.running = True
        self.climb_m_s = self._integral_m_s2 = 0.0
        self._time_us = time_us

    def step(self, time_us: int, climb_m_s: float, *, share: float, max_m_s: float) -> None:
        """Take one tick.

        Args:
            time_us: now.
            climb_m_s: commanded.
            share: of the ramp that has passed, 0..1.
            max_m_s: the limit at its end.
        """
        period_s = (time_us - self._time_us) / 1e6
        self._time_us = time_us
        least_m_s = -GRAVITY_M_S2 / _GAIN_1_S
        error_m_s = min(climb_m_s, least_m_s + share * (max_m_s - least_m_s)) - self.climb_m_s
        climb_m_s2 = max(_GAIN_1_S * error_m_s + self._integral_m_s2, -GRAVITY_M_S2)
        if climb_m_s2 > -GRAVITY_M_S2 or error_m_s > 0.0:
            self._integral_m_s2 += _INTEGRAL_GAIN_1_S2 * error_m_s * period_s
        self.climb_m_s = max(0.0, self.climb_m_s + climb_m_s2 * period_s)
        self.climb_m_s2 = climb_m_s2 if self.climb_m_s > 0.0 else 0.0
        self.running = share < 1.0 or self.climb_m_s < climb_m_s


class LiftOff:
    """Limits commands on the ground and at lift-off.

    Attributes:
        ticks: since the lift-off began; 0: the motors idle.
        spool_up_us: motors idle this long after arming (COM_SPOOLUP_TIME).
        ramp_us: duration of the climb ramp since a climb is commanded (MPC_TKO_RAMP_T).
    """

    def __init__(self) -> None:
        self.ticks = 0
        self.spool_up_us = 0
        self.ramp_us = 0
        self._ramp = _ClimbRamp()
        self._max_climb_m_s = self._build_up_m_s2 = 0.0
        self._builds_up = False
        self._armed_us = 0
        self._wanted = False  # a lift-off
        self._ramp_start_us = 0

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply changed parameters."""
        limits = SpeedLimits(airframe, parameters)
        self._max_climb_m_s, self._build_up_m_s2 = limits.up_m_s, limits.takeoff_m_s2
        self.spool_up_us = round(parameters.value("COM_SPOOLUP_TIME") * 1e6)
        self.ramp_us = round(parameters.value("MPC_TKO_RAMP_T") * 1e6)

    def arm(self, time_us: int) -> None:
        """Begin after arming."""
        self.rest()
        self._wanted = False
        self._armed_us = time_us

    def rest(self) -> None:
        """The motors are stopped."""
        self.ticks = 0
        self._ramp.running = False

    def in_air(self, command: ControlCommand, time_us: int) -> ControlCommand:
        """The command to follow in the air: after a lift-off it is limited by the ramp."""
        self.ticks = 0
        self._wanted = False
        return self._ramped(command, time_us) if self._ramp.running else command

    def on_ground(
        self,
        command: ControlCommand,
        time_us: int,
        down_m_s: float,
        *,
        may_lift: bool,
        builds_up_climb: bool,
    ) -> ControlCommand | None:
        """The command to follow on the ground; None: the motors idle.

        Args:
            command: of guidance.
            time_us: vehicle time.
            down_m_s: its vertical velocity; below zero: up.
            may_lift: the mode may leave the ground.
            builds_up_climb: see `Mode`.
        """
        self._builds_up = builds_up_climb
        if not self._lifts(time_us, down_m_s, may_lift=may_lift):
            self.rest()
            return None
        command = command.straight_up()
        if command.controls_climb and self._ramp.running:
            command = self._ramped(command, time_us)
            if self.ticks == 0 and self._ramp.climb_m_s == 0.0:
                return None
        self.ticks += 1
        return command

    @property
    def is_held(self) -> bool:
        """Whether the ground may still carry the weight, so that integrals are held."""
        return self.ticks <= _LIFT_HELD_TICKS

    def _lifts(self, time_us: int, down_m_s: float, *, may_lift: bool) -> bool:
        """Whether a climb is commanded that may leave the ground, possibly after a ramp."""
        if time_us - self._armed_us < self.spool_up_us or not may_lift or down_m_s > -_LIFT_M_S:
            self._wanted = False
            return False
        if not self._wanted:
            self._wanted = True
            self._ramp_start_us = time_us
            if self.ramp_us > 0:
                self._ramp.start(time_us)
        return True

    def _ramped(self, command: ControlCommand, time_us: int) -> ControlCommand:
        """The command with the climb that the ramp allows."""
        limited = command.with_limited_climb(lambda down_m_s: self._allowed(down_m_s, time_us))
        if limited is command:  # it does not climb
            self._ramp.running = False
        return limited

    def _allowed(self, down_m_s: float, time_us: int) -> tuple[float, float]:
        """The vertical velocity that is allowed for a commanded one, and its acceleration; below zero: up."""
        since_us, climb_m_s = time_us - self._ramp_start_us, -down_m_s
        if self._builds_up:
            climb_m_s = min(climb_m_s, _FIRST_CLIMB_M_S + self._build_up_m_s2 * since_us / 1e6)
        share = min(since_us / self.ramp_us, 1.0) if self.ramp_us > 0 else 1.0
        self._ramp.step(time_us, climb_m_s, share=share, max_m_s=self._max_climb_m_s)
        return min(-self._ramp.climb_m_s, _MIN_CLIMB_SHARE * down_m_s), -self._ramp.climb_m_s2
