"""Which parts of the arena, in plan, were seen to be free, and which places were in view of the camera.

A drone that knows obstacles flies only where it has seen that nothing stands; where a place was in view, a
gate at its height would have been seen.
"""

from __future__ import annotations

from math import hypot
from typing import Final

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import COLUMN_PX, CameraModel, CameraPose, FloorPoints
from offboard.navigation.obstacle_map import floor_cells
from offboard.navigation.pose_history import PoseChange
from scenarios.models import COLOURS, Arena, Base
from vision.types import ObstacleEdge

Bools = npt.NDArray[np.bool_]
Doubles = npt.NDArray[np.float64]

OWN_RADIUS_M: Final = 0.25  # where the drone is, there is nothing else
ROOM_M: Final = 0.2  # beside the drone's centre, that must have been seen
SUSPECT_RADIUS_M: Final = 0.2
_FARTHEST_M: Final = 6.0  # an obstacle farther away may be too small to be seen
_MARGIN_M: Final = 0.1  # before an obstacle, beside twice its error
_EDGE_PX: Final = 4.0  # at the image's sides
_NEAREST_M: Final = 0.05  # before the camera
_MOVED_M: Final = 0.05  # an image from a pose nearer than this and _TURNED_RAD to the last one is skipped
_TURNED_RAD: Final = 0.03


class SeenSpace:
    """Cells of the floor over which nothing stands.

    Obstacles stand on the floor and are higher than the drone flies, so a column of an image that shows none
    is free as far as one can be seen.

    Args:
        camera: the drone's camera.
        arena: what is outside need not be seen.

    Attributes:
        has_obstacles: an obstacle was seen; until then all is taken to be free.
        suspects_m: places that were looked at and not seen: obstacles, as discs in plan: x, y, radius.
    """

    def __init__(self, camera: CameraModel, arena: Arena) -> None:
        self.has_obstacles = False
        self.suspects_m: tuple[Vec3, ...] = ()
        self._camera = camera
        self._cell_m, self._x_m, self._y_m = floor_cells(arena)
        self._free: Bools = np.zeros((self._x_m.size, self._y_m.size), dtype=bool)
        self._change = PoseChange(_MOVED_M, _TURNED_RAD)
        self._waiting: list[tuple[Vec3, CameraPose, Doubles | None]] = []
        reach = np.arange(-int(ROOM_M / self._cell_m), int(ROOM_M / self._cell_m) + 1)
        i, j = (offsets.ravel() for offsets in np.meshgrid(reach, reach, indexing="ij"))
        order = np.argsort(np.hypot(i, j), kind="stable")
        self._around = np.stack((i, j), axis=1)[order]
        self._around_m: Doubles = np.hypot(i, j)[order] * self._cell_m

    def update(
        self,
        position_m: Vec3,
        attitude_arena: Quaternion,
        edges: tuple[ObstacleEdge, ...],
    ) -> None:
        """Take in what an image showed of obstacles, which may be nothing.

        Which cells that makes free is computed when somebody asks: where there is no obstacle, nobody does.

        Args:
            position_m: of the drone's centre when the image was exposed, arena axes.
            attitude_arena: body FLU to arena.
            edges: the lower ends of obstacles, in every eighth column of the image that shows one.
        """
        self.has_obstacles = self.has_obstacles or bool(edges)
        if not self._change.is_new(position_m, attitude_arena):
            return
        pose = self._camera.pose(position_m, attitude_arena)
        limits_m = self._limits_m(pose, edges) if edges else None
        self._waiting.append((position_m, pose, limits_m))
        if self.suspects_m:
            self.suspects_m = tuple(each for each in self.suspects_m if not self.is_seen(each))

    def _cells(self) -> Bools:
        """Which cells are free, shape (cells x, cells y)."""
        for image in self._waiting:
            self._add(*image)
        self._waiting.clear()
        return self._free

    def _add(self, position_m: Vec3, pose: CameraPose, limits_m: Doubles | None) -> None:
        """Note what an image showed to be free: each of its columns as far as its limit, if it has one."""
        dx, dy = self._x_m[:, None] - pose.position_m[0], self._y_m - pose.position_m[1]
        m = pose.rotation
        ahead, left = dx * m[0] + dy * m[3], dx * m[1] + dy * m[4]
        half_px = self._camera.half_width_px
        right_px = -left * (self._camera.focal_px / np.maximum(ahead, _NEAREST_M))
        shown = (ahead > _NEAREST_M) & (np.abs(right_px) < half_px - _EDGE_PX)
        reach_m: Doubles | float = _FARTHEST_M
        if limits_m is not None:
            columns = ((np.clip(right_px, -half_px, half_px) + half_px) / COLUMN_PX).astype(np.intp)
            reach_m = limits_m[np.minimum(columns, limits_m.size - 1)]
        self._free |= shown & (dx * dx + dy * dy < reach_m * reach_m)
        dx, dy = self._x_m[:, None] - position_m[0], self._y_m - position_m[1]
        self._free |= dx * dx + dy * dy < OWN_RADIUS_M**2

    def is_seen(self, place_m: Vec3) -> bool:
        """Whether nothing stands at a place."""
        i, j = (
            round((at - axis[0]) / self._cell_m)
            for at, axis in zip(place_m, (self._x_m, self._y_m), strict=False)
        )
        return bool(self._cells()[i, j])

    def suspect(self, place_m: Vec3) -> None:
        """Take it that something stands at a place, until it is seen that nothing does."""
        self.suspects_m = (*self.suspects_m, (place_m[0], place_m[1], SUSPECT_RADIUS_M))

    def first_unseen(self, places_m: list[Vec3], from_m: Vec3) -> Vec3 | None:
        """The first of some places where something may stand; near the drone less room is needed.

        Args:
            places_m: on a path, in order.
            from_m: where the drone is.
        """
        if not self.has_obstacles or not places_m:
            return None
        places = np.array(places_m)[:, :2]
        room_m = np.minimum(np.hypot(*(places - np.array(from_m[:2])).T) / 2, ROOM_M)
        low = np.array([self._x_m[0], self._y_m[0]])
        cells = np.floor((places - low) / self._cell_m + 0.5).astype(np.intp)[:, None] + self._around
        free = self._cells()
        inside = (cells >= 0).all(axis=-1) & (cells < free.shape).all(axis=-1)
        cells = np.clip(cells, 0, np.array(free.shape) - 1)
        unseen = inside & ~free[cells[..., 0], cells[..., 1]] & (self._around_m <= room_m[:, None])
        for place, cell in np.argwhere(unseen).tolist():
            i, j = cells[place, cell].tolist()
            x, y = float(self._x_m[i]), float(self._y_m[j])
            if all(hypot(x - each[0], y - each[1]) > each[2] for each in self.suspects_m):
                return (x, y, places_m[place][2])
        return None

    def _limits_m(self, pose: CameraPose, edges: tuple[ObstacleEdge, ...]) -> Doubles:
        """How far each column of the image is free; not farther than the columns beside it.

        An obstacle whose foot is below the image may be anywhere before the floor there, also where one is
        known: that may be a part of the same wall farther away.
        """
        half_px = self._camera.half_width_px
        limits_m = np.full(max(int(2 * half_px / COLUMN_PX), 1), _FARTHEST_M)
        right_px, down_px = [edge.right_px for edge in edges], [edge.down_px for edge in edges]
        feet = FloorPoints.seen_at(self._camera, pose, right_px, down_px)
        known = np.isfinite(feet.range_m)
        before_m = np.where(known, feet.range_m, 0.0) - 2 * np.where(known, feet.error_m, 0.0) - _MARGIN_M
        cut = np.array([edge.cut for edge in edges], dtype=bool)
        before_m = np.where(cut, 0.0, before_m)
        for edge, end_m in zip(edges, before_m.tolist(), strict=True):
            column = min(max(int((edge.right_px + half_px) / COLUMN_PX), 0), limits_m.size - 1)
            limits_m[column] = min(limits_m[column], max(end_m, 0.0))
        padded = np.pad(limits_m, 1, mode="edge")
        narrowest: Doubles = np.minimum(np.minimum(padded[:-2], padded[2:]), limits_m)
        return narrowest


_KEPT: Final = 256  # views
_VIEW_MOVED_M: Final = 0.15  # a view from a pose nearer than this and _VIEW_TURNED to the last one is skipped
_VIEW_TURNED: Final = 0.1  # likewise, of any part of the rotation matrix
_VIEWED_M: Final = 4.5  # a gate farther away may be too small to be seen
_BASE_M: Final = 0.8  # from the base in plan there is room for take-off and landing
_ABOVE_M: Final = 0.15  # above and below a place, that must be in view with it: a gate there
_FLOWN_M: Final = 0.3  # from where the camera was, along each axis: there is nothing
_NEAR_M: Final = 0.6  # from the drone in plan; nearer places cannot come into view


class ViewedSpace:
    """Remembers the camera's poses, and tells which places were in view from one of them.

    Attributes:
        needed: there may be gates that are not on the map; else all places are as good as viewed.
    """

    def __init__(self, camera: CameraModel, base: Base, shapes: GateShapes) -> None:
        self._base = base
        self._viewed_m = _VIEWED_M * min(camera.reach(shapes.of(colour)) for colour in COLOURS)
        self._right = camera.half_width_px / camera.focal_px
        self._up = camera.half_height_px / camera.focal_px
        self._positions: Doubles = np.zeros((_KEPT, 3))
        self._rotations: Doubles = np.zeros((_KEPT, 9))
        self._count = -1  # views that are kept, less one; after the last one there is the latest
        self.needed = True
        self._excused: list[Vec3] = []

    def update(self, pose: CameraPose) -> None:
        """Take in an image from a pose."""
        row = (self._count + 1) % _KEPT
        self._positions[row], self._rotations[row] = pose.position_m, pose.rotation
        last = self._count % _KEPT
        moved = np.abs(self._positions[last] - pose.position_m).max() > _VIEW_MOVED_M
        if self._count < 0 or moved or np.abs(self._rotations[last] - pose.rotation).max() > _VIEW_TURNED:
            self._count += 1

    def is_viewed(self, place_m: Vec3) -> bool:
        """Whether a place was in view, or is excused."""
        return bool(self._are_viewed(np.array([place_m]))[0])

    def first_unviewed(self, places_m: list[Vec3], from_m: Vec3) -> Vec3 | None:
        """The first of some places that was not in view; those near the drone in plan are left out."""
        if not self.needed or self._count < 0:
            return None
        x, y, _ = from_m
        base = self._base
        far = [
            place
            for place in places_m
            if hypot(place[0] - x, place[1] - y) > _NEAR_M
            and hypot(place[0] - base.x_m, place[1] - base.y_m) > _BASE_M
        ]
        if not far:
            return None
        viewed = self._are_viewed(np.array(far))
        return None if viewed.all() else far[int(viewed.argmin())]

    def excuse(self, place_m: Vec3) -> None:
        """Take a place as viewed that cannot be brought into view."""
        self._excused.append(place_m)

    def _are_viewed(self, places_m: Doubles) -> Bools:
        """Likewise of several, shape (n, 3)."""
        views = min(self._count + 2, _KEPT)
        offsets = places_m[:, None] - self._positions[:views]
        axes = self._rotations[:views].reshape(views, 3, 3)
        ahead, left, up = np.moveaxis(np.einsum("pvi,vij->pvj", offsets, axes), 2, 0)
        shown = (np.abs(left) < ahead * self._right) & (np.abs(up) + _ABOVE_M < ahead * self._up)
        flown = (np.abs(offsets) < _FLOWN_M).all(axis=2)
        viewed: Bools = (flown | (shown & (ahead < self._viewed_m))).any(axis=1)
        for excused in self._excused:
            viewed |= np.linalg.norm(places_m - np.array(excused), axis=1) < _NEAR_M
        return viewed
