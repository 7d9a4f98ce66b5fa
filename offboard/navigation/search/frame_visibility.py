"""Whether a frame would be recognised: cells of the arena, headings of a frame's normal, views of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, pi, radians, sin
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from offboard.navigation.camera_model import CameraModel
from offboard.navigation.goals import FRAME_HEIGHT_M, FRAME_WIDTH_M
from scenarios.models import Arena

Floats = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]

HEADINGS: Final = 8  # of a frame's normal, over half a turn: both sides of a frame look alike
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


class FrameVisibility:
    """How well a camera would recognise a frame, by the frame's place in the camera's axes."""

    def __init__(self, camera: CameraModel) -> None:
        self._right = np.float32(camera.half_width_px / camera.focal_px)
        self._up = np.float32(camera.half_height_px / camera.focal_px)

    def in_view(self, ahead: Floats, left: Floats, up: Floats, margin_m: float) -> Bools:
        """Whether a frame is wholly in the image, with a margin to its edges; metres in the camera's axes."""
        side = np.abs(left) + np.float32(FRAME_WIDTH_M / 2 + margin_m)
        height = np.abs(up) + np.float32(FRAME_HEIGHT_M / 2 + margin_m)
        seen: Bools = (side <= ahead * self._right) & (height <= ahead * self._up)
        return seen


def view_qualities(dx_m: Floats, dy_m: Floats, dz_m: Floats) -> Floats:
    """How surely a frame is recognised that is wholly in view, 0 to `BEST_QUALITY`, for each heading.

    It falls with the distance beyond 3 m and with the angle of the line of sight to the frame's normal
    beyond 50 degrees, to nothing at 75 degrees.

    Args:
        dx_m: from the camera to the frame, arena axes, any shape.
        dy_m: likewise.
        dz_m: likewise.

    Returns:
        Shape (HEADINGS, *shape): for a normal that is turned by index / HEADINGS of half a turn.
    """
    distance_m = np.maximum(np.sqrt(dx_m * dx_m + dy_m * dy_m + dz_m * dz_m), np.float32(0.1))
    by_distance = _falling(distance_m, _NEAR, _FAR, _TOO_FAR)
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
