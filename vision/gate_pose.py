"""The pose of a gate from four points of its middle plane.

A rectangle seen from one side has, in general, two poses that explain its image nearly as well as each other:
tilted to one side or to the other. Both follow from how the image of the middle changes with its place on
the gate (T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", International Journal of
Computer Vision, 2014). OpenCV has a solver for this, too; for a rectangle and in plain numbers it is several
times quicker, and an image that is symmetric to the last digit is no special case.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, copysign, cos, hypot, isfinite, pi, sqrt

import cv2
import numpy as np

from framerunner.geometry.vectors import Vec3
from vision.gate_model import Floats, GateModel, ModelPose, Point
from vision.types import GatePose

_NEAREST_M = 0.03
_MIN_UPRIGHT = 0.6  # cosine of the largest tilt of the camera, about 53 degrees: gates are upright
_MAX_STEPS = 12
_DAMPING = 1e-6 * np.eye(6)
_SMALL_STEP = 1e-3  # metres and radians
_MAX_DEPTH_ERROR = 0.08  # a pose that is less sure than this, relative to its distance, is left out
_MAX_TURN_ERROR = 0.25  # the same for its angle about the upright axis, radians
_MAX_DEVIATIONS = 3.0
_SAME_COSINE = 0.9995
_FLAT = 1e-9  # area of an image, in units of the focal length squared, of which no pose is found

_Rows = tuple[Vec3, Vec3, Vec3]


def find_poses(axes_corners: Sequence[Point], model: GateModel, max_error_px: float) -> list[ModelPose]:
    """Find the poses of a gate.

    Args:
        axes_corners: where the axes of its bars meet, upper left, upper right, lower right, lower left:
            pixels right of and below the optical axis.
        model: of the gate.
        max_error_px: poses that explain the corners worse than this (root mean square) are left out.

    Returns:
        None, one or two, the better one first.
    """
    image = [(x / model.focal_px, y / model.focal_px) for x, y in axes_corners]
    poses = [_pose(rotation, image, model) for rotation in _rotations(image, model.axes_m)]
    found = [pose for pose in poses if pose is not None and pose.error_px <= max_error_px]
    return sorted(found, key=lambda pose: pose.error_px)


def as_seen(pose: ModelPose) -> GatePose:
    """The pose as others use it, in the camera's axes forward, left, up."""
    right, down, ahead = pose.rotation[:, 2].tolist()
    x, y, z = pose.shift_m.tolist()
    if right * x + down * y + ahead * z > 0.0:  # the normal points to the side from which it is seen
        right, down, ahead = -right, -down, -ahead
    return GatePose((z, -x, -y), (ahead, -right, -down), pose.error_px)


def _rotations(image: list[Point], axes_m: tuple[float, float]) -> list[_Rows]:
    """The two rotations, by rows, with which a small part of the gate's middle looks as it does.

    Args:
        image: the four corners, in units of the focal length.
        axes_m: width and height of the gate, between the axes of its bars.
    """
    # The projective map from the unit square to the image (P. Heckbert, "Fundamentals of texture mapping and
    # image warping", 1989).
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = image
    ax, ay, bx, by, cx, cy = x1 - x2, y1 - y2, x3 - x2, y3 - y2, x0 - x1 + x2 - x3, y0 - y1 + y2 - y3
    area = ax * by - bx * ay
    if abs(area) < _FLAT:
        return []
    g, h = (cx * by - bx * cy) / area, (ax * cy - cx * ay) / area
    along, down = (x1 - x0 + g * x1, y1 - y0 + g * y1), (x3 - x0 + h * x3, y3 - y0 + h * y3)
    depth = 1.0 + 0.5 * (g + h)
    if depth < _FLAT:
        return []
    # The image of the middle, and how it changes with the place on the gate, for each metre.
    p, q = (0.5 * (along[0] + down[0]) + x0) / depth, (0.5 * (along[1] + down[1]) + y0) / depth
    per_x, per_y = 1.0 / (depth * axes_m[0]), 1.0 / (depth * axes_m[1])
    j00, j01 = (along[0] - p * g) * per_x, (down[0] - p * h) * per_y
    j10, j11 = (along[1] - q * g) * per_x, (down[1] - q * h) * per_y
    # The same in axes that are turned so that the middle is straight ahead.
    length = sqrt(p * p + q * q + 1.0)
    x, y, z = p / length, q / length, 1.0 / length
    share = 1.0 / (1.0 + z)
    ahead = ((1.0 - x * x * share, -x * y * share, x), (-x * y * share, 1.0 - y * y * share, y), (-x, -y, z))
    b00, b01 = ahead[0][0] - p * ahead[2][0], ahead[0][1] - p * ahead[2][1]
    b10, b11 = ahead[1][0] - q * ahead[2][0], ahead[1][1] - q * ahead[2][1]
    det = b00 * b11 - b01 * b10
    a00, a01 = (b11 * j00 - b01 * j10) / det, (b11 * j01 - b01 * j11) / det
    a10, a11 = (b00 * j10 - b10 * j00) / det, (b00 * j11 - b10 * j01) / det
    # Its larger singular value is the scale; what is missing to unit columns is their third component.
    one, other, both = a00 * a00 + a01 * a01, a10 * a10 + a11 * a11, a00 * a10 + a01 * a11
    scale = sqrt(0.5 * (one + other + hypot(one - other, 2.0 * both)))
    if scale < _FLAT:  # corners that are one: the map is flat in the middle
        return []
    a00, a01, a10, a11 = a00 / scale, a01 / scale, a10 / scale, a11 / scale
    c0 = sqrt(max(1.0 - a00 * a00 - a10 * a10, 0.0))
    c1 = copysign(sqrt(max(1.0 - a01 * a01 - a11 * a11, 0.0)), -(a00 * a01 + a10 * a11))
    return [_turned(ahead, (a00, a10, sign * c0), (a01, a11, sign * c1)) for sign in (1.0, -1.0)]


def _turned(turn: _Rows, first: Vec3, second: Vec3) -> _Rows:
    """A rotation, and before it the one with these first two columns."""
    (a, b, c), (d, e, f) = first, second
    third = (b * f - c * e, c * d - a * f, a * e - b * d)
    x, y, z = (
        (
            r[0] * a + r[1] * b + r[2] * c,
            r[0] * d + r[1] * e + r[2] * f,
            r[0] * third[0] + r[1] * third[1] + r[2] * third[2],
        )
        for r in turn
    )
    return (x, y, z)


def _pose(rotation: _Rows, image: list[Point], model: GateModel) -> ModelPose | None:
    """The pose with a rotation: the shift that fits the corners best, by linear least squares."""
    (r00, r01, _), (r10, r11, _), (r20, r21, _) = rotation
    if r11 < _MIN_UPRIGHT:
        return None
    points = [(r00 * x + r01 * y, r10 * x + r11 * y, r20 * x + r21 * y) for x, y in model.axes_places]
    # For each corner shift_x - u shift_z = u z - x, and likewise for y.
    sum_u, sum_v, sum_squares, sum_x, sum_y, sum_z = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for (u, v), (x, y, z) in zip(image, points, strict=True):
        right, down = u * z - x, v * z - y
        sum_u, sum_v, sum_squares = sum_u + u, sum_v + v, sum_squares + u * u + v * v
        sum_x, sum_y, sum_z = sum_x + right, sum_y + down, sum_z + u * right + v * down
    shift_z = (0.25 * (sum_u * sum_x + sum_v * sum_y) - sum_z) / (
        sum_squares - 0.25 * (sum_u * sum_u + sum_v * sum_v)
    )
    shift_x, shift_y = 0.25 * (sum_x + sum_u * shift_z), 0.25 * (sum_y + sum_v * shift_z)
    square = 0.0
    for (u, v), (x, y, z) in zip(image, points, strict=True):
        depth = z + shift_z
        if depth <= 0.0:  # behind the camera
            return None
        square += ((x + shift_x) / depth - u) ** 2 + ((y + shift_y) / depth - v) ** 2
    shift = np.array((shift_x, shift_y, shift_z))
    return ModelPose(np.array(rotation), shift, model.focal_px * sqrt(square / 4.0))


def poses_of_three(
    lines: Sequence[tuple[float, float, float] | None],
    corners: Sequence[Point | None],
    weights: Sequence[tuple[float, float]],
    model: GateModel,
    guesses: Sequence[ModelPose] = (),
) -> list[ModelPose]:
    """Find the poses of a gate of which one side is not seen.

    Args:
        lines: (a, b, c) of a x + b y = c for the axis of each side, pixels from the optical axis; one is
            None.
        corners: where the axes meet; two are None.
        weights: of each line at its first and its second corner, 1/px.
        model: of the gate.
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
    points = model.axes_corners[[(k + end) % 4 for k, end in rows]]
    scale = np.array([weights[k][end] for k, end in rows])
    found: list[ModelPose] = []
    for guess in guesses or [_first_guess(opposite, one, other, turn, model) for turn in (-0.8, 0.8)]:
        pose = _refined(guess, points, normals, scale, model.focal_px)
        if pose is not None and all(_differ(pose, known) for known in found):
            found.append(pose)
    return sorted(found, key=lambda pose: -abs(float(pose.rotation[2, 2])))


def _first_guess(side: int, one: Point, other: Point, turn: float, model: GateModel) -> ModelPose:
    """A pose turned about the upright axis by a given angle that puts one side about where it is seen."""
    dx, dy = other[0] - one[0], other[1] - one[1]
    upright = side % 2 == 1
    (width_m, height_m), focal_px = model.axes_m, model.focal_px
    length_m = height_m if upright else width_m * cos(turn)
    depth_m = length_m * focal_px / max(hypot(dx, dy), 1.0)
    # The direction in which this side goes in the model, turned to the one in which it is seen.
    roll = atan2(dy, dx) - (0.0, pi / 2, pi, -pi / 2)[side]
    about_y, about_z = np.array([0.0, turn, 0.0]), np.array([0.0, 0.0, roll])
    rotation = cv2.Rodrigues(about_z)[0] @ cv2.Rodrigues(about_y)[0]
    middle = np.array([one[0] + other[0], one[1] + other[1], 2.0 * focal_px]) * (0.5 * depth_m / focal_px)
    seen = 0.5 * (model.axes_corners[side] + model.axes_corners[(side + 1) % 4])
    return ModelPose(rotation, middle - rotation @ seen, 0.0)


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
