"""What the filter of the place measures: reported velocity and height, and corners of gates.

Each function gives the measurement's model: residual, Jacobian and noise at a state (`PlaceFilter`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.gates.gate_measurement import GateView, predicted
from offboard.navigation.pose_history import turned_by
from offboard.place.place_filter import POSITION, TURN, VELOCITY, Floats, Measurement, Model

PLACE_STD_M = 0.0005  # of the camera on the drone


def velocity(reported_m_s: Vec3, level_std_m_s: float, climb_std_m_s: float) -> Model:
    """A reported velocity, in the axes of the reported heading."""
    x, y, z = reported_m_s

    def at(state: Floats) -> Measurement:
        c, s = cos(state[TURN]), sin(state[TURN])
        ax, ay = c * x - s * y, s * x + c * y
        jacobian = np.zeros((3, len(state)))
        jacobian[:, VELOCITY] = np.eye(3)
        jacobian[:2, TURN] = (ay, -ax)
        residual = np.array((ax, ay, z)) - state[VELOCITY]
        return Measurement(
            residual, jacobian, np.diag(np.square((level_std_m_s, level_std_m_s, climb_std_m_s)))
        )

    return at


def height(reported_m: float, std_m: float) -> Model:
    """A reported height above the arena's floor."""

    def at(state: Floats) -> Measurement:
        jacobian = np.zeros((1, len(state)))
        jacobian[0, 2] = 1.0
        return Measurement(np.array((reported_m - state[2],)), jacobian, np.array(((std_m**2,),)))

    return at


def stands(position_m: Vec3, turn_rad: float, std_m: float, turn_std_rad: float, std_m_s: float) -> Model:
    """A drone at rest, whose place and heading are known: position, turn and velocity."""
    known = np.array((*position_m, turn_rad, 0.0, 0.0, 0.0))
    noise = np.diag(np.square((std_m, std_m, std_m, turn_std_rad, std_m_s, std_m_s, std_m_s)))

    def at(state: Floats) -> Measurement:
        jacobian = np.eye(len(known), len(state))
        return Measurement(known - state[: len(known)], jacobian, noise)

    return at


def position(reported_m: Vec3, std_m: float) -> Model:
    """A reported place in plan."""

    def at(state: Floats) -> Measurement:
        residual = np.array(reported_m[:2]) - state[:2]
        return Measurement(residual, np.eye(2, len(state)), std_m**2 * np.eye(2))

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


def corners(view: GateView, eye: Eye, first: int, yaw_var_rad2: float) -> Model:
    """The corners of a gate in an image.

    The linear part of a function of the yaw leaves out the square (second-order filter; Athans et al., 1968).

    Args:
        view: what was seen.
        eye: from where.
        first: index of the gate in the state.
        yaw_var_rad2: variance of the gate's yaw.
    """

    def at(state: Floats) -> Measurement | None:
        place_m, attitude = eye.place(state)
        here = replace(view, camera=eye.model.pose(place_m, attitude))
        expected = predicted(state[first : first + 4], here)
        if expected is None:
            return None
        corners_px, by_gate, curvature = expected
        moved = by_gate[:, :3]
        jacobian = np.zeros((len(corners_px), len(state)))
        jacobian[:, first : first + 4] = by_gate
        jacobian[:, POSITION] = -moved
        x, y, _ = state[first : first + 3] - state[POSITION]
        jacobian[:, TURN] = moved @ (y, -x, 0.0) - by_gate[:, 3]
        noise = (
            view.noise_px2
            + 0.5 * yaw_var_rad2 * np.outer(curvature, curvature)
            + PLACE_STD_M**2 * (moved @ moved.T)
        )
        return Measurement(view.corners_px - corners_px, jacobian, noise)

    return at
