"""What obstacles hide from where, and how far it is to fly round them; all in plan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from framerunner.geometry.vectors import Vec3
from offboard.navigation.search.gate_visibility import Bools, Floats, SearchGrid

_ROOM_M: Final = 0.1  # beside an obstacle, at least, for the drone to pass
_ONTO_GRID: Final = 1.6  # cells nearer than this many times their size are entered directly
_IN_BLOCK_M: Final = 0.5
_LARGEST: Final = 20_000  # elements of an array that are computed quickest
_STEPS: Final = ((1, 0), (0, 1), (1, 1), (1, -1))
_MOST_ROUNDS: Final = 80


class Obstruction:
    """Made for one grid; the work is done once for each obstacle.

    Args:
        places_m: x and y of places to look from, shape (places, 2).
        grid: its cells are flown through.
        blocks: its blocks are looked at.

    Attributes:
        columns_m: obstacles from the floor to the ceiling, as discs: x, y, radius.
        clear: which blocks, in plan, can be seen from each place: shape (places, blocks x * blocks y).
    """

    def __init__(self, places_m: Floats, grid: SearchGrid, blocks: SearchGrid) -> None:
        self.columns_m: tuple[Vec3, ...] = ()
        self._places_m, self._grid = places_m, grid
        to_x, to_y = (axis.ravel() for axis in np.meshgrid(blocks.x_m, blocks.y_m, indexing="ij"))
        self._blocks_m = (to_x, to_y)
        self.clear: Bools = np.ones((len(places_m), to_x.size), dtype=bool)
        x, y = np.meshgrid(grid.x_m, grid.y_m, indexing="ij")
        self._steps: list[_GridStep] = []
        for along_x, along_y in _STEPS:
            (leave_x, enter_x), (leave_y, enter_y) = _slices(along_x), _slices(along_y)
            leave, enter = (leave_x, leave_y), (enter_x, enter_y)
            length_m = np.float32(hypot(along_x * _pitch(grid.x_m), along_y * _pitch(grid.y_m)))
            self._steps.append(_GridStep(leave, enter, (x[leave], y[leave], x[enter], y[enter]), length_m))
        self._kept: dict[
            Vec3, tuple[Bools, ...]
        ] = {}  # by obstacle: what it leaves in sight, and of each step
        self._costs_m: list[Floats] = []

    def place(self, columns_m: Sequence[Vec3]) -> None:
        """Take in which obstacles there are."""
        if self.columns_m == tuple(columns_m):
            return
        self.columns_m = tuple(columns_m)
        new = tuple(each for each in self.columns_m if each not in self._kept)
        left = self._left_by(new) if new else ()
        kept = self._kept | dict(zip(new, left, strict=True))
        self._kept = {each: kept[each] for each in self.columns_m}
        together = zip(*self._kept.values(), strict=True)
        self.clear, *steps = (np.logical_and.reduce(masks) for masks in together)
        self._costs_m = [
            np.where(clear, step.length_m, np.float32(np.inf))
            for step, clear in zip(self._steps, steps, strict=True)
        ]

    def _left_by(self, columns_m: Sequence[Vec3]) -> Iterator[tuple[Bools, ...]]:
        """What each obstacle leaves: blocks in sight of each place, and steps from cell to cell."""
        steps = (_each_clear(columns_m, *step.ends_m, room_m=_ROOM_M) for step in self._steps)
        x, y = self._places_m[:, 0:1], self._places_m[:, 1:2]
        in_sight = _each_clear(columns_m, x, y, *self._blocks_m, room_m=0.0, end_m=_IN_BLOCK_M)
        return zip(in_sight, *steps, strict=True)

    def clear_from(self, places_m: Floats) -> Bools:
        """Which blocks, in plan, can be seen from places; those in which an obstacle stands can.

        Args:
            places_m: x and y, shape (places, 2).

        Returns:
            Shape (places, blocks x * blocks y).
        """
        from_x, from_y = places_m[:, 0:1], places_m[:, 1:2]
        each = _each_clear(self.columns_m, from_x, from_y, *self._blocks_m, room_m=0.0, end_m=_IN_BLOCK_M)
        clear: Bools = np.logical_and.reduce(each)
        return clear

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
            for step, cost_m in zip(self._steps, self._costs_m, strict=True):
                leave, enter = step.leave, step.enter
                np.minimum(field_m[enter], field_m[leave] + cost_m, out=field_m[enter])
                np.minimum(field_m[leave], field_m[enter] + cost_m, out=field_m[leave])
            if np.array_equal(before, field_m):
                break
        return WaysRound(at_m, columns_m, grid, field_m)


@dataclass(frozen=True, slots=True, eq=False)
class _GridStep:
    """From each cell to the next one in a direction: where they are in the grid, and in the arena."""

    leave: tuple[slice, slice]
    enter: tuple[slice, slice]
    ends_m: tuple[Floats, Floats, Floats, Floats]  # x and y left, x and y entered
    length_m: np.float32


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
        is_straight = np.logical_and.reduce(_each_clear(self.columns_m, x, y, x_m, y_m, room_m=_ROOM_M))
        distances_m: Floats = np.where(is_straight, straight_m, around_m)
        return distances_m


def _each_clear(
    columns_m: Sequence[Vec3],
    from_x: Floats,
    from_y: Floats,
    to_x: Floats,
    to_y: Floats,
    *,
    room_m: float,
    end_m: float = 0.0,
) -> Bools:
    """Which straight lines stay clear of each obstacle, shape (obstacles, *lines).

    An obstacle within `end_m` of a line's end is not in its way.
    """
    along_x, along_y = to_x - from_x, to_y - from_y
    length_2 = np.maximum(along_x * along_x + along_y * along_y, np.float32(1e-6))
    columns = np.array(columns_m, dtype=np.float32).reshape(-1, 3)
    clear = np.empty((len(columns), *length_2.shape), dtype=bool)
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
        clear[first : first + at_once] = free
    return clear


def _slices(step: int) -> tuple[slice, slice]:
    """Where the steps along one axis begin and end."""
    if step == 0:
        return (slice(None), slice(None))
    first, last = slice(None, -1), slice(1, None)
    return (first, last) if step > 0 else (last, first)


def _pitch(axis_m: Floats) -> float:
    return float(axis_m[1] - axis_m[0])
