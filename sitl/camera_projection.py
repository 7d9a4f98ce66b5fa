"""A pinhole camera's projection: all faces of a scene at once, cut to what can be seen, and other drones.

One matrix product gives the image of every corner and its side of each border of the view. Per face that says
whether it is out of sight, can be painted as it is, or must be cut first. Cuts go from corner to corner and
keep what lies on the inner side (Sutherland & Hodgman, "Reentrant polygon clipping", 1974); they use plain
scalars, as few polygons need them: those that reach beside or behind the camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import RotationRows
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from sitl.camera_scene import WALL, Bgr, Face
from sitl.optics.texture import FaceTexture

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Ints64 = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
Point = tuple[float, float]
Window = tuple[float, float, float, float]  # left, top, right, bottom

SHIFT = 4  # OpenCV's argument: corners are given in sixteenths of a pixel
SUBPIXELS = float(1 << SHIFT)
_BITS = 2.0 ** np.arange(10)
_CUT_BITS = 0b00111101  # beyond the near plane or the window
_MOST_ROLLED = 2.0  # heights of the canvas: what is farther above or below it moves with this row
_FINE_PX = 20_000  # what is painted finely has no more pixels than this
_SAME_M = 1e-6  # edges nearer than this are the same
_NEAR_M2 = 1e-4  # of edges that may be so near; much more than the rounding of a large arena's places
_LEAST_TURN = 1e-3  # twice the area of a corner's triangle, so that edges in line do not divide by zero
_LEAST_WIDTH = 0.62
"""Pixels: with this, polygons of all widths below one are as wide as they should be on average."""
_FARTHEST = 2.0**24  # sixteenths of a pixel, well within OpenCV's whole numbers of 32 bits


@dataclass(frozen=True, slots=True)
class Pinhole:
    """An ideal camera."""

    width_px: int
    height_px: int
    focal_px: float
    near_m: float  # depth from which on things are seen
    far_m: float  # a face wholly beyond this depth is not seen

    @property
    def centre_px(self) -> Point:
        """Where the optical axis meets the image; whole numbers are pixel centres."""
        return ((self.width_px - 1) / 2, (self.height_px - 1) / 2)

    def matrix(self, eye_arena_m: Vec3, rotation: RotationRows) -> Floats:
        """The projection of (x, y, z, 1) in arena axes to (u w, v w, w), shape (3, 4).

        u and v are in sixteenths of a pixel, w is the depth in metres.

        Args:
            eye_arena_m: position of the camera.
            rotation: rows of the matrix from forward, left, up to arena axes.
        """
        focal = self.focal_px * SUBPIXELS
        cu, cv = (centre * SUBPIXELS for centre in self.centre_px)
        rows = [(cu * fwd - focal * left, cv * fwd - focal * up, fwd) for fwd, left, up in rotation]
        (a0, b0, c0), (a1, b1, c1), (a2, b2, c2) = rows
        x, y, z = eye_arena_m
        shift = (-a0 * x - a1 * y - a2 * z, -b0 * x - b1 * y - b2 * z, -c0 * x - c1 * y - c2 * z)
        return np.array([*rows, shift]).T


@dataclass(frozen=True, slots=True)
class MeshFace:
    """Number of a face, the range of its corners among all corners, and its colour or picture."""

    index: int
    start: int
    stop: int
    colour: Bgr
    texture: FaceTexture | None


class Mesh:
    """The faces of a scene, in the order given, ready to be projected.

    Args:
        faces: all of them.
        parts: numbers of the first faces of the things that are painted finely if they are small.
        pinhole: the camera.
    """

    def __init__(self, faces: Sequence[Face], parts: Sequence[int], pinhole: Pinhole) -> None:
        stops = np.cumsum([len(face.corners_arena_m) for face in faces]).tolist()
        starts = [0, *stops[:-1]]
        self.faces = tuple(
            MeshFace(index, starts[index], stops[index], face.colour, face.texture)
            for index, face in enumerate(faces)
        )
        corners = np.concatenate([face.corners_arena_m for face in faces])
        self._corners = np.vstack([corners.T, np.ones(len(corners))])
        self._starts = np.array(starts)
        # What is before the first part is a part, too, and is never painted finely.
        self._parts = np.array([0, *parts])
        self._part_starts = self._starts[self._parts]
        self._part_sizes = np.diff(self._part_starts, append=len(corners))
        ends = np.array(stops) - 1
        self._next = np.arange(1, len(corners) + 1)  # of every corner the one after it, round its face
        self._next[ends] = starts
        self._last = np.arange(-1, len(corners) - 1)  # and the one before it
        self._last[starts] = ends
        self._beside = self._neighbours(faces, corners)
        self._normals = np.array([face.normal_arena for face in faces])
        self._offsets = np.array([np.dot(face.normal_arena, face.corners_arena_m[0]) for face in faces])
        self._pinhole = pinhole
        self._window = (-_FARTHEST, -8.0 * pinhole.height_px * SUBPIXELS, _FARTHEST, _FARTHEST)
        self._borders = _borders(pinhole, self._window)

    def project(self, eye_arena_m: Vec3, rotation: RotationRows, drift: Floats | None = None) -> Projection:
        """Project all faces.

        Args:
            eye_arena_m: as for `Pinhole.matrix`.
            rotation: as for `Pinhole.matrix`.
            drift: with a rolling shutter, the change of that matrix while as many rows are read out as the
                canvas has: every corner is where it is when its own row is read. Between corners, edges are
                straight.
        """
        to_canvas = self._pinhole.matrix(eye_arena_m, rotation)
        matrix = self._borders @ to_canvas
        near_m = self._pinhole.near_m
        matrix[3, 3] -= near_m
        matrix[4, 3] += self._pinhole.far_m
        projected = matrix @ self._corners
        if drift is not None:
            projected = self._rolled(projected, self._borders @ drift @ self._corners)
        # Ten borders are ten bits of one number a corner.
        outside = (_BITS @ (projected[3:] < 0.0)).astype(np.uint16)
        hidden = np.bitwise_and.reduceat(outside, self._starts)
        facing = self._normals @ eye_arena_m > self._offsets
        seen = facing & (hidden == 0)
        crossing = np.bitwise_or.reduceat(outside, self._starts) & _CUT_BITS
        flat = projected[:2] / np.maximum(projected[2], near_m)
        np.maximum(flat, -_FARTHEST, out=flat)
        np.minimum(flat, _FARTHEST, out=flat)
        views = self._views(flat, np.bitwise_or.reduceat(crossing, self._parts) != 0)
        scale, left, top = (np.repeat(values, self._part_sizes) for values in views[[4, 0, 1]])
        flat *= scale
        flat += 0.5 * SUBPIXELS * (scale - 1.0) - SUBPIXELS * scale * np.array((left, top))
        moved = ~np.append(facing, False).take(self._beside)
        inset, is_wide = _inset(flat, self._next, self._last, self._starts, moved)
        seen &= is_wide | (crossing != 0)
        pixels = np.rint(inset, out=inset).T.astype(np.int32, order="C")
        return Projection(
            eye_arena_m=eye_arena_m,
            matrix=to_canvas,
            drift=drift,
            corners=projected,
            pixels=pixels,
            seen=seen.tobytes(),
            to_cut=crossing.tolist(),
            near_m=near_m,
            window=self._window,
            views=views.T.tolist(),
        )

    def _neighbours(self, faces: Sequence[Face], corners: Floats) -> Ints64:
        """For the edge after each corner the face of its part along whose edge it is, or a number beyond all.

        Of the floor's faces only the walls have such edges: the others lie on each other.
        """
        ends = corners[self._next]
        of_face = np.repeat(np.arange(len(faces)), np.diff(self._starts, append=len(corners)))
        beside = np.full(len(corners), len(faces))
        for start, size in zip(self._part_starts.tolist(), self._part_sizes.tolist(), strict=True):
            part = np.arange(start, start + size)
            if start == 0:
                part = part[[faces[k].name == WALL for k in of_face[part]]]
            if not len(part):
                continue
            is_along = _are_along(corners[part], ends[part], of_face[part])
            beside[part] = np.where(is_along.any(axis=1), of_face[part][is_along.argmax(axis=1)], len(faces))
        return beside

    def _views(self, flat: Floats, is_cut: Flags) -> Ints:
        """Where each part is painted: left, top, right and bottom of the canvas, and how much finer, (5, n).

        Args:
            flat: where all corners are on the canvas, sixteenths of a pixel, shape (2, m).
            is_cut: whether a part has faces that must be cut, shape (n,).
        """
        size_px = np.array([[self._pinhole.width_px], [self._pinhole.height_px]])
        low = np.minimum.reduceat(flat, self._part_starts, axis=1) / SUBPIXELS
        high = np.maximum.reduceat(flat, self._part_starts, axis=1) / SUBPIXELS
        first = np.maximum(np.floor(low) - 1.0, 0.0)
        end = np.minimum(np.ceil(high) + 2.0, size_px)
        wide, tall = np.maximum(end - first, 0.0)
        area = wide * tall
        scale = np.where(area * 4 <= _FINE_PX, np.where(area * 16 <= _FINE_PX, 4, 2), 1)
        scale[is_cut] = 1
        scale[0] = 1
        views = np.array([*first, *end, scale])
        views[:2, scale == 1] = 0.0
        return views.astype(np.int32)

    def _rolled(self, projected: Floats, drift: Floats) -> Floats:
        """What is projected, each corner at the time at which its row is read out.

        Its row depends on that time; two steps find it, as within a read-out little moves.
        """
        near_m, height_px = self._pinhole.near_m, self._pinhole.height_px
        middle_px = self._pinhole.centre_px[1]
        at = projected
        for _ in range(2):
            rows = at[1] / (np.maximum(at[2], near_m) * SUBPIXELS)
            share = np.clip((rows - middle_px) / height_px, -_MOST_ROLLED, _MOST_ROLLED)
            at = projected + share * drift
        return at


@dataclass(frozen=True, slots=True)
class Projection:
    """All faces seen from one pose of the camera; u and v in sixteenths of a pixel."""

    eye_arena_m: Vec3
    matrix: Floats  # see `Pinhole.matrix`
    drift: Floats | None  # see `Mesh.project`
    corners: Floats  # columns (u w, v w, w, ...), one for every corner
    pixels: Ints  # (u, v) of every corner in the view of its part, shape (n, 2); wrong where cuts are needed
    seen: bytes  # per face, 1 if it faces the eye and is not wholly outside the view
    to_cut: list[int]  # per face, not 0 if it must be cut
    near_m: float  # depth of the near plane
    window: Window
    views: list[list[int]]  # per part left, top, right, bottom on the canvas, and how much finer

    def outline(self, face: MeshFace) -> Ints | None:
        """Corners of a seen face in sixteenths of a pixel, shape (k, 2); None if it is cut away."""
        if not self.to_cut[face.index]:
            return self.pixels[face.start : face.stop]
        points = _clip_near(self.corners[:3, face.start : face.stop].T.tolist(), self.near_m)
        points = _clip_window(points, self.window)
        return None if len(points) < 3 else inset_outline(np.array(points))


def inset_outline(points: Floats) -> Ints | None:
    """What OpenCV is given to paint a convex polygon where it is; None if it is too narrow.

    Args:
        points: its corners in sixteenths of a pixel, shape (k, 2).
    """
    last = np.arange(-1, len(points) - 1)
    following = last + 2
    following[-1] = 0
    moved = np.ones(len(points), np.bool_)
    inset, is_wide = _inset(points.T, following, last, np.zeros(1, np.intp), moved)
    return np.rint(inset).T.astype(np.int32, order="C") if is_wide[0] else None


def _are_along(starts: Floats, ends: Floats, of_face: Ints64) -> Flags:
    """Which edges of faces lie on which edges of other faces, shape (n, n)."""
    along: Flags = of_face[:, None] != of_face
    for points in (starts, ends):
        along &= _squares(points, starts, ends) < _NEAR_M2
    first, second = np.nonzero(along)
    for points in (starts, ends):
        apart_m = _distances(points[first], starts[second], ends[second])
        along[first, second] &= apart_m < _SAME_M
    return along


def _squares(points: Floats, starts: Floats, ends: Floats) -> Floats:
    """About the squares of the distances of all points and line segments, m², shape (points, segments)."""
    edges = ends - starts
    lengths2 = np.maximum((edges * edges).sum(axis=1), 1e-12)
    ways2 = (points * points).sum(axis=1)[:, None] - 2.0 * points @ starts.T + (starts * starts).sum(axis=1)
    dots = points @ edges.T - (starts * edges).sum(axis=1)
    share = np.clip(dots / lengths2, 0.0, 1.0)
    squares: Floats = ways2 - share * (2.0 * dots - share * lengths2)
    return squares


def _distances(points: Floats, starts: Floats, ends: Floats) -> Floats:
    """From each point to its line segment, metres, shape (n,)."""
    along = ends - starts
    beyond = points - starts
    share = (beyond * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-12)
    apart: Floats = np.linalg.norm(beyond - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
    return apart


def _inset(
    flat: Floats, following: Ints64, last: Ints64, starts: Ints64, moved: Flags
) -> tuple[Floats, Flags]:
    """Move the edges of convex polygons inwards by as much as OpenCV paints beyond them.

    `cv2.fillConvexPoly` paints the pixels nearest to an edge, too, in every column (row, if the edge is
    steep): half a pixel beyond it. Moved by that, pixels are painted whose centres are inside. Edges between
    two faces that are seen are not moved: as OpenCV rounds where an edge begins, there would be gaps.
    Polygons narrower than a pixel may have no inside; they stay as they are, or are left out, so that they
    are as wide as they should be on average.

    Args:
        flat: corners in sixteenths of a pixel, shape (2, n).
        following: of every corner the number of the next one.
        last: and of the one before.
        starts: number of each polygon's first corner.
        moved: which edges are moved, by the corner where they begin.

    Returns:
        The corners, and which polygons are to be painted.
    """
    along = flat.take(following, 1) - flat
    before = along.take(last, 1)
    sizes = np.abs(along)
    reach = np.maximum(sizes[0], sizes[1])
    turn = np.abs(before[0] * along[1] - before[1] * along[0])
    away = reach * moved
    inset = away.take(last) * along - away * before
    inset *= 0.5 * SUBPIXELS / np.maximum(turn, _LEAST_TURN)
    inset += flat
    kept = (inset.take(following, 1) - inset) * along
    narrow = np.minimum.reduceat(kept[0] + kept[1], starts) <= 0.0
    if not narrow.any():
        return inset, ~narrow
    of_face = np.repeat(narrow, np.diff(starts, append=flat.shape[1]))
    twice_area = np.abs(np.add.reduceat(flat[0] * along[1] - flat[1] * along[0], starts))
    width = twice_area / np.maximum(np.add.reduceat(reach, starts), 1e-9)
    return np.where(of_face, flat, inset), ~narrow | (width > _LEAST_WIDTH * SUBPIXELS)


def _borders(pinhole: Pinhole, window: Window) -> Floats:
    """The matrix from (u w, v w, w) to itself and the distances from ten borders, shape (13, 3).

    A distance below zero is outside. Near and far plane (still to be moved to their depths), the window's
    four sides, the image's four sides with a pixel to spare for outlines painted on the nearest pixel.
    """
    left, top, right, bottom = window
    width, height = pinhole.width_px * SUBPIXELS, pinhole.height_px * SUBPIXELS
    rows = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for x0, y0, x1, y1 in ((left, top, right, bottom), (-SUBPIXELS, -SUBPIXELS, width, height)):
        rows += [(1.0, 0.0, -x0), (-1.0, 0.0, x1), (0.0, 1.0, -y0), (0.0, -1.0, y1)]
    return np.array(rows)


def _clip_near(corners: Sequence[Sequence[float]], near_m: float) -> list[Point]:
    """Cut a convex polygon with corners (u w, v w, w) at the near plane; return what is left as (u, v).

    Before the division by w, straight lines in space are straight lines here too.
    """
    kept: list[Point] = []
    x0, y0, w0 = corners[-1]
    for x1, y1, w1 in corners:
        if (w0 < near_m) != (w1 < near_m):
            t = (near_m - w0) / (w1 - w0)
            kept.append(((x0 + t * (x1 - x0)) / near_m, (y0 + t * (y1 - y0)) / near_m))
        if w1 >= near_m:
            kept.append((x1 / w1, y1 / w1))
        x0, y0, w0 = x1, y1, w1
    return kept


def _clip_window(points: list[Point], window: Window) -> list[Point]:
    """Cut a convex polygon to a window of the image plane; fewer than three corners if nothing is left.

    OpenCV takes whole numbers of 32 bits and walks row by row from a polygon's topmost corner, however far
    above the image that is: this keeps it correct and fast.
    """
    left, top, right, bottom = window
    if all(left <= u <= right and top <= v <= bottom for u, v in points):
        return points
    for a, b, c in ((1.0, 0.0, -left), (-1.0, 0.0, right), (0.0, 1.0, -top), (0.0, -1.0, bottom)):
        points = clip_half_plane(points, a, b, c)
    return points


def clip_half_plane(corners: Sequence[Point], a: float, b: float, c: float) -> list[Point]:
    """Keep the part of a convex polygon where a u + b v + c >= 0."""
    heights = [a * u + b * v + c for u, v in corners]
    if not heights or min(heights) >= 0.0:
        return list(corners)
    kept: list[Point] = []
    if max(heights) < 0.0:
        return kept
    (u0, v0), before = corners[-1], heights[-1]
    for (u1, v1), now in zip(corners, heights, strict=True):
        if (before < 0.0) != (now < 0.0):
            t = before / (before - now)
            kept.append((u0 + t * (u1 - u0), v0 + t * (v1 - v0)))
        if now >= 0.0:
            kept.append((u1, v1))
        u0, v0, before = u1, v1, now
    return kept


def drone_outlines(
    drones: Sequence[Solid], eye_arena_m: Vec3, rotation: RotationRows, pinhole: Pinhole
) -> list[tuple[Solid, Ints]]:
    """Each drone seen with its outline (sixteenths of a pixel, shape (k, 2)), the farthest first.

    Drones that are behind the camera, too far away or so near that they reach the camera are left out. The
    drones are given by their boxes, the pose of the camera as for `Pinhole.matrix`.
    """
    matrix = pinhole.matrix(eye_arena_m, rotation)
    limit = 8.0 * max(pinhole.width_px, pinhole.height_px) * SUBPIXELS
    seen: list[tuple[Solid, Ints]] = []
    for drone in sorted(drones, key=lambda one: -dist(eye_arena_m, one.centre_arena_m)):
        if dist(eye_arena_m, drone.centre_arena_m) > pinhole.far_m:
            continue
        u, v, depth_m = matrix @ np.array([(*corner, 1.0) for corner in drone.corners()]).T
        if depth_m.min() <= pinhole.near_m:
            continue
        points = np.array([u / depth_m, v / depth_m]).T
        if np.abs(points).max() < limit:
            hull = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2)
            outline = inset_outline(hull.astype(np.float64))
            if outline is not None:
                seen.append((drone, outline))
    return seen
