"""What obstacles hide from where, and how far it is to fly round them; all in plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from geometry.vectors import Vec3
from offboard.navigation.search.frame_visibility import Bools, Floats, SearchGrid

_ROOM_M: Final = 0.1  # beside an obstacle, at least, for the drone to pass
_ONTO_GRID: Final = 1.6  # cells nearer than this many times their size are entered directly
_IN_BLOCK_M: Final = 0.5
_LARGEST: Final = 20_000  # elements of an array that are computed quickest
_STEPS: Final = ((1, 0), (0, 1), (1, 1), (1, -1))
_MOST_ROUNDS: Final = 80


class Obstruction:
    """Made for one set of obstacles; the work is done once.

    Args:
        columns_m: obstacles from the floor to the ceiling, as discs: x, y, radius.
        places_m: x and y of places to look from, shape (places, 2).
        grid: its cells are flown through.
        blocks: its blocks are looked at.

    Attributes:
        columns_m: the obstacles.
        clear: which blocks, in plan, can be seen from each place: shape (places, blocks x * blocks y).
    """

    def __init__(
        self, columns_m: Sequence[Vec3], places_m: Floats, grid: SearchGrid, blocks: SearchGrid
    ) -> None:
        self.columns_m = tuple(columns_m)
        self._grid = grid
        to_x, to_y = (axis.ravel() for axis in np.meshgrid(blocks.x_m, blocks.y_m, indexing="ij"))
        self._blocks_m = (to_x, to_y)
        self.clear = self.clear_from(places_m)
        x, y = np.meshgrid(grid.x_m, grid.y_m, indexing="ij")
        self._costs: list[tuple[tuple[slice, slice], tuple[slice, slice], Floats]] = []
        for step in _STEPS:
            here, there = _slices(step[0]), _slices(step[1])
            leave, enter = (here[0], there[0]), (here[1], there[1])
            clear = _is_clear(self.columns_m, x[leave], y[leave], x[enter], y[enter], room_m=_ROOM_M)
            length_m = np.float32(hypot(step[0] * _pitch(grid.x_m), step[1] * _pitch(grid.y_m)))
            self._costs.append((leave, enter, np.where(clear, length_m, np.float32(np.inf))))

    def clear_from(self, places_m: Floats) -> Bools:
        """Which blocks, in plan, can be seen from places; those in which an obstacle stands can.

        Args:
            places_m: x and y, shape (places, 2).

        Returns:
            Shape (places, blocks x * blocks y).
        """
        return _is_clear(
            self.columns_m, places_m[:, 0:1], places_m[:, 1:2], *self._blocks_m, room_m=0.0, end_m=_IN_BLOCK_M
        )

    def ways_from(self, at_m: Vec3) -> WaysRound:
        """The ways from a position."""
        x, y, _ = at_m
        # What the drone is already too near to does not keep it from leaving.
        columns_m = tuple(
            each for each in self.columns_m if hypot(x - each[0], y - each[1]) > each[2] + _ROOM_M
        )
        grid = self._grid
        field_m = np.full((grid.x_m.size, grid.y_m.size), np.inf, dtype=np.float32)
        dx, dy = grid.x_m[:, None] - np.float32(x), grid.y_m - np.float32(y)
        near_m = _ONTO_GRID * max(_pitch(grid.x_m), _pitch(grid.y_m))
        i, j = np.nonzero(dx * dx + dy * dy < np.float32(near_m**2))
        field_m[i, j] = WaysRound(at_m, columns_m, grid, field_m).distances_m(grid.x_m[i], grid.y_m[j])
        for _ in range(_MOST_ROUNDS):
            before = field_m.copy()
            for leave, enter, cost_m in self._costs:
                np.minimum(field_m[enter], field_m[leave] + cost_m, out=field_m[enter])
                np.minimum(field_m[leave], field_m[enter] + cost_m, out=field_m[leave])
            if np.array_equal(before, field_m):
                break
        return WaysRound(at_m, columns_m, grid, field_m)


@dataclass(frozen=True, slots=True, eq=False)
class WaysRound:
    """The ways from one position.

    Attributes:
        at_m: the position.
        columns_m: what is in the way.
        grid: cells flown through.
        field_m: distances to them, infinite where there is no way, shape (cells x, cells y).
    """

    at_m: Vec3
    columns_m: tuple[Vec3, ...]
    grid: SearchGrid
    field_m: Floats

    def distances_m(self, x_m: Floats, y_m: Floats) -> Floats:
        """How far it is to places, about: exactly if the way is straight; infinite if there is no way."""
        x, y = (np.array([each], dtype=np.float32) for each in self.at_m[:2])
        i = np.abs(x_m[:, None] - self.grid.x_m).argmin(axis=1)
        j = np.abs(y_m[:, None] - self.grid.y_m).argmin(axis=1)
        straight_m = np.sqrt((x_m - x) * (x_m - x) + (y_m - y) * (y_m - y))
        around_m = np.maximum(self.field_m[i, j], straight_m)
        is_straight = _is_clear(self.columns_m, x, y, x_m, y_m, room_m=_ROOM_M)
        distances_m: Floats = np.where(is_straight, straight_m, around_m)
        return distances_m


def _is_clear(
    columns_m: Sequence[Vec3],
    from_x: Floats,
    from_y: Floats,
    to_x: Floats,
    to_y: Floats,
    *,
    room_m: float,
    end_m: float = 0.0,
) -> Bools:
    """Whether straight lines stay clear of all obstacles, but for those within `end_m` of their ends."""
    along_x, along_y = to_x - from_x, to_y - from_y
    length_2 = np.maximum(along_x * along_x + along_y * along_y, np.float32(1e-6))
    clear = np.ones(length_2.shape, dtype=bool)
    columns = np.array(columns_m, dtype=np.float32).reshape(-1, 3)
    at_once = max(_LARGEST // max(length_2.size, 1), 1)
    for first in range(0, len(columns), at_once):
        x, y, radius = columns[first : first + at_once].T.reshape(3, -1, *(1 for _ in length_2.shape))
        dx, dy = x - from_x, y - from_y
        share = (dx * along_x + dy * along_y) / length_2
        np.clip(share, np.float32(0.0), np.float32(1.0), out=share)
        dx, dy = dx - share * along_x, dy - share * along_y
        free = dx * dx + dy * dy > (radius + np.float32(room_m)) ** 2
        if end_m > 0.0:
            dx, dy = x - to_x, y - to_y
            free |= dx * dx + dy * dy < np.float32(end_m**2)
        clear &= free.all(axis=0)
    return clear


def _slices(step: int) -> tuple[slice, slice]:
    """Where the steps along one axis begin and end."""
    if step == 0:
        return (slice(None), slice(None))
    first, last = slice(None, -1), slice(1, None)
    return (first, last) if step > 0 else (last, first)


def _pitch(axis_m: Floats) -> float:
    return float(axis_m[1] - axis_m[0])
