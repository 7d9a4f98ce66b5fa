"""What guidance gives the stabiliser: commands, from a velocity down to motor outputs, and limits.

Vectors are of shape (3,): level axes are forward, right, down and turn with the yaw; body axes are FRD. A yaw
rate is clockwise seen from above; a thrust is collective along body up, as a share of full thrust, 0..1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, tan
from typing import ClassVar

from framerunner.geometry.vectors import ZERO3, Vec3

_DESCENT_SHARE = 0.7  # of hover thrust: less means a descent


class FlightLimits:
    """Limits within which the stabiliser follows commands; they may change in flight.

    Args:
        airframe_tilt_rad: maximum for `limit_tilt`.

    Attributes:
        rate_rad_s: of roll and pitch together, where the vector law turns to an attitude.
        min_thrust: where the height is controlled, as a share of full thrust.
        max_thrust: the same.
        tilt_squared: square of the tilt limit, for small angles.
        tilt_tangent: its tangent, horizontal thrust per vertical thrust.
    """

    def __init__(self, airframe_tilt_rad: float) -> None:
        self._max_tilt_rad = airframe_tilt_rad
        self.limit_tilt(airframe_tilt_rad)
        self.rate_rad_s = inf
        self.min_thrust = 0.0
        self.max_thrust = 1.0

    def limit_tilt(self, tilt_rad: float) -> None:
        """Limit the tilt for velocities and accelerations; the airframe's limit holds as well."""
        tilt_rad = max(0.0, min(tilt_rad, self._max_tilt_rad))
        self.tilt_squared = tilt_rad**2
        self.tilt_tangent = tan(tilt_rad)


class ControlCommand:
    """A command to the stabiliser.

    Attributes:
        is_for_motors: passed on to the motors unchanged, on the ground as in the air.
        controls_climb: it holds a vertical velocity.
    """

    __slots__ = ()
    is_for_motors: ClassVar[bool] = False
    controls_climb: ClassVar[bool] = False

    def vertical_intent(self, hover_thrust: float) -> float:
        """The commanded vertical velocity, m/s down; without one, only its sign means anything.

        Args:
            hover_thrust: as a share of full thrust.
        """
        raise NotImplementedError

    def with_limited_climb(self, limit: Callable[[float], tuple[float, float]]) -> ControlCommand:
        """The same with a limited climb, if the command is a velocity.

        Args:
            limit: from the commanded vertical velocity, below zero, to the one allowed, m/s down, and its
                acceleration, m/s^2 down.
        """
        return self

    def straight_up(self) -> ControlCommand:
        """The part that may be followed while on the ground: no horizontal motion, no turn."""
        return self


@dataclass(slots=True)
class VelocityFrdCommand(ControlCommand):
    """A velocity, an acceleration as feed-forward, and a yaw rate."""

    velocity_level_m_s: Vec3 = ZERO3
    yaw_rate_rad_s: float = 0.0
    acceleration_level_m_s2: Vec3 = ZERO3
    controls_climb: ClassVar[bool] = True

    def vertical_intent(self, hover_thrust: float) -> float:
        """Its vertical velocity."""
        return self.velocity_level_m_s[2]

    def with_limited_climb(self, limit: Callable[[float], tuple[float, float]]) -> ControlCommand:
        """The same with a limited climb, and with feed-forward of that alone."""
        forward_m_s, right_m_s, down_m_s = self.velocity_level_m_s
        if down_m_s >= 0.0:
            return self
        down_m_s, down_m_s2 = limit(down_m_s)
        velocity_m_s = (forward_m_s, right_m_s, down_m_s)
        return VelocityFrdCommand(velocity_m_s, self.yaw_rate_rad_s, (0.0, 0.0, down_m_s2))

    def straight_up(self) -> ControlCommand:
        """Its vertical velocity only."""
        return VelocityFrdCommand((0.0, 0.0, self.velocity_level_m_s[2]))


@dataclass(slots=True)
class AccelerationCommand(ControlCommand):
    """An acceleration (zeros: hover) and a yaw rate; the velocity is not controlled."""

    acceleration_level_m_s2: Vec3
    yaw_rate_rad_s: float = 0.0

    def vertical_intent(self, hover_thrust: float) -> float:
        """Its vertical acceleration."""
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
        """Its vertical velocity."""
        return self.down_m_s

    def with_limited_climb(self, limit: Callable[[float], tuple[float, float]]) -> ControlCommand:
        """The same with a limited climb."""
        if self.down_m_s >= 0.0:
            return self
        down_m_s, _ = limit(self.down_m_s)
        return TiltCommand(self.roll_rad, self.pitch_rad, self.yaw_rate_rad_s, down_m_s)

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
        """Up unless the thrust is clearly less than the weight."""
        return _DESCENT_SHARE * hover_thrust - self.thrust

    def straight_up(self) -> ControlCommand:
        """Its thrust, level."""
        return AttitudeCommand(0.0, 0.0, 0.0, self.thrust)


@dataclass(slots=True)
class BodyRateCommand(ControlCommand):
    """Body rates and a thrust."""

    rate_frd_rad_s: Vec3
    thrust: float

    def vertical_intent(self, hover_thrust: float) -> float:
        """Up unless the thrust is clearly less than the weight."""
        return _DESCENT_SHARE * hover_thrust - self.thrust

    def straight_up(self) -> ControlCommand:
        """Its thrust, without rotation."""
        return BodyRateCommand(ZERO3, self.thrust)


@dataclass(slots=True)
class MotorCommand(ControlCommand):
    """Motor outputs, passed through: 0..1 of a rotor's full thrust, in the airframe's order."""

    outputs: tuple[float, ...]
    is_for_motors: ClassVar[bool] = True

    def vertical_intent(self, hover_thrust: float) -> float:
        """Up as soon as a motor turns."""
        return -1.0 if max(self.outputs, default=0.0) > 0.0 else 1.0
