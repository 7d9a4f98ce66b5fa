"""Other drones in the picture: dark boxes, as large as they are.

They move, so they are no part of the scene's tree; each is painted before the first face that is nearer than
its centre. That is right unless it flies closer to a bar or the base than about its own size.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import cos, dist, sin

import cv2
import numpy as np
import numpy.typing as npt

from geometry.rotations import RotationRows
from geometry.vectors import Vec3
from sitl.camera_mesh import SUBPIXELS, Pinhole
from sitl.solids import Solid

DRONE_BGR = (64, 62, 60)  # no colour that the detector looks for
_SIGNS = tuple(product((-1.0, 1.0), repeat=3))

Outline = npt.NDArray[np.int32]


def outlines(
    drones: Sequence[Solid], eye_m: Vec3, rotation: RotationRows, pinhole: Pinhole
) -> list[tuple[float, Outline]]:
    """What is seen of some drones.

    Args:
        drones: their boxes.
        eye_m: where the camera is, arena axes.
        rotation: rows of the matrix from forward, left, up to arena axes.
        pinhole: the camera.

    Returns:
        Distance in metres and outline in sixteenths of a pixel, shape (k, 2), the farthest first; none of
        those that are behind the camera, too far, or so near that they reach it.
    """
    seen: list[tuple[float, Outline]] = []
    for drone in drones:
        distance_m = dist(eye_m, drone.centre_arena_m)
        if distance_m > pinhole.far_m:
            continue
        points = [_point(corner, eye_m, rotation, pinhole) for corner in _corners(drone)]
        whole = [point for point in points if point is not None]
        if len(whole) == len(points):
            hull = cv2.convexHull(np.array(whole, np.float32)).reshape(-1, 2)
            seen.append((distance_m, np.rint(hull * SUBPIXELS).astype(np.int32)))
    seen.sort(key=lambda one: -one[0])
    return seen


def _corners(box: Solid) -> list[Vec3]:
    c, s = cos(box.yaw_rad), sin(box.yaw_rad)
    x, y, z = box.centre_arena_m
    a, b, h = box.half_extents_m
    return [(x + c * i * a - s * j * b, y + s * i * a + c * j * b, z + k * h) for i, j, k in _SIGNS]


def _point(
    point_m: Vec3, eye_m: Vec3, rotation: RotationRows, pinhole: Pinhole
) -> tuple[float, float] | None:
    """Where a point is in the image, pixels; None if it is not before the camera or far beside the image."""
    offset = [p - e for p, e in zip(point_m, eye_m, strict=True)]
    forward, left, up = (sum(rotation[i][axis] * offset[i] for i in range(3)) for axis in range(3))
    if forward <= pinhole.near_m:
        return None
    (cu, cv), scale = pinhole.centre_px, pinhole.focal_px / forward
    u, v = cu - left * scale, cv - up * scale
    far_px = 8.0 * max(pinhole.width_px, pinhole.height_px)
    return (u, v) if abs(u) < far_px and abs(v) < far_px else None
