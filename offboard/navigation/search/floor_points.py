"""Points of the floor in an image: where obstacles stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from offboard.navigation.camera_model import CameraModel, CameraPose

Bools = npt.NDArray[np.bool_]
Doubles = npt.NDArray[np.float64]

COLUMN_PX: Final = 8.0  # between the columns of the image in which the ends of obstacles are given
_ERROR_PX: Final = 1.5  # standard deviation of an end, the drone's attitude included
_FLATTEST: Final = 0.02  # slope of a line of sight; in flatter ones nothing is said of the floor
_LOWEST_M: Final = 0.05  # the camera is taken to be at least this high


@dataclass(frozen=True, slots=True)
class FloorPoints:
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
        return FloorPoints(self.ux[which], self.uy[which], self.range_m[which], self.error_m[which])
