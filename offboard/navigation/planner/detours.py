"""Legs that are clear of obstacles: the direct one, or several past points beside what blocks it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import pi, remainder

import numpy as np

from offboard.navigation.goals import FlightStyle
from offboard.navigation.planner.clearance import Clearance
from offboard.navigation.planner.connect import DESCENT_GAIN_PER_S2, Connector, Ends
from offboard.navigation.planner.legs import Array, Leg, Legs
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

_Blocked = tuple[float, int]
"""When a leg is deepest in an obstacle, as a share of its duration, and in which."""


class LegFinder:
    """Finds legs between the passes of a route.

    Args:
        clearance: the obstacles.
        connector: makes the legs.
        style: how boldly to fly.
    """

    def __init__(self, clearance: Clearance, connector: Connector, style: FlightStyle) -> None:
        self._clearance = clearance
        self._connector = connector
        self._style = style
        self._passages = Passages(clearance)

    def route(self, passes: Sequence[Pass]) -> list[list[Leg] | None]:
        """The legs from each pass to the next; None where no clear ones were found."""
        direct = self.direct(list(pairwise(passes)))
        found: list[list[Leg] | None] = []
        for index, (pair, blocked) in enumerate(zip(pairwise(passes), self._blocked(direct), strict=True)):
            leg = direct[index]
            if blocked is None or pair[1].begun:
                found.append([leg])
                continue
            found.append(self._round(*pair, leg, blocked, MAX_DEPTH))
        return found

    def direct(self, pairs: Sequence[tuple[Pass, Pass]]) -> Legs:
        """The legs between pairs of passes, obstacles left out."""
        starts = Ends.joined([before.exits for before, _ in pairs])
        return self._connector.legs(starts, Ends.joined([after.entries for _, after in pairs]))

    def _between(self, before: Pass, after: Pass, depth: int) -> list[Leg] | None:
        legs = self.direct([(before, after)])
        if legs.motions.strains[0] > _STRAIN:
            return None
        blocked = self._blocked(legs)[0]
        if blocked is None:
            return [legs[0]]
        return self._round(before, after, legs[0], blocked, depth) if depth else None

    def _round(self, before: Pass, after: Pass, leg: Leg, blocked: _Blocked, depth: int) -> list[Leg] | None:
        """Legs round the obstacle in which the direct one is deepest."""
        share, obstacle = blocked
        ways = self._ways(before, after, leg, share, obstacle)
        later: list[tuple[float, Pass]] = []
        if ways:
            legs = self.direct([(before, way) for way in ways] + [(way, after) for way in ways])
            n = len(ways)
            times = legs.motions.durations_s[:n] + legs.motions.durations_s[n:]
            possible = np.maximum(legs.motions.strains[:n], legs.motions.strains[n:]) <= _STRAIN
            hits = self._blocked(legs)
            clear = [i for i in range(n) if possible[i] and hits[i] is None and hits[n + i] is None]
            if clear:
                fastest = min(clear, key=lambda i: float(times[i]))
                return [legs[fastest], legs[n + fastest]]
            later = [(float(times[i]), ways[i]) for i in range(n) if possible[i]]
        if self._clearance.is_column(obstacle):
            passed = self._through_passages(before, after, depth)
            if passed is not None:
                return passed
        tried = [way for _, way in sorted(later, key=lambda entry: entry[0])[:_TRIED]]
        if depth == MAX_DEPTH:  # beside the start, before it is too near to pass in one curve
            tried += self._ways(before, after, leg, 0.0, obstacle)
        for way in tried:
            found = self._chain([before, way, after], depth - 1)
            if found is not None:
                return found
        return None

    def _through_passages(self, before: Pass, after: Pass, depth: int) -> list[Leg] | None:
        """Legs along the shortest way between columns: past its corners as fast as they stay clear."""
        start_m, end_m = before.exits.places_m[0], after.entries.places_m[0]
        corners = self._passages.corners(start_m, end_m)
        if not corners:
            return None
        points = [start_m[:2], *corners, end_m[:2]]
        along_m = lengths(points)
        chain = [before, after]
        for share in _CORNER_SHARES:
            chain = [before]
            for i, corner in enumerate(corners, start=1):
                part = along_m[i] / along_m[-1]
                height_m = start_m[2] + part * (end_m[2] - start_m[2])
                speed = share * self._style.axis_speed_m_s * _corner_direction(*points[i - 1 : i + 2])
                yaw = _turned(before, after, part)
                chain.append(place(np.array([corner[0], corner[1], height_m]), speed, yaw))
            chain.append(after)
            legs = self.direct(list(pairwise(chain)))
            if legs.motions.strains.max() <= _STRAIN and not any(self._blocked(legs)):
                return [legs[i] for i in range(len(legs))]
        return self._chain(chain, min(depth - 1, 1))

    def _chain(self, passes: Sequence[Pass], depth: int) -> list[Leg] | None:
        """Clear legs from pass to pass."""
        legs: list[Leg] = []
        for before, after in pairwise(passes):
            found = self._between(before, after, depth)
            if found is None:
                return None
            legs += found
        return legs

    def _blocked(self, legs: Legs) -> list[_Blocked | None]:
        """Where each leg is deepest in an obstacle; None if it is clear."""
        steps = int(float(legs.motions.durations_s.max()) / _STEP_S)
        shares = np.linspace(0.0, 1.0, min(max(steps, _FEWEST), _MOST) + 1)
        positions = legs.positions(shares)
        depths = self._clearance.depths(positions.reshape(-1, 3)).reshape(len(legs), len(shares), -1)
        flat = open_ended(depths).reshape(len(legs), -1)
        deepest = flat.argmax(axis=1)
        found: list[_Blocked | None] = []
        for row, at in enumerate(deepest.tolist()):
            index, obstacle = divmod(at, depths.shape[2])
            found.append((float(shares[index]), obstacle) if flat[row, at] > 0.0 else None)
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
