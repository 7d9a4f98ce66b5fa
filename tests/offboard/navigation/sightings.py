"""Frames as an ideal finder would see them: the outline of the solid frame, with noise."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import numpy.typing as npt

from geometry.rotations import multiply, normalized, quaternion_from_euler
from geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.frame_map import FrameMap
from offboard.navigation.pose_history import DronePose
from scenarios.models import Arena, Camera, Frame
from vision.types import Detections, FrameCorner, FrameSighting

CAMERA = CameraModel.of(Camera())
PERIOD_US = 100_000
STD_PX = 0.25
POSITION_STD_M = 0.005
ATTITUDE_STD_RAD = 0.004
Points = npt.NDArray[np.float64]


def frame_at(x: float, y: float, z: float, yaw: float, colour: str = "red") -> Frame:
    """A frame of the usual size."""
    return Frame.model_validate({"colour": colour, "x_m": x, "y_m": y, "z_m": z, "yaw_rad": yaw})


def hull_px(frame: Frame, drone_m: Vec3, attitude: Quaternion) -> Points | None:
    """Corners of the box around a frame in the image, shape (8, 2); None if not before the camera."""
    camera = CAMERA.pose(drone_m, attitude)
    c, s = cos(frame.yaw_rad), sin(frame.yaw_rad)
    points = []
    for a in (-frame.bar_m / 2, frame.bar_m / 2):
        for b in (-frame.outer_width_m / 2, frame.outer_width_m / 2):
            for h in (-frame.outer_height_m / 2, frame.outer_height_m / 2):
                point = (frame.x_m + a * c - b * s, frame.y_m + a * s + b * c, frame.z_m + h)
                points.append(CAMERA.project(camera, point))
    return None if None in points else np.array(points)


def corners_px(frame: Frame, drone_m: Vec3, attitude: Quaternion) -> Points | None:
    """Corners of the outline, shape (4, 2): its left-most and right-most uprights, cut by its long edges.

    For an attitude that is nearly level.
    """
    points = hull_px(frame, drone_m, attitude)
    if points is None:
        return None
    uprights = sorted(points.reshape(4, 2, 2).tolist(), key=lambda upright: upright[0][0] + upright[1][0])
    level = [points[i::2] for i in (1, 0)]  # upper and lower ends
    corners = []
    for right in (False, True):
        (low_u, low_v), (high_u, high_v) = uprights[-1 if right else 0]
        for upper, ends in ((True, level[0]), (False, level[1])):
            # The long edges, nearer and farther: the outline has that which is farther out.
            lines = [np.polyfit(ends[i : i + 2, 0], ends[i : i + 2, 1], 1) for i in (0, 2)]
            downs = [np.polyval(line, high_u if upper else low_u) for line in lines]
            down = min(downs) if upper else max(downs)
            share = (down - low_v) / (high_v - low_v)
            corners.append((low_u + share * (high_u - low_u), down))
    upper_left, lower_left, upper_right, lower_right = corners
    return np.array((upper_left, upper_right, lower_right, lower_left))


def sighting(
    frame: Frame, drone_m: Vec3, attitude: Quaternion, random: np.random.Generator, noise: float = 1.0
) -> FrameSighting | None:
    """A frame from a pose that differs from the given one by the usual errors; None if out of view."""
    x, y, z = (m + noise * POSITION_STD_M * random.standard_normal() for m in drone_m)
    a, b, c = noise * ATTITUDE_STD_RAD / 2 * random.standard_normal(3)
    points = corners_px(frame, (x, y, z), normalized(multiply(attitude, (1.0, a, b, c))))
    if points is None:
        return None
    points = points + noise * STD_PX * random.standard_normal((4, 2))
    corners = [
        FrameCorner(right, down, STD_PX, STD_PX) if CAMERA.contains(right, down) else None
        for right, down in points.tolist()
    ]
    if not any(corners):
        return None
    upper_left, upper_right, lower_right, lower_left = corners
    return FrameSighting(frame.colour, (upper_left, upper_right, lower_right, lower_left), all(corners), ())


class Flight:
    """A drone that shows frames to a map, an image every 100 ms, with the wobble of a real flight."""

    def __init__(self, seed: int = 0) -> None:
        self.map = FrameMap(CAMERA, Arena())
        self.random = np.random.default_rng(seed)
        self.time_us = 0

    def look(self, frames: list[Frame], drone_m: Vec3, yaw_rad: float) -> None:
        """Take an image."""
        roll, pitch, yaw = 0.03 * self.random.standard_normal(3)
        attitude = quaternion_from_euler(roll, pitch + 0.05, yaw_rad + yaw)
        seen = [sighting(frame, drone_m, attitude, self.random) for frame in frames]
        self.time_us += PERIOD_US
        pose = DronePose(self.time_us, drone_m, attitude, POSITION_STD_M, ATTITUDE_STD_RAD)
        self.map.observe(Detections(frames=tuple(one for one in seen if one is not None)), pose)

    def approach(
        self, frame: Frame, angle_rad: float, start_m: float, end_m: float, others: tuple[Frame, ...] = ()
    ) -> None:
        """Fly towards a frame at 1 m/s, at an angle to its normal, looking at it."""
        bearing = frame.yaw_rad + angle_rad
        for step in range(round((start_m - end_m) * 10) + 1):
            away_m = start_m - step / 10
            place = (frame.x_m + away_m * cos(bearing), frame.y_m + away_m * sin(bearing), frame.z_m)
            self.look([frame, *others], place, bearing + pi)
