"""The scenario as flat, shaded polygons: made once, painted many times.

Light does not move and nothing in the arena does, so every face has one colour (Lambert's law with ambient
light) and every shadow on the floor is a fixed polygon.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, sin

import cv2
import numpy as np
import numpy.typing as npt

from geometry.vectors import Vec3
from scenarios.models import Arena, Base, Frame, Light, Scenario

Bgr = tuple[int, int, int]
Floats = npt.NDArray[np.float64]

FRAME_BGR: dict[str, Bgr] = {"red": (0, 0, 255), "green": (0, 255, 0), "blue": (255, 0, 0)}
# None of these passes the detector's colour test, lit, shaded or after JPEG.
SKY_BGR: tuple[Bgr, ...] = ((222, 206, 190), (224, 210, 196), (226, 214, 202), (228, 218, 208))
"""From the zenith down to the horizon."""
GROUND_BGR: Bgr = (132, 134, 134)
UNDERGROUND_BGR: Bgr = (28, 30, 32)
TATAMI_BGR: Bgr = (56, 176, 226)
TATAMI_MAT_BGR: Bgr = (48, 164, 213)
BASE_BGR: Bgr = (168, 170, 172)
BASE_MARK_BGR: Bgr = (238, 238, 238)

MAT_M = 2.0
"""Edge of one mat of the tatami."""
DARKEST = 0.3
"""No face is painted darker than this share of its colour: a frame's colour must stay recognisable."""
SHADOW = 0.6
"""Brightness of the floor in a shadow."""


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

    def reach_m(self, axis: Vec3) -> float:
        """Return how far it extends from its centre along a unit vector."""
        c, s = cos(self.yaw_rad), sin(self.yaw_rad)
        x, y, z = self.half_extents_m
        along, across = c * axis[0] + s * axis[1], c * axis[1] - s * axis[0]
        return x * abs(along) + y * abs(across) + z * abs(axis[2])


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A convex flat polygon that is seen from one side.

    Attributes:
        corners_arena_m: shape (k, 3), in order.
        normal_arena: unit vector to the side it is seen from.
        colour: as painted, shading included.
    """

    corners_arena_m: Floats
    normal_arena: Vec3
    colour: Bgr


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A solid thing.

    Attributes:
        hull: the box around it.
        faces: in the order they may be painted: a later one is never hidden by an earlier one.
    """

    hull: Box
    faces: tuple[Face, ...]


@dataclass(frozen=True, slots=True)
class Scene:
    """All that can be seen.

    Attributes:
        tatami: the arena's floor.
        mats: every second mat of it, darker.
        shadows: on the floor.
        bodies: the base and the frames.
    """

    tatami: Face
    mats: tuple[Face, ...]
    shadows: tuple[Face, ...]
    bodies: tuple[Body, ...]


def build_scene(scenario: Scenario) -> Scene:
    """Turn a scenario into what the camera paints."""
    light, arena = scenario.light, scenario.arena
    bodies = (_base_body(scenario.base, light), *(_frame_body(frame, light) for frame in scenario.frames))
    solids = [_upright_box_corners(bodies[0].hull)]
    for frame in scenario.frames:
        solids += _bar_corners(frame)
    return Scene(
        tatami=_on_floor(_rectangle(arena, 0.0, 1.0, 0.0, 1.0), _lit(TATAMI_BGR, _UP, light)),
        mats=_mats(arena, light),
        shadows=tuple(face for solid in solids for face in _shadow(solid, arena, light)),
        bodies=bodies,
    )


def shade(normal: Vec3, light: Light) -> float:
    """Return the brightness of a face, DARKEST..1: ambient light and the sun by Lambert's law."""
    x, y, z = light.sun_direction_arena
    length = hypot(x, y, z)
    facing = -(normal[0] * x + normal[1] * y + normal[2] * z) / length if length > 0 else 0.0
    return max(DARKEST, light.ambient + (1.0 - light.ambient) * max(0.0, facing))


_UP: Vec3 = (0.0, 0.0, 1.0)


def _dim(colour: Bgr, share: float) -> Bgr:
    blue, green, red = (round(channel * share) for channel in colour)
    return (blue, green, red)


def _lit(colour: Bgr, normal: Vec3, light: Light) -> Bgr:
    return _dim(colour, shade(normal, light))


def _on_floor(corners_xy: Sequence[Sequence[float]] | Floats, colour: Bgr) -> Face:
    corners = np.zeros((len(corners_xy), 3))
    corners[:, :2] = corners_xy
    return Face(corners, _UP, colour)


def _rectangle(arena: Arena, x0: float, x1: float, y0: float, y1: float) -> list[tuple[float, float]]:
    """Return a part of the arena's floor, by shares 0..1 of its edges."""
    left, right = (x0 - 0.5) * arena.length_x_m, (x1 - 0.5) * arena.length_x_m
    near, far = (y0 - 0.5) * arena.width_y_m, (y1 - 0.5) * arena.width_y_m
    return [(left, near), (right, near), (right, far), (left, far)]


def _mats(arena: Arena, light: Light) -> tuple[Face, ...]:
    """Return every second mat as on a chessboard; at most 20 by 20 mats, so that a huge arena stays cheap."""
    colour = _lit(TATAMI_MAT_BGR, _UP, light)
    rows = min(20, max(1, round(arena.length_x_m / MAT_M)))
    columns = min(20, max(1, round(arena.width_y_m / MAT_M)))
    return tuple(
        _on_floor(_rectangle(arena, i / rows, (i + 1) / rows, j / columns, (j + 1) / columns), colour)
        for i in range(rows)
        for j in range(columns)
        if (i + j) % 2
    )


def _placed(box: Box, local: Sequence[Vec3]) -> Floats:
    """Return points given in a box's own axes (metres from its centre) in arena axes, shape (k, 3)."""
    c, s = cos(box.yaw_rad), sin(box.yaw_rad)
    x, y, z = box.centre_arena_m
    return np.array([(x + c * p[0] - s * p[1], y + s * p[0] + c * p[1], z + p[2]) for p in local])


def _face(box: Box, local: Sequence[Vec3], normal: Vec3, colour: Bgr, light: Light) -> Face:
    c, s = cos(box.yaw_rad), sin(box.yaw_rad)
    turned = (c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], normal[2])
    return Face(_placed(box, local), turned, _lit(colour, turned, light))


def _base_body(base: Base, light: Light) -> Body:
    half = base.edge_m / 2
    box = Box((base.x_m, base.y_m, base.top_m / 2), (half, half, base.top_m / 2))
    faces = [
        _face(box, _side(box.half_extents_m, axis, sign), _normal(axis, sign), BASE_BGR, light)
        for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1))
    ]
    mark, top = 0.7 * half, base.top_m / 2
    inset: list[Vec3] = [(-mark, -mark, top), (mark, -mark, top), (mark, mark, top), (-mark, mark, top)]
    faces.append(_face(box, inset, _UP, BASE_MARK_BGR, light))
    return Body(box, tuple(faces))


def _frame_body(frame: Frame, light: Light) -> Body:
    """Return a frame: the faces of its opening first, then those of its hull.

    Whatever hides a part of the opening's faces from an eye lies on the hull, and the faces of the hull that
    an eye sees never hide one another, so this order is right from everywhere.
    """
    colour = FRAME_BGR[frame.colour]
    outer: Vec3 = (frame.bar_m / 2, frame.outer_width_m / 2, frame.outer_height_m / 2)
    inner: Vec3 = (outer[0], outer[1] - frame.bar_m, outer[2] - frame.bar_m)
    box = Box(frame.position_arena_m, outer, frame.yaw_rad)
    around = ((1, 1), (1, -1), (2, 1), (2, -1))
    faces = [
        _face(box, _side(inner, axis, sign), _normal(axis, -sign), colour, light) for axis, sign in around
    ]
    for sign in (1, -1):
        x, y, z, v, w = sign * outer[0], outer[1], outer[2], inner[1], inner[2]
        for y0, y1, z0, z1 in ((-y, y, w, z), (-y, y, -z, -w), (v, y, -w, w), (-y, -v, -w, w)):
            quad: list[Vec3] = [(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)]
            faces.append(_face(box, quad, _normal(0, sign), colour, light))
    faces += [
        _face(box, _side(outer, axis, sign), _normal(axis, sign), colour, light) for axis, sign in around
    ]
    return Body(box, tuple(faces))


def _normal(axis: int, sign: int) -> Vec3:
    return (float(sign * (axis == 0)), float(sign * (axis == 1)), float(sign * (axis == 2)))


def _side(half: Vec3, axis: int, sign: int) -> list[Vec3]:
    """Return the corners of one side of a box, in order around it."""
    corners = []
    for first, second in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        signs = [first, second]
        signs.insert(axis, sign)
        corners.append((signs[0] * half[0], signs[1] * half[1], signs[2] * half[2]))
    return corners


def _upright_box_corners(box: Box) -> Floats:
    return _placed(box, _side(box.half_extents_m, 2, 1) + _side(box.half_extents_m, 2, -1))


def _bar_corners(frame: Frame) -> list[Floats]:
    """Return the eight corners of each bar of a frame, in arena axes."""
    box = Box(frame.position_arena_m, (0.0, 0.0, 0.0), frame.yaw_rad)
    bar, y, z = frame.bar_m, frame.outer_width_m / 2, frame.outer_height_m / 2
    spans = ((-y, y, z - bar, z), (-y, y, -z, bar - z), (y - bar, y, -z, z), (-y, bar - y, -z, z))
    return [
        _placed(box, [(a, b, c) for a in (-bar / 2, bar / 2) for b in (y0, y1) for c in (z0, z1)])
        for y0, y1, z0, z1 in spans
    ]


def _shadow(corners: Floats, arena: Arena, light: Light) -> list[Face]:
    """Return the shadow of a convex solid on the floor; none if the sun does not shine from above."""
    sun = np.array(light.sun_direction_arena)
    if sun[2] >= -1e-3 * float(np.linalg.norm(sun)):
        return []
    cast = corners[:, :2] - corners[:, 2:] / sun[2] * sun[:2]
    outline = cv2.convexHull(cast.astype(np.float32)).reshape(-1, 2)
    x, y = cast.mean(axis=0)
    on_tatami = abs(x) <= arena.length_x_m / 2 and abs(y) <= arena.width_y_m / 2
    lit = _lit(TATAMI_BGR if on_tatami else GROUND_BGR, _UP, light)
    return [_on_floor(outline, _dim(lit, SHADOW))]
