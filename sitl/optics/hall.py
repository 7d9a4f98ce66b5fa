"""The floor, the hall around the arena, and the flat things on them, as faces to be painted.

All that is in the arena is nearer than the walls and above the floor, so these faces are painted first.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin

import numpy as np

from framerunner.geometry.vectors import Vec3
from scenarios.imaging.effects import Hall, Patch
from scenarios.imaging.furnishings import Surface, Window
from scenarios.models import Arena, Light, Scenario
from sitl.camera_scene import WALL, Bgr, Body, Face, Floats, Scene, brightness, lit
from sitl.optics.colours import CEILING_BGR, DAY_BGR, HALL_BGR, PATCH_BGR, SILL_BGR
from sitl.optics.people import person_body
from sitl.optics.pictures import picture_pyramids
from sitl.optics.texture import FaceTexture, Pyramid, on_face, texture_pyramid

_LIFT_M = 0.002  # of a thing above what it is on; it decides nothing but keeps faces apart
_BEHIND_WALLS_M = 0.2  # how far a textured floor goes on behind the walls, which are painted over it
_LIGHT_STEPS = 100.0  # of the brightness of pictures
_SILL_M = 0.06  # height of a window's sill, and how far it goes beyond the frame
_Axes = tuple[Vec3, Vec3, Vec3, Vec3]  # origin, across, up, normal


class HallFaces:
    """All that is painted before what stands in the arena, in any light.

    Args:
        scenario: floor, hall and what is on them.

    Raises:
        TextureError: a photograph cannot be read.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario, self._hall = scenario, scenario.hall or Hall()
        arena, hall = scenario.arena, self._hall
        beyond_m = 0.0 if scenario.hall is None else hall.beyond_m + _BEHIND_WALLS_M
        self._floor_half_m = (arena.length_x_m / 2 + beyond_m, arena.width_y_m / 2 + beyond_m)
        x, y = self._floor_half_m
        self._floor = self._wall = None
        if scenario.floor_texture is not None:
            self._floor = texture_pyramid(scenario.floor_texture, 2.0 * x, 2.0 * y)
        if hall.wall_texture is not None:
            self._wall = texture_pyramid(hall.wall_texture, 2.0 * max(x, y), hall.height_m)
        self._pictures = picture_pyramids(hall.pictures)
        self._dimmed: dict[str | int, tuple[float, Pyramid]] = {}

    @property
    def is_floor_textured(self) -> bool:
        """Whether shadows darken a picture instead of being areas of a colour."""
        return self._floor is not None

    def before_shadows(self, scene: Scene, light: Light) -> tuple[Face, ...]:
        """Floor and walls with what hangs on these, in the order of painting.

        Args:
            scene: of the scenario in that light.
            light: on all of them.
        """
        walls = [] if self._scenario.hall is None else [*self._walls(light), *self._on_walls(light)]
        walls += self._patches(light, on_floor=False)
        if self._floor is None:
            return (*walls, scene.tatami, *scene.mats)
        # Walls hide where the floor ends.
        return (self._textured_floor(self._floor, light), *walls)

    def people(self, light: Light) -> list[Body]:
        """Who stands around the arena."""
        return [person_body(person, light) for person in self._hall.people]

    def after_shadows(self, light: Light) -> tuple[Face, ...]:
        """What lies on the floor."""
        return tuple(self._patches(light, on_floor=True))

    def _patches(self, light: Light, *, on_floor: bool) -> list[Face]:
        faces = []
        for patch in self._scenario.patches:
            if (patch.surface == "floor") == on_floor:
                axes = _axes(patch.surface, self._scenario.arena, self._hall)
                faces += _patch_faces(patch, axes, light)
        return faces

    def _textured_floor(self, picture: Pyramid, light: Light) -> Face:
        axes = _axes("floor", self._scenario.arena, self._hall)
        x, y = self._floor_half_m
        face = _face(axes, _rectangle(0.0, 0.0, x, y), HALL_BGR, light)
        return replace(face, texture=_hung(self._lit("floor", picture, face, light), axes, (-x, y)))

    def _walls(self, light: Light) -> list[Face]:
        arena, hall = self._scenario.arena, self._hall
        faces = []
        half_z = hall.height_m / 2
        x, y = arena.length_x_m / 2 + hall.beyond_m, arena.width_y_m / 2 + hall.beyond_m
        halves: dict[Surface, float] = {"front": y, "back": y, "left": x, "right": x}
        for surface, half in halves.items():
            axes = _axes(surface, arena, hall)
            face = _face(axes, _rectangle(0.0, half_z, half, half_z), HALL_BGR, light)
            if self._wall is not None:
                picture = self._lit(surface, self._wall, face, light)
                face = replace(face, texture=_hung(picture, axes, (-half, hall.height_m)))
            faces.append(face)
        above = ((0.0, 0.0, hall.height_m), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
        return [*faces, _face(above, _rectangle(0.0, 0.0, x, y), CEILING_BGR, light)]

    def _on_walls(self, light: Light) -> list[Face]:
        """Windows and pictures."""
        arena, hall = self._scenario.arena, self._hall
        faces: list[Face] = []
        for window in hall.windows:
            faces += _window_faces(window, _axes(window.surface, arena, hall), light)
        for index, (picture, pyramid) in enumerate(zip(hall.pictures, self._pictures, strict=True)):
            axes = _axes(picture.surface, arena, hall)
            half_w, half_h = picture.width_m / 2, picture.height_m / 2
            outline = _rectangle(picture.across_m, picture.up_m, half_w, half_h)
            face = _face(axes, outline, HALL_BGR, light, lift_m=_LIFT_M, name="picture")
            upper_left_m = (picture.across_m - half_w, picture.up_m + half_h)
            texture = _hung(self._lit(index, pyramid, face, light), axes, upper_left_m)
            faces.append(replace(face, texture=texture))
        return faces

    def _lit(self, key: str | int, picture: Pyramid, face: Face, light: Light) -> Pyramid:
        """A picture in the light on a face, made again when that has changed by a step."""
        share = round(brightness(face.normal_arena, light) * _LIGHT_STEPS) / _LIGHT_STEPS
        before, dimmed = self._dimmed.get(key, (None, picture))
        if before != share:
            dimmed = picture.dimmed(share)
            self._dimmed[key] = (share, dimmed)
        return dimmed


def _hung(
    picture: Pyramid, axes: _Axes, upper_left_m: tuple[float, float], turn_rad: float = 0.0
) -> FaceTexture:
    """A picture on a surface, its upper left corner given across and up."""
    origin, across, up, _ = (np.array(axis) for axis in axes)
    c, s = cos(turn_rad), sin(turn_rad)
    right, down = c * across + s * up, s * across - c * up
    corner = origin + upper_left_m[0] * across + upper_left_m[1] * up
    return on_face(picture, corner, right, down, axes[3])


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


def _window_faces(window: Window, axes: _Axes, light: Light) -> list[Face]:
    """Its panes, which shine, then the bars of its frame and the one in its middle, and its sill."""
    x, y, half_w, half_h = window.across_m, window.up_m, window.width_m / 2, window.height_m / 2
    bar, colour = window.bar_m / 2, PATCH_BGR[window.colour]
    bars = [_rectangle(x, y + sign * (half_h - bar), half_w, bar) for sign in (1.0, -1.0)]
    bars += [_rectangle(x + side * (half_w - bar), y, bar, half_h) for side in (1.0, 0.0, -1.0)]
    sill = _rectangle(x, y - half_h - _SILL_M / 2, half_w + _SILL_M, _SILL_M / 2)
    panes = _face(axes, _rectangle(x, y, half_w, half_h), DAY_BGR, light, lift_m=_LIFT_M, name="window")
    frame = [_face(axes, part, colour, light, lift_m=_LIFT_M, name="window") for part in bars]
    return [
        replace(panes, colour=DAY_BGR),
        *frame,
        _face(axes, sill, SILL_BGR, light, lift_m=_LIFT_M, name="window"),
    ]


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
    return [
        _face(axes, part @ turn + middle, PATCH_BGR[patch.colour], light, lift_m=_LIFT_M) for part in parts
    ]


def _rectangle(x: float, y: float, half_x: float, half_y: float) -> Floats:
    return np.array(
        [
            [x - half_x, y - half_y],
            [x + half_x, y - half_y],
            [x + half_x, y + half_y],
            [x - half_x, y + half_y],
        ]
    )


def _face(
    axes: _Axes, flat: Floats, colour: Bgr, light: Light, *, lift_m: float = 0.0, name: str = WALL
) -> Face:
    origin, across, up, normal = (np.array(axis) for axis in axes)
    corners = origin + flat[:, :1] * across + flat[:, 1:] * up + lift_m * normal
    return Face(corners, axes[3], lit(colour, axes[3], light), name)
