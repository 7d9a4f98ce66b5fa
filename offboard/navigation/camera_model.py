"""Where a point of the arena is in the image of a pinhole camera, and where a pixel's point of the floor is.

The camera is fixed to the drone or on a gimbal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import tan
from typing import Final, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape
from framerunner.geometry.rotations import Rotation, mounting_flu, rotation, to_body, to_world
from framerunner.geometry.vectors import Quaternion, Vec3
from scenarios.models import Camera

NEAREST_M = 0.05  # points nearer than this are not projected
LEAST_REACH, MOST_REACH = 0.4, 2.0
WHOLE_SPARE = 1.2  # how much farther than needed a gate is looked at
_CHALLENGE_FOCAL_PX = Camera().width_px / 2 / tan(Camera().horizontal_fov_rad / 2)


@dataclass(frozen=True, slots=True)
class CameraModel:
    """The camera of a scenario.

    Attributes:
        focal_px: focal length.
        half_width_px: from the optical axis to the image's left and right edges.
        half_height_px: to its upper and lower edges.
        position_flu_m: of the camera on the drone: forward, left, up.
        readout_s: of a rolling shutter, from the first to the last row; an image's time is the middle.
        on_gimbal: whether a gimbal carries it; its attitude is reported then.
        mounting: how it is turned on the drone, from its axes forward, left, up to the body's; None: not.
    """

    focal_px: float
    half_width_px: float
    half_height_px: float
    position_flu_m: Vec3
    readout_s: float = 0.0
    on_gimbal: bool = False
    mounting: Quaternion | None = None

    @classmethod
    def of(cls, camera: Camera) -> Self:
        """The model of a scenario's camera."""
        half_width_px = camera.width_px / 2
        focal_px = half_width_px / tan(camera.horizontal_fov_rad / 2)
        readout_s = 0.0 if camera.effects is None else camera.effects.readout_s
        half_height_px, place, gimbal = camera.height_px / 2, camera.position_flu_m, camera.gimbal
        angles_rad = camera.mounting_frd_rad
        mounting = mounting_flu(angles_rad) if any(angles_rad) else None
        return cls(focal_px, half_width_px, half_height_px, place, readout_s, gimbal is not None, mounting)

    def reach(self, shape: GateShape) -> float:
        """How much farther away a gate is recognised than the challenge's is by the challenge's camera.

        What counts is how large its sides and its bars are in the image.
        """
        sizes = (
            shape.outer_width_m / PAPER_GATE.outer_width_m,
            shape.outer_height_m / PAPER_GATE.outer_height_m,
            shape.bar_m / PAPER_GATE.bar_m,
        )
        return min(max(min(sizes) * self.focal_px / _CHALLENGE_FOCAL_PX, LEAST_REACH), MOST_REACH)

    def whole_from_m(self, shape: GateShape) -> float:
        """From how far a gate is wholly in the image, seen straight from before it."""
        half_width_m, half_height_m = shape.half_m
        slope = max(half_width_m / self.half_width_px, half_height_m / self.half_height_px)
        return WHOLE_SPARE * slope * self.focal_px + self.position_flu_m[0]

    def read_after_s(self, down_px: float) -> float:
        """How long after the time of an image a row is read out; before it if negative."""
        share = down_px / (2.0 * self.half_height_px)
        return self.readout_s * max(-0.5, min(0.5, share))

    def pose(self, drone_m: Vec3, attitude_arena: Quaternion) -> CameraPose:
        """The camera's pose with the drone's centre and attitude (body FLU to arena)."""
        turn = rotation(attitude_arena)
        x, y, z = to_world(turn, *self.position_flu_m)
        return CameraPose((drone_m[0] + x, drone_m[1] + y, drone_m[2] + z), turn)

    def carrier(self, drone_m: Vec3, attitude_arena: Quaternion, camera_attitude_arena: Quaternion) -> Vec3:
        """The centre of a drone that, with the camera's own attitude, has the camera at its place.

        With it and the camera's attitude, what holds for a camera that looks along the drone's axis holds for
        one on a gimbal, and for one that is mounted otherwise.
        """
        eye_m = self.pose(drone_m, attitude_arena).position_m
        x, y, z = to_world(rotation(camera_attitude_arena), *self.position_flu_m)
        return (eye_m[0] - x, eye_m[1] - y, eye_m[2] - z)

    def project(self, pose: CameraPose, point_m: Vec3) -> tuple[float, float] | None:
        """Pixels right of and below the optical axis, of a point in the arena; None if not before the camera.

        The result may lie outside the image.
        """
        at = pose.position_m
        ahead, left, up = to_body(pose.rotation, point_m[0] - at[0], point_m[1] - at[1], point_m[2] - at[2])
        if ahead < NEAREST_M:
            return None
        return (-self.focal_px * left / ahead, -self.focal_px * up / ahead)

    def contains(self, right_px: float, down_px: float, margin_px: float = 0.0) -> bool:
        """Whether a projected point is in the image, at least a margin from its edges."""
        return (
            abs(right_px) <= self.half_width_px - margin_px
            and abs(down_px) <= self.half_height_px - margin_px
        )


@dataclass(frozen=True, slots=True)
class CameraPose:
    """Where the camera was when an image was exposed."""

    position_m: Vec3  # arena axes
    rotation: Rotation  # body FLU to arena


Bools = npt.NDArray[np.bool_]
Doubles = npt.NDArray[np.float64]

COLUMN_PX: Final = 8.0  # between the columns of the image in which the ends of obstacles are given
_ERROR_PX: Final = 1.5  # standard deviation of an end, the drone's attitude included
_FLATTEST: Final = 0.02  # slope of a line of sight; in flatter ones nothing is said of the floor
_LOWEST_M: Final = 0.05  # the camera is taken to be at least this high


class FloorPoints(NamedTuple):
    """Points of the floor in pixels of an image, in plan from the camera; one element each.

    Attributes:
        ux: direction, unit vector in arena axes.
        uy: likewise.
        range_m: distance; infinite above the horizon.
        error_m: its standard deviation, which grows with the square of the distance.
    """

    ux: Doubles
    uy: Doubles
    range_m: Doubles
    error_m: Doubles

    @classmethod
    def seen_at(
        cls, camera: CameraModel, pose: CameraPose, right_px: Sequence[float], down_px: Sequence[float]
    ) -> Self:
        """The points in pixels right of and below the optical axis."""
        m, height_m = pose.rotation, max(pose.position_m[2], _LOWEST_M)
        left, up = -np.array(right_px) / camera.focal_px, -np.array(down_px) / camera.focal_px
        x, y, z = (m[row] + m[row + 1] * left + m[row + 2] * up for row in (0, 3, 6))
        plan = np.maximum(np.sqrt(x * x + y * y), 1e-6)
        below = z < -_FLATTEST
        range_m = np.where(below, plan * height_m / np.where(below, -z, 1.0), np.inf)
        error_m = (range_m * range_m / height_m + height_m) * (_ERROR_PX / camera.focal_px)
        return cls(x / plan, y / plan, range_m, error_m)

    def chosen(self, which: Bools) -> FloorPoints:
        """Some of the points."""
        return FloorPoints(*(values[which] for values in self))
