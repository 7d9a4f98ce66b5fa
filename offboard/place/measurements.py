"""What the filter of the place measures: what the vehicle reports, corners of gates, points known before.

Each function gives the measurement's model: residual, Jacobian and noise at a state (`PlaceFilter`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, exp, inf, sin

import numpy as np

from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import NEAREST_M, CameraModel
from offboard.navigation.gates.gate_measurement import GateView, predicted
from offboard.navigation.pose_history import turned_by
from offboard.place.place_filter import OWN, POSE, POSITION, SEEN_FROM, SIZE, TURN, Floats, Measurement, Model

PLACE_STD_M = 0.0005  # of the camera on the drone


def report(
    velocity_m_s: Vec3,
    level_std_m_s: float,
    climb_std_m_s: float,
    *,
    position_m: Vec3 = (0.0, 0.0, 0.0),
    height_std_m: float = inf,
    position_std_m: float = inf,
) -> Model:
    """What a vehicle reports of its motion.

    Args:
        velocity_m_s: in the axes of the reported heading.
        level_std_m_s: of its level components.
        climb_std_m_s: of the vertical one.
        position_m: above the arena's floor, and in plan.
        height_std_m: infinite: the height is not used.
        position_std_m: of each coordinate in plan; infinite: they are not used.
    """
    vx, vy, vz = velocity_m_s
    stds = [level_std_m_s, level_std_m_s, climb_std_m_s]
    used = []  # coordinates of the position
    for axis, std_m in ((2, height_std_m), (0, position_std_m), (1, position_std_m)):
        if std_m < inf:
            used.append(axis)
            stds.append(std_m)
    measured = [position_m[axis] for axis in used]
    noise = np.diag(np.square(stds))
    shown = np.zeros((len(stds), OWN))
    shown[np.arange(3), np.arange(4, 7)] = 1.0
    shown[np.arange(3, len(stds)), used] = 1.0

    def at(state: Floats) -> Measurement:
        c, s = cos(state[TURN]), sin(state[TURN])
        ax, ay = c * vx - s * vy, s * vx + c * vy
        jacobian = np.zeros((len(stds), len(state)))
        jacobian[:, :OWN] = shown
        jacobian[0, TURN], jacobian[1, TURN] = ay, -ax
        residual = np.array((ax, ay, vz, *measured)) - shown @ state[:OWN]
        return Measurement(residual, jacobian, noise)

    return at


def height(height_m: float, std_m: float) -> Model:
    """The height above the arena's floor."""
    noise = np.array(((std_m**2,),))

    def at(state: Floats) -> Measurement:
        jacobian = np.zeros((1, len(state)))
        jacobian[0, 2] = 1.0
        return Measurement(np.array((height_m - state[2],)), jacobian, noise)

    return at


def stands(position_m: Vec3, turn_rad: float, std_m: float, turn_std_rad: float, std_m_s: float) -> Model:
    """A drone at rest, whose place and heading are known: position, turn and velocity."""
    known = np.array((*position_m, turn_rad, 0.0, 0.0, 0.0))
    noise = np.diag(np.square((std_m, std_m, std_m, turn_std_rad, std_m_s, std_m_s, std_m_s)))

    def at(state: Floats) -> Measurement:
        jacobian = np.eye(len(known), len(state))
        return Measurement(known - state[: len(known)], jacobian, noise)

    return at


def size(first: int, std: float) -> Model:
    """A gate has the size of its shape.

    Args:
        first: index of the gate in the state.
        std: standard deviation of the logarithm of its size.
    """
    noise = np.array(((std * std,),))

    def at(state: Floats) -> Measurement:
        jacobian = np.zeros((1, len(state)))
        jacobian[0, first + SIZE] = 1.0
        return Measurement(-state[first + SIZE : first + SIZE + 1], jacobian, noise)

    return at


@dataclass(frozen=True, slots=True)
class Eye:
    """The camera's carrier in an image, before the filter has corrected it.

    Attributes:
        model: of the camera.
        attitude: reported, body FLU to arena; see `CameraModel.carrier`.
        offset_m: from the drone's centre when the image was exposed to the carrier's when these rows were
            read out, in the axes of the reported heading.
    """

    model: CameraModel
    attitude: Quaternion
    offset_m: Vec3

    def place(self, state: Floats) -> tuple[Vec3, Quaternion]:
        """Where a state has it."""
        c, s = cos(state[TURN]), sin(state[TURN])
        x, y, z = self.offset_m
        px, py, pz = state[POSITION].tolist()
        return (px + c * x - s * y, py + s * x + c * y, pz + z), turned_by(float(state[TURN]), self.attitude)

    def sees(self, state: Floats, point_m: Sequence[float]) -> bool:
        """Whether a point in the arena is in the image, where a state has the camera."""
        x, y, z = point_m
        seen = self.model.project(self.model.pose(*self.place(state)), (x, y, z))
        return seen is not None and self.model.contains(*seen, 0.0)


def corners(view: GateView, eye: Eye, first: int, yaw_var_rad2: float) -> Model:
    """The corners of a gate in an image.

    One larger than its shape looks like one that is nearer, and moves along with the drone. The linear
    part of a function of the yaw leaves out the square (second-order filter; Athans et al., 1968).

    Args:
        view: what was seen.
        eye: from where.
        first: index of the gate in the state.
        yaw_var_rad2: variance of the gate's yaw.
    """

    def at(state: Floats) -> Measurement | None:
        place_m, attitude = eye.place(state)
        camera = eye.model.pose(place_m, attitude)
        gate = state[first : first + POSE].copy()
        seen_from = slice(first + SEEN_FROM.start, first + SEEN_FROM.stop)
        kept, since_m = exp(-float(state[first + SIZE])), place_m - state[seen_from]
        gate[:3] += (1.0 - kept) * since_m
        expected = predicted(gate, replace(view, camera=camera))
        if expected is None:
            return None
        corners_px, by_gate, curvature = expected
        moved = by_gate[:, :3]
        jacobian = np.zeros((len(corners_px), len(state)))
        jacobian[:, first : first + POSE] = by_gate
        jacobian[:, first + SIZE] = kept * moved @ since_m
        jacobian[:, seen_from] = (kept - 1.0) * moved
        jacobian[:, POSITION] = -kept * moved
        x, y, _ = gate[:3] - place_m + kept * (place_m - state[POSITION])
        jacobian[:, TURN] = moved @ (y, -x, 0.0) - by_gate[:, 3]
        noise = (
            view.noise_px2
            + 0.5 * yaw_var_rad2 * np.outer(curvature, curvature)
            + PLACE_STD_M**2 * (moved @ moved.T)
        )
        return Measurement(view.corners_px - corners_px, jacobian, noise)

    return at


def points(
    points_m: Floats, pixels: Floats, covariance_px2: Floats, eye: Eye, attitude_std_rad: float
) -> Model:
    """Known points in an image, such as corners of the base.

    The attitude's error is common to all of them.

    Args:
        points_m: in the arena, shape (n, 3).
        pixels: right of and below the optical axis, shape (n, 2).
        covariance_px2: of all coordinates, shape (2 n, 2 n).
        eye: that sees them.
        attitude_std_rad: standard deviation of its attitude.
    """

    def at(state: Floats) -> Measurement | None:
        place_m, attitude = eye.place(state)
        camera = eye.model.pose(place_m, attitude)
        focal_px = eye.model.focal_px
        turn = np.array(camera.rotation).reshape(3, 3)
        in_camera = (points_m - camera.position_m) @ turn
        ahead = in_camera[:, 0]
        if float(ahead.min()) < NEAREST_M:
            return None
        seen = -focal_px * in_camera[:, 1:] / ahead[:, None]
        right, down = seen.T
        by_body = np.zeros((len(seen), 2, 3))
        by_body[:, 0, 0], by_body[:, 0, 1] = -right, -focal_px
        by_body[:, 1, 0], by_body[:, 1, 2] = -down, -focal_px
        by_point = (by_body / ahead[:, None, None]) @ turn.T
        x, y, _ = (points_m - state[POSITION]).T
        jacobian = np.zeros((len(seen), 2, len(state)))
        jacobian[:, :, POSITION] = -by_point
        jacobian[:, :, TURN] = by_point[:, :, 0] * y[:, None] - by_point[:, :, 1] * x[:, None]
        turned = np.stack(
            [
                np.stack([down, -right * down / focal_px, focal_px + right * right / focal_px], axis=1),
                np.stack([-right, -focal_px - down * down / focal_px, right * down / focal_px], axis=1),
            ],
            axis=1,
        ).reshape(-1, 3)
        noise = covariance_px2 + attitude_std_rad**2 * (turned @ turned.T)
        return Measurement((pixels - seen).ravel(), jacobian.reshape(-1, len(state)), noise)

    return at
