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

from vision.frame_model import AXES_CORNERS, Floats, ModelPose, Point
from vision.types import FramePose

_IDENTITY = np.eye(3)
_NUDGE = np.array([[1e-6, 2e-6], [-2e-6, 1e-6], [2e-6, -1e-6], [1e-6, 1e-6]]).reshape(4, 1, 2)


def find_poses(axes_corners: Sequence[Point], focal_px: float, max_error_px: float) -> list[ModelPose]:
    """Find the poses of a frame.

    Args:
        axes_corners: where the axes of its bars meet, upper left, upper right, lower right, lower left:
            pixels right of and below the optical axis.
        focal_px: focal length.
        max_error_px: poses that explain the corners worse than this (root mean square) are left out.

    Returns:
        None, one or two, the better one first.
    """
    # In units of the focal length the camera's matrix is the identity.
    image = np.array(axes_corners).reshape(4, 1, 2) / focal_px
    poses = _solved(image, focal_px, max_error_px)
    if len(poses) < 2:
        # An image that is symmetric to a few last digits makes the solver divide zero by zero.
        poses = max(poses, _solved(image + _NUDGE, focal_px, max_error_px), key=len)
    return sorted(poses, key=lambda pose: pose.error_px)


def as_seen(pose: ModelPose) -> FramePose:
    """The pose as others use it, in the camera's axes forward, left, up."""
    right, down, ahead = pose.rotation[:, 2].tolist()
    x, y, z = pose.shift_m.tolist()
    if right * x + down * y + ahead * z > 0.0:  # the normal points to the side from which it is seen
        right, down, ahead = -right, -down, -ahead
    return FramePose((z, -x, -y), (ahead, -right, -down), pose.error_px)


def _solved(image: Floats, focal_px: float, max_error_px: float) -> list[ModelPose]:
    """The solver's answers that are poses and explain the image."""
    # The model's y points down as the image's: the solver's rotation vectors fail near half a turn.
    try:
        turns, shifts = cv2.solvePnPGeneric(AXES_CORNERS, image, _IDENTITY, None, flags=cv2.SOLVEPNP_IPPE)[
            1:3
        ]
    except cv2.error:
        return []
    poses = (_pose(turn, shift, image, focal_px) for turn, shift in zip(turns, shifts, strict=True))
    return [pose for pose in poses if pose is not None and pose.error_px <= max_error_px]


def _pose(turn: Floats, shift: Floats, image: Floats, focal_px: float) -> ModelPose | None:
    if not all(map(isfinite, (*turn.ravel().tolist(), *shift.ravel().tolist()))):
        return None
    rotation, _ = cv2.Rodrigues(turn)
    points = AXES_CORNERS @ rotation.T + shift.ravel()
    if points[:, 2].min() <= 0.0 or rotation[1, 1] <= 0.0:  # behind the camera, or upside down
        return None
    error = (points[:, :2] / points[:, 2:] - image[:, 0]).ravel()
    return ModelPose(rotation, shift.ravel(), focal_px * sqrt(float(error @ error) / 4.0))
