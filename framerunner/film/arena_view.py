"""The arena in perspective: floor, base, frames, the drone and where it has flown.

Painted far to near at twice the size and made smaller: so all edges are smooth and nothing shows through the
seams of neighbouring faces.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from firmware_py.airframe import load_airframe
from framerunner.film.colours import MAT, PAPER, RIM, SHADOW, STEM, TATAMI, WHITE, Bgr, bgr, mixed
from framerunner.film.drone_shape import DroneShape, Patch
from framerunner.film.story import Floats, Instant, Story
from framerunner.film.viewpoint import Viewpoint
from framerunner.runs.plots import STATE_COLOURS
from scenarios.models import Light
from sitl.camera_order import PaintTree
from sitl.camera_scene import Face, build_scene

Image = npt.NDArray[np.uint8]

FINE = 2
"""Pixels painted for one that is shown, along each edge."""
DRONE_SCALE = 1.6
"""How much larger than life the drone is drawn: at its own size it is lost on a small screen."""
_SHIFT = 4
_SLAB_M = 0.06  # the floor is drawn as a slab
_TRAIL = [bgr(text) for text in STATE_COLOURS]


def state_colour(kind: int) -> Bgr:
    """The colour of a kind of state, as on the pictures that flights leave."""
    return _TRAIL[kind % len(_TRAIL)]


class ArenaView:
    """A view of one flight's arena.

    Args:
        story: what is shown.
        size_px: width and height of the picture.
    """

    def __init__(self, story: Story, size_px: tuple[int, int]) -> None:
        self._story = story
        self._size_px = size_px
        scenario = story.scenario
        scene = build_scene(scenario.model_copy(update={"light": Light()}))
        self._floor = [Face(scene.tatami.corners_arena_m, (0.0, 0.0, 1.0), TATAMI)]
        self._floor += [Face(mat.corners_arena_m, mat.normal_arena, MAT) for mat in scene.mats]
        self._floor += [Face(shadow.corners_arena_m, shadow.normal_arena, SHADOW) for shadow in scene.shadows]
        self._tree = PaintTree(scene.bodies)
        faces = self._tree.faces
        self._centres_m = np.array([face.corners_arena_m.mean(axis=0) for face in faces]).reshape(-1, 3)
        self._tops_m = np.array([face.corners_arena_m[:, 2].max() for face in faces])
        self._drone = DroneShape(load_airframe(scenario.airframe), DRONE_SCALE)
        self._slab = _slab(scene.tatami.corners_arena_m)
        self._paper = np.full((FINE * size_px[1], FINE * size_px[0], 3), PAPER, np.uint8)
        self._canvas = self._paper.copy()
        self._pen = max(1.0, FINE * size_px[1] / 430)  # a line's width where the picture has its usual size

    def paint(self, instant: Instant, viewpoint: Viewpoint, film_s: float) -> Image:
        """Paint what is to be seen at a time.

        Args:
            instant: of the flight.
            viewpoint: for a picture of this view's size.
            film_s: time of the film, for what turns.

        Returns:
            A new image, BGR, shape (height, width, 3).
        """
        view = viewpoint.scaled(FINE)
        np.copyto(self._canvas, self._paper)
        for corners, colour in self._slab:
            self._fill(view, corners, colour)
        for face in self._floor:
            self._fill(view, face.corners_arena_m, face.colour)
        self._stems(view)
        centre = np.array(instant.position_arena_m)
        self._drop(view, centre)
        order = self._tree.back_to_front((float(view.eye_m[0]), float(view.eye_m[1]), float(view.eye_m[2])))
        self._solids_and_trail(view, order, instant, film_s)
        return np.asarray(cv2.resize(self._canvas, self._size_px, interpolation=cv2.INTER_AREA), np.uint8)

    def _solids_and_trail(self, view: Viewpoint, order: list[int], instant: Instant, film_s: float) -> None:
        """Paint the faces; before the first that is nearer than a piece of the trail, that piece."""
        centre = np.array(instant.position_arena_m)
        points = np.concatenate((self._story.trail_m[: instant.trail], centre[None]))
        pixels = view.project(points)
        slots = self._slots(view, order, (points[1:] + points[:-1]) / 2)
        own = int(self._slots(view, order, centre[None])[0])
        runs = _runs(slots, self._story.trail_kind[: len(slots)])
        self._halo(pixels, runs)
        patches = self._drone.patches(centre, instant.yaw_rad, film_s, instant.motors_on)
        painted = 0
        for slot in sorted({*(slot for slot, *_ in runs), own, len(order)}):
            self._faces(view, order[painted:slot])
            painted = slot
            self._trail(pixels, [run for run in runs if run[0] == slot])
            if slot == own:
                self._patches(view, patches)

    def _faces(self, view: Viewpoint, numbers: Iterable[int]) -> None:
        for number in numbers:
            face = self._tree.faces[number]
            if float(np.dot(view.eye_m - face.corners_arena_m[0], face.normal_arena)) > 0.0:
                self._fill(view, face.corners_arena_m, face.colour)

    def _slots(self, view: Viewpoint, order: list[int], pieces_m: Floats) -> npt.NDArray[np.int64]:
        """How many faces, in the order of painting, come before the first that may hide each piece.

        That is one which is nearer and reaches higher than the piece: the eye looks from above, so its line
        of sight never comes below what it looks at.
        """
        face_m = np.linalg.norm(self._centres_m[order] - view.eye_m, axis=1)
        piece_m = np.linalg.norm(pieces_m - view.eye_m, axis=1)
        hides = (face_m[None, :] < piece_m[:, None]) & (self._tops_m[order][None, :] > pieces_m[:, 2:])
        if not order:
            return np.zeros(len(pieces_m), np.int64)
        return np.where(hides.any(axis=1), hides.argmax(axis=1), len(order))

    def _halo(self, pixels: Floats, runs: list[tuple[int, int, int, int]]) -> None:
        """A light line under the whole trail, so that it stands out from the floor."""
        if runs:
            line = _fixed(pixels[runs[0][2] : runs[-1][3] + 1])
            cv2.polylines(self._canvas, [line], False, WHITE, round(4.2 * self._pen), cv2.LINE_AA, _SHIFT)

    def _trail(self, pixels: Floats, runs: list[tuple[int, int, int, int]]) -> None:
        width = max(1, round(2.5 * self._pen))
        for _, kind, first, last in runs:
            line = _fixed(pixels[first : last + 1])
            cv2.polylines(self._canvas, [line], False, state_colour(kind), width, cv2.LINE_AA, _SHIFT)

    def _patches(self, view: Viewpoint, patches: list[Patch]) -> None:
        for patch in patches:
            outline = view.polygon(patch.corners_m)
            if len(outline) < 3:
                continue
            if patch.solid >= 1.0:
                cv2.fillConvexPoly(self._canvas, _fixed(outline), patch.colour, cv2.LINE_AA, _SHIFT)
            else:
                self._glaze(outline, patch.colour, patch.solid)

    def _glaze(self, outline: Floats, colour: Bgr, solid: float) -> None:
        """Fill a polygon through which something shines."""
        height, width = self._canvas.shape[:2]
        left, top = np.clip(np.floor(outline.min(axis=0)) - 2, 0, (width, height)).astype(int)
        right, bottom = np.clip(np.ceil(outline.max(axis=0)) + 3, 0, (width, height)).astype(int)
        if right <= left or bottom <= top:
            return
        under = self._canvas[top:bottom, left:right]
        over = under.copy()
        cv2.fillConvexPoly(over, _fixed(outline - (left, top)), colour, cv2.LINE_AA, _SHIFT)
        under[:] = cv2.addWeighted(over, solid, under, 1.0 - solid, 0.0)

    def _stems(self, view: Viewpoint) -> None:
        """Thin lines from the frames to the floor, so that the eye finds where they hang."""
        for frame in self._story.scenario.frames:
            below_m = frame.z_m - frame.outer_height_m / 2
            ends = np.array([(frame.x_m, frame.y_m, 0.0), (frame.x_m, frame.y_m, below_m)])
            self._line(view, ends, STEM, 1.2)

    def _drop(self, view: Viewpoint, centre_m: Floats) -> None:
        """The drone's shadow straight below it, and a line down to it."""
        x, y, z = centre_m
        base = self._story.scenario.base
        over_base = max(abs(x - base.x_m), abs(y - base.y_m)) <= base.edge_m / 2
        below_m = 0.0 if not over_base or z < base.top_m else base.top_m
        if below_m > 0.0:
            return  # it stands on the base or hangs close above it: the base is painted later
        angles = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        radius = 0.8 * self._drone.radius_m
        spot = np.stack((x + radius * np.cos(angles), y + radius * np.sin(angles), np.zeros_like(angles)), 1)
        outline = view.polygon(spot)
        if len(outline) > 2:
            self._glaze(outline, mixed(SHADOW, (40, 50, 60), 0.5), 0.55)
        self._line(view, np.array([(x, y, 0.0), (x, y, z)]), mixed(STEM, (40, 50, 60), 0.4), 1.2)

    def _line(self, view: Viewpoint, ends_m: Floats, colour: Bgr, width: float) -> None:
        pixels = view.project(ends_m)
        if np.isfinite(pixels).all():
            thickness = max(1, round(width * self._pen))
            cv2.polylines(self._canvas, [_fixed(pixels)], False, colour, thickness, cv2.LINE_AA, _SHIFT)

    def _fill(self, view: Viewpoint, corners_m: Floats, colour: Bgr) -> None:
        outline = view.polygon(corners_m)
        if len(outline) > 2:
            cv2.fillConvexPoly(self._canvas, _fixed(outline), colour, cv2.LINE_8, _SHIFT)


def _fixed(pixels: Floats) -> npt.NDArray[np.int32]:
    """Pixels as OpenCV's drawing takes them, in sixteenths; what is far beside the picture is kept finite."""
    far = 20_000.0
    kept = np.clip(pixels, -far, far)
    kept[np.isnan(kept)] = -far
    return np.rint(kept * (1 << _SHIFT)).astype(np.int32)


def _runs(slots: npt.NDArray[np.int64], kinds: npt.NDArray[np.int32]) -> list[tuple[int, int, int, int]]:
    """Neighbouring pieces of one slot and one kind: (slot, kind, first, one past the last)."""
    if not len(slots):
        return []
    ends = np.flatnonzero((np.diff(slots) != 0) | (np.diff(kinds) != 0)) + 1
    bounds = [0, *ends.tolist(), len(slots)]
    return [(int(slots[a]), int(kinds[a]), a, b) for a, b in pairwise(bounds)]


def _slab(corners_m: Floats) -> list[tuple[Floats, Bgr]]:
    """The edges of the floor, drawn as a slab a few centimetres thick; those behind it are painted over."""
    low = corners_m - np.array((0.0, 0.0, _SLAB_M))
    count = len(corners_m)
    return [(np.array((low[i - 1], low[i], corners_m[i], corners_m[i - 1])), RIM) for i in range(count)]
