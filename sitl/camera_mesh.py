"""All faces of a scene in one array, projected together.

One matrix product gives the image of every corner and on which side of the view's borders it lies; per face
that says whether it is out of sight, can be painted as it is, or must be cut first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from geometry.rotations import RotationRows
from geometry.vectors import Vec3
from sitl.camera_clip import clip_near, clip_window
from sitl.camera_scene import Bgr, Face

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

SHIFT = 4
"""Corners are given to OpenCV in sixteenths of a pixel (its `shift` argument)."""
SUBPIXELS = float(1 << SHIFT)
_BITS = 2.0 ** np.arange(10)
_CUT_BITS = 0b00111101  # beyond the near plane or the window
_FARTHEST = 2.0**24  # sixteenths of a pixel, well within OpenCV's whole numbers of 32 bits


@dataclass(frozen=True, slots=True)
class Pinhole:
    """An ideal camera.

    Attributes:
        width_px: of the image.
        height_px: of the image.
        focal_px: focal length.
        near_m: depth from which on things are seen.
        far_m: a face wholly beyond this depth is not seen.
    """

    width_px: int
    height_px: int
    focal_px: float
    near_m: float
    far_m: float

    @property
    def centre_px(self) -> tuple[float, float]:
        """Where the optical axis meets the image; whole numbers are pixel centres."""
        return ((self.width_px - 1) / 2, (self.height_px - 1) / 2)


@dataclass(frozen=True, slots=True)
class MeshFace:
    """Where the corners of a face stand among all corners, and its colour."""

    index: int
    start: int
    stop: int
    colour: Bgr


class Mesh:
    """The faces of a scene, ready to be projected.

    Attributes:
        faces: in the order given.
    """

    def __init__(self, faces: Sequence[Face], pinhole: Pinhole) -> None:
        self.faces = _number(faces)
        corners = np.concatenate([face.corners_arena_m for face in faces])
        self._corners = np.vstack([corners.T, np.ones(len(corners))])
        self._starts = np.array([face.start for face in self.faces])
        self._normals = np.array([face.normal_arena for face in faces])
        self._offsets = np.array([np.dot(face.normal_arena, face.corners_arena_m[0]) for face in faces])
        self._pinhole = pinhole
        self._window = (-_FARTHEST, -8.0 * pinhole.height_px * SUBPIXELS, _FARTHEST, _FARTHEST)
        self._borders = _borders(pinhole, self._window)

    def project(self, eye_arena_m: Vec3, rotation: RotationRows) -> Projection:
        """Project all faces.

        Args:
            eye_arena_m: place of the camera, shape (3,).
            rotation: rows of the matrix from forward, left, up to arena axes.
        """
        matrix = self._borders @ self._matrix(eye_arena_m, rotation)
        near_m = self._pinhole.near_m
        matrix[3, 3] -= near_m
        matrix[4, 3] += self._pinhole.far_m
        projected = matrix @ self._corners
        # Ten borders are ten bits of one number a corner.
        outside = (_BITS @ (projected[3:] < 0.0)).astype(np.uint16)
        hidden = np.bitwise_and.reduceat(outside, self._starts)
        seen = (self._normals @ eye_arena_m > self._offsets) & (hidden == 0)
        crossing = np.bitwise_or.reduceat(outside, self._starts) & _CUT_BITS
        flat = projected[:2] / np.maximum(projected[2], near_m)
        np.maximum(flat, -_FARTHEST, out=flat)
        np.minimum(flat, _FARTHEST, out=flat)
        pixels = np.rint(flat, out=flat).T.astype(np.int32, order="C")
        return Projection(projected, pixels, seen.tobytes(), crossing.tolist(), near_m, self._window)

    def _matrix(self, eye_arena_m: Vec3, rotation: RotationRows) -> Floats:
        """Return the matrix from (x, y, z, 1) to (u w, v w, w), shape (3, 4), u and v in subpixels."""
        focal = self._pinhole.focal_px * SUBPIXELS
        cu, cv = (centre * SUBPIXELS for centre in self._pinhole.centre_px)
        rows = [(cu * fwd - focal * left, cv * fwd - focal * up, fwd) for fwd, left, up in rotation]
        (a0, b0, c0), (a1, b1, c1), (a2, b2, c2) = rows
        x, y, z = eye_arena_m
        shift = (-a0 * x - a1 * y - a2 * z, -b0 * x - b1 * y - b2 * z, -c0 * x - c1 * y - c2 * z)
        return np.array([*rows, shift]).T


@dataclass(frozen=True, slots=True)
class Projection:
    """All faces as one pose of the camera sees them.

    Attributes:
        corners: columns (u w, v w, w, ...), one for every corner.
        pixels: (u, v) of every corner in sixteenths of a pixel, shape (n, 2); wrong where cuts are needed.
        seen: per face, 1 if it faces the eye and is not wholly outside the view.
        to_cut: per face, not 0 if it must be cut.
        near_m: depth of the near plane.
        window: left, top, right, bottom to cut at.
    """

    corners: Floats
    pixels: Ints
    seen: bytes
    to_cut: list[int]
    near_m: float
    window: tuple[float, float, float, float]

    def outline(self, face: MeshFace) -> Ints | None:
        """Return a seen face's corners in the image (1/16 pixel), shape (k, 2); None if it is cut away."""
        if not self.to_cut[face.index]:
            return self.pixels[face.start : face.stop]
        points = clip_near(self.corners[:3, face.start : face.stop].T.tolist(), self.near_m)
        points = clip_window(points, *self.window)
        if len(points) < 3:
            return None
        return np.array([(round(u), round(v)) for u, v in points], np.int32)


def _number(faces: Sequence[Face]) -> tuple[MeshFace, ...]:
    numbered, start = [], 0
    for index, face in enumerate(faces):
        stop = start + len(face.corners_arena_m)
        numbered.append(MeshFace(index, start, stop, face.colour))
        start = stop
    return tuple(numbered)


def _borders(pinhole: Pinhole, window: tuple[float, float, float, float]) -> Floats:
    """Return the matrix from (u w, v w, w) to itself and the distances from ten borders, shape (13, 3).

    A distance below zero is outside. Near and far plane (still to be moved to their depths), the window's
    four sides, the image's four sides with a pixel to spare for outlines painted on the nearest pixel.
    """
    left, top, right, bottom = window
    width, height = pinhole.width_px * SUBPIXELS, pinhole.height_px * SUBPIXELS
    rows = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for x0, y0, x1, y1 in ((left, top, right, bottom), (-SUBPIXELS, -SUBPIXELS, width, height)):
        rows += [(1.0, 0.0, -x0), (-1.0, 0.0, x1), (0.0, 1.0, -y0), (0.0, -1.0, y1)]
    return np.array(rows)
