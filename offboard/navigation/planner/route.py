"""Chooses how goals are passed: the side of each gate, its speed there, and the speed past each point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, hypot, nan, pi, sin

import numpy as np
import numpy.typing as npt

from offboard.navigation.goals import FlightStyle, Gate, Goal, Motion, Point
from offboard.navigation.path import Crossing
from offboard.navigation.planner.clearance import Clearance
from offboard.navigation.planner.legs import Array, LegLimits, durations, rotate

SPEED_SHARES = (1.0, 0.7, 0.4)  # of the crossing speed, to choose from
LEAST_STRAIGHT_M = 0.22  # before and behind an opening: the drone's box is clear of the bars there
COMMITTED_BEFORE_M = 0.9  # from a start nearer before an opening the straight flight may begin later
LEAVING_M = 0.15
LEAVING_S = 0.15
LEAST_CROSSING_M_S = 0.25
LATE_STRAIGHT_M = 0.16  # where it begins at the latest: the drone's box does not reach the bars yet
LATE_ENTRIES_M = (-0.27, -0.2, -LATE_STRAIGHT_M)
LATE_ACROSS_M = 0.05  # there the drone must be this near the opening's axis
SWITCH_S = 0.5  # another side than before must be faster by this
LOOK_REACH_M = 0.5  # shorter legs to a gate are flown with the heading along them
TURN_SPARE_S = 0.2  # to begin and end a turn
TURNED_BEFORE_M = 0.25  # before an opening a turn must have ended
NO_TURN_RAD = 0.1  # a smaller turn takes no time of its own
_ROOM_STEP_M = 0.05
_ROOM_STEPS = 24
_DESCENT_GAIN = 1.5
"""A descent to a height that brakes with this times the height above 0.15 m, per s^2, is nowhere faster than
the height above 0.15 m over 1.1 s, to which the app limits it: v^2 / 2a <= h for v = (z - 0.15) / 1.1."""
_FLOOR_M = 0.15
Indices = npt.NDArray[np.intp]
_Row = tuple[Array, Array, Array, float, float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """Ways in which one goal may be passed; arrays with one row each.

    Attributes:
        goal: which is passed.
        entry_m: where its legs end, shape (k, 3).
        exit_m: where the next legs start, shape (k, 3); from entry to exit the flight is straight and even.
        velocity_m_s: at both, shape (k, 3).
        inner_s: time from entry to exit, shape (k,).
        yaw_rad: the heading there; NaN if it is free, shape (k,).
        turn_s: time after the entry in which a turn to that heading may still end, shape (k,).
        cost_s: added to the time, shape (k,).
    """

    goal: Goal | None
    entry_m: Array
    exit_m: Array
    velocity_m_s: Array
    inner_s: Array
    yaw_rad: Array
    turn_s: Array
    cost_s: Array


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """The way in which a goal is passed: one row of `States`."""

    goal: Goal | None
    entry_m: Array
    exit_m: Array
    velocity_m_s: Array
    inner_s: float
    yaw_rad: float
    turn_s: float


class RouteFinder:
    """Finds the fastest route, obstacles besides the goals' own surroundings left out.

    Args:
        clearance: the obstacles.
        style: how boldly to fly.
    """

    def __init__(self, clearance: Clearance, style: FlightStyle) -> None:
        self._clearance = clearance
        self._style = style
        self._reach_m = np.arange(1, _ROOM_STEPS + 1) * _ROOM_STEP_M

    def find(
        self, start: Motion, goals: Sequence[Goal], previous: Sequence[Crossing]
    ) -> tuple[list[Pass], str]:
        """The ways to pass the start and each goal, or none and the reason."""
        stages = [_still_or_moving(None, start.position_m, start.velocity_m_s, start.yaw_rad)]
        for index, goal in enumerate(goals):
            last = index == len(goals) - 1
            if isinstance(goal, Gate):
                states = self._gate_states(goal, start if index == 0 else None, previous)
                if not len(states.inner_s):
                    return [], "a gate has no room before or behind its opening"
            else:
                states = self._point_states(goal, stages[-1], None if last else goals[index + 1])
            stages.append(states)
        return self._best(stages), ""

    def _best(self, stages: list[States]) -> list[Pass]:
        """The fastest sequence, by dynamic programming."""
        costs = stages[0].cost_s
        chosen: list[Array] = []
        for before, after in pairwise(stages):
            m, n = len(before.inner_s), len(after.inner_s)
            rows, columns = np.repeat(np.arange(m), n), np.tile(np.arange(n), m)
            leg_s = self.leg_times(before, rows, after, columns).reshape(m, n)
            total = costs[:, None] + leg_s + (after.inner_s + after.cost_s)[None, :]
            chosen.append(total.argmin(axis=0))
            costs = total.min(axis=0)
        index = int(costs.argmin())
        route: list[Pass] = []
        for stage, back in zip(reversed(stages), [*reversed(chosen), None], strict=True):
            route.append(
                Pass(
                    stage.goal,
                    stage.entry_m[index],
                    stage.exit_m[index],
                    stage.velocity_m_s[index],
                    float(stage.inner_s[index]),
                    float(stage.yaw_rad[index]),
                    float(stage.turn_s[index]),
                )
            )
            index = index if back is None else int(back[index])
        return route[::-1]

    def leg_times(self, before: States, rows: Indices, after: States, columns: Indices) -> Array:
        """Durations of the legs between pairs of states, obstacles left out."""
        start_m, end_m = before.exit_m[rows], after.entry_m[columns]
        yaw_before, yaw_after = before.yaw_rad[rows], after.yaw_rad[columns]
        to_gate = isinstance(after.goal, Gate)
        turn = leg_turns(end_m - start_m, yaw_before, yaw_after, to_gate=to_gate, style=self._style)
        c, s = np.cos(turn), np.sin(turn)
        turn_s = turn_times(yaw_before, yaw_after, after.turn_s[columns], self._style)
        return durations(
            rotate(end_m - start_m, c, -s),
            rotate(before.velocity_m_s[rows], c, -s),
            rotate(after.velocity_m_s[columns], c, -s),
            leg_limits(start_m, end_m, self._style, self._clearance),
            turn_s,
        )

    def _gate_states(self, gate: Gate, start: Motion | None, previous: Sequence[Crossing]) -> States:
        """Both sides at each speed, as far as there is room."""
        style, clearance = self._style, self._clearance
        own = clearance.frame_of(gate)
        rows: list[_Row] = []
        for sign in (1, -1):
            if gate.direction == -sign:
                continue
            yaw = gate.yaw_rad if sign > 0 else gate.yaw_rad + pi
            normal = np.array([cos(yaw), sin(yaw), 0.0])
            centre = np.array(gate.centre_m)
            before_m, after_m = self._room(centre, -normal, own), self._room(centre, normal, own)
            if min(before_m, after_m) < LEAST_STRAIGHT_M:
                continue
            cost_s = _switch_cost(gate, yaw, previous)
            straight_m = min(before_m, style.straight_before_m)
            exit_m = min(after_m, style.straight_after_m)
            ways = [(-straight_m, speed) for speed in self._speeds(before_m - straight_m, after_m - exit_m)]
            if start is not None:
                exit_m = _leaving_exit(start, centre, normal, exit_m)
                late = _late_entries(start, centre, normal, exit_m)
                present = float(np.array(start.velocity_m_s) @ normal)
                speeds = (style.crossing_speed_m_s, max(present, LEAST_CROSSING_M_S))
                ways += [(entry, speed) for entry in late for speed in speeds]
            for entry_m, speed in ways:
                rows.append(
                    (
                        centre + entry_m * normal,
                        centre + exit_m * normal,
                        speed * normal,
                        (exit_m - entry_m) / speed,
                        yaw,
                        max(-TURNED_BEFORE_M - entry_m, 0.0) / speed,
                        cost_s,
                    )
                )
        return _states(gate, rows)

    def _speeds(self, before_m: float, after_m: float) -> list[float]:
        """Speeds to cross a gate with, for which there is room to accelerate before and to brake behind."""
        style = self._style
        top = max((2.0 * style.acceleration_m_s2 * min(before_m, after_m)) ** 0.5, 0.2)
        speeds = [share * style.crossing_speed_m_s for share in SPEED_SHARES]
        return [speed for speed in speeds if speed <= top] or speeds[-1:]

    def _room(self, centre_m: Array, direction: Array, own: int) -> float:
        """How far from an opening the drone may fly straight, metres; at most 1.2."""
        points = centre_m + self._reach_m[:, None] * direction
        points[:, 2] = np.clip(points[:, 2], self._clearance.low_m[2], self._clearance.high_m[2])
        depths = self._clearance.depths(points)
        if own >= 0:
            depths[:, own] = -1.0
        blocked = (depths > 0.0).any(axis=1)
        return float(blocked.argmax() if blocked.any() else _ROOM_STEPS) * _ROOM_STEP_M

    def _point_states(self, point: Point, before: States, following: Goal | None) -> States:
        """At rest, or past it towards the next goal at each speed."""
        yaw = nan if point.yaw_rad is None else point.yaw_rad
        position = np.array(point.position_m)
        rest = (position, position, np.zeros(3), 0.0, yaw, 0.0, 0.0)
        if point.stop or following is None:
            return _states(point, [rest])
        target = following.centre_m if isinstance(following, Gate) else following.position_m
        to_next = np.array(target) - position
        from_last = position - before.exit_m.mean(axis=0)
        chord = to_next / (np.linalg.norm(to_next) + 1e-9) + from_last / (np.linalg.norm(from_last) + 1e-9)
        chord[2] = 0.0
        size = float(np.linalg.norm(chord))
        if size < 0.2:
            return _states(point, [rest])
        speed = self._style.axis_speed_m_s
        rows = [
            (position, position, share * speed * chord / size, 0.0, yaw, 9.0, 0.0) for share in SPEED_SHARES
        ]
        return _states(point, [*rows, rest])


def _still_or_moving(
    goal: Goal | None, position: Sequence[float], velocity: Sequence[float], yaw: float
) -> States:
    at, speed = np.array([position], dtype=float), np.array([velocity], dtype=float)
    zero = np.zeros(1)
    return States(goal, at, at, speed, zero, np.array([yaw]), zero, zero)


def _states(goal: Goal, rows: list[_Row]) -> States:
    if not rows:
        none = np.zeros((0, 3))
        return States(goal, none, none, none, *([none[:, 0]] * 4))
    return States(goal, *(np.array(column) for column in zip(*rows, strict=True)))


def _switch_cost(gate: Gate, yaw_rad: float, previous: Sequence[Crossing]) -> float:
    """Time added to the other side than that of the path flown now."""
    for crossing in previous:
        gap_m = np.linalg.norm(np.array(crossing.gate.centre_m) - np.array(gate.centre_m))
        if gap_m < 1.0:
            return SWITCH_S if cos(crossing.heading_rad - yaw_rad) < 0.0 else 0.0
    return 0.0


def _leaving_exit(start: Motion, centre: Array, normal: Array, exit_m: float) -> float:
    """Where the straight flight ends; farther for a start that is just leaving, and not to turn back."""
    along_m = float((np.array(start.position_m) - centre) @ normal)
    speed = float(np.array(start.velocity_m_s) @ normal)
    leaving = speed > 0.1 and -LATE_STRAIGHT_M < along_m < exit_m + LEAVING_M
    return max(exit_m, along_m + 0.03 + LEAVING_S * speed) if leaving else exit_m


def _late_entries(start: Motion, centre: Array, normal: Array, exit_m: float) -> list[float]:
    """Later entries, as distances behind the opening, for a start that is before or in it already."""
    offset = np.array(start.position_m) - centre
    velocity = np.array(start.velocity_m_s)
    along_m = float(offset @ normal)
    if not -COMMITTED_BEFORE_M < along_m < exit_m:
        return []
    across_m = hypot(offset[0] - along_m * normal[0], offset[1] - along_m * normal[1])
    beside_m = max(across_m, abs(float(offset[2])))
    if along_m > -LATE_STRAIGHT_M:
        return [exit_m] if beside_m < LATE_ACROSS_M else []
    speed = float(velocity @ normal)
    aside = float(np.linalg.norm(velocity - speed * normal))
    to_go_m = -LATE_STRAIGHT_M - along_m
    if beside_m > LATE_ACROSS_M + 0.25 * to_go_m or aside > 0.1 + 0.5 * max(speed, 0.0):
        return []
    return [entry for entry in LATE_ENTRIES_M if entry > along_m + 0.02] or [exit_m]


def leg_turns(way: Array, yaw_before: Array, yaw_after: Array, *, to_gate: bool, style: FlightStyle) -> Array:
    """The headings of legs' axes; where they may differ from the direction, both axes are used.

    Args:
        way: from start to end, shape (n, 3).
        yaw_before: the heading at the start, shape (n,), NaN for any.
        yaw_after: likewise at the end.
        to_gate: the legs end at a gate, which is looked at.
        style: how boldly to fly.
    """
    bearing = np.arctan2(way[:, 1], way[:, 0])
    reach = np.hypot(way[:, 0], way[:, 1])
    aside = np.where(np.isnan(yaw_before), 0.0, wrap(yaw_before - bearing))
    if to_gate:
        side = np.where(np.abs(aside) > NO_TURN_RAD, aside, wrap(yaw_after - bearing))
        offset = np.copysign(style.look_offset_rad, side) * np.clip(reach - LOOK_REACH_M, 0.0, 1.0)
    else:
        quarter = np.floor(aside / (pi / 2)) * (pi / 2) + pi / 4
        offset = np.where(np.isnan(yaw_after), quarter, 0.0)
    turn: Array = np.where(reach > 1e-6, bearing + offset, np.where(np.isnan(yaw_before), 0.0, yaw_before))
    return turn


def turn_times(yaw_before: Array, yaw_after: Array, later_s: Array, style: FlightStyle) -> Array:
    """Times that turns need within legs, shape (n,); none where a heading is free or the turn small.

    Args:
        yaw_before: headings at the start, shape (n,), NaN for any.
        yaw_after: at the end.
        later_s: time after the end in which the turn may still end.
        style: how boldly to fly.
    """
    turn = np.abs(wrap(yaw_after - yaw_before))
    needed: Array = np.where(turn > NO_TURN_RAD, turn / style.yaw_rate_rad_s + TURN_SPARE_S - later_s, 0.0)
    return np.maximum(needed, 0.0)


def leg_limits(start_m: Array, end_m: Array, style: FlightStyle, clearance: Clearance) -> LegLimits:
    """Limits of legs' axes, arrays of shape (n, 3): descents brake early enough for the app's floor."""
    n = len(start_m)
    speed = np.tile([style.axis_speed_m_s, style.axis_speed_m_s, style.climb_speed_m_s], (n, 1))
    acceleration = np.tile(
        [style.acceleration_m_s2, style.acceleration_m_s2, style.climb_acceleration_m_s2], (n, 1)
    )
    floor_m = clearance.low_m[2] - style.floor_margin_m + _FLOOR_M
    gentle = np.maximum(_DESCENT_GAIN * (end_m[:, 2] - floor_m), 0.2)
    down = end_m[:, 2] < start_m[:, 2]
    acceleration[down, 2] = np.minimum(acceleration[down, 2], gentle[down])
    return LegLimits(speed, acceleration)


def wrap(angle: Array) -> Array:
    """Angles between -pi and pi."""
    wrapped: Array = (angle + pi) % (2 * pi) - pi
    return wrapped
