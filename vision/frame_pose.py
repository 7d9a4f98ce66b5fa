"""The pose of a frame from four points of its middle plane.

A rectangle seen from one side has, in general, two poses that explain its image nearly as well as each other:
tilted to one side or to the other. OpenCV's solver for planes finds both (T. Collins, A. Bartoli,
"Infinitesimal plane-based pose estimation", International Journal of Computer Vision, 2014). It may answer
with numbers that are no pose and still report success, so every answer is projected and compared here.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, isfinite, pi, sqrt

import cv2
import numpy as np

from vision.frame_model import AXES_CORNERS, AXES_HEIGHT_M, AXES_WIDTH_M, Floats, ModelPose, Point
from vision.types import FramePose

_IDENTITY = np.eye(3)
_NEAREST_M = 0.03
_MIN_UPRIGHT = 0.6  # cosine of the largest tilt of the camera, about 53 degrees: frames are upright
_MAX_STEPS = 12
_DAMPING = 1e-6 * np.eye(6)
_SMALL_STEP = 1e-3  # metres and radians
_MAX_DEPTH_ERROR = 0.08  # a pose that is less sure than this, relative to its distance, is left out
_MAX_TURN_ERROR = 0.25  # the same for its angle about the upright axis, radians
_MAX_DEVIATIONS = 3.0
_SAME_COSINE = 0.9995
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
    if points[:, 2].min() <= 0.0 or rotation[1, 1] < _MIN_UPRIGHT:  # behind the camera, or fallen
        return None
    error = (points[:, :2] / points[:, 2:] - image[:, 0]).ravel()
    return ModelPose(rotation, shift.ravel(), focal_px * sqrt(float(error @ error) / 4.0))


def poses_of_three(
    lines: Sequence[tuple[float, float, float] | None],
    corners: Sequence[Point | None],
    weights: Sequence[tuple[float, float]],
    focal_px: float,
    guesses: Sequence[ModelPose] = (),
) -> list[ModelPose]:
    """Find the poses of a frame of which one side is not seen.

    Args:
        lines: (a, b, c) of a x + b y = c for the axis of each side, pixels from the optical axis; one is
            None.
        corners: where the axes meet; two are None.
        weights: of each line at its first and its second corner, 1/px.
        focal_px: focal length.
        guesses: poses near to which the answers are, if they are known.

    Returns:
        None, one or two, those with the smaller turn first. Three lines fix all six numbers of a pose, so no
        error tells one from the other.
    """
    missing = next(k for k, line in enumerate(lines) if line is None)
    opposite = (missing + 2) % 4
    one, other = corners[opposite], corners[(opposite + 1) % 4]
    if one is None or other is None:
        return []
    rows = [(k, end) for k in range(4) if k != missing for end in (0, 1)]
    normals = np.array([lines[k] for k, _ in rows])
    points = AXES_CORNERS[[(k + end) % 4 for k, end in rows]]
    scale = np.array([weights[k][end] for k, end in rows])
    found: list[ModelPose] = []
    for guess in guesses or [_first_guess(opposite, one, other, turn, focal_px) for turn in (-0.8, 0.8)]:
        pose = _refined(guess, points, normals, scale, focal_px)
        if pose is not None and all(_differ(pose, known) for known in found):
            found.append(pose)
    return sorted(found, key=lambda pose: -abs(float(pose.rotation[2, 2])))


def _first_guess(side: int, one: Point, other: Point, turn: float, focal_px: float) -> ModelPose:
    """A pose turned about the upright axis by a given angle that puts one side about where it is seen."""
    dx, dy = other[0] - one[0], other[1] - one[1]
    upright = side % 2 == 1
    length_m = AXES_HEIGHT_M if upright else AXES_WIDTH_M * cos(turn)
    depth_m = length_m * focal_px / max(hypot(dx, dy), 1.0)
    # The direction in which this side goes in the model, turned to the one in which it is seen.
    roll = atan2(dy, dx) - (0.0, pi / 2, pi, -pi / 2)[side]
    about_y, about_z = np.array([0.0, turn, 0.0]), np.array([0.0, 0.0, roll])
    rotation = cv2.Rodrigues(about_z)[0] @ cv2.Rodrigues(about_y)[0]
    middle = np.array([one[0] + other[0], one[1] + other[1], 2.0 * focal_px]) * (0.5 * depth_m / focal_px)
    model = 0.5 * (AXES_CORNERS[side] + AXES_CORNERS[(side + 1) % 4])
    return ModelPose(rotation, middle - rotation @ model, 0.0)


def _refined(
    guess: ModelPose, points: Floats, normals: Floats, weights: Floats, focal_px: float
) -> ModelPose | None:
    """Gauss and Newton's method on the distances of a model's points from lines; None if it fails."""
    rotation, shift = guess.rotation, guess.shift_m
    a, b, c = normals.T
    for _ in range(_MAX_STEPS):
        turned = points @ rotation.T
        px, py, pz = turned.T
        x, y, depth = (turned + shift).T
        if depth.min() <= _NEAREST_M:
            return None
        scale = focal_px / depth
        across = (a * x + b * y) * scale
        error = (across - c) * weights
        # How each distance changes with the shift; and with a small turn, by the product with the arm.
        scale *= weights
        gx, gy, gz = a * scale, b * scale, -across * weights / depth
        jacobian = np.array([py * gz - pz * gy, pz * gx - px * gz, px * gy - py * gx, gx, gy, gz])
        square = jacobian @ jacobian.T
        try:
            step = np.linalg.solve(square + _DAMPING, -(jacobian @ error))
        except np.linalg.LinAlgError:
            return None
        size = float(np.abs(step).max())
        if not isfinite(size):
            return None
        step *= min(1.0, 0.5 / max(size, 1e-9))
        rotation, shift = cv2.Rodrigues(step[:3])[0] @ rotation, shift + step[3:]
        if size < _SMALL_STEP:
            break
    else:
        return None
    spread = np.sqrt(np.abs(np.diag(np.linalg.pinv(square))))
    unsure = float(spread[5]) > _MAX_DEPTH_ERROR * float(shift[2]) or float(spread[1]) > _MAX_TURN_ERROR
    if unsure or rotation[1, 1] < _MIN_UPRIGHT or float(np.abs(error).max()) > _MAX_DEVIATIONS:
        return None
    facing = rotation[:, 2] @ shift
    return ModelPose(rotation, shift, sqrt(float(error @ error) / 4.0)) if facing > 0.0 else None


def _differ(one: ModelPose, other: ModelPose) -> bool:
    return float(one.rotation[:, 2] @ other.rotation[:, 2]) < _SAME_COSINE
