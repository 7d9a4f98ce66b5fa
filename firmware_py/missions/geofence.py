"""The geofence: polygons, circles and distances from home that the vehicle must not leave."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, isfinite

from firmware_py.missions.flight import VehicleView
from firmware_py.missions.items import CIRCLES, POLYGONS, Do, MissionItem
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import CRITICAL, StatusText
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import LocalProjection

MIN_VERTICES = 3
"""Of a polygon."""

_KEEP_IN = frozenset({Do.POLYGON_INCLUSION, Do.CIRCLE_INCLUSION})

Edge = tuple[float, float, float, float]  # north and east of one end, then of the other


@dataclass(frozen=True, slots=True)
class Shape:
    """A polygon, or a circle if it has no edges.

    Attributes:
        name: for people.
        keep_in: whether the vehicle must stay inside; else outside.
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
        """Whether a place is inside: a ray from it crosses the edges an odd number of times."""
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
    """What makes a fence invalid, for people; None: nothing."""
    index = 0
    while index < len(items):
        if items[index].command not in POLYGONS:
            index += 1
            continue
        first, count = items[index], vertex_count(items[index])
        if count < MIN_VERTICES:
            return f"Fence item {index + 1}: a polygon of {count} vertices, it needs {MIN_VERTICES}"
        vertices = items[index : index + count]
        alike = [
            vertex for vertex in vertices if vertex.command == first.command and vertex_count(vertex) == count
        ]
        if len(alike) < count:
            return f"Fence item {index + 1}: a polygon of {count} vertices, {len(alike)} given"
        index += count
    return None


def vertex_count(item: MissionItem) -> int:
    """The number of vertices that a polygon's item gives for its polygon."""
    count = item.params[0]
    return int(count + 0.5) if isfinite(count) and count >= 0.0 else 0


def shapes_of(items: Sequence[MissionItem], view: VehicleView) -> Iterator[Shape]:
    """The shapes of a valid fence in the local frame; none without a projection."""
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


class Geofence:
    """The store's fence and the GF_ parameters, prepared once for quick checks.

    As in PX4 a shape that home would breach is left out, with a text; so is one that the vehicle in flight
    would breach at the moment of the upload, unless GF_ACTION is 0.

    A breach is returned as text for people, such as "outside circle of item 1"; None: no breach.
    """

    def __init__(self, store: MissionStore, parameters: Parameters) -> None:
        self._store = store
        self._parameters = parameters
        self._parameters_version = -1
        self._prepared: tuple[int, LocalProjection | None] = (-1, None)
        self._shapes: tuple[Shape, ...] = ()
        self._texts: list[StatusText] = []

    def check(self, view: VehicleView) -> str | None:
        """The breach of the vehicle; with GF_PREDICT, of the place where it can stop."""
        self._prepare(view)
        if self._braking is None:
            return self._breach(view.position_ned_m, view)
        return self._breach(_stopping_place(view, *self._braking), view)

    def breach_at(self, position_ned_m: Vec3, view: VehicleView) -> str | None:
        """The breach of a place in the local frame."""
        self._prepare(view)
        return self._breach(position_ned_m, view)

    def take_texts(self) -> list[StatusText]:
        """Texts about shapes that were left out since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def _breach(self, position_ned_m: Vec3, view: VehicleView) -> str | None:
        home_ned_m = view.home_ned_m
        if home_ned_m is not None:
            north_m, east_m, down_m = position_ned_m
            if 0.0 < self._radius_m <= hypot(north_m - home_ned_m[0], east_m - home_ned_m[1]):
                return f"farther from home than {self._radius_m:g} m"
            if 0.0 < self._height_m <= home_ned_m[2] - down_m:
                return f"higher above home than {self._height_m:g} m"
        for shape in self._shapes:
            if not shape.allows(position_ned_m):
                return f"{'outside' if shape.keep_in else 'inside'} {shape.name}"
        return None

    def _prepare(self, view: VehicleView) -> None:
        """Apply the plan and the parameters when they have changed."""
        if self._parameters.version != self._parameters_version:
            self._configure()
        state = (self._store.fence.version, view.projection)
        if state == self._prepared:
            return
        self._prepared = state
        flying = not view.landed and self._parameters.integer("GF_ACTION") != 0
        kept = []
        for shape in shapes_of(self._store.fence.items, view):
            if view.home_ned_m is not None and not shape.allows(view.home_ned_m):
                self._reject(shape, "Home position")
            elif flying and not shape.allows(view.position_ned_m):
                self._reject(shape, "current vehicle position")
            else:
                kept.append(shape)
        self._shapes = tuple(kept)

    def _reject(self, shape: Shape, whom: str) -> None:
        verb = "doesn't contain" if shape.keep_in else "excludes"
        self._texts.append(StatusText(CRITICAL, f"Geofence invalid, {verb} {whom}: {shape.name}"))

    def _configure(self) -> None:
        value = self._parameters.value
        self._parameters_version = self._parameters.version
        self._radius_m = value("GF_MAX_HOR_DIST")
        self._height_m = value("GF_MAX_VER_DIST")
        self._braking: tuple[float, float, float] | None = None
        if value("GF_PREDICT"):
            self._braking = (value("MPC_ACC_HOR"), value("MPC_ACC_DOWN_MAX"), value("MPC_JERK_AUTO"))


def _stopping_place(
    view: VehicleView, horizontal_m_s2: float, downward_m_s2: float, jerk_m_s3: float
) -> Vec3:
    """Where the vehicle comes to rest if it brakes now; a descent is ignored, no fence is below.

    The distance is v^2 / (2 a) and, for the time in which the acceleration builds up, v a / j.
    """
    north_m_s, east_m_s, down_m_s = view.velocity_ned_m_s
    north_m, east_m, down_m = view.position_ned_m
    speed_m_s, climb_m_s = hypot(north_m_s, east_m_s), max(0.0, -down_m_s)
    time_s = speed_m_s / (2.0 * horizontal_m_s2) + horizontal_m_s2 / jerk_m_s3
    climb_m = climb_m_s * (climb_m_s / (2.0 * downward_m_s2) + downward_m_s2 / jerk_m_s3)
    return (north_m + time_s * north_m_s, east_m + time_s * east_m_s, down_m - climb_m)
