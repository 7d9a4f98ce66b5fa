"""Chooses how goals are passed: the side of each gate, its speed there, and the speed past each point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, hypot, nan, pi, sqrt

import numpy as np
import numpy.typing as npt

from offboard.navigation.goals import PRESENT_SHARE, FlightStyle, Goal, Motion, PathGate, Point, Refusal
from offboard.navigation.path import Crossing
from offboard.navigation.planner.clearance import Clearance, deeper_m, room_share
from offboard.navigation.planner.legs import Array, Connector, Ends

SPEED_SHARES = (1.0, 0.7, 0.4)  # of the crossing speed, to choose from
LEAST_STRAIGHT_M = 0.22  # before and behind an opening: the drone's box is clear of the bars there
TURNED_BEFORE_M = 0.25  # before an opening a turn must have ended
COMMITTED_BEFORE_M = 0.9  # from a start nearer before an opening the straight flight may begin later
LATE_STRAIGHT_M = 0.16  # where it begins at the latest: the drone's box does not reach the bars yet
LATE_ENTRIES_M = (-0.27, -0.2, -LATE_STRAIGHT_M)
LATE_ROOM_M = 0.08  # to a later entry; nearer, one leg leads from the start through the opening
LATE_ACROSS_M = 0.05  # there the drone must be this near the opening's axis
LEAVING_M = 0.15  # so far behind the end of the straight flight it is still continued
LEAVING_S = 0.15
LEAST_CROSSING_M_S = 0.25
SWITCH_S = 0.5  # another side than before must be faster by this
BLOCKED_S = 1e4  # time of a leg that obstacles block
_ROOM_STEP_M = 0.05
_ROOM_STEPS = 24
_SAME_GATE_M = 1.0
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """A way in which a goal is passed, or several: the arrays have as many rows.

    Attributes:
        goal: which is passed; None for the start and for a place beside an obstacle.
        entries: where legs to it end.
        exits: where legs from it start; from entry to exit the flight is straight and even.
        inner_s: time from entry to exit, shape (n,).
        costs_s: added to the time, shape (n,).
    """

    goal: Goal | None
    entries: Ends
    exits: Ends
    inner_s: Array
    costs_s: Array

    def one(self, index: int) -> Pass:
        """One of the ways."""
        row = np.array([index])
        return Pass(
            self.goal, self.entries.take(row), self.exits.take(row), self.inner_s[row], self.costs_s[row]
        )

    @property
    def begun(self) -> bool:
        """Whether the start is in this gate's opening already, so that its leg leads through the rest."""
        return isinstance(self.goal, PathGate) and not self.inner_s[0]

    @property
    def yaw_rad(self) -> float:
        """The heading of the first way; NaN if it is free."""
        return float(self.entries.yaws_rad[0])


def place(position_m: Array, velocity_m_s: Array, yaw_rad: float, goal: Goal | None = None) -> Pass:
    """A pass at one place with one velocity."""
    at_gate = np.zeros(1, dtype=bool)
    ends = Ends(position_m[None], velocity_m_s[None], np.array([yaw_rad]), np.zeros(1), at_gate)
    return Pass(goal, ends, ends, np.zeros(1), np.zeros(1))


@dataclass(frozen=True, slots=True, eq=False)
class _Opening:
    """A gate, seen from one side."""

    centre_m: Array
    normal: Array  # in the direction of the crossing
    yaw_rad: float
    before_m: float  # room before it
    after_m: float
    deeper_m: float  # see `deeper_m`: all straight flight is so much longer
    across_m: float  # how near its axis the drone must be


class RouteFinder:
    """Finds the fastest route by dynamic programming; obstacles between the goals only as `correct` tells.

    Args:
        clearance: the obstacles.
        connector: makes the legs.
        style: how boldly to fly.
    """

    def __init__(self, clearance: Clearance, connector: Connector, style: FlightStyle) -> None:
        self._clearance = clearance
        self._connector = connector
        self._style = style
        self._stages: list[Pass] = []
        self._leg_s: list[Array] = []
        self._corrected: set[tuple[int, bool, bool]] = set()

    def prepare(self, start: Motion, goals: Sequence[Goal], previous: Sequence[Crossing]) -> Refusal | None:
        """Collect the ways to pass all goals, and how long legs between them take.

        Returns:
            Why there is none; None if there is.
        """
        at, speed = np.array(start.position_m), np.array(start.velocity_m_s)
        self._stages = [place(at, speed, start.yaw_rad)]
        openings = self._openings([goal for goal in goals if isinstance(goal, PathGate)])
        for index, goal in enumerate(goals):
            if isinstance(goal, Point):
                yaw = nan if goal.yaw_rad is None else goal.yaw_rad
                self._stages.append(place(np.array(goal.position_m), np.zeros(3), yaw, goal))
                continue
            ways = self._through_gate(goal, openings.pop(0), start if index == 0 else None, previous)
            if ways is None:
                return Refusal(f"goal {index + 1}, a gate, has no room before or behind its opening", index)
            self._stages.append(ways)
        for before, after in pairwise(self._stages):
            m, n = len(before.inner_s), len(after.inner_s)
            rows, columns = np.repeat(np.arange(m), n), np.tile(np.arange(n), m)
            legs = self._connector.legs(before.exits.take(rows), after.entries.take(columns))
            self._leg_s.append(legs.durations_s.reshape(m, n))
        return None

    def best(self) -> tuple[list[Pass], list[int], list[float]]:
        """The fastest route, which way it takes at each goal, and how long its legs take."""
        costs = self._stages[0].costs_s
        chosen: list[Indices] = []
        for leg_s, after in zip(self._leg_s, self._stages[1:], strict=True):
            total = costs[:, None] + leg_s + (after.inner_s + after.costs_s)[None, :]
            chosen.append(total.argmin(axis=0))
            costs = total.min(axis=0)
        ways = [int(costs.argmin())]
        for back in reversed(chosen):
            ways.append(int(back[ways[-1]]))
        ways.reverse()
        route = [stage.one(way) for stage, way in zip(self._stages, ways, strict=True)]
        times = [float(leg_s[pair]) for leg_s, pair in zip(self._leg_s, pairwise(ways), strict=True)]
        return route, ways, times

    def correct(self, leg: int, ways: tuple[int, int], time_s: float) -> None:
        """Take in how long a leg takes round obstacles, also as a guess for others between the same sides.

        Args:
            leg: which leg of the route.
            ways: the ways at its start and end.
            time_s: `BLOCKED_S` if it is not possible.
        """
        times = self._leg_s[leg]
        before, after = (self._stages[leg + i] for i in (0, 1))
        sides = [stage.entries.yaws_rad for stage in (before, after)]
        same = [np.cos(yaws - yaws[way]) > 0.0 for yaws, way in zip(sides, ways, strict=True)]
        key = (leg, bool(same[0][0]), bool(same[1][0]))
        if key not in self._corrected:
            self._corrected.add(key)
            extra_s = min(0.9 * (time_s - times[ways]), BLOCKED_S / 2)
            times[np.ix_(same[0], same[1])] += extra_s
        times[ways] = time_s

    def _openings(self, gates: list[PathGate]) -> list[list[_Opening]]:
        """Both sides of each gate, as far as there is room and its direction allows."""
        if not gates:
            return []
        yaws = np.array([gate.yaw_rad + turn for gate in gates for turn in (0.0, pi)])
        normals = np.stack((np.cos(yaws), np.sin(yaws), np.zeros(len(yaws))), axis=1)
        centres = np.repeat(np.array([gate.centre_m for gate in gates]), 2, axis=0)
        reach = np.arange(1, _ROOM_STEPS + 1) * _ROOM_STEP_M
        points = centres[:, None] + reach[:, None] * normals[:, None]
        low, high = self._clearance.low_m[2], self._clearance.high_m[2]
        points[..., 2] = np.clip(points[..., 2], low, high)  # a gate beyond is crossed at its own height
        depths = self._clearance.depths(points.reshape(-1, 3)).reshape(len(gates), 2, _ROOM_STEPS, -1)
        for index, gate in enumerate(gates):
            own = self._clearance.obstacle_of(gate)
            if own >= 0:
                depths[index, :, :, own] = -1.0
        blocked = (depths > 0.0).any(axis=-1)
        rooms = np.where(blocked.any(axis=-1), blocked.argmax(axis=-1), _ROOM_STEPS) * _ROOM_STEP_M
        found: list[list[_Opening]] = []
        for index in range(len(gates)):
            sides: list[_Opening] = []
            for side in (0, 1):
                row = 2 * index + side
                before_m, after_m = float(rooms[index, 1 - side]), float(rooms[index, side])
                deeper = deeper_m(gates[index].shape)
                if min(before_m, after_m) >= LEAST_STRAIGHT_M + deeper:
                    across_m = LATE_ACROSS_M * room_share(gates[index].shape)
                    yaw = float(yaws[row])
                    sides.append(
                        _Opening(centres[row], normals[row], yaw, before_m, after_m, deeper, across_m)
                    )
            found.append(sides)
        return found

    def _through_gate(
        self, gate: PathGate, openings: list[_Opening], start: Motion | None, previous: Sequence[Crossing]
    ) -> Pass | None:
        """Each side at each speed; None if there is no side."""
        style = self._style
        rows: list[tuple[Array, Array, Array, tuple[float, float, float, float]]] = []
        for opening in openings:
            centre, normal = opening.centre_m, opening.normal
            same_way = _same_way(gate, opening.yaw_rad, previous)
            cost_s = SWITCH_S if same_way is False else 0.0
            straight_m = min(opening.before_m, style.straight_before_m + opening.deeper_m)
            exit_m = min(opening.after_m, style.straight_after_m + opening.deeper_m)
            room_m = min(opening.before_m - straight_m, opening.after_m - exit_m)
            ways = [(-straight_m, speed) for speed in self._speeds(room_m)]
            if start is not None:
                if same_way:
                    exit_m = _leaving_exit(start, opening, exit_m)
                present = max(float(np.array(start.velocity_m_s) @ normal), LEAST_CROSSING_M_S)
                most = PRESENT_SHARE * style.crossing_speed_m_s
                top = self._top_speed(opening.after_m - exit_m)
                for at_m in _late_entries(start, opening, exit_m, begun=bool(same_way)):
                    speeds = (present,) if at_m >= exit_m else (style.crossing_speed_m_s, min(present, most))
                    ways += [(at_m, min(speed, top)) for speed in speeds]
            turned_m = TURNED_BEFORE_M + opening.deeper_m
            for at_m, speed in ways:
                times = (exit_m - at_m) / speed, max(-turned_m - at_m, 0.0) / speed
                ends = centre + at_m * normal, centre + exit_m * normal, speed * normal
                rows.append((*ends, (opening.yaw_rad, *times, cost_s)))
        if not rows:
            return None
        entry, leave, velocity, numbers = (np.array(column) for column in zip(*rows, strict=True))
        yaw, inner_s, turn_s, cost_s = numbers.T
        at_gates = np.ones(len(rows), dtype=bool)
        entries = Ends(entry, velocity, yaw, turn_s, at_gates)
        return Pass(gate, entries, Ends(leave, velocity, yaw, turn_s, at_gates), inner_s, cost_s)

    def _speeds(self, room_m: float) -> list[float]:
        """Speeds to cross a gate with, for which there is room to accelerate before and to brake behind."""
        top = self._top_speed(room_m)
        speeds = [share * self._style.crossing_speed_m_s for share in SPEED_SHARES]
        return [speed for speed in speeds if speed <= top] or speeds[-1:]

    def _top_speed(self, room_m: float) -> float:
        """The speed from which there is room to brake."""
        return max(sqrt(2.0 * self._style.acceleration_m_s2 * max(room_m, 0.0)), LEAST_CROSSING_M_S)


def _same_way(gate: PathGate, yaw_rad: float, previous: Sequence[Crossing]) -> bool | None:
    """Whether the path flown now crosses a gate in this direction; None if it does not cross it."""
    for crossing in previous:
        gap_m = np.linalg.norm(np.array(crossing.gate.centre_m) - np.array(gate.centre_m))
        if gap_m < _SAME_GATE_M:
            return cos(crossing.heading_rad - yaw_rad) > 0.0
    return None


def _leaving_exit(start: Motion, opening: _Opening, exit_m: float) -> float:
    """Where the straight flight ends; farther for a start that is just leaving, and not to turn back."""
    along_m = float((np.array(start.position_m) - opening.centre_m) @ opening.normal)
    speed = float(np.array(start.velocity_m_s) @ opening.normal)
    leaving = speed > 0.1 and -LATE_STRAIGHT_M - opening.deeper_m < along_m < exit_m + LEAVING_M
    return max(exit_m, along_m + 0.03 + LEAVING_S * speed) if leaving else exit_m


def _late_entries(start: Motion, opening: _Opening, exit_m: float, *, begun: bool) -> list[float]:
    """Later entries, as distances behind the opening, for a start that is before or in it already.

    Args:
        start: the motion now.
        opening: the gate from one side.
        exit_m: where the straight flight ends, behind the opening.
        begun: the path flown now leads through the opening in this direction.
    """
    offset = np.array(start.position_m) - opening.centre_m
    velocity, normal = np.array(start.velocity_m_s), opening.normal
    along_m = float(offset @ normal)
    if not -COMMITTED_BEFORE_M < along_m < (exit_m if begun else 0.0):
        return []
    across_m = hypot(offset[0] - along_m * normal[0], offset[1] - along_m * normal[1])
    beside_m = max(across_m, abs(float(offset[2])))
    latest_m = -LATE_STRAIGHT_M - opening.deeper_m
    if along_m > latest_m:
        return [exit_m] if beside_m < opening.across_m else []
    speed = float(velocity @ normal)
    aside = float(np.linalg.norm(velocity - speed * normal))
    to_go_m = latest_m - along_m
    if beside_m > opening.across_m + 0.25 * to_go_m or aside > 0.1 + 0.5 * max(speed, 0.0):
        return []
    late_m = (entry - opening.deeper_m for entry in LATE_ENTRIES_M)
    entries = [entry for entry in late_m if entry > along_m + LATE_ROOM_M]
    if beside_m < opening.across_m and to_go_m < LATE_ROOM_M:
        entries.append(exit_m)
    return entries
