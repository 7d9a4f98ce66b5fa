"""How much of a step lies outside the arena."""

from __future__ import annotations

from geometry.vectors import Vec3
from scenarios.models import Arena


class Boundary:
    """The arena's four sides and its ceiling. The floor is no side: nothing is outside for being too low."""

    __slots__ = ("_ceiling_m", "_half_x_m", "_half_y_m")

    def __init__(self, arena: Arena) -> None:
        self._half_x_m = arena.length_x_m / 2
        self._half_y_m = arena.width_y_m / 2
        self._ceiling_m = arena.height_m

    def holds(self, point_m: Vec3) -> bool:
        """Whether a point (arena axes) is inside; the border is."""
        return (
            -self._half_x_m <= point_m[0] <= self._half_x_m
            and -self._half_y_m <= point_m[1] <= self._half_y_m
            and point_m[2] <= self._ceiling_m
        )

    def margin(self, point_m: Vec3) -> float:
        """How far a point is from the nearest side; below zero outside."""
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
