"""A flight mode as an object: what it gets on entry, and what it commands each tick."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from math import atan2, hypot
from typing import ClassVar

from firmware_py.commands import ControlCommand, VelocityFrdCommand
from firmware_py.guidance.limits import SpeedLimits, clamp, level_pair, yaw_rate
from firmware_py.guidance.orbit import Orbit
from firmware_py.guidance.trajectory import Trajectory
from firmware_py.parameters import Parameters
from firmware_py.setpoints import Setpoint, TrajectorySetpoint
from firmware_py.types import ManualInput, VehicleState
from framerunner.geometry.vectors import NAN3, ZERO3, Vec3
from framerunner.vehicle.airframe import Airframe

_FACING_M = 0.5  # nearer than this, the direction of a region of interest is not used


@dataclass(slots=True)
class ModeContext:
    """What all modes share; `Guidance` updates it.

    Attributes:
        limits: speeds, accelerations and gains.
        period_s: of control.
        trajectory: of automatic modes.
        sticks: an operator's newest input.
        home_ned_m: heights of return, landing and following count from it, shape (3,).
        region_ned_m: a place to look at while flying to targets and in hold, shape (3,); None: none.
    """

    limits: SpeedLimits
    period_s: float
    trajectory: Trajectory = field(default_factory=Trajectory)
    sticks: ManualInput = field(default_factory=lambda: ManualInput(0))
    home_ned_m: Vec3 = ZERO3
    region_ned_m: Vec3 | None = None


@dataclass(frozen=True, slots=True)
class ModeEntry:
    """What a mode gets when it is entered.

    Attributes:
        previous: the mode flown until now.
        target_ned_m: where to take off to, land or return to, shape (3,); NaN: not given.
        keep_target: hold mode: continue to the present target.
        orbit: the circle to fly.
    """

    previous: Mode
    target_ned_m: Vec3 = NAN3
    keep_target: bool = False
    orbit: Orbit = field(default_factory=Orbit)


class Mode(ABC):
    """A flight mode.

    Attributes:
        builds_up_climb: on the ground it begins with a descent, from which its climb is built up.
        setpoint: followed now, for telemetry.
        target_reached: a take-off has reached its height.
    """

    builds_up_climb: ClassVar[bool] = False

    def __init__(self, context: ModeContext, airframe: Airframe, parameters: Parameters) -> None:
        self._context = context
        self.setpoint: Setpoint = TrajectorySetpoint(0)
        self.target_reached = False
        self.configure(airframe, parameters)

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply changed parameters, except for the limits; called at the start too."""
        del airframe, parameters

    @abstractmethod
    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin here."""

    @abstractmethod
    def step(self, state: VehicleState) -> ControlCommand:
        """The command of this tick."""

    def departs(self, state: VehicleState) -> bool:
        """Whether the mode flies to a place well above, for which it leaves the ground even in hold."""
        return False

    @property
    def hold_target(self) -> tuple[Vec3, float] | None:
        """Place (NED, metres) and yaw (rad) to which a hold that keeps the target continues; None: none."""
        return None


class TrajectoryMode(Mode):
    """A mode that follows a smooth trajectory."""

    _shown_ned_m = NAN3  # the target in `setpoint`

    def _start(self, state: VehicleState) -> None:
        """Start a trajectory from the present motion: brake and stay."""
        context = self._context
        context.trajectory.start(state, context.limits)

    def _fly_to_target(self, state: VehicleState) -> ControlCommand:
        context = self._context
        trajectory = context.trajectory
        velocity_ned_m_s, yaw_rad = trajectory.step(state, context.limits, context.period_s)
        if trajectory.target_ned_m is not self._shown_ned_m:
            self._show_target(state)
        if context.region_ned_m is not None:
            yaw_rad = _yaw_towards(state, context.region_ned_m, yaw_rad)
        return self._follow(state, velocity_ned_m_s, yaw_rad)

    def _descend(self, state: VehicleState) -> ControlCommand:
        """Descend over the target, slower near the ground."""
        context = self._context
        trajectory, limits = context.trajectory, context.limits
        height_m = context.home_ned_m[2] - state.position_ned_m[2]
        trajectory.drift_ned_m_s = (0.0, 0.0, limits.landing_m_s(height_m, limits.auto_down_m_s))
        velocity_ned_m_s, yaw_rad = trajectory.step(state, limits, context.period_s, height_bound=False)
        return self._follow(state, velocity_ned_m_s, yaw_rad)

    def _follow(
        self, state: VehicleState, velocity_ned_m_s: Vec3, yaw_rad: float, turn_rad_s: float = 0.0
    ) -> VelocityFrdCommand:
        """The command for a velocity, with the reference point's acceleration, and a yaw."""
        context = self._context
        limits = context.limits
        max_rad_s = limits.auto_yaw_rate_rad_s
        velocity, acceleration = level_pair(
            state, limits.clip(*velocity_ned_m_s), context.trajectory.reference.acceleration_ned_m_s2
        )
        turn_rad_s = yaw_rate(state.yaw_rad, yaw_rad, turn_rad_s, limits)
        return VelocityFrdCommand(velocity, clamp(turn_rad_s, -max_rad_s, max_rad_s), acceleration)

    def _show_target(self, state: VehicleState) -> None:
        trajectory = self._context.trajectory
        self._shown_ned_m = trajectory.target_ned_m
        self.setpoint = TrajectorySetpoint(state.time_us, trajectory.target_ned_m, yaw_rad=trajectory.yaw_rad)


def _yaw_towards(state: VehicleState, region_ned_m: Vec3, yaw_rad: float) -> float:
    """The yaw towards a place; very near to it, the given one."""
    north_m = region_ned_m[0] - state.position_ned_m[0]
    east_m = region_ned_m[1] - state.position_ned_m[1]
    return atan2(east_m, north_m) if hypot(north_m, east_m) > _FACING_M else yaw_rad
