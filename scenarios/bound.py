"""A lower bound of the time of a try, for somebody who knows the layout: a linear program.

No drone whose motion stays within an envelope can complete a try of the scenario in less time;
docs/bound.md has the proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, pi, sin
from typing import TYPE_CHECKING

from framerunner.geometry.vectors import Vec3
from scenarios.models import COLOURS, Gate, Scenario, ScenarioError
from scenarios.touchdown import STANDING_TOLERANCE_M

if TYPE_CHECKING:
    import numpy as np

    Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

DIRECTIONS = 72
"""Sides of the polygon around the disc of displacements in plan; its corners are 0.1 % outside the disc."""
TOTAL_LEGS = 4
"""For how many legs an envelope's `total_excess_m` holds."""


@dataclass(frozen=True, slots=True)
class Reach:
    """How far a drone gets in one direction: at most `speed_m_s` t + `excess_m`, and at most `peak_m_s` t.

    Attributes:
        speed_m_s: the highest that can be commanded.
        excess_m: of a distance, when the true speed exceeds that for a moment.
        peak_m_s: the highest true speed.
    """

    speed_m_s: float
    excess_m: float = 0.0
    peak_m_s: float = inf


@dataclass(frozen=True, slots=True)
class Fall:
    """How far a drone gets from where its motors stop to where it comes to rest, as the referee counts.

    In plan it gets at most `level_m` + `level_per_m` times the height lost, and at most `longest_m`.

    Attributes:
        level_m: see above.
        level_per_m: see above.
        longest_m: see above.
        deepest_m: height lost, at most.
        rise_m: height gained, at most.
    """

    level_m: float = 0.0
    level_per_m: float = 0.0
    longest_m: float = 0.0
    deepest_m: float = 0.0
    rise_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Envelope:
    """What a drone's true motion never exceeds.

    Attributes:
        level: in plan, between any two times of a try.
        up: likewise upwards.
        down: likewise downwards.
        total_excess_m: in plan, the lengths of the first four legs together, from the start on, exceed
            `level.speed_m_s` times their time by at most this, wherever each ends; it may be below zero.
        fall: after the motors have stopped.
    """

    level: Reach
    up: Reach
    down: Reach
    total_excess_m: float = inf
    fall: Fall = Fall()


@dataclass(frozen=True, slots=True)
class Bound:
    """A lower bound, and where the linear program has its solution, which need not be the only one.

    Attributes:
        time_s: no try is shorter.
        leg_times_s: to each gate, and to where the motors stop.
        points_arena_m: start, a point in each opening, and where the motors stop.
    """

    time_s: float
    leg_times_s: tuple[float, ...]
    points_arena_m: tuple[Vec3, ...]


def ordered_gates(scenario: Scenario) -> tuple[Gate, ...]:
    """The gates in the order in which they must be crossed."""
    return tuple(sorted(scenario.frames, key=lambda gate: COLOURS.index(gate.colour)))


def lower_bound(scenario: Scenario, start_m: Vec3, height_m: float, envelope: Envelope) -> Bound:
    """Compute the bound; takes some milliseconds.

    Args:
        scenario: with at least one gate.
        start_m: centre of the drone when the motors start, arena axes.
        height_m: of the drone.
        envelope: of its motion.

    Raises:
        ScenarioError: the scenario has no gates, or the linear program has no solution.
    """
    from scipy.optimize import linprog  # noqa: PLC0415 - it takes 0.2 s, and most uses of scenarios need none

    if not scenario.frames:
        raise ScenarioError(f"scenario '{scenario.name}' has no frames, so no bound; use one that has some")
    program = _Program(scenario, start_m, height_m, envelope)
    found = linprog(
        program.cost, A_ub=program.rows, b_ub=program.limits, bounds=program.bounds, method="highs"
    )
    if found.x is None or found.fun is None:
        raise ScenarioError(
            f"scenario '{scenario.name}': no bound found ({found.message}); check its numbers"
        )
    return Bound(
        float(found.fun),
        tuple(float(time_s) for time_s in found.x[program.times]),
        program.points(found.x),
    )


class _Program:
    """The linear program: the least sum of the legs' times.

    Its variables: for each gate the offsets to the side and up from the opening's centre; x, y and z of the
    place where the motors stop; the length in plan and the time of each leg.
    """

    def __init__(self, scenario: Scenario, start_m: Vec3, height_m: float, envelope: Envelope) -> None:
        import numpy as np  # noqa: PLC0415 - most uses of scenarios need none

        gates = ordered_gates(scenario)
        legs = len(gates) + 1
        self._stop = 2 * len(gates)
        self._lengths = slice(self._stop + 3, self._stop + 3 + legs)
        self.times = slice(self._stop + 3 + legs, self._stop + 3 + 2 * legs)
        self._count = self.times.stop
        self.cost = np.zeros(self._count)
        self.cost[self.times] = 1.0
        resting_m = scenario.base.top_m + height_m / 2
        # x, y and z of each place are affine in the variables.
        self._constant = np.array([start_m, *(gate.position_arena_m for gate in gates), (0.0, 0.0, 0.0)])
        self._linear = np.zeros((legs + 1, 3, self._count))
        self.bounds: list[tuple[float, float]] = []
        for index, gate in enumerate(gates):
            self._linear[index + 1, :2, 2 * index] = (-sin(gate.yaw_rad), cos(gate.yaw_rad))
            self._linear[index + 1, 2, 2 * index + 1] = 1.0
            self.bounds += [(-size_m / 2, size_m / 2) for size_m in gate.opening_m]
        self._linear[legs, :, self._stop : self._stop + 3] = np.eye(3)
        self.bounds += [*_stop_ranges(scenario, resting_m, envelope.fall), *[(0.0, inf)] * (2 * legs)]

        parts = [self._leg(leg, envelope, is_last=leg == legs - 1) for leg in range(legs)]
        parts.append(self._fall(scenario, resting_m, envelope.fall))
        if legs <= TOTAL_LEGS and envelope.total_excess_m < inf:
            row = np.zeros((1, self._count))
            row[0, self._lengths], row[0, self.times] = 1.0, -envelope.level.speed_m_s
            parts.append((row, np.array([envelope.total_excess_m])))
        self.rows = np.concatenate([rows for rows, _ in parts])
        self.limits = np.concatenate([limits for _, limits in parts])

    def points(self, variables: Array) -> tuple[Vec3, ...]:
        """The places of a solution."""
        return tuple((float(x), float(y), float(z)) for x, y, z in self._constant + self._linear @ variables)

    def _leg(self, leg: int, envelope: Envelope, *, is_last: bool) -> tuple[Array, Array]:
        """Rows and limits of a leg: its length in plan by the polygon's sides, and what its time allows."""
        import numpy as np  # noqa: PLC0415

        angles = np.arange(DIRECTIONS) * (2.0 * pi / DIRECTIONS)
        sides = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)))
        change = self._linear[leg + 1] - self._linear[leg]
        constant = self._constant[leg + 1] - self._constant[leg]
        length, time = self._lengths.start + leg, self.times.start + leg
        rows = [sides @ change]
        rows[0][:, length] -= 1.0
        limits = [-sides @ constant]
        in_plan = np.zeros(self._count)
        in_plan[length] = 1.0
        rise_m = envelope.fall.rise_m if is_last else 0.0  # see `_stop_ranges`
        for reach, moved, already_m, more_m in (
            (envelope.level, in_plan, 0.0, 0.0),
            (envelope.up, change[2], constant[2], rise_m),
            (envelope.down, -change[2], -constant[2], 0.0),
        ):
            for speed_m_s, excess_m in ((reach.speed_m_s, reach.excess_m), (reach.peak_m_s, 0.0)):
                if speed_m_s < inf:
                    row = moved.copy()
                    row[time] -= speed_m_s
                    rows.append(row[np.newaxis])
                    limits.append(np.array([excess_m + more_m - already_m]))
        return np.concatenate(rows), np.concatenate(limits)

    def _fall(self, scenario: Scenario, resting_m: float, fall: Fall) -> tuple[Array, Array]:
        """Rows that let the motors stop farther from the base only if they stop higher above it."""
        import numpy as np  # noqa: PLC0415

        base = scenario.base
        rows, limits = np.zeros((4, self._count)), np.zeros(4)
        for row, (axis, sign) in enumerate(((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0))):
            rows[row, self._stop + axis], rows[row, self._stop + 2] = sign, -fall.level_per_m
            limits[row] = sign * (base.x_m, base.y_m)[axis] + base.edge_m / 2
            limits[row] += fall.level_m - fall.level_per_m * resting_m
        return rows, limits


def _stop_ranges(scenario: Scenario, resting_m: float, fall: Fall) -> list[tuple[float, float]]:
    """Ranges of x, y and z where the motors may stop: from there the drone can come to rest on the base.

    The referee accepts a drone at rest whose centre is over the base's square, and whose underside is less
    than a tolerance above its top. A place lower than the centre's height at rest counts as one at that
    height, which the last leg's limit upwards allows.
    """
    base = scenario.base
    reach_m = base.edge_m / 2 + fall.longest_m
    return [
        (base.x_m - reach_m, base.x_m + reach_m),
        (base.y_m - reach_m, base.y_m + reach_m),
        (resting_m, resting_m + STANDING_TOLERANCE_M + fall.deepest_m),
    ]
