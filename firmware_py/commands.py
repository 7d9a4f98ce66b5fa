"""What guidance can tell the stabiliser: the kinds of command, from a velocity down to the motors' outputs.

Vectors are of shape (3,): level axes are forward, right, down and turn with the yaw; body axes are FRD. A yaw
rate is clockwise seen from above; a thrust is collective along body up, as a share of the greatest, 0..1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from geometry.vectors import ZERO3, Vec3

_DESCENT_SHARE = 0.7  # less than this share of the thrust that carries the weight means to go down


class ControlCommand:
    """What a stabiliser can be told.

    Attributes:
        is_for_motors: the motors get it unchanged, on the ground as in the air.
        controls_climb: it holds a vertical velocity.
    """

    __slots__ = ()
    is_for_motors: ClassVar[bool] = False
    controls_climb: ClassVar[bool] = False

    def vertical_intent(self, hover_thrust: float) -> float:
        """The vertical velocity it asks for in m/s; else only the sign counts. Below zero is up.

        Args:
            hover_thrust: what carries the weight, as a share of the greatest thrust.
        """
        raise NotImplementedError

    def with_limited_climb(self, limit: Callable[[float], float]) -> ControlCommand:
        """The same with another climb, if it climbs by a velocity.

        Args:
            limit: from the vertical velocity asked for, below zero, to the one allowed, m/s.
        """
        del limit
        return self

    def straight_up(self) -> ControlCommand:
        """What of it may be followed while the ground still touches: nothing sideways, no turn."""
        return self


@dataclass(slots=True)
class VelocityCommand(ControlCommand):
    """A velocity with an acceleration as feed-forward, and a yaw rate."""

    velocity_level_m_s: Vec3 = ZERO3
    yaw_rate_rad_s: float = 0.0
    acceleration_level_m_s2: Vec3 = ZERO3
    controls_climb: ClassVar[bool] = True

    def vertical_intent(self, hover_thrust: float) -> float:
        """The velocity downwards, m/s."""
        return self.velocity_level_m_s[2]

    def with_limited_climb(self, limit: Callable[[float], float]) -> ControlCommand:
        """The same with another climb and without feed-forward."""
        forward_m_s, right_m_s, down_m_s = self.velocity_level_m_s
        if down_m_s >= 0.0:
            return self
        return VelocityCommand((forward_m_s, right_m_s, limit(down_m_s)), self.yaw_rate_rad_s)

    def straight_up(self) -> ControlCommand:
        """Its vertical velocity only."""
        return VelocityCommand((0.0, 0.0, self.velocity_level_m_s[2]))


@dataclass(slots=True)
class AccelerationCommand(ControlCommand):
    """An acceleration (zeros hover) and a yaw rate; the velocity is left to whoever commands it."""

    acceleration_level_m_s2: Vec3
    yaw_rate_rad_s: float = 0.0

    def vertical_intent(self, hover_thrust: float) -> float:
        """The sign of the acceleration downwards."""
        return self.acceleration_level_m_s2[2]

    def straight_up(self) -> ControlCommand:
        """Its vertical acceleration only."""
        return AccelerationCommand((0.0, 0.0, self.acceleration_level_m_s2[2]))


@dataclass(slots=True)
class TiltCommand(ControlCommand):
    """A tilt (right side down, nose up), a yaw rate and a vertical velocity."""

    roll_rad: float
    pitch_rad: float
    yaw_rate_rad_s: float = 0.0
    down_m_s: float = 0.0
    controls_climb: ClassVar[bool] = True

    def vertical_intent(self, hover_thrust: float) -> float:
        """The velocity downwards, m/s."""
        return self.down_m_s

    def with_limited_climb(self, limit: Callable[[float], float]) -> ControlCommand:
        """The same with another climb."""
        if self.down_m_s >= 0.0:
            return self
        return TiltCommand(self.roll_rad, self.pitch_rad, self.yaw_rate_rad_s, limit(self.down_m_s))

    def straight_up(self) -> ControlCommand:
        """Its vertical velocity, level."""
        return TiltCommand(0.0, 0.0, 0.0, self.down_m_s)


@dataclass(slots=True)
class AttitudeCommand(ControlCommand):
    """A tilt (right side down, nose up), a yaw rate and a thrust."""

    roll_rad: float
    pitch_rad: float
    yaw_rate_rad_s: float
    thrust: float

    def vertical_intent(self, hover_thrust: float) -> float:
        """The sign: up unless the thrust is clearly less than the weight."""
        return _DESCENT_SHARE * hover_thrust - self.thrust

    def straight_up(self) -> ControlCommand:
        """Its thrust, level."""
        return AttitudeCommand(0.0, 0.0, 0.0, self.thrust)


@dataclass(slots=True)
class BodyRateCommand(ControlCommand):
    """Roll, pitch and yaw rate, and a thrust."""

    rate_frd_rad_s: Vec3
    thrust: float

    def vertical_intent(self, hover_thrust: float) -> float:
        """The sign: up unless the thrust is clearly less than the weight."""
        return _DESCENT_SHARE * hover_thrust - self.thrust

    def straight_up(self) -> ControlCommand:
        """Its thrust, without turning."""
        return BodyRateCommand(ZERO3, self.thrust)


@dataclass(slots=True)
class MotorCommand(ControlCommand):
    """Outputs of the motors, passed through: 0..1 of a rotor's full thrust, in the airframe's order."""

    outputs: tuple[float, ...]
    is_for_motors: ClassVar[bool] = True

    def vertical_intent(self, hover_thrust: float) -> float:
        """The sign: up as soon as a motor turns."""
        return -1.0 if max(self.outputs, default=0.0) > 0.0 else 1.0
