"""The pose of a frame from four points of its middle plane.

A rectangle seen from one side has, in general, two poses that explain its image nearly as well as each other:
tilted to one side or to the other. OpenCV's solver for planes finds both (T. Collins, A. Bartoli,
"Infinitesimal plane-based pose estimation", International Journal of Computer Vision, 2014). It may answer
with numbers that are no pose and still report success, so every answer is projected and compared here.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, sqrt

import cv2
import numpy as np
import numpy.typing as npt

from geometry.vectors import Vec3
from vision.types import FramePose

Floats = npt.NDArray[np.float64]
Point = tuple[float, float]

_IDENTITY = np.eye(3)
_NUDGE = np.array([[1e-6, 2e-6], [-2e-6, 1e-6], [2e-6, -1e-6], [1e-6, 1e-6]]).reshape(4, 1, 2)


def frame_poses(
    corners: Sequence[Point], width_m: float, height_m: float, focal_px: float, max_error_px: float
) -> tuple[FramePose, ...]:
    """Find the poses of a rectangle.

    Args:
        corners: upper left, upper right, lower right, lower left: pixels right of and below the optical axis.
        width_m: of the rectangle.
        height_m: of the rectangle.
        focal_px: focal length.
        max_error_px: poses that explain the corners worse than this (root mean square) are left out.

    Returns:
        None, one or two, the better one first.
    """
    x, y = width_m / 2, height_m / 2
    # The model's y points down as the image's: the solver's rotation vectors fail near half a turn.
    model = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    # In units of the focal length the camera's matrix is the identity.
    image = np.array(corners).reshape(4, 1, 2) / focal_px
    poses = _solved(model, image, focal_px, max_error_px)
    if len(poses) < 2:
        # An image that is symmetric to a few last digits makes the solver divide zero by zero.
        again = _solved(model, image + _NUDGE, focal_px, max_error_px)
        poses = max(poses, again, key=len)
    return tuple(sorted(poses, key=lambda pose: pose.error_px))


def _solved(model: Floats, image: Floats, focal_px: float, max_error_px: float) -> list[FramePose]:
    """The solver's answers that are poses and explain the image."""
    try:
        turns, shifts = cv2.solvePnPGeneric(model, image, _IDENTITY, None, flags=cv2.SOLVEPNP_IPPE)[1:3]
    except cv2.error:
        return []
    poses = (
        _pose(turn.ravel().tolist(), shift.ravel().tolist(), model, image, focal_px)
        for turn, shift in zip(turns, shifts, strict=True)
    )
    return [pose for pose in poses if pose is not None and pose.error_px <= max_error_px]


def _pose(
    turn: list[float], shift: list[float], model: Floats, image: Floats, focal_px: float
) -> FramePose | None:
    if not all(map(isfinite, (*turn, *shift))):
        return None
    rotation, _ = cv2.Rodrigues(np.array(turn))
    points = model @ rotation.T + np.array(shift)
    if points[:, 2].min() <= 0.0 or rotation[1, 1] <= 0.0:  # behind the camera, or upside down
        return None
    error = points[:, :2] / points[:, 2:] - image[:, 0]
    right, down, ahead = rotation[:, 2].tolist()
    if right * shift[0] + down * shift[1] + ahead * shift[2] > 0.0:
        right, down, ahead = -right, -down, -ahead
    position: Vec3 = (shift[2], -shift[0], -shift[1])
    return FramePose(position, (ahead, -right, -down), focal_px * sqrt(float((error * error).sum()) / 4.0))
