"""The cube of the base as a wire model, and which of its edges a camera sees.

Axes of the base: x and y along its edges, z up, the origin on the floor under its centre. A camera looks
along the first of its axes forward, left, up; pixels count right and down from its optical axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from vision.calibration.lens import Lens

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]

NEAREST_M: Final = 0.05
"""Depth from which on points are projected."""
TOP: Final = 4
MARK: Final = 5
BACKGROUND: Final = 6
"""Numbers of what is beside an edge; 0 to 3 are the cube's upright faces."""

_AROUND = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
_NORMALS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_LOWER = [(k, (k + 1) % 4, k, BACKGROUND) for k in range(4)]
_UPRIGHT = [(k, 4 + k, k, (k - 1) % 4) for k in range(4)]
_UPPER = [(4 + k, 4 + (k + 1) % 4, k, TOP) for k in range(4)]
_OF_MARK = [(8 + k, 8 + (k + 1) % 4, MARK, TOP) for k in range(4)]
_EDGES: Ints = np.array([*_LOWER, *_UPRIGHT, *_UPPER, *_OF_MARK], np.intp)
_CUBE_EDGES = 12


@dataclass(frozen=True)
class BaseShape:
    """Size of a base.

    Attributes:
        edge_m: of its square top.
        top_m: height of the top above the floor.
        mark_m: edge of the square in the middle of the top that has another brightness; 0: there is none.
    """

    edge_m: float
    top_m: float
    mark_m: float = 0.0

    @cached_property
    def points_m(self) -> Floats:
        """Lower corners, upper corners, corners of the mark, shape (12, 3); without a mark shape (8, 3)."""
        levels = ((self.edge_m, 0.0), (self.edge_m, self.top_m), (self.mark_m, self.top_m))
        return np.array(
            [
                (x * width / 2, y * width / 2, z)
                for width, z in levels[: 3 if self.mark_m > 0.0 else 2]
                for x, y in _AROUND
            ]
        )

    @cached_property
    def edges(self) -> Ints:
        """Both ends (numbers of points) and both faces of each edge, shape (16, 4) or (12, 4)."""
        return _EDGES if self.mark_m > 0.0 else _EDGES[:_CUBE_EDGES]

    @cached_property
    def _offsets_m(self) -> Floats:
        """How far each face is from the origin, along its normal."""
        return np.array([self.edge_m / 2] * 4 + [self.top_m])

    @staticmethod
    def is_upright(numbers: Ints) -> Flags:
        """Which of these edges are upright."""
        flags: Flags = (numbers >= len(_LOWER)) & (numbers < len(_LOWER) + len(_UPRIGHT))
        return flags

    def faces_seen(self, eyes_m: Floats) -> Flags:
        """Which faces are turned to each eye, shape (n, 7): the mark is with the top, the background never.

        Args:
            eyes_m: positions in the base's axes, shape (n, 3).
        """
        seen: Flags = eyes_m @ _NORMALS.T > self._offsets_m
        return np.hstack([seen, seen[:, TOP:], np.zeros((len(seen), 1), np.bool_)])


@dataclass(frozen=True, slots=True, eq=False)
class BaseCamera:
    """A base, and the camera that sees it.

    Attributes:
        shape: of the base.
        focal_px: focal length; the optical axis is in the middle of the image.
        lens: of a camera that is not ideal; it has the same focal length.
    """

    shape: BaseShape
    focal_px: float
    lens: Lens | None = None


@dataclass(frozen=True, slots=True)
class CameraView:
    """A camera beside the base.

    Attributes:
        eye_m: its position in the base's axes, shape (3,).
        turn: the matrix from its axes forward, left, up to the base's, shape (3, 3).
    """

    eye_m: Floats
    turn: Floats

    def moved(self, change: Floats) -> CameraView:
        """Moved (metres) and turned (a rotation vector, radians), both in the base's axes, shape (6,)."""
        return CameraView(self.eye_m + change[:3], turned(change[3:]) @ self.turn)


def turned(vector_rad: Floats) -> Floats:
    """The matrix of a rotation vector (Rodrigues' formula), shape (3, 3)."""
    angle = float(np.linalg.norm(vector_rad))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector_rad / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix: Floats = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return matrix


def projected(in_camera_m: Floats, focal_px: float) -> Floats:
    """Pixels right and down of points in a camera's axes, shape (..., 2); their depth must be positive."""
    pixels: Floats = -focal_px * in_camera_m[..., 1:] / in_camera_m[..., :1]
    return pixels


@dataclass(frozen=True, slots=True, eq=False)
class SeenEdges:
    """The edges that a camera sees, cut off at its nearest depth and at the image's borders.

    Attributes:
        number: of the edge in the shape, shape (k,).
        inner: number of the face whose side is the inner one, shape (k,).
        outer: the same for the outer side.
        ends_m: both ends in the base's axes, shape (k, 2, 3).
        ends_px: both ends in the image, before it is cut off there, shape (k, 2, 2).
        depths_m: of both ends, shape (k, 2).
        span: the part of each edge that is in the image, shares of its length there, shape (k, 2).
        normal: unit vector across the edge in the image, from the inner to the outer side, shape (k, 2).
        length_px: of the part in the image, shape (k,).
    """

    number: Ints
    inner: Ints
    outer: Ints
    ends_m: Floats
    ends_px: Floats
    depths_m: Floats
    span: Floats
    normal: Floats
    length_px: Floats

    def samples(self, shares: Floats) -> tuple[Floats, Floats]:
        """Points on the edges.

        Args:
            shares: of the part of each edge in the image, 0 to 1, shape (m,).

        Returns:
            Points in the base's axes, shape (k, m, 3), and the shares of the whole edges in the image, shape
            (k, m).
        """
        along = self.span[:, :1] + (self.span[:, 1:] - self.span[:, :1]) * shares
        near, far = self.depths_m[:, :1], self.depths_m[:, 1:]
        in_space = along * near / (along * near + (1.0 - along) * far)  # 1 / depth is linear in the image
        start, end = self.ends_m[:, None, 0], self.ends_m[:, None, 1]
        return start + in_space[..., None] * (end - start), along


def seen_edges(
    shape: BaseShape, view: CameraView, focal_px: float, half_px: tuple[float, float], shortest_px: float
) -> SeenEdges | None:
    """The edges that are seen from a camera; None if there are none.

    Args:
        shape: of the base.
        view: of the camera.
        focal_px: focal length.
        half_px: from the optical axis to the right and the lower border of what is used of the image.
        shortest_px: shorter ones are left out.
    """
    faces = shape.faces_seen(view.eye_m[None])[0]
    sides = shape.edges[:, 2:]
    used = faces[sides].any(axis=1)
    swapped = ~faces[sides[:, 0]]
    inner = np.where(swapped, sides[:, 1], sides[:, 0])
    outer = np.where(swapped, sides[:, 0], sides[:, 1])
    outer = np.where(faces[outer], outer, BACKGROUND)
    ends_m = shape.points_m[shape.edges[:, :2]]
    depths = (ends_m - view.eye_m) @ view.turn[:, 0]
    used &= (depths > NEAREST_M).any(axis=1)
    number = np.flatnonzero(used)
    if not len(number):
        return None
    inner, outer, ends_m = inner[number], outer[number], ends_m[number]
    depths = depths[number]
    if (depths <= NEAREST_M).any():
        ends_m = _cut_near(ends_m, depths)
    in_camera = (ends_m - view.eye_m) @ view.turn
    ends_px = projected(in_camera, focal_px)
    span = _inside(ends_px, half_px)
    along = ends_px[:, 1] - ends_px[:, 0]
    full_px = np.hypot(along[:, 0], along[:, 1])
    length_px = full_px * (span[:, 1] - span[:, 0])
    keep = length_px >= shortest_px
    if not keep.any():
        return None
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(full_px, 1e-9)[:, None]
    # The outer side is away from the middle of the inner face, which is seen beside the edge's middle.
    middles = _face_middles(shape)[inner]
    beside = middles - ends_m.mean(axis=1)
    point = ends_m.mean(axis=1) + 1e-3 * beside
    off = projected((point - view.eye_m) @ view.turn, focal_px) - projected(
        (ends_m.mean(axis=1) - view.eye_m) @ view.turn, focal_px
    )
    normal *= np.where((normal * off).sum(axis=1) > 0.0, -1.0, 1.0)[:, None]
    return SeenEdges(
        number[keep], inner[keep], outer[keep], ends_m[keep], ends_px[keep], in_camera[keep][..., 0],
        span[keep], normal[keep], length_px[keep],
    )  # fmt: skip


def _face_middles(shape: BaseShape) -> Floats:
    half_m, top_m = shape.edge_m / 2, shape.top_m
    middles = _NORMALS * half_m + np.array([0.0, 0.0, top_m / 2])
    middles[TOP] = (0.0, 0.0, top_m)
    return np.vstack([middles, middles[TOP]])


def _cut_near(ends_m: Floats, depths: Floats) -> Floats:
    """Edges without what is nearer than `NEAREST_M`; at least one end of each is not."""
    start, end = ends_m[:, 0], ends_m[:, 1]
    change = depths[:, 1] - depths[:, 0]
    share = (NEAREST_M - depths[:, 0]) / np.where(np.abs(change) < 1e-12, 1.0, change)
    at = start + share[:, None] * (end - start)
    cut = np.stack([start, end], axis=1)
    for side in (0, 1):
        behind = depths[:, side] <= NEAREST_M
        cut[behind, side] = at[behind] + 1e-6 * (ends_m[behind, 1 - side] - at[behind])
    return cut


def _inside(ends_px: Floats, half_px: tuple[float, float]) -> Floats:
    """The part of each segment within a rectangle, as shares (Liang and Barsky), shape (k, 2)."""
    start, along = ends_px[:, 0], ends_px[:, 1] - ends_px[:, 0]
    half = np.array(half_px)
    safe = np.where(np.abs(along) < 1e-9, 1e-9, along)
    one, other = (-half - start) / safe, (half - start) / safe
    first = np.maximum(np.minimum(one, other).max(axis=1), 0.0)
    last = np.minimum(np.maximum(one, other).min(axis=1), 1.0)
    return np.stack([first, np.maximum(last, first)], axis=1)
