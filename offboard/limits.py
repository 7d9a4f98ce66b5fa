"""The limits of what a mission may command, by its class."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf


@dataclass(frozen=True, slots=True)
class CommandLimits:
    """The highest rates that a mission may command, in level axes turned with the yaw; all positive.

    Attributes:
        forward_m_s: forward and backward.
        left_m_s: to the left and to the right.
        up_m_s: climb.
        down_m_s: descent.
        yaw_rate_rad_s: to either side.
        level_m_s: forward and to the side together; infinite if each axis is limited by itself.
    """

    forward_m_s: float = 1.0
    left_m_s: float = 1.0
    up_m_s: float = 1.0
    down_m_s: float = 1.0
    yaw_rate_rad_s: float = 1.0
    level_m_s: float = inf

    def level(self, forward_m_s: float, left_m_s: float) -> tuple[float, float]:
        """A level velocity within the limits; what is shortened as a whole keeps its direction.

        An infinite component becomes its axis's limit first.
        """
        forward_m_s = clamped(forward_m_s, self.forward_m_s, self.forward_m_s)
        left_m_s = clamped(left_m_s, self.left_m_s, self.left_m_s)
        speed_m_s = hypot(forward_m_s, left_m_s)
        if speed_m_s <= self.level_m_s:
            return forward_m_s, left_m_s
        scale = self.level_m_s / speed_m_s
        return scale * forward_m_s, scale * left_m_s


CONTEST = CommandLimits()
"""The class `contest`: the paper's limits, +-1 m/s on each axis and +-1 rad/s."""


def clamped(value: float, below: float, above: float) -> float:
    """The nearest value from -below to above."""
    return -below if value < -below else above if value > above else value
