"""What an image says of a gate's pose: where the corners of its outline are, and how exactly that is known.

A gate is upright and the drone's attitude is known, so its pose has four numbers: the state (x, y, z, yaw).
The corners are those of a rectangle in the gate's middle plane. All arrays are small; what is called for
every image uses plain numbers up to the last step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, log, sin
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShape
from offboard.navigation.camera_model import NEAREST_M, CameraModel, CameraPose
from offboard.navigation.pose_history import DronePose
from scenarios.models import Arena
from vision.types import GateCorner, GateSighting

Floats: TypeAlias = npt.NDArray[np.float64]

# To the right and up, halves of a gate: upper left, upper right, lower right, lower left as seen.
_CORNERS = ((-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))

EDGE_ON = 0.1  # sine of the angle to the gate's plane below which its outline says little
PIXEL_STD_PX = 0.1  # added to what the finder of gates states: its edges' errors are not all independent
# Angles between a gate's normal and the line of sight, and their deviation: together they cover all that can
# be seen, and within each the measurement is nearly linear.
YAWS_RAD = (-1.1, -0.66, -0.22, 0.22, 0.66, 1.1)
YAW_STD_RAD = 0.22
_STEPS = 10
_CONVERGED = 0.03  # decrease of the cost
_YAW_STEP_RAD = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class GateView:
    """A gate's corners in one image, k of which are seen.

    Attributes:
        colour: of the gate.
        shape: its sizes.
        whole: nothing of it is hidden.
        time_us: vehicle time of the image.
        camera: where it was taken.
        focal_px: focal length.
        seen: which of the four corners are seen.
        corners_px: right and down of each seen corner from the optical axis, shape (2 k,).
        noise_px2: covariance of their errors, that of the drone's attitude included, shape (2 k, 2 k).
        position_var_m2: variance of each coordinate of the drone's position.
    """

    colour: str
    shape: GateShape
    whole: bool
    time_us: int
    camera: CameraPose
    focal_px: float
    seen: tuple[bool, bool, bool, bool]
    corners_px: Floats
    noise_px2: Floats
    position_var_m2: float


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A pose that explains views, with its covariance.

    Attributes:
        state: x, y, z (metres), yaw (radians).
        covariance: shape (4, 4).
        cost: sum of the squares of the residuals in standard deviations.
        log_weight: logarithm of its likelihood, all states near it together.
    """

    state: Floats
    covariance: Floats
    cost: float
    log_weight: float


def view_of(sighting: GateSighting, shape: GateShape, model: CameraModel, pose: DronePose) -> GateView | None:
    """A sighting of a gate of known shape as a measurement; None if no corner is seen."""
    seen = [corner for corner in sighting.corners if corner is not None]
    if not seen:
        return None
    corners_px = [number for corner in seen for number in (corner.right_px, corner.down_px)]
    variances = [std**2 + PIXEL_STD_PX**2 for c in seen for std in (c.std_right_px, c.std_down_px)]
    turned = np.array([row for corner in seen for row in _turned(corner, model.focal_px)])
    noise = np.diag(variances) + pose.attitude_std_rad**2 * (turned @ turned.T)
    a, b, c, d = (corner is not None for corner in sighting.corners)
    camera = model.pose(pose.position_m, pose.attitude_arena)
    return GateView(
        colour=sighting.colour,
        shape=shape,
        whole=sighting.whole,
        time_us=pose.time_us,
        camera=camera,
        focal_px=model.focal_px,
        seen=(a, b, c, d),
        corners_px=np.array(corners_px),
        noise_px2=noise,
        position_var_m2=pose.position_std_m**2,
    )


def _turned(corner: GateCorner, focal_px: float) -> tuple[tuple[float, float, float], ...]:
    """How a corner moves in the image when the camera turns about forward, left and up, pixels a radian."""
    right, down = corner.right_px, corner.down_px
    return (
        (down, -right * down / focal_px, focal_px + right * right / focal_px),
        (-right, -focal_px - down * down / focal_px, right * down / focal_px),
    )


def predicted(state: Floats, view: GateView) -> tuple[Floats, Floats, Floats] | None:
    """Where a gate's corners should be in a view, pixels, their Jacobian, and their curvature in the yaw.

    Args:
        state: x, y, z (metres), yaw (radians) of the gate.
        view: says from where and which corners.

    Returns:
        Shapes (2 k,), (2 k, 4) and (2 k,), the second derivative; None if the gate is seen edge-on or is
        not before the camera.
    """
    x, y, z, yaw = state.tolist()
    camera, focal = view.camera, view.focal_px
    dx, dy, dz = camera.position_m[0] - x, camera.position_m[1] - y, camera.position_m[2] - z
    # The normal towards the camera; along it, to the right as seen, and up: where the camera is.
    nx, ny = cos(yaw), sin(yaw)
    ahead = nx * dx + ny * dy
    if ahead < 0.0:
        nx, ny, ahead = -nx, -ny, -ahead
    if ahead < EDGE_ON * hypot(dx, dy, dz):
        return None
    m = camera.rotation
    half_width_m, half_height_m = view.shape.half_m
    numbers: list[float] = []
    curvature: list[float] = []
    rows: list[tuple[float, float, float, float]] = []
    for seen, (right, high) in zip(view.seen, _CORNERS, strict=True):
        if not seen:
            continue
        across, up = right * half_width_m, high * half_height_m
        px, py, pz = -across * ny - dx, across * nx - dy, up - dz
        forward = m[0] * px + m[3] * py + m[6] * pz
        if forward < NEAREST_M:
            return None
        scale = -focal / forward
        u = scale * (m[1] * px + m[4] * py + m[7] * pz)
        v = scale * (m[2] * px + m[5] * py + m[8] * pz)
        r = u / focal
        rx, ry, rz = scale * (m[1] + r * m[0]), scale * (m[4] + r * m[3]), scale * (m[7] + r * m[6])
        r = v / focal
        sx, sy, sz = scale * (m[2] + r * m[0]), scale * (m[5] + r * m[3]), scale * (m[8] + r * m[6])
        numbers += (u, v)
        rows.append((rx, ry, rz, -across * (rx * nx + ry * ny)))
        rows.append((sx, sy, sz, -across * (sx * nx + sy * ny)))
        curvature += (across * (rx * ny - ry * nx), across * (sx * ny - sy * nx))
    return np.array(numbers), np.array(rows), np.array(curvature)


def noise_of(view: GateView, jacobian: Floats) -> Floats:
    """Covariance of a view's errors, pixels squared: that of the drone's position included."""
    moved = jacobian[:, :3]
    noise: Floats = view.noise_px2 + view.position_var_m2 * (moved @ moved.T)
    return noise


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """Where a gate can be, before anything is seen: somewhere in the arena, with one of several yaws."""

    state: Floats
    information: Floats  # inverse of the covariance, shape (4, 4)

    @classmethod
    def of(cls, arena: Arena) -> Prior:
        """Mean and variance of a uniform distribution in the arena; yaw 0 is to be replaced."""
        extents_m = (arena.length_x_m, arena.width_y_m, arena.height_m)
        information = [12.0 / extent_m**2 for extent_m in extents_m]
        return cls(np.array((0.0, 0.0, arena.height_m / 2, 0.0)), np.diag((*information, YAW_STD_RAD**-2)))


def solutions(views: list[GateView], prior: Prior) -> list[Solution]:
    """The poses that explain views, the likeliest first: one for each of several yaws; none if none can.

    The first view must have a whole upright edge, from whose height the search begins.
    """
    found = [
        _solve(views, replace(prior, state=np.array((*prior.state[:3], start[3]))), start)
        for start in _starts(views[0])
    ]
    return sorted((one for one in found if one is not None), key=lambda solution: -solution.log_weight)


def upright_edges(view: GateView) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The upright edges that are seen from end to end: upper and lower end, each right and down, pixels."""
    places = iter([(right, down) for right, down in view.corners_px.reshape(-1, 2).tolist()])
    corner = [next(places) if seen else None for seen in view.seen]
    ends = ((corner[0], corner[3]), (corner[1], corner[2]))
    return [(high, low) for high, low in ends if high is not None and low is not None]


def _starts(view: GateView) -> list[Floats]:
    """States to begin the search at: the distance from the height of an upright edge, several yaws."""
    heights = [low[1] - high[1] for high, low in upright_edges(view)]
    if not heights or min(heights) < 0.5:
        return []
    forward = view.focal_px * view.shape.outer_height_m / (sum(heights) / len(heights))
    right, down = view.corners_px.reshape(-1, 2).mean(axis=0).tolist()
    left, up = -right * forward / view.focal_px, -down * forward / view.focal_px
    m, at = view.camera.rotation, view.camera.position_m
    away = [m[i] * forward + m[i + 1] * left + m[i + 2] * up for i in (0, 3, 6)]
    bearing = float(np.arctan2(away[1], away[0]))
    place = [a + b for a, b in zip(at, away, strict=True)]
    return [np.array((*place, bearing + offset)) for offset in YAWS_RAD]


def _solve(views: list[GateView], prior: Prior, start: Floats) -> Solution | None:
    """Least squares from a start (Levenberg and Marquardt's method); None if it does not converge."""
    state, damping = start, 1e-3
    system = _normal_equations(views, prior, state)
    if system is None:
        return None
    for _ in range(_STEPS):
        information, gradient, cost, _ = system
        step = np.linalg.solve(information + damping * np.diag(np.diag(information)), gradient)
        step *= min(1.0, _YAW_STEP_RAD / max(abs(float(step[3])), 1e-9))
        after = _normal_equations(views, prior, state + step)
        if after is None or after[2] > cost + 1e-9:
            damping *= 10.0
            if damping > 1e4:
                break
            continue
        state, system, damping = state + step, after, damping * 0.1
        if cost - after[2] < _CONVERGED:
            break
    information, _, cost, residual = system
    covariance = np.asarray(np.linalg.inv(information), np.float64)
    spread = log(max(float(np.linalg.det(covariance)), 1e-300))
    return Solution(state, covariance, residual, -0.5 * cost + 0.5 * spread)


def _normal_equations(
    views: list[GateView], prior: Prior, state: Floats
) -> tuple[Floats, Floats, float, float] | None:
    """Information, gradient, cost with the prior's, cost of the views alone; None if one shows nothing."""
    away = prior.state - state
    gradient = prior.information @ away
    information, own = prior.information, float(away @ gradient)
    cost = 0.0
    for view in views:
        prediction = predicted(state, view)
        if prediction is None:
            return None
        corners, jacobian, _ = prediction
        weighted = np.linalg.solve(
            noise_of(view, jacobian), np.column_stack((jacobian, view.corners_px - corners))
        )
        information = information + jacobian.T @ weighted[:, :4]
        gradient = gradient + jacobian.T @ weighted[:, 4]
        cost += float((view.corners_px - corners) @ weighted[:, 4])
    return information, gradient, cost + own, cost
