"""The hall around the arena, and the flat things on its walls and on the floor, as faces to be painted.

All that is in the arena is nearer than the walls and above the floor, so these faces are painted first.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from framerunner.geometry.vectors import Vec3
from scenarios.imaging.effects import Hall, Patch, PatchColour, Surface
from scenarios.models import Arena, Light, Scenario
from sitl.camera_scene import WALL, Bgr, Face, Floats, lit

HALL_BGR: Bgr = (196, 204, 206)
CEILING_BGR: Bgr = (226, 228, 228)
PATCH_BGR: dict[PatchColour, Bgr] = {
    "red": (36, 28, 214),
    "green": (60, 172, 34),
    "blue": (196, 66, 24),
    "cyan": (216, 178, 22),
    "magenta": (150, 34, 206),
    "yellow": (20, 208, 240),
    "orange": (22, 118, 236),
    "white": (240, 242, 242),
    "black": (34, 32, 30),
}
"""Colours of print and cloth: less pure than a gate's."""

_LIFT_M = 0.002  # of a thing above what it is on; it decides nothing but keeps faces apart
_Axes = tuple[Vec3, Vec3, Vec3, Vec3]  # origin, across, up, normal


def hall_faces(scenario: Scenario, light: Light) -> tuple[list[Face], list[Face]]:
    """The faces that are painted before the arena's floor, and those that are painted on it."""
    walls: list[Face] = []
    if scenario.hall is not None:
        walls += _walls(scenario.arena, scenario.hall, light)
    on_floor: list[Face] = []
    for patch in scenario.patches:
        axes = _axes(patch.surface, scenario.arena, scenario.hall or Hall())
        faces = _patch_faces(patch, axes, light)
        (on_floor if patch.surface == "floor" else walls).extend(faces)
    return walls, on_floor


def _walls(arena: Arena, hall: Hall, light: Light) -> list[Face]:
    faces = []
    half_z = hall.height_m / 2
    x, y = arena.length_x_m / 2 + hall.beyond_m, arena.width_y_m / 2 + hall.beyond_m
    halves: dict[Surface, float] = {"front": y, "back": y, "left": x, "right": x}
    for surface, half in halves.items():
        axes = _axes(surface, arena, hall)
        faces.append(_face(axes, _rectangle(0.0, half_z, half, half_z), HALL_BGR, light))
    above = ((0.0, 0.0, hall.height_m), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
    return [*faces, _face(above, _rectangle(0.0, 0.0, x, y), CEILING_BGR, light)]


def _axes(surface: Surface, arena: Arena, hall: Hall) -> _Axes:
    """Where a surface is: its origin, its two directions, and the side from which it is seen."""
    x, y = arena.length_x_m / 2 + hall.beyond_m, arena.width_y_m / 2 + hall.beyond_m
    up = (0.0, 0.0, 1.0)
    axes: dict[Surface, _Axes] = {
        "floor": ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), up),
        "front": ((x, 0.0, 0.0), (0.0, -1.0, 0.0), up, (-1.0, 0.0, 0.0)),
        "back": ((-x, 0.0, 0.0), (0.0, 1.0, 0.0), up, (1.0, 0.0, 0.0)),
        "left": ((0.0, y, 0.0), (1.0, 0.0, 0.0), up, (0.0, -1.0, 0.0)),
        "right": ((0.0, -y, 0.0), (-1.0, 0.0, 0.0), up, (0.0, 1.0, 0.0)),
    }
    return axes[surface]


def _patch_faces(patch: Patch, axes: _Axes, light: Light) -> list[Face]:
    """A rectangle, or the four parts of its border."""
    half_w, half_h, border = patch.width_m / 2, patch.height_m / 2, patch.border_m
    parts = [_rectangle(0.0, 0.0, half_w, half_h)]
    if border is not None and border < min(half_w, half_h):
        inner = half_h - border
        parts = [_rectangle(0.0, sign * (half_h - border / 2), half_w, border / 2) for sign in (1.0, -1.0)]
        parts += [_rectangle(sign * (half_w - border / 2), 0.0, border / 2, inner) for sign in (1.0, -1.0)]
    c, s = cos(patch.turn_rad), sin(patch.turn_rad)
    turn = np.array([[c, s], [-s, c]])
    middle = np.array([patch.across_m, patch.up_m])
    return [_face(axes, part @ turn + middle, PATCH_BGR[patch.colour], light, _LIFT_M) for part in parts]


def _rectangle(x: float, y: float, half_x: float, half_y: float) -> Floats:
    return np.array(
        [
            [x - half_x, y - half_y],
            [x + half_x, y - half_y],
            [x + half_x, y + half_y],
            [x - half_x, y + half_y],
        ]
    )


def _face(axes: _Axes, flat: Floats, colour: Bgr, light: Light, lift_m: float = 0.0) -> Face:
    origin, across, up, normal = (np.array(axis) for axis in axes)
    corners = origin + flat[:, :1] * across + flat[:, 1:] * up + lift_m * normal
    return Face(corners, axes[3], lit(colour, axes[3], light), WALL)
