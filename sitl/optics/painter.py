"""What a pinhole camera sees of a scenario, painted with OpenCV.

Far to near: sky, ground to the horizon, the hall's walls, tatami, shadows, then base and gates in an order
in which nothing is painted over by what it hides.

Pixels: OpenCV's convention, whole coordinates at pixel centres, so the optical axis is at ((w - 1) / 2,
(h - 1) / 2) and projection agrees with `cv2.projectPoints`. Pixels are painted whose centres are
inside a polygon (`camera_projection` takes back what OpenCV paints beyond it). Small bodies are painted two
or four times as finely, and the camera takes means of the canvas's pixels, so edges are anti-aliased where
they are, and a bar thinner than a pixel is as bright as its share.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import hypot

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import RotationRows
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from scenarios.models import Scenario
from sitl.camera_projection import (
    SHIFT,
    SUBPIXELS,
    Floats,
    Ints,
    Mesh,
    MeshFace,
    Pinhole,
    Projection,
    clip_half_plane,
    drone_outlines,
)
from sitl.camera_scene import (
    DRONE_BGR,
    GROUND_BGR,
    SHADOW,
    SKY_BGR,
    UNDERGROUND_BGR,
    PaintTree,
    build_scene,
)
from sitl.optics.backdrop import Backdrop
from sitl.optics.hall import HallFaces
from sitl.optics.textured import TexturePainter

Image = npt.NDArray[np.uint8]

MARGIN_PX = 2
"""To be painted around an image and cut off: OpenCV is not exact at the border of its canvas."""

_HAZE_BAND = 0.09  # height of a band of haze above the horizon, as a share of the focal length
_BANDS_BGR = (*SKY_BGR[1:], GROUND_BGR)
_OVERLAP_PX = 2.0  # of neighbouring bands of colour, so that no gap is seen between them
_FAR_HEIGHTS = 4.0  # of the image: lines farther away than this are cut before they are painted
_FAR_M = 1e5  # from farther away only sky and ground are seen
_LIGHT_STEP_RAD = 0.01  # the scene is lit anew when the light has turned by this


@dataclass(frozen=True, slots=True)
class _Lit:
    """The scene in one light, ready to be projected."""

    tree: PaintTree
    mesh: Mesh
    floor: tuple[MeshFace, ...]  # and the hall's walls: in the order of painting, before all else
    shadows: range  # of the floor's faces those that darken what is below them, if that is a picture
    solid: tuple[MeshFace, ...]  # in the order of the tree's faces
    part: list[int]  # of each of these, its number among the mesh's parts


class Painter:
    """Paints a scenario on canvases of one size."""

    def __init__(self, scenario: Scenario, pinhole: Pinhole) -> None:
        self._scenario, self._pinhole = scenario, pinhole
        shape = (pinhole.height_px, pinhole.width_px, 3)
        self._sky = np.full(shape, SKY_BGR[0], np.uint8)
        right, bottom = float(pinhole.width_px), float(pinhole.height_px)
        self._corners_px = ((-1.0, -1.0), (right, -1.0), (right, bottom), (-1.0, bottom))
        turn_rad_s = abs(scenario.light.turn_rad_s)
        self._step_us = round(1e6 * _LIGHT_STEP_RAD / turn_rad_s) if turn_rad_s > 0.0 else None
        self._step = 0
        self._surroundings = HallFaces(scenario)
        self._textured = TexturePainter(pinhole)
        self._lit = self._light(0)

    def paint(
        self,
        eye_arena_m: Vec3,
        rotation: RotationRows,
        drones: Sequence[Solid] = (),
        *,
        time_us: int = 0,
        drift: Floats | None = None,
        canvas: Image | None = None,
        backdrop: Backdrop | None = None,
    ) -> Image:
        """Paint a canvas, BGR, shape (height, width, 3).

        Args:
            eye_arena_m: position of the camera.
            rotation: rows of the matrix from forward, left, up to arena axes.
            drones: boxes of other drones.
            time_us: chooses the light, if that changes.
            drift: of a rolling shutter, see `Mesh.project`.
            canvas: to be painted on; by default a new one.
            backdrop: seen instead of sky, ground, hall and what lies on the floor.
        """
        if canvas is None:
            canvas = np.empty_like(self._sky)
        if eye_arena_m[2] <= 0.0:
            canvas[:] = UNDERGROUND_BGR
            return canvas
        if backdrop is None:
            np.copyto(canvas, self._sky)
            self._paint_background(canvas, rotation)
        else:
            backdrop.paint(canvas, rotation, self._pinhole)
        if max(map(abs, eye_arena_m)) >= _FAR_M:
            return canvas
        if self._step_us is not None and time_us // self._step_us != self._step:
            self._step = time_us // self._step_us
            self._lit = self._light(self._step * self._step_us)
        lit = self._lit
        projection = lit.mesh.project(eye_arena_m, rotation, drift)
        if backdrop is None:
            self._paint_floor(canvas, projection, lit)
        order = lit.tree.back_to_front(eye_arena_m)
        painted = 0
        for behind, outline in self._place_drones(drones, eye_arena_m, rotation) if drones else ():
            _paint_solids(canvas, projection, lit, order[painted:behind])
            cv2.fillConvexPoly(canvas, outline, DRONE_BGR, cv2.LINE_8, SHIFT)
            painted = behind
        _paint_solids(canvas, projection, lit, order[painted:])
        return canvas

    def _light(self, time_us: int) -> _Lit:
        """The scene in the light of a time."""
        light = self._scenario.light.after(time_us / 1e6)
        scene = build_scene(self._scenario, light)
        surroundings = self._surroundings
        tree = PaintTree((*scene.bodies, *surroundings.people(light)))
        below = surroundings.before_shadows(scene, light)
        floor = (*below, *scene.shadows, *surroundings.after_shadows(light))
        mesh = Mesh([*floor, *tree.faces], [len(floor) + first for first in tree.parts], self._pinhole)
        sizes = np.diff(tree.parts, append=len(tree.faces))
        part = np.repeat(np.arange(1, len(sizes) + 1), sizes).tolist()
        first, stop = len(below), len(below) + len(scene.shadows)
        shadows = range(first, stop) if surroundings.is_floor_textured else range(0)
        return _Lit(tree, mesh, mesh.faces[: len(floor)], shadows, mesh.faces[len(floor) :], part)

    def _place_drones(
        self, drones: Sequence[Solid], eye: Vec3, rotation: RotationRows
    ) -> list[tuple[int, Ints]]:
        """How many faces are painted before each drone seen, and its outline, in order of painting."""
        found = drone_outlines(drones, eye, rotation, self._pinhole)
        places = self._lit.tree.places(
            eye, np.array([drone.centre_arena_m for drone, _ in found]).reshape(-1, 3)
        )
        outlines = [outline for _, outline in found]
        return sorted(zip(places.tolist(), outlines, strict=True), key=lambda each: each[0])

    def _paint_floor(self, canvas: Image, projection: Projection, lit: _Lit) -> None:
        """Floor, walls, and what is on them."""
        seen, shadows = projection.seen, lit.shadows
        if not shadows and all(face.texture is None for face in lit.floor):
            _paint(canvas, projection, [face for face in lit.floor if seen[face.index]])
            return
        for face in lit.floor:
            if face.index == shadows.start and shadows:
                outlines = [projection.outline(lit.floor[index]) for index in shadows if seen[index]]
                self._textured.darken(canvas, [each for each in outlines if each is not None], SHADOW)
            if not seen[face.index] or face.index in shadows:
                continue
            if face.texture is None:
                _paint(canvas, projection, (face,))
            else:
                self._textured.paint(canvas, projection, face, face.texture)

    def _paint_background(self, canvas: Image, rotation: RotationRows) -> None:
        """Paint the haze and the ground: bands between lines parallel to the horizon."""
        focal, (cu, cv) = self._pinhole.focal_px, self._pinhole.centre_px
        fwd_z, left_z, up_z = rotation[2]
        # A pixel's ray goes down where fwd_z - left_z (u - cu)/f - up_z (v - cv)/f is negative.
        a, b = left_z / focal, up_z / focal
        c = -(fwd_z + a * cu + b * cv) - 0.5 * max(abs(a), abs(b))  # OpenCV paints the nearest pixels, too
        band = _HAZE_BAND * hypot(left_z, up_z)
        starts = (c + 3.0 * band, c + 2.0 * band, c + band, c)  # a band is where a u + b v + start >= 0
        bands = self._upright_bands(a, b, starts) or self._tilted_bands(a, b, starts)
        for colour, outline in zip(_BANDS_BGR, bands, strict=True):
            if len(outline) > 2:
                cv2.fillConvexPoly(canvas, outline, colour, cv2.LINE_8, SHIFT)

    def _upright_bands(self, a: float, b: float, starts: Sequence[float]) -> list[Ints] | None:
        """The bands from the left to the right border; None if they are too steep for that."""
        if abs(a) >= b:  # also straight down, where both are zero
            return None
        (left, _), (right, bottom) = self._corners_px[0], self._corners_px[2]
        l0, l1, l2, l3 = (-(start + a * left) / b for start in starts)
        r0, r1, r2, r3 = (-(start + a * right) / b for start in starts)
        if max(abs(l0), abs(r0), abs(l3), abs(r3)) > _FAR_HEIGHTS * bottom:
            return None
        over = _OVERLAP_PX
        corners = np.array(
            (
                ((left, l0), (right, r0), (right, r1 + over), (left, l1 + over)),
                ((left, l1), (right, r1), (right, r2 + over), (left, l2 + over)),
                ((left, l2), (right, r2), (right, r3 + over), (left, l3 + over)),
                ((left, l3), (right, r3), (right, max(bottom, r3)), (left, max(bottom, l3))),
            )
        )
        return list(np.rint(SUBPIXELS * corners).astype(np.int32))

    def _tilted_bands(self, a: float, b: float, starts: Sequence[float]) -> list[Ints]:
        """The same for any attitude: half planes cut to the image."""
        overlap = _OVERLAP_PX * hypot(a, b)
        bands: list[Ints] = []
        for i, start in enumerate(starts):
            points = clip_half_plane(self._corners_px, a, b, start)
            if i + 1 < len(starts):  # no farther than a little into the next colour
                points = clip_half_plane(points, -a, -b, overlap - starts[i + 1])
            bands.append(np.rint(SUBPIXELS * np.array(points).reshape(-1, 2)).astype(np.int32))
        return bands


def _paint_solids(canvas: Image, projection: Projection, lit: _Lit, order: Sequence[int]) -> None:
    """Paint faces of the tree in their order; small things finely, as thin bars need it."""
    seen, first = projection.seen, len(lit.floor)
    for part, indices in groupby(order, lit.part.__getitem__):
        faces = [lit.solid[i] for i in indices if seen[first + i]]
        if not faces:
            continue
        left, top, right, bottom, scale = projection.views[part]
        if scale == 1:
            _paint(canvas, projection, faces)
            continue
        view = canvas[top:bottom, left:right]
        size = (scale * (right - left), scale * (bottom - top))
        fine = cv2.resize(view, size, interpolation=cv2.INTER_NEAREST)
        _paint(fine, projection, faces)
        view[...] = reduced(fine, scale)


def reduced(image: Image, scale: int) -> Image:
    """The mean of scale by scale pixels for each pixel of a new image; the scale is a power of two."""
    while scale > 1:
        height, width = image.shape[:2]
        # Twice by two is several times as fast as by four.
        image = np.asarray(
            cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA), np.uint8
        )
        scale //= 2
    return image


def _paint(canvas: Image, projection: Projection, faces: Iterable[MeshFace]) -> None:
    """Paint faces in their order."""
    for face in faces:
        outline = projection.outline(face)
        if outline is not None:
            cv2.fillConvexPoly(canvas, outline, face.colour, cv2.LINE_8, SHIFT)
