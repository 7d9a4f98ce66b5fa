"""The bars of gates as solid boxes, and the contact of solid boxes with the drone's box.

Contact is found by the separating axis theorem on two boxes (Gottschalk, Lin, Manocha, "OBBTree", 1996):
they overlap if and only if their projections overlap on all of 15 axes; the axis of least overlap is the
direction that pushes them apart. Plain scalars: this runs at the physics rate while something is near.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, sqrt

from framerunner.geometry.rotations import RotationRows
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from scenarios.models import UprightGate

_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


@dataclass(frozen=True, slots=True)
class Touch:
    """The overlap of two boxes."""

    depth_m: float  # along the normal
    normal_arena: Vec3  # unit vector from the solid to the drone
    point_arena_m: Vec3  # where they touch


def gate_solids(gate: UprightGate) -> tuple[Solid, ...]:
    """The four bars of a gate: top, bottom, left, right (left and right between the others)."""
    half_bar, half_depth = gate.bar_m / 2, gate.shape.depth_m / 2
    half_width, half_height = gate.shape.half_m
    level = half_height - half_bar
    side = half_width - half_bar
    left_y, left_x = cos(gate.yaw_rad) * side, -sin(gate.yaw_rad) * side
    x, y, z = gate.position_arena_m
    horizontal: Vec3 = (half_depth, half_width, half_bar)
    upright: Vec3 = (half_depth, half_bar, half_height - gate.bar_m)
    return (
        Solid(gate.colour, (x, y, z + level), gate.yaw_rad, horizontal),
        Solid(gate.colour, (x, y, z - level), gate.yaw_rad, horizontal),
        Solid(gate.colour, (x + left_x, y + left_y, z), gate.yaw_rad, upright),
        Solid(gate.colour, (x - left_x, y - left_y, z), gate.yaw_rad, upright),
    )


def touch(
    solid: Solid, centre_m: Vec3, rotation: RotationRows, half_extents_m: Vec3, entered: Vec3 | None = None
) -> Touch | None:
    """The overlap of a moving box with a solid; None while they are apart.

    Args:
        solid: does not move.
        centre_m: centre of the moving box, arena axes.
        rotation: rows of the matrix from the box's own axes to arena axes.
        half_extents_m: of the moving box.
        entered: normal of the touch at its beginning (arena axes). A thin bar must push back to the side
            the drone came from, however deep it is; the shortest way out may be the far side.
    """
    c, s = solid.turn
    offset = solid.offset(centre_m)
    r0, r1, r2 = rotation
    # The moving box's axes in the solid's axes, as rows of the relative rotation.
    turn: RotationRows = (
        (c * r0[0] + s * r1[0], c * r0[1] + s * r1[1], c * r0[2] + s * r1[2]),
        (c * r1[0] - s * r0[0], c * r1[1] - s * r0[1], c * r1[2] - s * r0[2]),
        r2,
    )
    least = _least_overlap(offset, turn, solid.half_extents_m, half_extents_m)
    if least is None:
        return None
    depth, (nx, ny, nz) = least
    if entered is not None:
        nx, ny, nz = c * entered[0] + s * entered[1], c * entered[1] - s * entered[0], entered[2]
        along = nx * offset[0] + ny * offset[1] + nz * offset[2]
        columns = [(turn[0][j], turn[1][j], turn[2][j]) for j in range(3)]
        depth = max(_reach((nx, ny, nz), columns, solid.half_extents_m, half_extents_m) - along, 0.0)
    point = _touching_point(offset, turn, solid.half_extents_m, half_extents_m)
    return Touch(depth, (c * nx - s * ny, s * nx + c * ny, nz), solid.to_arena(point))


def _least_overlap(offset: Vec3, turn: RotationRows, a: Vec3, b: Vec3) -> tuple[float, Vec3] | None:
    """Depth and normal (from the solid outwards, in its axes) of least overlap; None when apart."""
    # Faces of the solid first: they separate the boxes in nearly every case.
    best_depth, best_normal = 1e9, (0.0, 0.0, 0.0)
    for i in range(3):
        row = turn[i]
        depth = a[i] + b[0] * abs(row[0]) + b[1] * abs(row[1]) + b[2] * abs(row[2]) - abs(offset[i])
        if depth <= 0.0:
            return None
        if depth < best_depth:
            sign = 1.0 if offset[i] >= 0 else -1.0
            best_depth = depth
            best_normal = (sign if i == 0 else 0.0, sign if i == 1 else 0.0, sign if i == 2 else 0.0)
    for j in range(3):  # faces of the moving box
        x, y, z = turn[0][j], turn[1][j], turn[2][j]
        along = x * offset[0] + y * offset[1] + z * offset[2]
        depth = b[j] + a[0] * abs(x) + a[1] * abs(y) + a[2] * abs(z) - abs(along)
        if depth <= 0.0:
            return None
        if depth < best_depth - 1e-9:
            sign = 1.0 if along >= 0 else -1.0
            best_depth, best_normal = depth, (sign * x, sign * y, sign * z)
    for i, i1, i2 in _CYCLES:  # cross products of the solid's edges with the box's edges
        for j, j1, j2 in _CYCLES:
            u, v = turn[i1][j], turn[i2][j]
            length = sqrt(u * u + v * v)
            if length < 1e-3:  # parallel edges: a face axis has covered it
                continue
            along = u * offset[i2] - v * offset[i1]
            reach = a[i1] * abs(v) + a[i2] * abs(u) + b[j1] * abs(turn[i][j2]) + b[j2] * abs(turn[i][j1])
            depth = (reach - abs(along)) / length
            if depth <= 0.0:
                return None
            if depth < best_depth - 1e-9:
                scale = 1.0 / length if along >= 0 else -1.0 / length
                normal = [0.0, 0.0, 0.0]
                normal[i1], normal[i2] = -v * scale, u * scale
                best_depth, best_normal = depth, (normal[0], normal[1], normal[2])
    return best_depth, best_normal


def _reach(normal: Vec3, columns: list[Vec3], a: Vec3, b: Vec3) -> float:
    """The sum of both boxes' extents along a unit vector (in the solid's axes)."""
    nx, ny, nz = normal
    reach = a[0] * abs(nx) + a[1] * abs(ny) + a[2] * abs(nz)
    for half, column in zip(b, columns, strict=True):
        reach += half * abs(nx * column[0] + ny * column[1] + nz * column[2])
    return reach


def _touching_point(offset: Vec3, turn: RotationRows, a: Vec3, b: Vec3) -> Vec3:
    """The point of the moving box nearest to the solid's point nearest to the box's centre."""
    near = [min(max(offset[i], -a[i]), a[i]) - offset[i] for i in range(3)]
    inside = []
    for j in range(3):
        along = near[0] * turn[0][j] + near[1] * turn[1][j] + near[2] * turn[2][j]
        inside.append(min(max(along, -b[j]), b[j]))
    return (
        offset[0] + turn[0][0] * inside[0] + turn[0][1] * inside[1] + turn[0][2] * inside[2],
        offset[1] + turn[1][0] * inside[0] + turn[1][1] * inside[1] + turn[1][2] * inside[2],
        offset[2] + turn[2][0] * inside[0] + turn[2][1] * inside[1] + turn[2][2] * inside[2],
    )
