"""Whether a frame would be recognised: cells of the arena, headings of a frame's normal, views of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, pi, sin
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from offboard.navigation.camera_model import CameraModel
from scenarios.models import Arena

Floats = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]

HEADINGS: Final = 8  # of a frame's normal, over half a turn: both sides of a frame look alike
BEST_QUALITY: Final = 0.98  # of any view: no place is ever certain to be empty
_CELL_M: Final = 0.5
_MOST_CELLS: Final = 20  # along one axis; a larger arena has larger cells
_HALF_WIDTH_M: Final = 0.21  # of a frame, bars included
_HALF_HEIGHT_M: Final = 0.11
_NEAR_M, _FAR_M, _UNSEEN_M = 3.0, 6.0, 7.5  # distances of full, good and no quality
_FAR_QUALITY: Final = 0.85
_STEEP: Final = tuple(cos(degrees * pi / 180) for degrees in (75.0, 65.0, 50.0))  # no, good, full quality
_STEEP_QUALITY: Final = 0.75
NORMALS: Final = tuple((cos(index * pi / HEADINGS), sin(index * pi / HEADINGS)) for index in range(HEADINGS))


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


class FrameVisibility:
    """How well a camera would recognise a frame, by the frame's place in the camera's axes."""

    def __init__(self, camera: CameraModel) -> None:
        self._right = np.float32(camera.half_width_px / camera.focal_px)
        self._up = np.float32(camera.half_height_px / camera.focal_px)

    def in_view(self, ahead: Floats, left: Floats, up: Floats, margin_m: float) -> Bools:
        """Whether a frame is wholly in the image, with a margin to its edges; metres in the camera's axes."""
        side = np.abs(left) + np.float32(_HALF_WIDTH_M + margin_m)
        height = np.abs(up) + np.float32(_HALF_HEIGHT_M + margin_m)
        seen: Bools = (side <= ahead * self._right) & (height <= ahead * self._up)
        return seen


def view_qualities(dx_m: Floats, dy_m: Floats, dz_m: Floats) -> list[Floats]:
    """How surely a frame is recognised that is wholly in view, 0 to `BEST_QUALITY`, for each heading.

    It falls with the distance beyond 3 m and with the angle of the line of sight to the frame's normal
    beyond 50 degrees, to nothing at 75 degrees.

    Args:
        dx_m: from the camera to the frame, arena axes.
        dy_m: likewise.
        dz_m: likewise.

    Returns:
        One array for each of the `NORMALS`.
    """
    distance_m = np.maximum(np.sqrt(dx_m * dx_m + dy_m * dy_m + dz_m * dz_m), np.float32(0.1))
    by_distance = _interpolated(
        distance_m, (_NEAR_M, _FAR_M, _UNSEEN_M), (BEST_QUALITY, BEST_QUALITY * _FAR_QUALITY, 0.0)
    )
    ux, uy = dx_m / distance_m, dy_m / distance_m
    qualities = []
    for nx, ny in NORMALS:
        facing = np.abs(ux * np.float32(nx) + uy * np.float32(ny))
        qualities.append(by_distance * _interpolated(facing, _STEEP, (0.0, _STEEP_QUALITY, 1.0)))
    return qualities


def _centres(length_m: float) -> Floats:
    """Centres of cells along an axis that begins at 0; an even number of cells."""
    count = min(max(2 * ceil(length_m / (2 * _CELL_M) - 1e-9), 2), _MOST_CELLS)
    centres: Floats = (np.arange(count, dtype=np.float32) + np.float32(0.5)) * np.float32(length_m / count)
    return centres


def _interpolated(at: Floats, points: tuple[float, ...], values: tuple[float, ...]) -> Floats:
    """A line through three points, constant beyond the ends; in single precision, element by element."""
    (p0, p1, p2), (v0, v1, v2) = points, values
    low = np.float32(v0) + (at - np.float32(p0)) * np.float32((v1 - v0) / (p1 - p0))
    high = np.float32(v1) + (at - np.float32(p1)) * np.float32((v2 - v1) / (p2 - p1))
    line = np.where(at < np.float32(p1), low, high)
    result: Floats = np.minimum(np.maximum(line, np.float32(min(v0, v2))), np.float32(max(v0, v2)))
    return result
