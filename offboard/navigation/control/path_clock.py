"""Where on its path a drone is commanded to be, which moves on smoothly, also when it waits.

What is commanded now is flown after the vehicle's dead time, so a command is for the place on the path where
the vehicle will be then. Were that place to jump, the vehicle would be told to fly back what it has been told
to fly.
"""

from __future__ import annotations

from collections import deque
from math import cos, hypot, sin, sqrt

from framerunner.geometry.vectors import Vec3
from offboard.navigation.path import Path

MAX_RATE_CHANGE_PER_S = 1.5  # of the path's time
RATE_S = (0.1, 0.2)  # time constant of that rate, and its share of the lead: without it, both would swing
IN_GATE_M_S2 = 0.4  # in a gate a drone speeds up by no more than this to fly as fast as planned
BRAKE_END_S = 0.25  # in which the last of the speed is braked, so that the drone is not thrown back
WAIT_FROM_M = 0.1  # farther from the path, its time goes slower
WAIT_ASIDE_M = 0.05  # or aside from it
WAIT_M = 0.25  # beyond that, it stands still
GATE_FROM_M = 0.05  # farther from the path across a gate, the drone waits
GATE_WAIT_M = 0.06  # beyond that, the path's time stands still
_MOVING_M_S = 0.2
_TICKS = 24
_Pace = tuple[float, float]
"""How fast the path's time goes, and how fast that changes, 1/s."""


class PathClock:
    """The time along a path that is commanded; call `advance` once a tick.

    Attributes:
        ahead_s: time along the path that is commanded now,
        lead_s: which will be flown after this time.
        pace: how fast it goes, and how fast that changes.
    """

    def __init__(self, lead_s: float) -> None:
        self.ahead_s = 0.0
        self.lead_s = lead_s
        self.pace: _Pace = (1.0, 0.0)
        self._ticks: deque[tuple[float, float, _Pace]] = deque(maxlen=_TICKS)  # duration, advance, pace then

    def lead(self, lead_s: float) -> None:
        """Command for another time ahead from now on."""
        self.ahead_s += (lead_s - self.lead_s) * self.pace[0]
        self.lead_s = lead_s

    def advance(self, step_s: float, duration_s: float) -> None:
        """Go on by a tick, at most to the end of the path."""
        advance_s = min(self.pace[0] * step_s, duration_s - self.ahead_s)
        self.ahead_s += advance_s
        self._ticks.append((step_s, advance_s, self.pace))

    def in_(self, time_s: float) -> tuple[float, _Pace]:
        """Time along the path for some time from now, and its pace."""
        time_s -= self.lead_s
        at_s, pace = self.ahead_s, self.pace
        if time_s >= 0.0:
            return at_s + pace[0] * time_s, pace
        for step_s, advance_s, then in reversed(self._ticks):
            if -time_s < step_s:
                return at_s + advance_s * time_s / step_s, pace
            at_s, pace = at_s - advance_s, then
            time_s += step_s
        return at_s + pace[0] * time_s, pace

    def change(
        self, rate: float, speed_m_s: float, step_s: float, *, in_gate: bool, brake_m_s2: float
    ) -> None:
        """Let the path's time go faster or slower, but not suddenly, or brake it to a stop.

        Args:
            rate: that is wanted.
            speed_m_s: of the path.
            step_s: since the last tick.
            in_gate: a drone that speeds up now would be tilted in a gate.
            brake_m_s2: brake with this; 0 to fly on.
        """
        before, most = self.pace[0], MAX_RATE_CHANGE_PER_S * step_s
        speed_m_s = max(speed_m_s, _MOVING_M_S)
        faster = min(most, IN_GATE_M_S2 * step_s / speed_m_s) if in_gate else most
        rate = before + (rate - before) * step_s / (step_s + RATE_S[0] + RATE_S[1] * self.lead_s)
        rate = min(max(rate, before - most), before + faster)
        if brake_m_s2:
            slowing_per_s = min(brake_m_s2 / speed_m_s, before / BRAKE_END_S)
            rate = max(min(rate, before - slowing_per_s * step_s), 0.0)
        self.pace = (rate, (rate - before) / step_s if step_s else 0.0)


def rate_of(error_m: Vec3, velocity_m_s: Vec3) -> float:
    """How fast the path's time goes: slower while the drone is behind or aside, not while it is ahead."""
    speed = hypot(*velocity_m_s)
    behind_m = sum(e * v for e, v in zip(error_m, velocity_m_s, strict=True)) / speed if speed > 0.05 else 0.0
    aside_m = sqrt(max(sum(e * e for e in error_m) - behind_m * behind_m, 0.0))
    late_m = max(behind_m - WAIT_FROM_M, 0.0) + max(aside_m - WAIT_ASIDE_M, 0.0)
    return max(1.0 - late_m / WAIT_M, 0.0)


def rate_before_gate(
    path: Path, at_s: float, near_s: tuple[float, float], error_m: Vec3, unsteady_m: float
) -> float:
    """How fast the path's time may go: a drone that is not straight before a gate waits until it is.

    Args:
        path: that is followed.
        at_s: time along it.
        near_s: least and greatest time before the gate in which the drone waits.
        error_m: from the drone to the path, arena axes.
        unsteady_m: what adds to its part across the gate: for a wrong heading.
    """
    for crossing in path.crossings:
        if near_s[0] < crossing.time_s - at_s < near_s[1]:
            c, s = cos(crossing.heading_rad), sin(crossing.heading_rad)
            off_m = hypot(c * error_m[1] - s * error_m[0], error_m[2]) + unsteady_m
            return max(1.0 - max(off_m - GATE_FROM_M, 0.0) / GATE_WAIT_M, 0.0)
    return 1.0
