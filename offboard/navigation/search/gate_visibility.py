"""Whether a gate would be recognised: cells of the arena, headings of a gate's normal, views of them.

What could be seen from a fixed set of places and headings is in tables, made once for a camera and an arena.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import atan, ceil, cos, pi, radians, remainder, sin, tau
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.vectors import Vec3
from offboard.navigation.camera_model import CameraModel
from scenarios.models import COLOURS, Arena

Floats = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]

HEADINGS: Final = 8  # of a gate's normal, over half a turn: both sides of a gate look alike
BEST_QUALITY: Final = 0.98  # of any view: no place is ever certain to be empty
_CELL_M: Final = 0.5
_MOST_CELLS: Final = 20  # along one axis; a larger arena has larger cells
_Point = tuple[float, float]
_NEAR: Final[_Point] = (3.0, BEST_QUALITY)  # metres, and quality of a view from there
_FAR: Final[_Point] = (6.0, 0.85 * BEST_QUALITY)
_TOO_FAR: Final[_Point] = (7.5, 0.0)
_OPEN: Final[_Point] = (
    cos(radians(50.0)),
    1.0,
)  # cosine of the angle to the normal, and factor
_NARROW: Final[_Point] = (cos(radians(65.0)), 0.75)
_EDGE_ON: Final[_Point] = (cos(radians(75.0)), 0.0)
_NORMALS: Final[Floats] = np.array(
    [[turn(index * pi / HEADINGS) for index in range(HEADINGS)] for turn in (cos, sin)], dtype=np.float32
)


@dataclass(frozen=True, slots=True)
class SearchGrid:
    """Cells of the arena. Blocks of 2 x 2 x 2 cells make a coarser grid for planning.

    Attributes:
        x_m: centres of the cells along x, arena axes.
        y_m: along y.
        z_m: along z.
    """

    x_m: Floats
    y_m: Floats
    z_m: Floats

    @classmethod
    def of(cls, arena: Arena) -> Self:
        """The cells of an arena: an even number along each axis, about half a metre large."""
        x_m = _centres(arena.length_x_m) - np.float32(arena.length_x_m / 2)
        y_m = _centres(arena.width_y_m) - np.float32(arena.width_y_m / 2)
        return cls(x_m, y_m, _centres(arena.height_m))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of cells along x, y and z."""
        return (self.x_m.size, self.y_m.size, self.z_m.size)

    def blocks(self) -> SearchGrid:
        """The coarser grid."""
        return SearchGrid(
            *((axis[::2] + axis[1::2]) * np.float32(0.5) for axis in (self.x_m, self.y_m, self.z_m))
        )

    def centres(self) -> tuple[Floats, Floats, Floats]:
        """The x, y and z of all cells, each flat, x slowest."""
        x_m, y_m, z_m = np.meshgrid(self.x_m, self.y_m, self.z_m, indexing="ij")
        return (x_m.ravel(), y_m.ravel(), z_m.ravel())


def block_means(cells: Floats) -> Floats:
    """Means over blocks of 2 x 2 x 2 of an array with axes x, y, z last; added in a fixed order."""
    plane = cells[..., ::2, :, :] + cells[..., 1::2, :, :]
    row = plane[..., ::2, :] + plane[..., 1::2, :]
    means: Floats = (row[..., ::2] + row[..., 1::2]) * np.float32(0.125)
    return means


class GateVisibility:
    """How well a camera would recognise a gate, by the gate's place in the camera's axes.

    Args:
        camera: of the drone.
        shapes: of the gates; all are in view where the widest and the highest would be.

    Attributes:
        reach: see `CameraModel.reach`, for the gate that is recognised from the least distance.
    """

    def __init__(self, camera: CameraModel, shapes: GateShapes) -> None:
        widths_m, heights_m = zip(*(shapes.of(colour).half_m for colour in COLOURS), strict=True)
        self._half_width_m, self._half_height_m = max(widths_m), max(heights_m)
        self.reach = min(camera.reach(shapes.of(colour)) for colour in COLOURS)
        self._right = np.float32(camera.half_width_px / camera.focal_px)
        self._up = np.float32(camera.half_height_px / camera.focal_px)

    def in_view(self, ahead: Floats, left: Floats, up: Floats, margin_m: float) -> Bools:
        """Whether a gate is wholly in the image, with a margin to its edges; metres in the camera's axes."""
        side = np.abs(left) + np.float32(self._half_width_m + margin_m)
        height = np.abs(up) + np.float32(self._half_height_m + margin_m)
        seen: Bools = (side <= ahead * self._right) & (height <= ahead * self._up)
        return seen


def view_qualities(dx_m: Floats, dy_m: Floats, dz_m: Floats, reach: float) -> Floats:
    """How surely a gate is recognised that is wholly in view, 0 to `BEST_QUALITY`, for each heading.

    It falls with the distance beyond 3 m, times `reach`, and with the angle of the line of sight to the
    gate's normal beyond 50 degrees, to nothing at 75 degrees.

    Args:
        dx_m: from the camera to the gate, arena axes, any shape.
        dy_m: likewise.
        dz_m: likewise.
        reach: of the camera, see `CameraModel.reach`.

    Returns:
        Shape (HEADINGS, *shape): for a normal that is turned by index / HEADINGS of half a turn.
    """
    distance_m = np.maximum(np.sqrt(dx_m * dx_m + dy_m * dy_m + dz_m * dz_m), np.float32(0.1))
    by_distance = _falling(distance_m / np.float32(reach), _NEAR, _FAR, _TOO_FAR)
    normals = _NORMALS.reshape(2, HEADINGS, *(1 for _ in dx_m.shape))
    facing = normals[0] * (dx_m / distance_m) + normals[1] * (dy_m / distance_m)
    qualities = _falling(np.abs(facing, out=facing), _OPEN, _NARROW, _EDGE_ON)
    qualities *= by_distance
    return qualities


def _centres(length_m: float) -> Floats:
    """Centres of cells along an axis that begins at 0; an even number of cells."""
    count = min(max(2 * ceil(length_m / (2 * _CELL_M) - 1e-9), 2), _MOST_CELLS)
    centres: Floats = (np.arange(count, dtype=np.float32) + np.float32(0.5)) * np.float32(length_m / count)
    return centres


def _falling(at: Floats, full: _Point, good: _Point, none: _Point) -> Floats:
    """Two straight lines through three points, constant beyond them; steeper towards `none`."""
    gentle, steep = (
        (np.float32((b[1] - a[1]) / (b[0] - a[0])), np.float32(a[0]), np.float32(a[1]))
        for a, b in ((full, good), (good, none))
    )
    value = (at - gentle[1]) * gentle[0] + gentle[2]
    np.minimum(value, (at - steep[1]) * steep[0] + steep[2], out=value)
    return np.clip(value, np.float32(none[1]), np.float32(full[1]), out=value)


Doubles = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

YAWS: Final = tuple(remainder(index * tau / 12, tau) for index in range(12))
_PLACES: Final = 9  # along x and y
_WALL_M: Final = 1.0  # from the outermost places to the arena's sides
_LOW_M, _MIDDLE_M, _BELOW_CEILING_M = 0.6, 1.5, 1.3
_EDGE_RAD: Final = 0.08  # at the sides of the image, where a gate is cut
_NEAREST_M: Final = 0.7
_TABLES_KEPT: Final = 4  # of 5 MB each


@lru_cache(_TABLES_KEPT)
def view_table(camera: CameraModel, arena: Arena, reach: float) -> ViewTable:
    """The table of a camera with its reach and an arena; it never changes, so that all flights share it."""
    return ViewTable(camera, arena, SearchGrid.of(arena).blocks(), reach)


class ViewTable:
    """Gains of all views from a grid of places, fast and roughly: the image is taken as a sector in plan.

    Attributes:
        heights_m: heights of the places.
        places_m: x, y, z of the places, arena axes, shape (places, 3); all heights at one x and y together.
        grounds_m: x and y of the places, shape (places / heights, 2).
    """

    def __init__(self, camera: CameraModel, arena: Arena, blocks: SearchGrid, reach: float) -> None:
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
        self._qualities = view_qualities(dx_m, dy_m, dz_m, reach) * reached
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
            weights: how likely a gate is in each block, shape (blocks,).
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
