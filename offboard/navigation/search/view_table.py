"""What could be seen from a fixed set of places and headings: tables made once for a camera and an arena."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from math import atan, cos, remainder, sin, tau
from typing import Final

import numpy as np
import numpy.typing as npt

from framerunner.geometry.vectors import Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.search.frame_visibility import HEADINGS, Bools, Floats, SearchGrid, view_qualities
from scenarios.models import Arena

Doubles = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

YAWS: Final = tuple(remainder(index * tau / 12, tau) for index in range(12))
_PLACES: Final = 9  # along x and y
_WALL_M: Final = 1.0  # from the outermost places to the arena's sides
_LOW_M, _MIDDLE_M, _BELOW_CEILING_M = 0.6, 1.5, 1.3
_EDGE_RAD: Final = 0.08  # at the sides of the image, where a frame is cut
_NEAREST_M: Final = 0.7
_TABLES_KEPT: Final = 4  # of 5 MB each


@lru_cache(_TABLES_KEPT)
def view_table(camera: CameraModel, arena: Arena) -> ViewTable:
    """The table of a camera and an arena; it never changes, so that all flights share it."""
    return ViewTable(camera, arena, SearchGrid.of(arena).blocks())


class ViewTable:
    """Gains of all views from a grid of places, fast and roughly: the image is taken as a sector in plan.

    Attributes:
        heights_m: heights of the places.
        places_m: x, y, z of the places, arena axes, shape (places, 3); all heights at one x and y together.
        grounds_m: x and y of the places, shape (places / heights, 2).
    """

    def __init__(self, camera: CameraModel, arena: Arena, blocks: SearchGrid) -> None:
        self.heights_m = _heights_m(arena)
        self._axes_m = (_along(arena.length_x_m), _along(arena.width_y_m), self.heights_m)
        self.places_m = np.array(list(product(*self._axes_m)))
        self.grounds_m: Floats = self.places_m[:: len(self.heights_m), :2].astype(np.float32)
        x_m, y_m, z_m = blocks.centres()
        dx_m, dy_m, dz_m = (
            centres[None, :] - self.places_m[:, axis, None].astype(np.float32)
            for axis, centres in enumerate((x_m, y_m, z_m))
        )
        plan_2 = dx_m * dx_m + dy_m * dy_m
        steepest = np.float32(0.9 * camera.half_height_px / camera.focal_px)
        reached = (dz_m * dz_m <= plan_2 * steepest * steepest) & (plan_2 >= np.float32(_NEAREST_M**2))
        self._qualities = view_qualities(dx_m, dy_m, dz_m) * reached
        bearings = _pseudo_angle(dx_m, dy_m)
        rows = np.arange(len(bearings))[:, None] * bearings.shape[1]
        self._order: Indices = np.argsort(bearings, axis=1, kind="stable") + rows  # of the flat array
        ordered = np.take(bearings, self._order)
        half_rad = atan(camera.half_width_px / camera.focal_px) - _EDGE_RAD
        self._first = _counts_below(ordered, [yaw - half_rad for yaw in YAWS])
        self._end = _counts_below(ordered, [yaw + half_rad for yaw in YAWS])

    def place(self, index: int) -> Vec3:
        """One of the places."""
        x_m, y_m, z_m = self.places_m[index].tolist()
        return (x_m, y_m, z_m)

    def nearest_ground(self, position_m: Vec3) -> int:
        """Index of the x and y nearest to a position."""
        return self.nearest(position_m, 0.0)[0] // len(self.heights_m)

    def nearest(self, position_m: Vec3, yaw_rad: float) -> tuple[int, int]:
        """Index of the view nearest to a pose: of its place and of its heading."""
        place = 0
        for axis_m, at_m in zip(self._axes_m, position_m, strict=True):
            distances_m = [abs(each_m - at_m) for each_m in axis_m]
            place = place * len(axis_m) + distances_m.index(min(distances_m))
        return place, round(yaw_rad / tau * len(YAWS)) % len(YAWS)

    def gains(self, seen: Floats, weights: Floats, clear: Bools | None = None) -> Doubles:
        """How much would be newly seen.

        Args:
            seen: quality of the best view so far, shape (HEADINGS, blocks).
            weights: how likely a frame is in each block, shape (blocks,).
            clear: which blocks, in plan, obstacles leave in sight: shape (grounds, blocks x * blocks y).

        Returns:
            Gain of each view, shape (places, `YAWS`).
        """
        new = np.zeros_like(self._qualities[0])
        gain = np.empty_like(new)
        for heading in range(HEADINGS):
            np.subtract(self._qualities[heading], seen[heading], out=gain)
            new += np.maximum(gain, np.float32(0.0), out=gain)
        new *= weights
        if clear is not None:
            by_height = new.reshape(len(self.grounds_m), len(self.heights_m), clear.shape[1], -1)
            by_height *= clear[:, None, :, None]
        # Cumulative sums have one order of adding on every processor, so that ties are decided alike.
        sums = np.zeros((new.shape[0], new.shape[1] + 1))
        np.cumsum(np.take(new, self._order), axis=1, out=sums[:, 1:])
        end = np.take_along_axis(sums, self._end, axis=1)
        first = np.take_along_axis(sums, self._first, axis=1)
        around = np.where(self._end < self._first, sums[:, -1:], 0.0)
        gains: Doubles = end - first + around
        return gains


def _along(length_m: float) -> list[float]:
    reach_m = max(length_m / 2 - _WALL_M, 0.0)
    return [reach_m * (2 * index / (_PLACES - 1) - 1) for index in range(_PLACES)]


def _heights_m(arena: Arena) -> list[float]:
    half_m = arena.height_m / 2
    return [min(_LOW_M, half_m), min(_MIDDLE_M, half_m), max(arena.height_m - _BELOW_CEILING_M, half_m)]


def _pseudo_angle(x: Floats, y: Floats) -> Floats:
    """-2..2, rises with the angle -pi..pi; unlike the arc tangent, the same to the bit on every processor."""
    slope = y / np.maximum(np.abs(x) + np.abs(y), np.float32(1e-6))
    angle: Floats = np.where(
        x >= 0, slope, np.where(y >= 0, np.float32(2.0) - slope, np.float32(-2.0) - slope)
    )
    return angle


def _counts_below(ordered: Floats, angles_rad: list[float]) -> Indices:
    """How many of each row are below each angle: shape (rows, angles)."""
    at = _pseudo_angle(
        np.array([cos(angle) for angle in angles_rad], dtype=np.float32),
        np.array([sin(angle) for angle in angles_rad], dtype=np.float32),
    )
    return np.stack([np.count_nonzero(ordered < limit, axis=1) for limit in at], axis=1)
