"""A planned path: where to be at which time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import pi, remainder

from geometry.vectors import Vec3
from offboard.navigation.goals import Gate, Motion

_Step = tuple[float, float]
"""Its duration, and the share of it that has passed."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """A gate on a path.

    Attributes:
        gate: the goal.
        heading_rad: in which it is crossed.
        time_s: when, since the path's start.
        left_s: when the straight flight behind it ends; from then on the gate is no goal any more.
    """

    gate: Gate
    heading_rad: float
    time_s: float
    left_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Motions at knots, with cubic positions and linear accelerations between them.

    Attributes:
        times_s: of the knots, from 0 on, increasing.
        knots: x, y, z, their velocities, their accelerations, yaw (continuous, maybe beyond pi), its rate.
        crossings: the gates, in order.
    """

    times_s: list[float]
    knots: list[list[float]]
    crossings: tuple[Crossing, ...]

    @property
    def duration_s(self) -> float:
        """Time from start to end."""
        return self.times_s[-1]

    @property
    def gate_times_s(self) -> tuple[float, ...]:
        """When each gate is crossed, since the start."""
        return tuple(crossing.time_s for crossing in self.crossings)

    def at(self, time_s: float) -> Motion:
        """The motion at a time since the start; before and after the path, that of its start and end."""
        times = self.times_s
        time_s = min(max(time_s, 0.0), times[-1])
        index = min(bisect_right(times, time_s), len(times) - 1) - 1
        a, b = self.knots[index], self.knots[index + 1]
        step_s = times[index + 1] - times[index]
        share = (time_s - times[index]) / step_s
        step = (step_s, share)
        x, vx = _cubic(a[0], a[3], b[0], b[3], step)
        y, vy = _cubic(a[1], a[4], b[1], b[4], step)
        z, vz = _cubic(a[2], a[5], b[2], b[5], step)
        yaw, rate = _cubic(a[9], a[10], b[9], b[10], step)
        ax, ay, az = (a[i] + share * (b[i] - a[i]) for i in (6, 7, 8))
        return Motion((x, y, z), (vx, vy, vz), remainder(yaw, 2 * pi), rate, (ax, ay, az))

    def gates_left(self, time_s: float) -> int:
        """How many gates have been crossed and left behind at a time: a new plan leaves them out."""
        return sum(crossing.left_s <= time_s for crossing in self.crossings)

    def points(self) -> list[Vec3]:
        """The positions of all knots, for displays."""
        return [(knot[0], knot[1], knot[2]) for knot in self.knots]


def _cubic(start: float, start_rate: float, end: float, end_rate: float, step: _Step) -> tuple[float, float]:
    """Value and rate of the cubic with given ends (Hermite) within a step."""
    step_s, u = step
    w = 1.0 - u
    first = w * w * ((1.0 + 2.0 * u) * start + u * step_s * start_rate)
    second = u * u * ((1.0 + 2.0 * w) * end - w * step_s * end_rate)
    slopes = w * (w - 2.0 * u) * start_rate + u * (u - 2.0 * w) * end_rate
    return first + second, 6.0 * u * w * (end - start) / step_s + slopes
