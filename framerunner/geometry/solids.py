"""Upright boxes, of which everything solid in an arena consists."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin

from framerunner.geometry.vectors import Vec3


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """An upright box."""

    name: str  # as in the referee's reports
    centre_arena_m: Vec3
    yaw_rad: float  # counter-clockwise from arena x
    half_extents_m: Vec3  # along its own axes
    turn: tuple[float, float] = field(init=False)  # cosine and sine of the yaw

    def __post_init__(self) -> None:
        object.__setattr__(self, "turn", (cos(self.yaw_rad), sin(self.yaw_rad)))

    def is_within(self, reach_m: float, point_m: Vec3) -> bool:
        """Whether a point (arena axes) is inside the box or nearer to it than a distance."""
        x, y, z = self.offset(point_m)
        a, b, c = self.half_extents_m
        x, y, z = abs(x) - a, abs(y) - b, abs(z) - c
        square = x * x if x > 0.0 else 0.0
        if y > 0.0:
            square += y * y
        if z > 0.0:
            square += z * z
        return square < reach_m * reach_m

    def distance_m(self, point_m: Vec3) -> float:
        """Distance of a point (arena axes) from the box, 0 inside it."""
        x, y, z = self.offset(point_m)
        a, b, c = self.half_extents_m
        return hypot(max(0.0, abs(x) - a), max(0.0, abs(y) - b), max(0.0, abs(z) - c))

    def plan_distance_m(self, x_m: float, y_m: float) -> float:
        """Distance of a point from the box seen from above (arena axes), 0 over or under it."""
        return self.distance_m((x_m, y_m, self.centre_arena_m[2]))

    def offset(self, point_m: Vec3) -> Vec3:
        """From the centre to a point given in arena axes, in the box's own axes, metres."""
        c, s = self.turn
        x, y, z = self.centre_arena_m
        dx, dy = point_m[0] - x, point_m[1] - y
        return (c * dx + s * dy, c * dy - s * dx, point_m[2] - z)

    def to_arena(self, offset_m: Vec3) -> Vec3:
        """A point given from the centre in the box's own axes, in arena axes: the inverse of `offset`."""
        c, s = self.turn
        x, y, z = self.centre_arena_m
        return (x + c * offset_m[0] - s * offset_m[1], y + s * offset_m[0] + c * offset_m[1], z + offset_m[2])

    def corners(self) -> list[Vec3]:
        """The eight corners, arena axes."""
        a, b, c = self.half_extents_m
        return [self.to_arena((x, y, z)) for x in (-a, a) for y in (-b, b) for z in (-c, c)]
