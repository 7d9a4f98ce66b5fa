"""Legs that are clear of obstacles: the direct one, or several past points beside what blocks it."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import pi, remainder

import numpy as np

from offboard.navigation.goals import FlightStyle
from offboard.navigation.planner.clearance import Clearance, Mask
from offboard.navigation.planner.legs import DESCENT_GAIN_PER_S2, Array, Connector, Ends, Leg, Legs
from offboard.navigation.planner.passages import Passages, lengths
from offboard.navigation.planner.route import Pass, place

MAX_DEPTH = 3  # detours within detours
_STEP_S = 0.08  # of the check for obstacles
_FEWEST, _MOST = 8, 80  # points of a leg that are checked
_DEEPER_M = 0.01
_STRAIN = 1.05  # a leg whose acceleration is this multiple of the limit is not possible
_SPEED_SHARES = (1.0, 0.5)
_CORNER_SHARES = (1.0, 0.6, 0.3, 0.0)
_TRIED = 3  # ways round an obstacle that are themselves blocked
CHECK_WORK = 20_000  # of a check of legs, beside one for each point and obstacle
ROUND_WORK = 200 * CHECK_WORK  # after which no other ways round an obstacle are tried
MOST_WORK = 600 * CHECK_WORK  # likewise of all legs

_Blocked = tuple[float, int]
"""When a leg is deepest in an obstacle, as a share of its duration, and in which."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLeg:
    """A leg, and where it ends."""

    leg: Leg
    end: Pass


Steps = list[PlannedLeg] | None
Seeking = Generator[None, None, Steps]


class LegFinder:
    """Finds legs between the passes of a route. Generators pause after each check, so that a search can wait.

    Args:
        clearance: the obstacles.
        connector: makes the legs.
        style: how boldly to fly.

    Attributes:
        work: done so far; in the unit of a point's distance from an obstacle, which takes some nanoseconds.
    """

    def __init__(self, clearance: Clearance, connector: Connector, style: FlightStyle) -> None:
        self.work = 0
        self._clearance = clearance
        self._connector = connector
        self._style = style
        self._passages = Passages(clearance)
        self._until_work = 0  # a way round an obstacle is sought

    def route(self, passes: Sequence[Pass]) -> Generator[None, None, list[Steps]]:
        """The legs from each pass to the next; None where no clear ones were found."""
        direct = self.direct(list(pairwise(passes)))
        hits = self._blocked(direct)
        yield
        found: list[Steps] = []
        for index, (pair, blocked) in enumerate(zip(pairwise(passes), hits, strict=True)):
            leg = direct[index]
            if blocked is None or pair[1].begun:
                found.append([PlannedLeg(leg, pair[1])])
                continue
            self._until_work = min(self.work + ROUND_WORK, MOST_WORK)
            found.append((yield from self._round(*pair, leg, blocked, MAX_DEPTH)))
        return found

    def direct(self, pairs: Sequence[tuple[Pass, Pass]]) -> Legs:
        """The legs between pairs of passes, obstacles left out."""
        starts = Ends.joined([before.exits for before, _ in pairs])
        return self._connector.legs(starts, Ends.joined([after.entries for _, after in pairs]))

    def clear_leg(self, before: Pass, after: Pass) -> Leg | None:
        """The direct leg; None if it is blocked or not possible."""
        legs = self.direct([(before, after)])
        return legs[0] if legs.strains[0] <= _STRAIN and self._blocked(legs)[0] is None else None

    def _between(self, before: Pass, after: Pass, depth: int) -> Seeking:
        legs = self.direct([(before, after)])
        if legs.strains[0] > _STRAIN:
            return None
        blocked = self._blocked(legs)[0]
        yield
        if blocked is None:
            return [PlannedLeg(legs[0], after)]
        return (yield from self._round(before, after, legs[0], blocked, depth)) if depth else None

    def _round(self, before: Pass, after: Pass, leg: Leg, blocked: _Blocked, depth: int) -> Seeking:
        """Legs round the obstacle in which the direct one is deepest."""
        share, obstacle = blocked
        ways = self._ways(before, after, leg, share, obstacle)
        later: list[tuple[float, Pass]] = []
        if ways:
            legs = self.direct([(before, way) for way in ways] + [(way, after) for way in ways])
            n = len(ways)
            times = legs.durations_s[:n] + legs.durations_s[n:]
            possible = np.maximum(legs.strains[:n], legs.strains[n:]) <= _STRAIN
            hits = self._blocked(legs)
            yield
            clear = [i for i in range(n) if possible[i] and hits[i] is None and hits[n + i] is None]
            if clear:
                fastest = min(clear, key=lambda i: float(times[i]))
                return [PlannedLeg(legs[fastest], ways[fastest]), PlannedLeg(legs[n + fastest], after)]
            later = [(float(times[i]), ways[i]) for i in range(n) if possible[i]]
        if self._clearance.is_column(obstacle):
            passed = yield from self._through_passages(before, after, depth)
            if passed is not None:
                return passed
        tried = [way for _, way in sorted(later, key=lambda entry: entry[0])[:_TRIED]]
        if depth == MAX_DEPTH:  # beside the start, before it is too near to pass in one curve
            tried += self._ways(before, after, leg, 0.0, obstacle)
        for way in tried:
            if self.work > self._until_work:
                break
            found = yield from self._chain([before, way, after], depth - 1)
            if found is not None:
                return found
        return None

    def _through_passages(self, before: Pass, after: Pass, depth: int) -> Seeking:
        """Legs along the shortest way between columns: past its corners as fast as they stay clear."""
        start_m, end_m = before.exits.places_m[0], after.entries.places_m[0]
        work = self._passages.work
        self._passages.prepare()
        self.work += self._passages.work - work
        yield
        work = self._passages.work
        corners = self._passages.corners(start_m, end_m)
        self.work += self._passages.work - work
        yield
        if not corners:
            return None
        points = [start_m[:2], *corners, end_m[:2]]
        along_m = lengths(points)
        shares = [length_m / along_m[-1] for length_m in along_m[1:-1]]
        places_m = []
        for corner, part in zip(corners, shares, strict=True):
            height_m = start_m[2] + part * (end_m[2] - start_m[2])
            place_m = self._outside(np.array([corner[0], corner[1], height_m]))
            if place_m is None:
                return None
            places_m.append(place_m)
        chain = [before, after]
        for share in _CORNER_SHARES:
            chain = [before]
            for i, (place_m, part) in enumerate(zip(places_m, shares, strict=True)):
                speed = share * self._style.axis_speed_m_s * _corner_direction(*points[i : i + 3])
                chain.append(place(place_m, speed, _turned(before, after, part)))
            chain.append(after)
            legs = self.direct(list(pairwise(chain)))
            if legs.strains.max() <= _STRAIN:
                hits = self._blocked(legs)
                yield
                if not any(hits):
                    return [PlannedLeg(legs[i], end) for i, end in enumerate(chain[1:])]
        return (yield from self._chain(chain, min(depth - 1, 1)))

    def _outside(self, corner_m: Array) -> Array | None:
        """A corner between columns; beside the gate that it is in: a leg may end in an obstacle."""
        depths = self._clearance.depths(corner_m[None])[0]
        if depths.max() <= 0.0:
            return corner_m
        ways_m = [m for m, _ in self._clearance.ways_round(corner_m, np.zeros(3), int(depths.argmax()))]
        clear = self._clearance.depths(np.array(ways_m)).max(axis=1) <= 0.0
        return ways_m[int(clear.argmax())] if clear.any() else None

    def _chain(self, passes: Sequence[Pass], depth: int) -> Seeking:
        """Clear legs from pass to pass."""
        steps: list[PlannedLeg] = []
        for before, after in pairwise(passes):
            found = yield from self._between(before, after, depth)
            if found is None:
                return None
            steps += found
        return steps

    def _blocked(self, legs: Legs) -> list[_Blocked | None]:
        """Where each leg is deepest in an obstacle; None if it is clear."""
        steps = int(float(legs.durations_s.max()) / _STEP_S)
        shares = np.linspace(0.0, 1.0, min(max(steps, _FEWEST), _MOST) + 1)
        positions = legs.positions(shares)
        depths = self._clearance.depths(positions.reshape(-1, 3)).reshape(len(legs), len(shares), -1)
        self.work += CHECK_WORK + depths.size
        found: list[_Blocked | None] = [None] * len(legs)
        touched: Mask = np.any(depths > 0.0, axis=1)
        rows, obstacles = np.flatnonzero(touched.any(axis=1)), np.flatnonzero(touched.any(axis=0))
        if not len(rows):
            return found
        flat = open_ended(depths[rows][..., obstacles]).reshape(len(rows), -1)
        for row, values, at in zip(rows.tolist(), flat, flat.argmax(axis=1).tolist(), strict=True):
            index, obstacle = divmod(at, len(obstacles))
            if values[at] > 0.0:
                found[row] = (float(shares[index]), int(obstacles[obstacle]))
        return found

    def _ways(self, before: Pass, after: Pass, leg: Leg, share: float, obstacle: int) -> list[Pass]:
        """Places beside an obstacle, instead of that at a share of a leg, at several speeds."""
        position, velocity, _ = leg.at(np.array([share * leg.duration_s]))
        ways = self._clearance.ways_round(position[0], velocity[0], obstacle)
        depths = self._clearance.depths(np.array([point for point, _ in ways]))
        yaw = _turned(before, after, share)
        found: list[Pass] = []
        for (point, speed), clear in zip(ways, (depths.max(axis=1) <= 0.0).tolist(), strict=True):
            if clear:
                sink = DESCENT_GAIN_PER_S2 / 3 * (point[2] - self._clearance.low_m[2])
                speed[2] = max(speed[2], -sink)
                found += [place(point, part * speed, yaw) for part in _SPEED_SHARES]
        return found


def _corner_direction(before: Array, corner: Array, after: Array) -> Array:
    """The level direction of flight at a corner, shape (3,); shorter, the sharper the corner."""
    come, go = corner - before, after - corner
    middle = come / max(float(np.linalg.norm(come)), 1e-6) + go / max(float(np.linalg.norm(go)), 1e-6)
    return np.array([middle[0] / 2, middle[1] / 2, 0.0])


def _turned(before: Pass, after: Pass, share: float) -> float:
    """The heading on the way, NaN if either is free: each part has time for its share of the turn."""
    yaw = float(before.exits.yaws_rad[0])
    return yaw + share * remainder(after.yaw_rad - yaw, 2 * pi)


def open_ended(depths: Array, *, ends: bool = True) -> Array:
    """Depths of legs' points in obstacles; what they start or end in counts only where they go deeper.

    Args:
        depths: shape (legs, points, obstacles); not above zero where a point is clear.
        ends: what they end in does not count, either.
    """
    inside = depths > 0.0
    leaving = np.logical_and.accumulate(inside, axis=1) & (depths <= depths[:, :1] + _DEEPER_M)
    if not ends:
        return np.where(leaving, -1.0, depths)
    entering = np.logical_and.accumulate(inside[:, ::-1], axis=1)[:, ::-1]
    entering &= depths <= depths[:, -1:] + _DEEPER_M
    kept: Array = np.where(leaving | entering, -1.0, depths)
    return kept
