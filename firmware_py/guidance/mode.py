"""A flight mode as an object: what it is told on entry, and what it asks of the stabiliser each tick."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from math import atan2, hypot
from typing import ClassVar

from firmware_py.airframe import Airframe
from firmware_py.commands import ControlCommand, VelocityCommand
from firmware_py.guidance.limits import SpeedLimits, clamp, level_pair, yaw_rate
from firmware_py.guidance.orbit import Orbit
from firmware_py.guidance.travel import Traveller
from firmware_py.parameters import Parameters
from firmware_py.setpoints import Setpoint, TrajectorySetpoint
from firmware_py.types import ManualInput, VehicleState
from geometry.vectors import NAN3, ZERO3, Vec3

_FACING_M = 0.5  # nearer than this, a region of interest says nothing about where to look
_RAMP_FROM_M_S = -2.45  # PX4's: without thrust, g over its velocity gain
_WOUND_UP_M_S = 0.95  # fitted to heights of x500 flights: PX4's velocity loop winds up during the ramp
_CATCHING_UP = 1.2  # of MPC_Z_V_AUTO_UP: what PX4 leaves modes that fly by themselves


@dataclass(frozen=True, slots=True)
class ClimbRamp:
    """What climb is allowed while taking off, m/s; as PX4's, it leads to a limit and not to the climb wanted.

    Attributes:
        from_m_s: at its beginning; below zero.
        to_m_s: at its end, after MPC_TKO_RAMP_T.
    """

    from_m_s: float
    to_m_s: float


@dataclass(slots=True)
class ModeContext:
    """What all modes share; `Guidance` keeps it up to date.

    Attributes:
        limits: speeds, accelerations and gains.
        period_s: of control.
        traveller: the point that modes lead which fly by themselves.
        sticks: a pilot's newest input.
        home_ned_m: heights of return, landing and following count from it, shape (3,).
        region_ned_m: a place to look at on journeys and in hold, shape (3,); None: none.
    """

    limits: SpeedLimits
    period_s: float
    traveller: Traveller = field(default_factory=Traveller)
    sticks: ManualInput = field(default_factory=lambda: ManualInput(0))
    home_ned_m: Vec3 = ZERO3
    region_ned_m: Vec3 | None = None


@dataclass(frozen=True, slots=True)
class ModeEntry:
    """What a mode is told when it is entered.

    Attributes:
        previous: the mode flown until now.
        target_ned_m: where to take off to, land or return to, shape (3,); NaN: open.
        keep_target: hold: go on to the present target.
        orbit: the circle to fly.
    """

    previous: Mode
    target_ned_m: Vec3 = NAN3
    keep_target: bool = False
    orbit: Orbit = field(default_factory=Orbit)


class Mode(ABC):
    """One way to fly.

    Args:
        context: shared by all modes.
        airframe: what flies.
        parameters: see `configure`.

    Attributes:
        takes_off: it leaves the ground by itself.
        setpoint: what is followed, for telemetry.
        target_reached: a take-off is at its height.
    """

    takes_off: ClassVar[bool] = False

    def __init__(self, context: ModeContext, airframe: Airframe, parameters: Parameters) -> None:
        self._context = context
        self.setpoint: Setpoint = TrajectorySetpoint(0)
        self.target_reached = False
        self.configure(airframe, parameters)

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Take over changed parameters, beside the limits; at the start too."""
        del airframe, parameters

    @abstractmethod
    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin here."""

    @abstractmethod
    def step(self, state: VehicleState) -> ControlCommand:
        """What the stabiliser has to follow in this tick."""

    def departs(self, state: VehicleState) -> bool:
        """Whether it is on the way to a place well above it: then it leaves the ground even from hold."""
        del state
        return False

    @property
    def climb_ramp(self) -> ClimbRamp:
        """How the climb of a take-off grows in this mode."""
        limits = self._context.limits
        if self.takes_off:
            return ClimbRamp(_RAMP_FROM_M_S, _CATCHING_UP * limits.auto_up_m_s)
        return ClimbRamp(_RAMP_FROM_M_S - _WOUND_UP_M_S, limits.up_m_s)

    @property
    def hold_target(self) -> tuple[Vec3, float] | None:
        """Place (NED, metres) and yaw (rad) that a hold which keeps the target goes on to; None: its own."""
        return None


class JourneyMode(Mode):
    """A mode that leads a point which moves smoothly, and follows it; the stabiliser does the rest."""

    _shown_ned_m = NAN3  # the target that `setpoint` tells

    def _begin(self, state: VehicleState) -> None:
        """Lead the point another way, from the velocity there is."""
        context = self._context
        context.traveller.start(state, context.limits)

    def _travel(self, state: VehicleState) -> ControlCommand:
        """Go on to the traveller's target."""
        context = self._context
        traveller = context.traveller
        velocity_ned_m_s, yaw_rad = traveller.step(state, context.limits, context.period_s)
        if traveller.target_ned_m is not self._shown_ned_m:
            self._show_journey(state)
        if context.region_ned_m is not None:
            yaw_rad = _facing(state, context.region_ned_m, yaw_rad)
        return self._chase(state, velocity_ned_m_s, yaw_rad)

    def _sink(self, state: VehicleState) -> ControlCommand:
        """Descend at the traveller's target, slower near the ground."""
        context = self._context
        traveller, limits = context.traveller, context.limits
        height_m = context.home_ned_m[2] - state.position_ned_m[2]
        traveller.drift_ned_m_s = (0.0, 0.0, limits.landing_m_s(height_m, limits.auto_down_m_s))
        velocity_ned_m_s, yaw_rad = traveller.step(state, limits, context.period_s, height_bound=False)
        return self._chase(state, velocity_ned_m_s, yaw_rad)

    def _chase(
        self, state: VehicleState, velocity_ned_m_s: Vec3, yaw_rad: float, turn_rad_s: float = 0.0
    ) -> VelocityCommand:
        """Follow the point: limited velocity, its acceleration, and a turn that is not hasty."""
        context = self._context
        limits = context.limits
        max_rad_s = limits.auto_yaw_rate_rad_s
        velocity, acceleration = level_pair(
            state, limits.clip(*velocity_ned_m_s), context.traveller.reference.acceleration_ned_m_s2
        )
        turn_rad_s = yaw_rate(state.yaw_rad, yaw_rad, turn_rad_s, limits)
        return VelocityCommand(velocity, clamp(turn_rad_s, -max_rad_s, max_rad_s), acceleration)

    def _show_journey(self, state: VehicleState) -> None:
        traveller = self._context.traveller
        self._shown_ned_m = traveller.target_ned_m
        self.setpoint = TrajectorySetpoint(state.time_us, traveller.target_ned_m, yaw_rad=traveller.yaw_rad)


def _facing(state: VehicleState, region_ned_m: Vec3, yaw_rad: float) -> float:
    """The yaw that looks at a place; too near to it, the one given."""
    north_m = region_ned_m[0] - state.position_ned_m[0]
    east_m = region_ned_m[1] - state.position_ned_m[1]
    return atan2(east_m, north_m) if hypot(north_m, east_m) > _FACING_M else yaw_rad
