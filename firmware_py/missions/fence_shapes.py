"""A fence's polygons and circles: from items to shapes in the local frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite

from firmware_py.missions.flight import View
from firmware_py.missions.items import CIRCLES, POLYGONS, Do, MissionItem
from geometry.vectors import Vec3

FEWEST_VERTICES = 3
_KEEP_IN = frozenset({Do.POLYGON_INCLUSION, Do.CIRCLE_INCLUSION})

Edge = tuple[float, float, float, float]  # north and east of one end, then of the other


@dataclass(frozen=True, slots=True)
class Shape:
    """A polygon, or a circle if it has no edges.

    Attributes:
        name: which it is, for people.
        keep_in: whether the vehicle must stay inside; otherwise outside.
        edges: of the polygon, metres.
        centre_ne_m: of the circle, shape (2,).
        radius_m: of the circle.
    """

    name: str
    keep_in: bool
    edges: tuple[Edge, ...] = ()
    centre_ne_m: tuple[float, float] = (0.0, 0.0)
    radius_m: float = 0.0

    def allows(self, position_ned_m: Vec3) -> bool:
        """Whether the vehicle may be there."""
        north_m, east_m, _ = position_ned_m
        return self.contains(north_m, east_m) == self.keep_in

    def contains(self, north_m: float, east_m: float) -> bool:
        """Whether a place is inside; a ray that crosses the edges an odd number of times says so."""
        if not self.edges:
            north_m -= self.centre_ne_m[0]
            east_m -= self.centre_ne_m[1]
            return north_m * north_m + east_m * east_m < self.radius_m * self.radius_m
        inside = False
        for north_1_m, east_1_m, north_2_m, east_2_m in self.edges:
            if (east_1_m >= east_m) != (east_2_m >= east_m):
                share = (east_m - east_1_m) / (east_2_m - east_1_m)
                if north_m <= north_1_m + share * (north_2_m - north_1_m):
                    inside = not inside
        return inside


def fence_fault(items: Sequence[MissionItem]) -> str | None:
    """What is wrong with a fence as a whole, for people; None: nothing."""
    index = 0
    while index < len(items):
        if items[index].command not in POLYGONS:
            index += 1
            continue
        first, count = items[index], vertex_count(items[index])
        if count < FEWEST_VERTICES:
            return f"Fence item {index + 1}: a polygon of {count} vertices, it needs {FEWEST_VERTICES}"
        vertices = items[index : index + count]
        alike = [
            vertex for vertex in vertices if vertex.command == first.command and vertex_count(vertex) == count
        ]
        if len(alike) < count:
            return f"Fence item {index + 1}: a polygon of {count} vertices, {len(alike)} given"
        index += count
    return None


def vertex_count(item: MissionItem) -> int:
    """How many vertices a polygon's item says the polygon has."""
    count = item.params[0]
    return int(count + 0.5) if isfinite(count) and count >= 0.0 else 0


def shapes_of(items: Sequence[MissionItem], view: View) -> Iterator[Shape]:
    """The shapes of a sound fence in the local frame; a view without a projection gives none."""
    if view.projection is None:
        return
    index = 0
    while index < len(items):
        item = items[index]
        if item.command in POLYGONS:
            count = max(1, vertex_count(item))
            corners = [view.place_of(vertex)[:2] for vertex in items[index : index + count]]
            edges = tuple((*one, *other) for one, other in pairwise([*corners, corners[0]]))
            name = f"polygon of items {index + 1} to {index + count}"
            yield Shape(name, item.command in _KEEP_IN, edges)
            index += count
        else:
            if item.command in CIRCLES:
                north_m, east_m, _ = view.place_of(item)
                name = f"circle of item {index + 1}"
                yield Shape(name, item.command in _KEEP_IN, (), (north_m, east_m), item.params[0])
            index += 1
