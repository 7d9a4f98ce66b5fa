"""What hides what: the order in which upright boxes are painted, from back to front.

Two convex bodies that do not touch can be parted by a plane; the one on the eye's side may hide the other and
never the reverse. For upright boxes a plane along one of their faces is always enough (separating axis
theorem, in plan and in height), so the planes are found once and an image needs one dot product per pair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

from scenarios.axes import Vec3


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box.

    Attributes:
        centre_arena_m: shape (3,).
        half_extents_m: along its own axes, shape (3,).
        yaw_rad: of its first axis, counter-clockwise from arena x.
    """

    centre_arena_m: Vec3
    half_extents_m: Vec3
    yaw_rad: float = 0.0

    def reach(self, axis: Vec3) -> float:
        """Return how far it extends from its centre along a unit vector, metres."""
        c, s = cos(self.yaw_rad), sin(self.yaw_rad)
        x, y, z = self.half_extents_m
        return x * abs(c * axis[0] + s * axis[1]) + y * abs(c * axis[1] - s * axis[0]) + z * abs(axis[2])


@dataclass(frozen=True, slots=True)
class _Wall:
    """The plane between two boxes: normal . p = offset, `below` on its negative side, `above` on the other."""

    normal: Vec3
    offset: float
    below: int
    above: int


class PaintOrder:
    """Sorts boxes for an eye at any place.

    Boxes that intersect (they should not) are parted at their least overlap; three boxes that hide one another
    in a ring, which frames in an arena do not, are painted in the order they were given.
    """

    def __init__(self, boxes: Sequence[Box]) -> None:
        self._count = len(boxes)
        self._walls = tuple(_wall(boxes, i, j) for j in range(self._count) for i in range(j))
        self._known: dict[int, tuple[int, ...]] = {}

    def back_to_front(self, eye_arena_m: Vec3) -> tuple[int, ...]:
        """Return the indices of the boxes, the farthest first."""
        x, y, z = eye_arena_m
        key = 0
        for wall in self._walls:
            nx, ny, nz = wall.normal
            key = key << 1 | (nx * x + ny * y + nz * z > wall.offset)
        order = self._known.get(key)
        if order is None:
            order = self._known[key] = self._sort(key)
        return order

    def _sort(self, key: int) -> tuple[int, ...]:
        behind: list[set[int]] = [set() for _ in range(self._count)]
        for wall in reversed(self._walls):
            if key & 1:  # the eye is above the wall
                behind[wall.above].add(wall.below)
            else:
                behind[wall.below].add(wall.above)
            key >>= 1
        left = list(range(self._count))
        order: list[int] = []
        while left:
            # Nothing unpainted stands behind the chosen one, unless they form a ring.
            chosen = min(left, key=lambda i: (len(behind[i].intersection(left)), i))
            left.remove(chosen)
            order.append(chosen)
        return tuple(order)


def _wall(boxes: Sequence[Box], i: int, j: int) -> _Wall:
    """Find the plane with the widest gap between two boxes."""
    a, b = boxes[i], boxes[j]
    best_gap, best = -1e9, _Wall((0.0, 0.0, 1.0), 0.0, i, j)
    axes: list[Vec3] = [(0.0, 0.0, 1.0)]
    for yaw in (a.yaw_rad, b.yaw_rad):
        axes += [(cos(yaw), sin(yaw), 0.0), (-sin(yaw), cos(yaw), 0.0)]
    for axis in axes:
        at_a = sum(n * p for n, p in zip(axis, a.centre_arena_m, strict=True))
        at_b = sum(n * p for n, p in zip(axis, b.centre_arena_m, strict=True))
        reach_a, reach_b = a.reach(axis), b.reach(axis)
        gap = abs(at_b - at_a) - reach_a - reach_b
        if gap <= best_gap:
            continue
        best_gap = gap
        if at_a <= at_b:
            best = _Wall(axis, (at_a + reach_a + at_b - reach_b) / 2, i, j)
        else:
            best = _Wall(axis, (at_b + reach_b + at_a - reach_a) / 2, j, i)
    return best
