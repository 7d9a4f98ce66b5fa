"""Where to look next for gates: the view that shows most of what has not been seen, for its time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, cos, hypot, isfinite, remainder, sin, tau
from typing import Final

import numpy as np

from framerunner.geometry.axes import Pose
from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.vectors import Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.goals import FlightStyle
from offboard.navigation.search.coverage import Coverage
from offboard.navigation.search.gate_visibility import (
    YAWS,
    Bools,
    Doubles,
    Floats,
    GateVisibility,
    view_qualities,
    view_table,
)
from offboard.navigation.search.likelihood import Likelihood, LineOfSight
from offboard.navigation.search.obstruction import Obstruction, WaysRound
from scenarios.models import Arena

_START_S: Final = 0.4  # lost when speeding up
_PATH_SHARE: Final = 0.9  # of the highest speed of a path: what it is flown with at most, on the average
_TURNS: Final = (0.0, 0.6, -0.6, 1.2, -1.2, 1.8, -1.8, 2.5, -2.5)  # rad, of views from about here
_OTHER_HEIGHT_M: Final = 0.3  # a height that differs by less is not tried
_FAR_PLACES: Final = 14  # places of the table that are looked at closely
_SAMPLES: Final = 4  # views counted on the way to a viewpoint, itself included
_SAMPLE_MARGIN_M: Final = 0.1
_KEEP: Final = 1.15  # the last choice counts for more, so that the drone does not waver
_NO_FLIGHT_S: Final = 0.1  # to so near a viewpoint the drone only turns
_DETOUR_M: Final = 0.1  # a way longer by more than this is not straight
_USED: Final = 1.0  # how much a view counts for less, each time it was taken
_REFUSED: Final = 3.0  # visits for which a place counts that could not be reached
_CLEAR_M: Final = 0.5  # from a viewpoint to gates found, and to obstacles' surfaces


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast the drone flies to a viewpoint; the defaults are those of the contest's style."""

    speed_m_s: float = 1.0
    climb_m_s: float = 0.8
    turn_rad_s: float = 0.9

    @staticmethod
    def of(style: FlightStyle) -> Pace:
        """The pace of a style: speed on the average over all directions of flight."""
        bolder = style.axis_speed_m_s / FlightStyle().axis_speed_m_s
        speed_m_s = min(bolder * Pace().speed_m_s, _PATH_SHARE * style.path_speed_m_s)
        return Pace(speed_m_s, Pace().climb_m_s, style.yaw_rate_rad_s)


class Explorer:
    """Remembers what has been seen and chooses the next view. The same calls give the same answers.

    No place ever counts as certainly empty, what was seen long ago counts as seen less well, and a view
    that was taken before counts for less: so all views are taken sooner or later.

    Args:
        camera: the drone's camera.
        arena: where the gates are.
        pace: of the flight to viewpoints.
        shapes: of the gates; None: all have that of the frame challenge.

    Attributes:
        coverage: what has been seen so far.
    """

    def __init__(
        self,
        camera: CameraModel,
        arena: Arena,
        pace: Pace | None = None,
        shapes: GateShapes | None = None,
    ) -> None:
        self._pace = pace or Pace()
        shapes = shapes or GateShapes()
        self.coverage = Coverage(camera, arena, shapes)
        self._visibility = GateVisibility(camera, shapes)
        self._blocks = self.coverage.grid.blocks()
        self._table = view_table(camera, arena, self._visibility.reach)
        self._likelihood = Likelihood(self._blocks)
        self._visits = np.zeros((len(self._table.places_m), len(YAWS)))
        self._last: Pose | None = None
        self._obstruction: Obstruction | None = None  # None without obstacles

    def next_viewpoint(
        self,
        position_m: Vec3,
        yaw_rad: float,
        found: Sequence[Vec3] = (),
        hints: Sequence[LineOfSight] = (),
        columns_m: Sequence[Vec3] = (),
        *,
        from_here: bool = True,
    ) -> Pose:
        """Choose the view with the largest gain for its time, counting what is seen on the way.

        Ask again about twice a second, also before the drone is there.

        Args:
            position_m: of the drone's centre, arena axes.
            yaw_rad: its heading.
            found: centres of the gates that are known; others are less likely close to them.
            hints: directions in which gates were seen that are not known; they are looked at first.
            columns_m: obstacles from the floor to the ceiling, as discs in plan: x, y, radius.
            from_here: the drone flies from there, so the choice is remembered; False: it only will be there.

        Returns:
            The viewpoint: where to fly and look next, turning on the way by half a circle at most. The drone
            can turn where it is, so there is always one.
        """
        if from_here:
            self._visits[self._table.nearest(position_m, yaw_rad)] += 1.0
        self._place_obstacles(columns_m)
        here = Pose(position_m, yaw_rad)
        around = None if self._obstruction is None else self._obstruction.ways_from(position_m)
        seen = self.coverage.blocks()
        unseen = _Unseen(seen, self._likelihood.weights(seen, found, hints))
        blocked = [(x, y, radius_m + _CLEAR_M) for x, y, radius_m in columns_m]
        blocked += [(x, y, _CLEAR_M) for x, y, _ in found]
        viewpoints = [
            each
            for each in (*self._near(here), *self._far(here, around, unseen))
            if each.position_m == position_m or _is_clear(each, blocked)
        ]
        ways = _ways(here, around, viewpoints)
        viewpoint = ways[int(np.argmax(self._scores(here, ways, unseen)))].viewpoint
        if from_here:
            self._last = viewpoint
        return viewpoint

    def refuse(self) -> None:
        """No way was found to the viewpoint chosen last: it counts as looked at from, in all directions."""
        if self._last is not None:
            place, _ = self._table.nearest(self._last.position_m, self._last.yaw_rad)
            self._visits[place] += _REFUSED
            self._last = None

    def _place_obstacles(self, columns_m: Sequence[Vec3]) -> None:
        if not columns_m:
            self._obstruction = None
            return
        if self._obstruction is None:
            self._obstruction = Obstruction(self._table.grounds_m, self.coverage.grid, self._blocks)
        self._obstruction.place(columns_m)

    def _near(self, here: Pose) -> list[Pose]:
        """The last choice, and views from where the drone is and from below and above."""
        x, y, z = here.position_m
        heights_m = [each for each in self._table.heights_m if abs(each - z) > _OTHER_HEIGHT_M]
        turned = [
            Pose((x, y, height_m), remainder(here.yaw_rad + turn, tau))
            for height_m in (z, *heights_m)
            for turn in _TURNS
            if turn != 0.0 or height_m != z
        ]
        return turned if self._last is None else [self._last, *turned]

    def _far(self, here: Pose, around: WaysRound | None, unseen: _Unseen) -> list[Pose]:
        """The best view from each of the table's best places, roughly."""
        table, obstruction = self._table, self._obstruction
        gains = table.gains(unseen.seen, unseen.weights, None if obstruction is None else obstruction.clear)
        gains /= 1.0 + _USED * self._visits
        dx_m, dy_m, dz_m = (table.places_m[:, axis] - here.position_m[axis] for axis in range(3))
        if around is None:
            level_m = np.sqrt(dx_m * dx_m + dy_m * dy_m)
        else:
            ground_m = around.distances_m(table.grounds_m[:, 0], table.grounds_m[:, 1])
            level_m = np.repeat(ground_m, len(table.heights_m)).astype(np.float64)
        pace = self._pace
        fly_s = _START_S + np.maximum(level_m / pace.speed_m_s, np.abs(dz_m) / pace.climb_m_s)
        turn_s = np.array([abs(remainder(yaw - here.yaw_rad, tau)) for yaw in YAWS]) / pace.turn_rad_s
        scores = gains / (np.maximum(fly_s[:, None], turn_s) + _START_S)
        headings = np.argmax(scores, axis=1)
        best = np.take_along_axis(scores, headings[:, None], axis=1)[:, 0]
        chosen = np.argsort(-best, kind="stable")[:_FAR_PLACES].tolist()
        return [Pose(table.place(index), YAWS[headings[index]]) for index in chosen]

    def _scores(self, here: Pose, ways: Sequence[_Way], unseen: _Unseen) -> list[float]:
        """Gain of each view and of those on the way to it, for its time."""
        times_s = [_time_s(here, way, self._pace) for way in ways]
        gains = self._gains(here, ways, times_s, unseen)
        scores = []
        for index, way in enumerate(ways):
            view = self._table.nearest(way.viewpoint.position_m, way.viewpoint.yaw_rad)
            score = float(gains[index]) / (times_s[index] + _START_S) / (1.0 + _USED * self._visits[view])
            scores.append(score * _KEEP if way.viewpoint is self._last else score)
        return scores

    def _gains(self, here: Pose, ways: Sequence[_Way], times_s: Sequence[float], unseen: _Unseen) -> Doubles:
        """Gains of the views and of those on the way to them."""
        x_m, y_m, z_m = self._blocks.centres()
        best_view = np.tile(unseen.seen, (1, len(ways)))
        gains = np.zeros(len(ways))
        clear = self._clear(here, ways)
        for sample in range(1, _SAMPLES + 1):
            poses = [
                _on_the_way(here, way, time_s * sample / _SAMPLES, self._pace)
                for way, time_s in zip(ways, times_s, strict=True)
            ]
            at = np.array([(*each.position_m, cos(each.yaw_rad), sin(each.yaw_rad)) for each in poses])
            x, y, z, cosine, sine = at.astype(np.float32).T[:, :, None]
            dx, dy, dz = x_m - x, y_m - y, z_m - z
            shown = self._visibility.in_view(
                dx * cosine + dy * sine, dy * cosine - dx * sine, dz, _SAMPLE_MARGIN_M
            )
            if clear is not None:
                shown &= clear[sample > _SAMPLES / 2]
            in_view = np.flatnonzero(shown)
            way, block = np.divmod(in_view, x_m.size)
            dx, dy, dz = (each.ravel()[in_view] for each in (dx, dy, dz))
            qualities = view_qualities(dx, dy, dz, self._visibility.reach)
            before = np.take(best_view, in_view, axis=1)
            after = np.maximum(before, qualities)
            best_view[:, in_view] = after
            after -= before
            new = after[0]
            for layer in after[1:]:
                new += layer
            gains += np.bincount(way, weights=new * unseen.weights[block], minlength=len(ways))
        return gains

    def _clear(self, here: Pose, ways: Sequence[_Way]) -> tuple[Bools, Bools] | None:
        """Which blocks obstacles leave in sight on the first and on the last part of each way."""
        if self._obstruction is None:
            return None
        x, y, _ = here.position_m
        first = self._obstruction.clear_from(np.array([[x, y]], dtype=np.float32))
        rows = [
            first[0] if way.level_m == 0.0 else self._obstruction.clear[self._ground(way)] for way in ways
        ]
        levels = self._blocks.z_m.size
        return np.repeat(first, levels, axis=1), np.repeat(np.array(rows), levels, axis=1)

    def _ground(self, way: _Way) -> int:
        return self._table.nearest_ground(way.viewpoint.position_m)


@dataclass(frozen=True, slots=True)
class _Unseen:
    """What there is to see, by block of the grid."""

    seen: Floats  # quality of the best view so far, shape (HEADINGS, blocks)
    weights: Floats  # how likely a gate is there, shape (blocks,)


@dataclass(frozen=True, slots=True)
class _Way:
    """How to get to a viewpoint."""

    viewpoint: Pose
    level_m: float  # distance in plan, round obstacles; infinite if there is no way
    straight: bool  # nothing is in the way


def _ways(here: Pose, around: WaysRound | None, viewpoints: Sequence[Pose]) -> list[_Way]:
    """How to get to viewpoints; those that cannot be reached are left out."""
    x, y, _ = here.position_m
    level_m = [hypot(each.position_m[0] - x, each.position_m[1] - y) for each in viewpoints]
    way_m = level_m
    if around is not None:
        to_x = np.array([each.position_m[0] for each in viewpoints], dtype=np.float32)
        to_y = np.array([each.position_m[1] for each in viewpoints], dtype=np.float32)
        way_m = around.distances_m(to_x, to_y).tolist()
    ways = []
    for viewpoint, direct_m, length_m in zip(viewpoints, level_m, way_m, strict=True):
        straight = direct_m == 0.0 or length_m <= direct_m + _DETOUR_M
        if straight or isfinite(length_m):
            ways.append(_Way(viewpoint, direct_m if straight else length_m, straight))
    return ways


def _fly_s(here: Pose, way: _Way, pace: Pace) -> float:
    up_m = abs(way.viewpoint.position_m[2] - here.position_m[2])
    return max(way.level_m / pace.speed_m_s, up_m / pace.climb_m_s)


def _time_s(here: Pose, way: _Way, pace: Pace) -> float:
    """Time to get to a viewpoint, turning on the way."""
    fly_s = _fly_s(here, way, pace)
    turn_s = abs(remainder(way.viewpoint.yaw_rad - here.yaw_rad, tau)) / pace.turn_rad_s
    return max(fly_s + _START_S if fly_s > _NO_FLIGHT_S else 0.0, turn_s)


def _on_the_way(here: Pose, way: _Way, time_s: float, pace: Pace) -> Pose:
    """The pose some time after leaving for a viewpoint; on a way round obstacles, that at its end."""
    viewpoint = way.viewpoint
    if not way.straight:
        return viewpoint
    fly_s = _fly_s(here, way, pace)
    share = min(max(time_s - _START_S, 0.0) / fly_s, 1.0) if fly_s > _NO_FLIGHT_S else 1.0
    (x, y, z), (to_x, to_y, to_z) = here.position_m, viewpoint.position_m
    place_m = (x + share * (to_x - x), y + share * (to_y - y), z + share * (to_z - z))
    turn_rad = remainder(viewpoint.yaw_rad - here.yaw_rad, tau)
    return Pose(place_m, here.yaw_rad + copysign(min(abs(turn_rad), pace.turn_rad_s * time_s), turn_rad))


def _is_clear(viewpoint: Pose, blocked: Sequence[tuple[float, float, float]]) -> bool:
    x, y, _ = viewpoint.position_m
    return all(hypot(x - bx, y - by) >= radius_m for bx, by, radius_m in blocked)
