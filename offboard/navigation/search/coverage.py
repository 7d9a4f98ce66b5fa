"""What of the arena has been seen so far: for each cell and heading of a gate's normal, by the best view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import COLUMN_PX, CameraModel, CameraPose, FloorPoints
from offboard.navigation.pose_history import PoseChange
from offboard.navigation.search.gate_visibility import (
    HEADINGS,
    Floats,
    GateVisibility,
    SearchGrid,
    block_means,
    view_qualities,
)
from scenarios.models import Arena
from vision.types import ObstacleEdge

_MOVED_M: Final = 0.15  # an image from a pose nearer than this and _TURNED_RAD to the last one is skipped
_TURNED_RAD: Final = 0.12
_MARGIN_M: Final = 0.12  # beyond a gate at a cell's centre: it may be elsewhere in the cell
_MOST_WAITING: Final = 2
_FADE: Final = 0.9998  # of what has been seen, an image used: what was seen long ago is looked at again


class Coverage:
    """Remembers how well each place has been seen.

    Attributes:
        grid: the cells.
    """

    def __init__(self, camera: CameraModel, arena: Arena, shapes: GateShapes) -> None:
        self.grid = SearchGrid.of(arena)
        self._camera = camera
        self._visibility = GateVisibility(camera, shapes)
        self._centres = self.grid.centres()
        self._seen = np.zeros((HEADINGS, self._centres[0].size), dtype=np.float32)
        self._change = PoseChange(_MOVED_M, _TURNED_RAD)
        self._waiting: list[tuple[CameraPose, Sequence[ObstacleEdge]]] = []
        self._is_asked = False

    def update(
        self, position_m: Vec3, attitude_arena: Quaternion, obstacle_edges: Sequence[ObstacleEdge] = ()
    ) -> None:
        """Take in an image, whatever it showed.

        What images add is computed when the coverage is asked for and, once it was, soon after them, so that
        many of them never wait for one tick.

        Args:
            position_m: of the drone's centre when the image was exposed, arena axes.
            attitude_arena: body FLU to arena.
            obstacle_edges: where obstacles stand; nothing behind them counts as seen.
        """
        if self._change.is_new(position_m, attitude_arena):
            self._waiting.append((self._camera.pose(position_m, attitude_arena), obstacle_edges))
            if self._is_asked and len(self._waiting) > _MOST_WAITING:
                self._add(*self._waiting.pop(0))

    def _cells(self) -> Floats:
        """Quality of the best view, 0 to 1, by heading and cell of the grid: shape (HEADINGS, x, y, z)."""
        self._is_asked = True
        for pose, obstacle_edges in self._waiting:
            self._add(pose, obstacle_edges)
        self._waiting.clear()
        return self._seen.reshape(HEADINGS, *self.grid.shape)

    def _add(self, pose: CameraPose, obstacle_edges: Sequence[ObstacleEdge]) -> None:
        in_view = self._in_view(pose)
        dx_m, dy_m, dz_m = (
            axis[in_view] - np.float32(at) for axis, at in zip(self._centres, pose.position_m, strict=True)
        )
        if obstacle_edges:
            clear = self._clear(pose, obstacle_edges, dx_m, dy_m, dz_m)
            in_view, dx_m, dy_m, dz_m = in_view[clear], dx_m[clear], dy_m[clear], dz_m[clear]
        self._seen *= np.float32(_FADE)
        qualities = view_qualities(dx_m, dy_m, dz_m, self._visibility.reach)
        self._seen[:, in_view] = np.maximum(np.take(self._seen, in_view, axis=1), qualities)

    def blocks(self) -> Floats:
        """Quality of the best view, 0 to 1, by heading and block of the grid: shape (HEADINGS, blocks)."""
        means = block_means(self._cells())
        flat: Floats = means.reshape(HEADINGS, -1)
        return flat

    def _in_view(self, pose: CameraPose) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        """Indices of the cells in which a gate is wholly in the image."""
        m = pose.rotation
        dx, dy, dz = (
            axis - np.float32(at)
            for axis, at in zip((self.grid.x_m, self.grid.y_m, self.grid.z_m), pose.position_m, strict=True)
        )
        ahead, left, up = (
            ((dx * np.float32(m[at]))[:, None, None] + (dy * np.float32(m[at + 3]))[:, None])
            + dz * np.float32(m[at + 6])
            for at in range(3)
        )
        return np.flatnonzero(self._visibility.in_view(ahead, left, up, _MARGIN_M))

    def _clear(
        self, pose: CameraPose, edges: Sequence[ObstacleEdge], dx_m: Floats, dy_m: Floats, dz_m: Floats
    ) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Which places are in front of all obstacles, or in a column of the image without any."""
        camera, m = self._camera, pose.rotation
        ends = FloorPoints.seen_at(
            camera, pose, [edge.right_px for edge in edges], [edge.down_px for edge in edges]
        )
        limits_m = np.full(max(int(2 * camera.half_width_px / COLUMN_PX), 1), np.inf, dtype=np.float32)
        for edge, range_m in zip(edges, ends.range_m, strict=True):
            column = int((edge.right_px + camera.half_width_px) / COLUMN_PX)
            limits_m[min(max(column, 0), limits_m.size - 1)] = 0.0 if edge.cut else range_m
        ahead = dx_m * np.float32(m[0]) + dy_m * np.float32(m[3]) + dz_m * np.float32(m[6])
        left = dx_m * np.float32(m[1]) + dy_m * np.float32(m[4]) + dz_m * np.float32(m[7])
        right_px = -left / ahead * np.float32(camera.focal_px)
        columns = ((right_px + np.float32(camera.half_width_px)) / np.float32(COLUMN_PX)).astype(np.intp)
        np.clip(columns, 0, limits_m.size - 1, out=columns)
        clear: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
            dx_m * dx_m + dy_m * dy_m < limits_m[columns] * limits_m[columns]
        )
        return clear
