"""Ways between columns, in plan: the shortest on a grid, pulled straight."""

from __future__ import annotations

from functools import cached_property
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from offboard.navigation.planner.clearance import Clearance, Mask
from offboard.navigation.planner.legs import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

CELL_M = 0.15
SPARE_M = 0.06  # how much farther than needed a way stays away from columns, so that corners can be rounded
_SIGHT_STEP_M = 0.05
_NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))
_START_REACH_CELLS = 3
_SHORTEST_WORK = 100_000  # of a shortest way
_SIGHT_WORK = 2_000  # of a look from one point to another
_ROUNDING_M = 1e-9


class Passages:
    """Shortest ways in plan, clear of all columns and of the arena's sides.

    Args:
        clearance: the obstacles.

    Attributes:
        work: done so far, in the unit of `LegFinder`.
    """

    def __init__(self, clearance: Clearance) -> None:
        self.work = 0
        self._clearance = clearance
        low, high = clearance.low_m[:2], clearance.high_m[:2]
        self._low_m: Array = low
        self._counts = np.maximum(np.ceil((high - low) / CELL_M).astype(int) + 1, 2)
        self._steps_m: Array = (high - low) / (self._counts - 1)

    def prepare(self) -> None:
        """Do the part of the work that all ways have in common."""
        _ = self._graph

    def corners(self, start_m: Array, end_m: Array) -> list[Array] | None:
        """Where to turn on the way between two points in plan; None if there is no way."""
        nodes = self._nodes(start_m), self._nodes(end_m)
        if nodes[0] is None or nodes[1] is None:
            return None
        way = self._shortest(nodes[0], nodes[1])
        if way is None:
            return None
        return self._pulled([start_m[:2], *way, end_m[:2]])

    @cached_property
    def _free(self) -> Mask:
        """Whether each grid point is clear, shape (x, y)."""
        axes = [self._low_m[i] + np.arange(self._counts[i]) * self._steps_m[i] for i in (0, 1)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        self.work += len(points) * self._clearance.columns
        return self._clear(points).reshape(tuple(self._counts))

    def _clear(self, points_m: Array) -> Mask:
        deepest = self._clearance.column_depths(points_m).max(axis=1, initial=-1.0)
        return np.asarray(deepest < -SPARE_M)

    def _nodes(self, point_m: Array) -> int | None:
        """The clear grid point nearest to a point, as an index; None if none is near."""
        at = np.rint((point_m[:2] - self._low_m) / self._steps_m).astype(int)
        at = np.clip(at, 0, self._counts - 1)
        low = np.maximum(at - _START_REACH_CELLS, 0)
        part = self._free[low[0] : at[0] + _START_REACH_CELLS + 1, low[1] : at[1] + _START_REACH_CELLS + 1]
        found = np.argwhere(part) + low
        if not len(found):
            return None
        nearest = found[((found - at) ** 2).sum(axis=1).argmin()]
        return int(nearest[0] * self._counts[1] + nearest[1])

    def _shortest(self, start: int, end: int) -> list[Array] | None:
        from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415 - see `load_graphs`

        self.work += _SHORTEST_WORK
        found = dijkstra(self._graph, directed=False, indices=[start], return_predecessors=True)
        before = found[1][0]
        way = [end]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
            if way[-1] < 0:
                return None
        columns = int(self._counts[1])
        return [self._low_m + np.array(divmod(node, columns)) * self._steps_m for node in reversed(way)]

    @cached_property
    def _graph(self) -> csr_array[np.float64, tuple[int, int]]:
        """Lengths between neighbouring clear grid points, as a sparse matrix."""
        from scipy.sparse import csr_array  # noqa: PLC0415 - see `load_graphs`

        free = self._free
        index = np.arange(free.size).reshape(free.shape)
        parts: list[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], float]] = []
        for dx, dy in _NEIGHBOURS:
            here = (slice(0, free.shape[0] - dx), slice(max(-dy, 0), free.shape[1] - max(dy, 0)))
            there = (slice(dx, free.shape[0]), slice(max(dy, 0), free.shape[1] - max(-dy, 0)))
            both = free[here] & free[there]
            length = float(np.hypot(dx * self._steps_m[0], dy * self._steps_m[1]))
            parts.append((index[here][both], index[there][both], length))
        rows, columns = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        lengths = np.concatenate([np.full(len(part[0]), part[2]) for part in parts])
        return csr_array((lengths, (rows, columns)), shape=(free.size, free.size))

    def _pulled(self, way: list[Array]) -> list[Array]:
        """The corners of a way after each piece in sight was made straight."""
        points = np.array(way)
        corners: list[Array] = []
        at = 0
        while at < len(points) - 1:
            at = self._last_in_sight(points, at)
            corners.append(points[at])
        return corners[:-1]

    def _last_in_sight(self, points_m: Array, at: int) -> int:
        """Which of the points that come after one is the last that is in sight; the next one always is.

        Only lines that pass a column by a few millimetres are looked at step by step; of all others bounds of
        their depths say what that would find. Counted is the work of looking at each step by step.
        """
        ways = points_m[at + 2 :] - points_m[at]
        lengths_m = np.linalg.norm(ways, axis=1)
        counts = np.maximum((lengths_m / _SIGHT_STEP_M).astype(int), 1)
        least, greatest = self._clearance.line_depths(points_m[at], ways, lengths_m / counts)
        clear = (greatest < -SPARE_M - _ROUNDING_M) | (counts == 1)
        unknown = ~clear & (least <= -SPARE_M + _ROUNDING_M)
        for later in range(len(ways) - 1, -1, -1):
            self.work += _SIGHT_WORK + (int(counts[later]) - 1) * self._clearance.columns
            if clear[later] or (unknown[later] and self._sees(points_m[at], ways[later], counts[later])):
                return at + 2 + later
        return at + 1

    def _sees(self, start_m: Array, way_m: Array, count: int) -> bool:
        """Whether all points between the ends of a line are clear."""
        shares = np.linspace(0.0, 1.0, count + 1)[1:-1, None]
        return bool(self._clear(start_m + shares * way_m).all())


def load_graphs() -> None:
    """Import scipy's graphs, which takes a quarter of a second: before a flight, and only if it plans."""
    import_module("scipy.sparse.csgraph")


def lengths(points: list[Array]) -> list[float]:
    """From the first of some points to each, along the straight lines between them, metres."""
    sums = [0.0]
    for one, other in pairwise(points):
        sums.append(sums[-1] + float(np.linalg.norm(other - one)))
    return sums
