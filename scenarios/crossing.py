"""Where a try's path passes through gates' openings, and how long it is outside the arena."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, dist, hypot, sin
from typing import Literal

from framerunner.geometry.vectors import Vec3
from scenarios.models import Arena, Gate

MAX_GAP_US = 1_000_000  # across a longer gap in the states no crossing counts
_SLACK_RESERVE_M = 0.01  # of the distance to the nearest plane, so that rounding loses no passage

Side = Literal["front", "back"]


@dataclass(frozen=True, slots=True)
class Passage:
    """One passage through an opening."""

    fraction: float  # of the last step before the plane was met, 0 to 1
    offset_m: float  # distance from the opening's centre, in the gate's plane
    side: Side  # from which it came; the front is where the gate's normal (its local x axis) points


class GateWatch:
    """Follows a path past one gate.

    A step passes when its start is on one side of the gate's plane, its end on the other, and the straight
    line between meets the plane inside the opening. A point exactly in the plane belongs to the side the path
    came from, so touching the plane and going back is no passage, and a path cut into more steps passes as
    often as before. Only the drone's centre counts: what its edges touch is a contact.
    """

    def __init__(self, gate: Gate) -> None:
        width_m, height_m = gate.opening_m
        self._half_width_m = width_m / 2
        self._half_height_m = height_m / 2
        self._centre = gate.position_arena_m
        self._cos = cos(gate.yaw_rad)
        self._sin = sin(gate.yaw_rad)
        self._offset_m = self._cos * gate.x_m + self._sin * gate.y_m
        self._side = 0  # 1 front, -1 back, 0 not known yet
        self.distance_m = 0.0  # from the last point to the gate's plane; a shorter path cannot pass it

    def restart(self, point_m: Vec3) -> None:
        """Start a new path at a point; it is not joined to the last one."""
        self._side = 0
        self.follow(point_m, point_m)

    def follow(self, start_m: Vec3, end_m: Vec3) -> Passage | None:
        """Follow the path by one step.

        Args:
            start_m: the end of the last step, arena axes, shape (3,).
            end_m: where the drone is now, arena axes, shape (3,).

        Returns:
            The passage, if this step passes through the opening.
        """
        before_m = self._cos * start_m[0] + self._sin * start_m[1] - self._offset_m
        now_m = self._cos * end_m[0] + self._sin * end_m[1] - self._offset_m
        self.distance_m = abs(now_m)
        came_from = self._side
        if now_m == 0.0 or ((came_from > 0.0) == (now_m > 0.0) and came_from):
            return None
        self._side = 1 if now_m > 0.0 else -1
        if came_from == 0:
            return None
        fraction = before_m / (before_m - now_m)
        x_m, y_m, z_m = (a + fraction * (b - a) for a, b in zip(start_m, end_m, strict=True))
        lateral_m = self._cos * (y_m - self._centre[1]) - self._sin * (x_m - self._centre[0])
        vertical_m = z_m - self._centre[2]
        if abs(lateral_m) > self._half_width_m or abs(vertical_m) > self._half_height_m:
            return None
        return Passage(fraction, hypot(lateral_m, vertical_m), "front" if came_from > 0 else "back")


class Boundary:
    """The arena's four sides and its ceiling. The floor is no side: nothing is outside for being too low."""

    def __init__(self, arena: Arena) -> None:
        self._half_x_m = arena.length_x_m / 2
        self._half_y_m = arena.width_y_m / 2
        self._ceiling_m = arena.height_m

    def margin(self, point_m: Vec3) -> float:
        """Distance of a point (arena axes) from the nearest side, metres; below zero outside."""
        return min(
            self._half_x_m - abs(point_m[0]),
            self._half_y_m - abs(point_m[1]),
            self._ceiling_m - point_m[2],
        )

    def outside_share(self, start_m: Vec3, end_m: Vec3) -> float:
        """Share (0..1) of the straight step between two points that is outside.

        The arena is convex, so the inside part is one piece: the line clipped by each slab in turn
        (Kay & Kajiya, "Ray tracing complex scenes", 1986).
        """
        enter, leave = 0.0, 1.0
        limits = (
            (-self._half_x_m, self._half_x_m),
            (-self._half_y_m, self._half_y_m),
            (float("-inf"), self._ceiling_m),
        )
        for a, b, (low, high) in zip(start_m, end_m, limits, strict=True):
            step = b - a
            if step == 0.0:
                if not low <= a <= high:
                    return 1.0
                continue
            first, last = sorted(((low - a) / step, (high - a) / step))
            enter = max(enter, first)
            leave = min(leave, last)
        return 1.0 - max(0.0, leave - enter)


class PathWatch:
    """Follows the path of one try, straight from state to state.

    Gates and boundary are checked only when the drone may have reached the nearest of them since the last
    check; this runs at 250 Hz.
    """

    def __init__(self, arena: Arena, gates: Sequence[Gate]) -> None:
        self._boundary = Boundary(arena)
        self._gates = tuple((gate.colour, GateWatch(gate)) for gate in gates)
        self._inside = True
        self._slack_m = 0.0  # the drone can go this far before the next check
        self.length_m = 0.0
        self.outside_us = 0.0
        self.longest_gap_us = 0  # between two points

    def restart(self, point_m: Vec3) -> None:
        """Go on at a point (arena axes) that is not joined to the last one."""
        self._inside = self._boundary.margin(point_m) >= 0.0
        self._restart_gates(point_m)

    def follow(self, start_m: Vec3, end_m: Vec3, step_us: int) -> Sequence[tuple[str, Passage]]:
        """Follow the path by one step, from the last point to the next (arena axes, shape (3,)).

        Returns:
            The gates it passes through, by colour.
        """
        self.longest_gap_us = max(self.longest_gap_us, step_us)
        if step_us > MAX_GAP_US:
            self._restart_gates(end_m)
        step_m = dist(start_m, end_m)
        self.length_m += step_m
        self._slack_m -= step_m
        return self._check(start_m, end_m, step_us) if self._slack_m <= 0.0 else ()

    def _restart_gates(self, point_m: Vec3) -> None:
        self._slack_m = 0.0
        for _, gate in self._gates:
            gate.restart(point_m)

    def _check(self, start_m: Vec3, end_m: Vec3, step_us: int) -> list[tuple[str, Passage]]:
        passages: list[tuple[str, Passage]] = []
        margin_m = nearest_m = self._boundary.margin(end_m)
        for colour, gate in self._gates:
            passage = gate.follow(start_m, end_m)
            if passage is not None:
                passages.append((colour, passage))
            nearest_m = min(nearest_m, gate.distance_m)
        inside = margin_m >= 0.0
        if not (inside and self._inside):
            self.outside_us += self._boundary.outside_share(start_m, end_m) * step_us
        self._inside = inside
        self._slack_m = max(nearest_m - _SLACK_RESERVE_M, 0.0)
        return passages
