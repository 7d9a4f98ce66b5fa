"""A planned path: where to be at which time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import cached_property
from math import dist, pi, remainder

from framerunner.geometry.vectors import Vec3
from offboard.navigation.goals import Motion, PathGate

_SHORTEST_S = 0.005  # knots are not nearer to each other than this
_SAME_GATE_M = 0.3


@dataclass(frozen=True, slots=True)
class Crossing:
    """A gate on a path.

    Attributes:
        gate: the goal.
        heading_rad: in which it is crossed.
        time_s: when, since the path's start.
    """

    gate: PathGate
    heading_rad: float
    time_s: float

    def moved(self, by_s: float) -> Crossing:
        """The same crossing on a path that began earlier by a time."""
        return replace(self, time_s=self.time_s + by_s)


@dataclass(frozen=True, eq=False)
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

    def at(self, time_s: float) -> Motion:
        """The motion at a time since the start; before and after the path, that of its start and end."""
        (x, y, z, vx, vy, vz, ax, ay, az, yaw, rate), turn = self._between(time_s)
        return Motion((x, y, z), (vx, vy, vz), remainder(yaw, 2 * pi), rate, (ax, ay, az), turn)

    def position_at_m(self, time_s: float) -> Vec3:
        """As `at`, only where to be."""
        a, b, step_s, u = self._segment(time_s)
        w = 1.0 - u
        start, start_rate = w * w * (1.0 + 2.0 * u), w * w * u * step_s
        end, end_rate = u * u * (1.0 + 2.0 * w), -u * u * w * step_s
        return (
            start * a[0] + start_rate * a[3] + end * b[0] + end_rate * b[3],
            start * a[1] + start_rate * a[4] + end * b[1] + end_rate * b[4],
            start * a[2] + start_rate * a[5] + end * b[2] + end_rate * b[5],
        )

    def yaw_at(self, time_s: float) -> float:
        """As `at`, only the heading."""
        a, b, step_s, u = self._segment(time_s)
        w = 1.0 - u
        start, start_rate = w * w * (1.0 + 2.0 * u), w * w * u * step_s
        end, end_rate = u * u * (1.0 + 2.0 * w), -u * u * w * step_s
        yaw = start * a[9] + start_rate * a[10] + end * b[9] + end_rate * b[10]
        return remainder(yaw, 2 * pi)

    def then(self, following: Path, from_s: float, until_s: float) -> Path:
        """This path from one time until another, and then another path, which starts with its motion then."""
        lead_s = until_s - from_s
        turns = 2 * pi * round((following.knots[0][9] - self._knot(until_s)[9]) / (2 * pi))
        inner = range(
            bisect_right(self.times_s, from_s + _SHORTEST_S),
            bisect_right(self.times_s, until_s - _SHORTEST_S),
        )
        kept = [(0.0, self._knot(from_s)), *((self.times_s[i] - from_s, self.knots[i]) for i in inner)]
        first = [
            crossing.moved(-from_s) for crossing in self.crossings if from_s <= crossing.time_s < until_s
        ]
        later = [crossing.moved(lead_s) for crossing in following.crossings]
        if first and later and dist(first[-1].gate.centre_m, later[0].gate.centre_m) < _SAME_GATE_M:
            del later[0]  # it was in the opening when the other path began
        return Path(
            [*(time_s for time_s, _ in kept), *(time_s + lead_s for time_s in following.times_s)],
            [*([*knot[:9], knot[9] + turns, knot[10]] for _, knot in kept), *following.knots],
            (*first, *later),
        )

    def _knot(self, time_s: float) -> list[float]:
        return self._between(time_s)[0]

    def _between(self, time_s: float) -> tuple[list[float], float]:
        """The numbers of a knot between two knots (Hermite's cubics), and the acceleration of the yaw."""
        a, b, step_s, u = self._segment(time_s)
        w = 1.0 - u
        start, start_rate = w * w * (1.0 + 2.0 * u), w * w * u * step_s
        end, end_rate = u * u * (1.0 + 2.0 * w), -u * u * w * step_s
        change, from_rate, to_rate = 6.0 * u * w / step_s, w * (w - 2.0 * u), u * (u - 2.0 * w)
        ax, ay, az, avx, avy, avz, aax, aay, aaz, a_yaw, a_turn = a
        bx, by, bz, bvx, bvy, bvz, bax, bay, baz, b_yaw, b_turn = b
        knot = [  # written out: it is made ten times a tick
            start * ax + start_rate * avx + end * bx + end_rate * bvx,
            start * ay + start_rate * avy + end * by + end_rate * bvy,
            start * az + start_rate * avz + end * bz + end_rate * bvz,
            change * (bx - ax) + from_rate * avx + to_rate * bvx,
            change * (by - ay) + from_rate * avy + to_rate * bvy,
            change * (bz - az) + from_rate * avz + to_rate * bvz,
            aax + u * (bax - aax),
            aay + u * (bay - aay),
            aaz + u * (baz - aaz),
            start * a_yaw + start_rate * a_turn + end * b_yaw + end_rate * b_turn,
            change * (b_yaw - a_yaw) + from_rate * a_turn + to_rate * b_turn,
        ]
        return knot, (b_turn - a_turn) / step_s

    def _segment(self, time_s: float) -> tuple[list[float], list[float], float, float]:
        """The knots before and after a time, how long it is between them, and the share that is over."""
        times = self.times_s
        time_s = min(max(time_s, 0.0), times[-1])
        index = min(bisect_right(times, time_s), len(times) - 1) - 1
        step_s = times[index + 1] - times[index]
        return self.knots[index], self.knots[index + 1], step_s, (time_s - times[index]) / step_s

    @cached_property
    def points_m(self) -> tuple[Vec3, ...]:
        """The positions of all knots, for displays."""
        return tuple([(knot[0], knot[1], knot[2]) for knot in self.knots])
