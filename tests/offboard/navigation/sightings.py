"""Gates as an ideal finder would see them: corners of the outline, with noise."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.rotations import multiply, normalized, quaternion_from_euler
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.pose_history import DronePose
from scenarios.models import Arena, Camera, Gate
from vision.types import Detections, GateCorner, GateSighting

CAMERA = CameraModel.of(Camera())
PERIOD_US = 100_000
STD_PX = 0.25
POSITION_STD_M = 0.005
ATTITUDE_STD_RAD = 0.004
Points = npt.NDArray[np.float64]


def gate_at(x: float, y: float, z: float, yaw: float, colour: str = "red") -> Gate:
    """A gate of the usual size."""
    return Gate.model_validate({"colour": colour, "x_m": x, "y_m": y, "z_m": z, "yaw_rad": yaw})


def corners_px(gate: Gate, drone_m: Vec3, attitude: Quaternion) -> Points | None:
    """Corners of the outline in the gate's middle plane, clockwise from the upper left as seen, (4, 2).

    None if one is not before the camera.
    """
    camera = CAMERA.pose(drone_m, attitude)
    half_m = gate.outer_width_m / 2
    x, y = -half_m * sin(gate.yaw_rad), half_m * cos(gate.yaw_rad)
    sides = [
        [
            CAMERA.project(camera, (gate.x_m + sign * x, gate.y_m + sign * y, gate.z_m + up))
            for up in (gate.outer_height_m / 2, -gate.outer_height_m / 2)
        ]
        for sign in (-1.0, 1.0)
    ]
    if any(corner is None for side in sides for corner in side):
        return None
    left, right = sorted(np.array(sides), key=lambda side: float(side[:, 0].sum()))
    return np.array((left[0], right[0], right[1], left[1]))


def sighting(
    gate: Gate, drone_m: Vec3, attitude: Quaternion, random: np.random.Generator, noise: float = 1.0
) -> GateSighting | None:
    """A gate from a pose that differs from the given one by the usual errors; None if out of view."""
    x, y, z = (m + noise * POSITION_STD_M * random.standard_normal() for m in drone_m)
    a, b, c = noise * ATTITUDE_STD_RAD / 2 * random.standard_normal(3)
    points = corners_px(gate, (x, y, z), normalized(multiply(attitude, (1.0, a, b, c))))
    if points is None:
        return None
    points = points + noise * STD_PX * random.standard_normal((4, 2))
    corners = [
        GateCorner(right, down, STD_PX, STD_PX) if CAMERA.contains(right, down) else None
        for right, down in points.tolist()
    ]
    if not any(corners):
        return None
    upper_left, upper_right, lower_right, lower_left = corners
    return GateSighting(gate.colour, (upper_left, upper_right, lower_right, lower_left), all(corners), ())


class Flight:
    """A drone that shows gates to a map, an image every 100 ms, with the wobble of a real flight."""

    def __init__(self, seed: int = 0) -> None:
        self.map = GateMap(CAMERA, Arena(), GateShapes())
        self.random = np.random.default_rng(seed)
        self.time_us = 0

    def look(self, gates: list[Gate], drone_m: Vec3, yaw_rad: float) -> None:
        """Take an image."""
        roll, pitch, yaw = 0.03 * self.random.standard_normal(3)
        attitude = quaternion_from_euler(roll, pitch + 0.05, yaw_rad + yaw)
        seen = [sighting(gate, drone_m, attitude, self.random) for gate in gates]
        self.time_us += PERIOD_US
        pose = DronePose(self.time_us, drone_m, attitude, POSITION_STD_M, ATTITUDE_STD_RAD)
        self.map.observe(Detections(frames=tuple(one for one in seen if one is not None)), pose)

    def approach(
        self, gate: Gate, angle_rad: float, start_m: float, end_m: float, others: tuple[Gate, ...] = ()
    ) -> None:
        """Fly towards a gate at 1 m/s, at an angle to its normal, looking at it."""
        bearing = gate.yaw_rad + angle_rad
        for step in range(round((start_m - end_m) * 10) + 1):
            away_m = start_m - step / 10
            place = (gate.x_m + away_m * cos(bearing), gate.y_m + away_m * sin(bearing), gate.z_m)
            self.look([gate, *others], place, bearing + pi)
