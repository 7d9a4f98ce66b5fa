"""What the gimbal's services need of a gimbal."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import Protocol

GIMBAL_COMPONENT_ID = 154  # MAV_COMP_ID_GIMBAL


@dataclass(frozen=True, slots=True)
class GimbalLimits:
    """Angles that it reaches: pitch to the horizon, yaw to the vehicle's heading, clockwise from above."""

    pitch_min_rad: float
    pitch_max_rad: float
    yaw_max_rad: float  # to either side

    @property
    def ranges_rad(self) -> tuple[float, float, float, float]:
        """Least and greatest pitch, least and greatest yaw."""
        return self.pitch_min_rad, self.pitch_max_rad, -self.yaw_max_rad, self.yaw_max_rad


@dataclass(frozen=True, slots=True)
class GimbalTarget:
    """Where a gimbal is to point; NaN: not given. An axis with neither angle nor rate stays as it is.

    Attributes:
        pitch_rad: to the horizon, up is positive.
        yaw_rad: to north if the yaw is locked, else to the vehicle's heading; clockwise from above.
        pitch_rate_rad_s: turned at without an angle.
        yaw_rate_rad_s: turned at without an angle.
        yaw_locked: whether the yaw stays to north when the vehicle turns.
    """

    pitch_rad: float = nan
    yaw_rad: float = nan
    pitch_rate_rad_s: float = nan
    yaw_rate_rad_s: float = nan
    yaw_locked: bool = False


class GimbalDevice(Protocol):
    """A gimbal; its roll is always level."""

    @property
    def limits(self) -> GimbalLimits:
        """What it reaches."""

    @property
    def pitch_rad(self) -> float:
        """To the horizon, up is positive."""

    @property
    def yaw_rad(self) -> float:
        """To the vehicle's heading, clockwise from above."""

    @property
    def pitch_rate_rad_s(self) -> float:
        """Of `pitch_rad`."""

    @property
    def yaw_rate_rad_s(self) -> float:
        """Of its turning to another angle; not of the vehicle's turning."""

    @property
    def yaw_locked(self) -> bool:
        """Whether the yaw stays to north when the vehicle turns."""

    def turn(self, target: GimbalTarget) -> None:
        """Take a new target; angles beyond the limits are limited."""
