"""Legs that are clear of obstacles: the direct one, or several past points beside what blocks it."""

from __future__ import annotations

from math import pi, remainder

import numpy as np

from offboard.navigation.goals import FlightStyle, Gate
from offboard.navigation.planner.clearance import Clearance
from offboard.navigation.planner.legs import Array, Leg, durations, make_leg, rotate
from offboard.navigation.planner.route import Pass, leg_limits, leg_turns, turn_times

STEP_S = 0.05
MAX_DEPTH = 3  # detours within detours
_SPEED_SHARES = (1.0, 0.5)


class LegFinder:
    """Finds legs between the passes of a route.

    Args:
        clearance: the obstacles.
        style: how boldly to fly.
    """

    def __init__(self, clearance: Clearance, style: FlightStyle) -> None:
        self._clearance = clearance
        self._style = style

    def legs(self, before: Pass, after: Pass) -> list[Leg] | None:
        """The legs from a pass to the next; None if no clear ones were found."""
        found = self._between(before, after, MAX_DEPTH)
        return None if found is None else found[1]

    def _between(self, before: Pass, after: Pass, depth: int) -> tuple[float, list[Leg]] | None:
        leg = self.direct(before, after)
        blocked = self._deepest(leg)
        if blocked is None:
            return leg.duration_s, [leg]
        if depth == 0:
            return None
        time_s, obstacle = blocked
        position, velocity, _ = leg.at(np.array([time_s]))
        yaw = _turned(before.yaw_rad, after.yaw_rad, time_s / leg.duration_s)
        direct: list[tuple[float, list[Leg]]] = []
        later: list[tuple[float, Pass]] = []
        for via in self._ways(position[0], velocity[0], obstacle, yaw):
            first, second = self.direct(before, via), self.direct(via, after)
            total_s = first.duration_s + second.duration_s
            if self._deepest(first) is None and self._deepest(second) is None:
                direct.append((total_s, [first, second]))
            else:
                later.append((total_s, via))
        if direct:
            return min(direct, key=lambda found: found[0])
        for _, via in sorted(later, key=lambda entry: entry[0])[:3]:
            first_part = self._between(before, via, depth - 1)
            second_part = self._between(via, after, depth - 1) if first_part else None
            if first_part and second_part:
                return first_part[0] + second_part[0], first_part[1] + second_part[1]
        return None

    def direct(self, before: Pass, after: Pass) -> Leg:
        """The leg between two passes, obstacles left out."""
        start, end = before.exit_m[None], after.entry_m[None]
        yaws = np.array([before.yaw_rad]), np.array([after.yaw_rad])
        to_gate = isinstance(after.goal, Gate)
        turn = leg_turns(end - start, *yaws, to_gate=to_gate, style=self._style)
        c, s = float(np.cos(turn[0])), float(np.sin(turn[0]))
        limits = leg_limits(start, end, self._style, self._clearance)
        turn_s = turn_times(*yaws, np.array([after.turn_s]), self._style)
        duration = durations(
            rotate(end - start, c, -s),
            rotate(before.velocity_m_s[None], c, -s),
            rotate(after.velocity_m_s[None], c, -s),
            limits,
            turn_s,
        )
        ends = (before.exit_m, before.velocity_m_s), (after.entry_m, after.velocity_m_s)
        return make_leg(*ends, (c, s), limits, float(duration[0]))

    def _deepest(self, leg: Leg) -> tuple[float, int] | None:
        """When a leg is deepest in an obstacle, and in which; None if it is clear.

        What the leg starts or ends in does not count until it has left it: it has to begin somewhere.
        """
        times = np.linspace(0.0, leg.duration_s, max(int(leg.duration_s / STEP_S), 2) + 1)
        positions, _, _ = leg.at(times)
        depths = open_ended(self._clearance.depths(positions))
        if depths.max() <= 0.0:
            return None
        index, obstacle = np.unravel_index(int(depths.argmax()), depths.shape)
        return float(times[index]), int(obstacle)

    def _ways(self, position: Array, velocity: Array, obstacle: int, yaw: float) -> list[Pass]:
        ways = self._clearance.ways_round(position, velocity, obstacle)
        depths = self._clearance.depths(np.array([point for point, _ in ways]))
        return [
            Pass(None, point, point, share * speed, 0.0, yaw, 0.0)
            for (point, speed), clear in zip(ways, (depths.max(axis=1) <= 0.0).tolist(), strict=True)
            if clear
            for share in _SPEED_SHARES
        ]


def _turned(before_rad: float, after_rad: float, share: float) -> float:
    """The heading on the way from one to another, NaN if either is free: each part has time for its turn."""
    return before_rad + share * remainder(after_rad - before_rad, 2 * pi)


def open_ended(depths: Array) -> Array:
    """Depths of the points of a leg in obstacles, with those from the start and to the end left out.

    Args:
        depths: shape (points, obstacles); not above zero where a point is clear.
    """
    inside = depths > 0.0
    from_start = np.logical_and.accumulate(inside, axis=0)
    to_end = np.logical_and.accumulate(inside[::-1], axis=0)[::-1]
    kept: Array = np.where(from_start | to_end, -1.0, depths)
    return kept
