"""A pinhole camera on the drone, painted with OpenCV.

Far to near: sky, ground to the horizon, tatami, shadows, then base and frames in an order in which nothing is
painted over by what it hides. One matrix product projects all corners of the scene; only polygons that reach
beside or behind the camera are cut, one by one.

Pixels: OpenCV's convention, whole coordinates at pixel centres, so the optical axis is at ((w - 1) / 2,
(h - 1) / 2) and projection agrees with `cv2.projectPoints`. A polygon's border is painted on the *nearest*
pixels: a detected box is neither wider nor narrower than the true outline on average (each edge within half a
pixel), and a bar thinner than a pixel does not vanish.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, isfinite, tan

import cv2
import numpy as np
import numpy.typing as npt

from scenarios.axes import Quaternion, Vec3
from scenarios.models import Scenario
from sitl.camera_clip import Homogeneous, Point, clip_half_plane, clip_to_view
from sitl.camera_order import PaintOrder
from sitl.camera_scene import GROUND_BGR, SKY_BGR, UNDERGROUND_BGR, Bgr, Face, build_scene

Image = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int32]
Matrix = tuple[Vec3, Vec3, Vec3]

_SHIFT = 4  # corners are given to OpenCV in sixteenths of a pixel
_SUBPIXELS = float(1 << _SHIFT)
_SKY_BAND = 0.09  # height of a band of haze above the horizon, as a share of the focal length
_LOST_M = 1e5  # from farther away nothing but sky and ground is to be seen


@dataclass(frozen=True, slots=True)
class _Polygon:
    """Where a face's corners stand in the array of all corners, and its colour."""

    index: int
    start: int
    stop: int
    colour: Bgr


@dataclass(frozen=True, slots=True)
class _Solid:
    """A body's bounding ball and its polygons in painting order."""

    centre_arena_m: Vec3
    radius_m: float
    polygons: tuple[_Polygon, ...]


@dataclass(frozen=True, slots=True)
class _View:
    """Where the camera is: the eye and the directions forward, left and up as columns of a rotation."""

    eye_arena_m: Vec3
    rotation: Matrix


class Camera:
    """The camera of a scenario. It keeps nothing from one image to the next: same pose, same image."""

    def __init__(self, scenario: Scenario) -> None:
        self._settings = settings = scenario.camera
        self._focal_px = settings.width_px / 2 / tan(settings.horizontal_fov_rad / 2)
        self._centre_px = ((settings.width_px - 1) / 2, (settings.height_px - 1) / 2)
        self._limit_px = 8.0 * max(settings.width_px, settings.height_px)
        shape = (settings.height_px, settings.width_px, 3)
        self._sky = np.full(shape, SKY_BGR[0], np.uint8)
        self._underground = np.full(shape, UNDERGROUND_BGR, np.uint8)

        scene = build_scene(scenario)
        flat = _pack((scene.tatami, *scene.checks, *scene.shadows))
        self._tatami, self._shadows = flat[0], flat[1 + len(scene.checks) :]
        self._checks = flat[1 : 1 + len(scene.checks)]
        self._floor_corners = _corner_rows((scene.tatami, *scene.checks, *scene.shadows))

        faces = [face for body in scene.bodies for face in body.faces]
        packed = iter(_pack(faces))
        self._solids = tuple(
            _Solid(
                body.hull.centre_arena_m,
                hypot(*body.hull.half_extents_m),
                tuple(next(packed) for _ in body.faces),
            )
            for body in scene.bodies
        )
        self._order = PaintOrder([body.hull for body in scene.bodies])
        self._corners = _corner_rows(faces)
        self._face_of_corner = np.repeat(np.arange(len(faces)), [len(face.corners_arena_m) for face in faces])
        self._normals = np.array([face.normal_arena for face in faces])
        self._offsets = np.array([np.dot(face.normal_arena, face.corners_arena_m[0]) for face in faces])

    @property
    def focal_px(self) -> float:
        """Focal length, pixels."""
        return self._focal_px

    def render(self, position_arena_m: Vec3, attitude_arena: Quaternion) -> Image:
        """Paint what the camera sees.

        Args:
            position_arena_m: centre of the drone, shape (3,); the camera stands before it as the scenario says.
            attitude_arena: quaternion (w, x, y, z), body FLU to arena; need not have unit length.

        Returns:
            A new image, BGR, shape (height, width, 3), uint8.

        Raises:
            ValueError: a number is not finite, or the quaternion is zero.
        """
        view = self._view(position_arena_m, attitude_arena)
        if view.eye_arena_m[2] <= 0.0:
            return self._underground.copy()
        image = self._sky.copy()
        self._paint_background(image, view.rotation)
        if max(map(abs, view.eye_arena_m)) < _LOST_M:
            projection = self._projection(view)
            self._paint_floor(image, self._floor_corners @ projection)
            self._paint_solids(image, view, projection)
        return image

    def _view(self, position: Vec3, attitude: Quaternion) -> _View:
        if not all(map(isfinite, position)):
            raise ValueError(f"position_arena_m: every component must be finite, got {position}")
        norm = hypot(*attitude)
        if not isfinite(norm) or norm == 0.0:
            raise ValueError(f"attitude_arena: need a finite quaternion other than zero, got {attitude}")
        rotation = _rotation(attitude, norm)
        offset = self._settings.position_flu_m
        x, y, z = (
            p + row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2]
            for p, row in zip(position, rotation, strict=True)
        )
        return _View((x, y, z), rotation)

    def _projection(self, view: _View) -> npt.NDArray[np.float64]:
        """Return the matrix from (x, y, z, 1) in arena metres to (u w, v w, w), shape (4, 3).

        u and v are in sixteenths of a pixel; w is the depth in metres.
        """
        focal = self._focal_px * _SUBPIXELS
        cu, cv = self._centre_px[0] * _SUBPIXELS, self._centre_px[1] * _SUBPIXELS
        rows = [(cu * fwd - focal * left, cv * fwd - focal * up, fwd) for fwd, left, up in view.rotation]
        (a0, b0, c0), (a1, b1, c1), (a2, b2, c2) = rows
        x, y, z = view.eye_arena_m
        shift = (-a0 * x - a1 * y - a2 * z, -b0 * x - b1 * y - b2 * z, -c0 * x - c1 * y - c2 * z)
        return np.array([*rows, shift])

    def _paint_background(self, image: Image, rotation: Matrix) -> None:
        """Paint the haze and the ground: half planes below the horizon and lines parallel to it."""
        focal, (cu, cv) = self._focal_px, self._centre_px
        fwd_z, left_z, up_z = rotation[2]
        # A pixel's ray goes down where fwd_z - left_z (u - cu)/f - up_z (v - cv)/f is negative.
        a, b = left_z / focal, up_z / focal
        c = -(fwd_z + a * cu + b * cv)
        band = _SKY_BAND * hypot(left_z, up_z)
        right, bottom = float(image.shape[1]), float(image.shape[0])
        corners = [(-1.0, -1.0), (right, -1.0), (right, bottom), (-1.0, bottom)]
        colours = (*SKY_BGR[1:], GROUND_BGR)
        for i in range(len(colours)):
            points = clip_half_plane(corners, a, b, c + band * (len(colours) - 1 - i))
            if len(points) > 2:
                cv2.fillConvexPoly(image, _subpixels(points, _SUBPIXELS), colours[i], cv2.LINE_8, _SHIFT)

    def _paint_floor(self, image: Image, projected: npt.NDArray[np.float64]) -> None:
        """Paint the tatami, its mats and the shadows, given all their corners as (u w, v w, w)."""
        corners: list[Homogeneous] = [(u, v, w) for u, v, w in projected.tolist()]
        tatami = self._cut(corners, self._tatami)
        if tatami is not None:
            cv2.fillConvexPoly(image, tatami, self._tatami.colour, cv2.LINE_8, _SHIFT)
            stripes = [self._cut(corners, stripe) for stripe in self._checks]
            seen = [stripe for stripe in stripes if stripe is not None]
            if seen:  # one call: where two stripes cross, OpenCV's even-odd rule leaves the lighter mat
                cv2.fillPoly(image, seen, self._checks[0].colour, cv2.LINE_8, _SHIFT)
        for shadow in self._shadows:
            outline = self._cut(corners, shadow)
            if outline is not None:
                cv2.fillConvexPoly(image, outline, shadow.colour, cv2.LINE_8, _SHIFT)

    def _cut(self, corners: Sequence[Homogeneous], polygon: _Polygon) -> Ints | None:
        """Cut one polygon to the view; None if nothing is left."""
        points = clip_to_view(
            corners[polygon.start : polygon.stop], self._settings.near_m, self._limit_px * _SUBPIXELS
        )
        return _subpixels(points, 1.0) if len(points) > 2 else None

    def _paint_solids(self, image: Image, view: _View, projection: npt.NDArray[np.float64]) -> None:
        """Paint the base and the frames, the farthest first."""
        near, limit = self._settings.near_m, self._limit_px * _SUBPIXELS
        projected = self._corners @ projection
        depth = projected[:, 2:]
        flat = projected[:, :2] / np.maximum(depth, near)
        beyond = ((depth < near) | (np.abs(flat) > limit)).any(axis=1)
        to_cut = set(self._face_of_corner[beyond].tolist())
        pixels = np.rint(np.clip(flat, -limit, limit)).astype(np.int32)
        facing = (self._normals @ view.eye_arena_m > self._offsets).tolist()
        for i in self._order.back_to_front(view.eye_arena_m):
            solid = self._solids[i]
            if not self._may_be_seen(solid, view):
                continue
            for polygon in solid.polygons:
                if not facing[polygon.index]:
                    continue
                start, stop = polygon.start, polygon.stop
                outline: Ints | None = pixels[start:stop]
                if polygon.index in to_cut:
                    rows = [(u, v, w) for u, v, w in projected[start:stop].tolist()]
                    points = clip_to_view(rows, near, limit)
                    outline = _subpixels(points, 1.0) if len(points) > 2 else None
                if outline is not None:
                    cv2.fillConvexPoly(image, outline, polygon.colour, cv2.LINE_8, _SHIFT)

    def _may_be_seen(self, solid: _Solid, view: _View) -> bool:
        """Tell whether a body's bounding ball reaches into the pyramid of view."""
        (x, y, z), (r0, r1, r2) = solid.centre_arena_m, view.rotation
        ex, ey, ez = view.eye_arena_m
        dx, dy, dz = x - ex, y - ey, z - ez
        forward = dx * r0[0] + dy * r1[0] + dz * r2[0]
        radius = solid.radius_m
        if forward + radius < self._settings.near_m or forward > self._settings.far_m:
            return False
        left = abs(dx * r0[1] + dy * r1[1] + dz * r2[1])
        up = abs(dx * r0[2] + dy * r1[2] + dz * r2[2])
        focal, (cu, cv) = self._focal_px, self._centre_px
        # Distance from the pyramid's sides; two pixels to spare, for borders painted on the nearest pixel.
        return (focal * left - (cu + 2) * forward) <= radius * hypot(focal, cu + 2) and (
            focal * up - (cv + 2) * forward
        ) <= radius * hypot(focal, cv + 2)


def _pack(faces: Sequence[Face]) -> tuple[_Polygon, ...]:
    polygons, start = [], 0
    for index, face in enumerate(faces):
        stop = start + len(face.corners_arena_m)
        polygons.append(_Polygon(index, start, stop, face.colour))
        start = stop
    return tuple(polygons)


def _corner_rows(faces: Sequence[Face]) -> npt.NDArray[np.float64]:
    """Return all corners one under the other as (x, y, z, 1)."""
    corners = np.concatenate([face.corners_arena_m for face in faces])
    return np.hstack([corners, np.ones((len(corners), 1))])


def _subpixels(points: Sequence[Point], scale: float) -> Ints:
    return np.array([(round(u * scale), round(v * scale)) for u, v in points], np.int32)


def _rotation(attitude: Quaternion, norm: float) -> Matrix:
    """Return the rotation matrix of a quaternion, row by row."""
    w, x, y, z = (component / norm for component in attitude)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
