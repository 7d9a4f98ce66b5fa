"""The base as a landmark: when it is looked for in an image, and what an image that shows it says."""

from __future__ import annotations

from collections import deque
from math import hypot

import numpy as np

from offboard.navigation.camera_model import CameraModel
from offboard.navigation.pose_history import DronePose
from offboard.place.place_filter import Floats
from scenarios.models import Base
from vision.types import BaseExpectation, BaseSighting

FARTHEST_M = 3.6  # from there it is some pixels only, and a cube turned otherwise looks the same
MARKER_PX = 8.0  # a marker is read as long as it is so wide
SPACED_US = 250_000  # between two images in which it is looked for: what is common to an edge is so to both
NEAR_M, NEAR_SPACED_US = 2.5, 140_000  # likewise near it, before a landing
LEAST_STD_M, LEAST_STD_RAD = 0.06, 0.015
FACTOR = 1.5  # by which the place may be known less well than the filter states
LEAST_CORNERS = 3  # that should be in the image
MARGIN_PX = 20.0
SEEN_KEPT = 8


class BaseLandmark:
    """The base of an arena, whose place in it is known.

    Args:
        camera: of the drone.
        base: as the task has it.

    Attributes:
        seen_us: vehicle times of the last images that showed it where the drone's place has it.
    """

    def __init__(self, camera: CameraModel, base: Base) -> None:
        self.seen_us: deque[int] = deque(maxlen=SEEN_KEPT)
        self._camera, self._base = camera, base
        self._looked_us: int | None = None
        marker_m = 0.0 if base.marker is None else base.marker.edge_m
        self._farthest_m = max(FARTHEST_M, camera.focal_px * marker_m / MARKER_PX)
        half_m = base.edge_m / 2
        self._corners_m = [
            (base.x_m + x, base.y_m + y, z)
            for x in (-half_m, half_m)
            for y in (-half_m, half_m)
            for z in (0.0, base.top_m)
        ]

    def expected(self, pose: DronePose, std: Floats) -> BaseExpectation | None:
        """What is expected of the base in an image; None if it is out of view or was looked for just before.

        Args:
            pose: of the drone when it is exposed.
            std: of x, y, z (metres) and the heading (radians), shape (4,).
        """
        base, camera = self._base, self._camera.pose(pose.position_m, pose.attitude_arena)
        x, y, z = camera.position_m
        away_m = hypot(x - base.x_m, y - base.y_m)
        spaced_us = NEAR_SPACED_US if away_m < NEAR_M else SPACED_US
        looked_us = self._looked_us
        if away_m > self._farthest_m or (looked_us is not None and 0 <= pose.time_us - looked_us < spaced_us):
            return None
        seen = [self._camera.project(camera, corner) for corner in self._corners_m]
        inside = [one for one in seen if one is not None and self._camera.contains(*one, -MARGIN_PX)]
        if len(inside) < LEAST_CORNERS:
            return None
        self._looked_us = pose.time_us
        std_x, std_y, std_z = np.maximum(FACTOR * std[:3], LEAST_STD_M).tolist()
        heading_std_rad = max(FACTOR * float(std[3]), LEAST_STD_RAD)
        eye_m = (x - base.x_m, y - base.y_m, z)
        return BaseExpectation(eye_m, pose.attitude_arena, (std_x, std_y, std_z), heading_std_rad)

    def sightings(self, since_us: int) -> int:
        """How many images have shown it since a vehicle time, of the last ones."""
        return sum(time_us >= since_us for time_us in self.seen_us)

    def row_px(self, sighting: BaseSighting) -> float:
        """The middle row of what the image shows of it, below the optical axis."""
        half_px = self._camera.half_height_px
        return float(np.clip(sighting.pixels[:, 1], -half_px, half_px).mean())

    def points_m(self, sighting: BaseSighting) -> Floats:
        """The corners in a sighting, in the arena, shape (n, 3)."""
        points: Floats = sighting.points_m + np.array((self._base.x_m, self._base.y_m, 0.0))
        return points
