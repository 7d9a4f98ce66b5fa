"""Where obstacles stand: a map of the floor, made of where images show their lower ends."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Final

import numpy as np
import numpy.typing as npt

from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import COLUMN_PX, CameraModel, CameraPose, Doubles, FloorPoints
from scenarios.models import Arena
from vision.types import ObstacleEdge

Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

CELL_M: Final = 0.1
_MOST_CELLS: Final = 400  # along one axis; a larger arena has larger cells
_LEAST_ERROR_M: Final = 0.04
_MOST_ERROR_M: Final = 0.6  # an end known less well says nothing
_FARTHEST_M: Final = 6.0  # a column of the image without obstacles is free up to here
_FREE_MARGIN_M: Final = 0.15  # a cell this much nearer than an end, beside its error, is free
_SHARP_M: Final = 0.15  # an end with a larger error needs several views
_THICKNESS_M: Final = 0.1  # what stands there reaches at least this far back
_OCCUPIED: Final = 0.85  # log odds by one view
_FREE: Final = -0.25
_LEAST, _MOST = -2.0, 4.0  # log odds
_THRESHOLD: Final = 0.8  # log odds of what counts as occupied: one good view
_DISC_CELLS: Final = 3  # occupied cells of a square with this edge become one disc


class ObstacleMap:
    """Log odds that a cell of the floor has an obstacle; obstacles are taken to reach up to the ceiling.

    Args:
        camera: the drone's camera.
        arena: where obstacles may be.

    Attributes:
        x_m: centres of the cells along x, arena axes.
        y_m: along y.
        occupied: which cells are, shape (cells x, cells y).
        columns_m: discs in plan that cover all occupied cells: x, y, radius; in a fixed order.
    """

    def __init__(self, camera: CameraModel, arena: Arena) -> None:
        self._camera = camera
        self._cell_m, self.x_m, self.y_m = floor_cells(arena)
        self._log_odds = np.zeros((self.x_m.size, self.y_m.size))
        self.occupied: Bools = np.zeros(self._log_odds.shape, dtype=bool)
        self.columns_m: tuple[Vec3, ...] = ()

    def update(self, position_m: Vec3, attitude_arena: Quaternion, edges: Sequence[ObstacleEdge]) -> None:
        """Take in what an image showed of obstacles, which may be nothing.

        Args:
            position_m: of the drone's centre when the image was exposed, arena axes.
            attitude_arena: body FLU to arena.
            edges: the lower ends of obstacles, in every eighth column of the image that shows one.
        """
        if not edges and not self.columns_m:
            return
        pose = self._camera.pose(position_m, attitude_arena)
        occupied, free = self._evidence(pose, edges)
        self._log_odds += _OCCUPIED * occupied + _FREE * (free & (occupied == 0.0))
        np.clip(self._log_odds, _LEAST, _MOST, out=self._log_odds)
        now = self._log_odds >= _THRESHOLD
        if (now != self.occupied).any():
            self.occupied = now
            self.columns_m = self._discs()

    def _ends(self, pose: CameraPose, edges: Sequence[ObstacleEdge]) -> FloorPoints:
        """Where obstacles stand, as far as that is known."""
        whole = [edge for edge in edges if not edge.cut]
        right_px, down_px = [edge.right_px for edge in whole], [edge.down_px for edge in whole]
        ends = FloorPoints.seen_at(self._camera, pose, right_px, down_px)
        return ends.chosen(ends.error_m <= _MOST_ERROR_M)

    def _empty_columns(self, pose: CameraPose, edges: Sequence[ObstacleEdge]) -> FloorPoints:
        """The floor at the lower edge of the image, in the columns without an obstacle."""
        camera = self._camera
        first_px, count = 0.5 - camera.half_width_px, int(2 * camera.half_width_px / COLUMN_PX)
        taken = {round((edge.right_px - first_px) / COLUMN_PX) for edge in edges}
        right_px = [first_px + COLUMN_PX * column for column in range(count) if column not in taken]
        nearest = FloorPoints.seen_at(camera, pose, right_px, [camera.half_height_px] * len(right_px))
        return nearest.chosen(nearest.range_m < _FARTHEST_M)

    def _evidence(self, pose: CameraPose, edges: Sequence[ObstacleEdge]) -> tuple[Doubles, Bools]:
        """What one image says of each cell: how surely it is occupied, 0 to 1, and whether it is free.

        Floor below the image is not seen, and of a column whose obstacle is cut nothing is known.
        """
        along_m = np.arange(0.0, _FARTHEST_M + _MOST_ERROR_M, self._cell_m)
        ends = self._ends(pose, edges)
        end_m, error_m = ends.range_m[:, None], np.maximum(ends.error_m, _LEAST_ERROR_M)[:, None]
        off_m = np.maximum(end_m - along_m, along_m - end_m - _THICKNESS_M).clip(0.0)
        sure = (1.0 - off_m / (error_m + self._cell_m / 2)).clip(0.0) * np.minimum(_SHARP_M / error_m, 1.0)
        cells, inside = self._cells(pose, ends, along_m)
        occupied = np.zeros(self._log_odds.size)
        np.maximum.at(occupied, cells[inside], sure[inside])

        free = np.zeros(self._log_odds.size, dtype=bool)
        free[cells[inside & (along_m < end_m - 2 * error_m - _FREE_MARGIN_M)]] = True
        empty = self._empty_columns(pose, edges)
        cells, inside = self._cells(pose, empty, along_m)
        free[cells[inside & (along_m >= empty.range_m[:, None]) & (along_m < _FARTHEST_M)]] = True
        return occupied.reshape(self._log_odds.shape), free.reshape(self._log_odds.shape)

    def _cells(self, pose: CameraPose, rays: FloorPoints, along_m: Doubles) -> tuple[Indices, Bools]:
        """Flat indices of the cells along rays over the floor, and which of them are in the arena."""
        x = np.floor((pose.position_m[0] + rays.ux[:, None] * along_m - self.x_m[0]) / self._cell_m + 0.5)
        y = np.floor((pose.position_m[1] + rays.uy[:, None] * along_m - self.y_m[0]) / self._cell_m + 0.5)
        inside: Bools = (x >= 0) & (x < self.x_m.size) & (y >= 0) & (y < self.y_m.size)
        return np.where(inside, x * self.y_m.size + y, 0.0).astype(np.intp), inside

    def _discs(self) -> tuple[Vec3, ...]:
        squares: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for i, j in np.argwhere(self.occupied).tolist():
            squares.setdefault((i // _DISC_CELLS, j // _DISC_CELLS), []).append((i, j))
        discs = []
        for cells in squares.values():
            low = [min(cell[axis] for cell in cells) for axis in range(2)]
            high = [max(cell[axis] for cell in cells) for axis in range(2)]
            x_m = float(self.x_m[low[0]] + self.x_m[high[0]]) / 2
            y_m = float(self.y_m[low[1]] + self.y_m[high[1]]) / 2
            radius_m = hypot(high[0] - low[0] + 1, high[1] - low[1] + 1) * self._cell_m / 2
            discs.append((x_m, y_m, radius_m))
        return tuple(discs)


def floor_cells(arena: Arena) -> tuple[float, Doubles, Doubles]:
    """The size of the floor's cells, and their centres along x and y, metres."""
    cell_m = max(CELL_M, arena.length_x_m / _MOST_CELLS, arena.width_y_m / _MOST_CELLS)
    return cell_m, _centres(arena.length_x_m, cell_m), _centres(arena.width_y_m, cell_m)


def _centres(length_m: float, cell_m: float) -> Doubles:
    count = max(round(length_m / cell_m), 1)
    return np.array([(index + 0.5 - count / 2) * cell_m for index in range(count)])
