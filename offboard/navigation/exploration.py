"""Where to look next for frames: the view that shows most of what has not been seen, for its time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, cos, hypot, remainder, sin, tau
from typing import Final

import numpy as np

from geometry.axes import Pose
from geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.search.coverage import Coverage
from offboard.navigation.search.frame_visibility import HEADINGS, Floats, FrameVisibility, view_qualities
from offboard.navigation.search.view_table import YAWS, Doubles, ViewTable
from scenarios.models import Arena
from vision.types import ObstacleEdge

SPEED_M_S: Final = 1.0
CLIMB_M_S: Final = 0.8
TURN_RAD_S: Final = 0.9
_START_S: Final = 0.4  # lost when speeding up
_TURNS: Final = (0.0, 0.6, -0.6, 1.2, -1.2, 1.8, -1.8, 2.5, -2.5)  # rad, of views from about here
_FAR_PLACES: Final = 14  # places of the table that are looked at closely
_SAMPLES: Final = 4  # views counted on the way to a viewpoint, itself included
_SAMPLE_MARGIN_M: Final = 0.1
_KEEP: Final = 1.15  # the last choice counts for more, so that the drone does not waver
_USED: Final = 1.0  # how much a view counts for less, each time it was taken
_FLOOR_M, _CEILING_M = 0.3, 3.0  # most frames hang between
_ELSEWHERE: Final = 0.4  # prior weight of other heights
_APART_M: Final = 1.2  # from a frame found to other frames, most likely
_NEAR_FOUND: Final = 0.25  # prior weight nearer than that
_CLEAR_M: Final = 0.5  # from a viewpoint to frames found, and to obstacles' surfaces
_RAY_M: Final = 0.45  # half width of a line of sight at its origin
_RAY_LEFT: Final = 0.1  # share of a line of sight; when less is unseen it attracts less


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Where to fly and look next, turning on the way."""

    position_m: Vec3  # drone's centre, arena axes
    yaw_rad: float  # -pi..pi; the turn is at most half a circle


@dataclass(frozen=True, slots=True)
class LineOfSight:
    """A frame that was seen, but not well enough to know how far away it is."""

    origin_m: Vec3  # of the camera, arena axes
    direction: Vec3  # unit vector towards what was seen
    nearest_m: float = 0.3
    farthest_m: float = 12.0


@dataclass(frozen=True, slots=True)
class _Unseen:
    """What there is to see, by block of the grid."""

    seen: Floats  # quality of the best view so far, shape (HEADINGS, blocks)
    weights: Floats  # how likely a frame is there, shape (blocks,)


class Explorer:
    """Remembers what has been seen and chooses the next view. The same calls give the same answers.

    No place ever counts as certainly empty, what was seen long ago counts as seen less well, and a view
    that was taken before counts for less: so all views are taken sooner or later.

    Args:
        camera: the drone's camera.
        arena: where the frames are.

    Attributes:
        coverage: what has been seen so far.
    """

    def __init__(self, camera: CameraModel, arena: Arena) -> None:
        self.coverage = Coverage(camera, arena)
        self._visibility = FrameVisibility(camera)
        blocks = self.coverage.grid.blocks()
        self._table = ViewTable(camera, arena, blocks)
        self._x_m, self._y_m, self._z_m = blocks.centres()
        self._prior = _prior(self._z_m, blocks.z_m)
        self._heights_m = self._table.heights_m
        self._visits = np.zeros((len(self._table.places_m), len(YAWS)))
        self._last: Viewpoint | None = None

    def update(
        self, position_m: Vec3, attitude_arena: Quaternion, obstacle_edges: Sequence[ObstacleEdge] = ()
    ) -> None:
        """Take in an image, whatever it showed.

        Args:
            position_m: of the drone's centre when the image was exposed, arena axes.
            attitude_arena: body FLU to arena.
            obstacle_edges: where obstacles stand; nothing behind them counts as seen.
        """
        self.coverage.update(position_m, attitude_arena, obstacle_edges)

    def next_viewpoint(
        self,
        position_m: Vec3,
        yaw_rad: float,
        found: Sequence[Vec3] = (),
        hints: Sequence[LineOfSight] = (),
        columns_m: Sequence[Vec3] = (),
    ) -> Viewpoint:
        """Choose the view with the largest gain for its time, counting what is seen on the way.

        Ask again about twice a second, also before the drone is there.

        Args:
            position_m: of the drone's centre, arena axes.
            yaw_rad: its heading.
            found: centres of the frames that are known; others are less likely close to them.
            hints: frames seen but not located.
            columns_m: obstacles from the floor to the ceiling, as discs in plan: x, y, radius.

        Returns:
            The viewpoint. The drone can turn where it is, so there is always one.
        """
        seen = self.coverage.blocks()
        unseen = _Unseen(seen, self._weights(seen, found, hints))
        here = Pose(position_m, yaw_rad)
        place, yaw = self._table.nearest(position_m, yaw_rad)
        self._visits[place, yaw] += 1.0
        blocked = [(x, y, radius_m + _CLEAR_M) for x, y, radius_m in columns_m]
        blocked += [(x, y, _CLEAR_M) for x, y, _ in found]
        candidates = [
            each
            for each in self._candidates(here, unseen)
            if each.position_m == position_m or _is_clear(each, blocked)
        ]
        scores = self._scores(candidates, here, unseen)
        best = candidates[int(np.argmax(scores))]
        self._last = best
        return best

    def _weights(self, seen: Floats, found: Sequence[Vec3], hints: Sequence[LineOfSight]) -> Floats:
        """How likely a frame is in each block, if it is not in view."""
        weights = self._prior.copy()
        for x, y, _ in found:
            dx_m, dy_m = self._x_m - np.float32(x), self._y_m - np.float32(y)
            near = dx_m * dx_m + dy_m * dy_m < np.float32(_APART_M**2)
            weights[near] *= np.float32(_NEAR_FOUND)
        if hints:
            doubt = np.float32(1.0) - seen[0] / HEADINGS
            for layer in seen[1:]:
                doubt -= layer / np.float32(HEADINGS)
            total = float(np.cumsum(weights, dtype=np.float64)[-1])
            rays = np.zeros_like(weights)
            for hint in hints:
                on_ray = self._on_ray(hint)
                unseen = float(np.cumsum(np.where(on_ray, doubt, 0.0), dtype=np.float64)[-1])
                least = max(_RAY_LEFT * np.count_nonzero(on_ray), 1.0)
                rays = np.maximum(rays, np.where(on_ray, np.float32(total / max(unseen, least)), 0.0))
            weights += rays
        return weights

    def _on_ray(self, hint: LineOfSight) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        (ox, oy, oz), (ux, uy, uz) = hint.origin_m, hint.direction
        dx_m, dy_m, dz_m = self._x_m - np.float32(ox), self._y_m - np.float32(oy), self._z_m - np.float32(oz)
        along = dx_m * np.float32(ux) + dy_m * np.float32(uy) + dz_m * np.float32(uz)
        along = np.clip(along, np.float32(hint.nearest_m), np.float32(hint.farthest_m))
        dx_m, dy_m, dz_m = (d - along * np.float32(u) for d, u in ((dx_m, ux), (dy_m, uy), (dz_m, uz)))
        on_ray: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
            dx_m * dx_m + dy_m * dy_m + dz_m * dz_m
            < np.float32(_RAY_M**2) + along * along * np.float32(0.0036)
        )
        return on_ray

    def _candidates(self, here: Pose, unseen: _Unseen) -> list[Viewpoint]:
        """Views to look at closely: the last choice, some from about here, and the table's best."""
        x, y, z = here.position_m
        candidates = [] if self._last is None else [self._last]
        heights_m = [z, *(height_m for height_m in self._heights_m if abs(height_m - z) > 0.3)]
        for height_m in heights_m:
            candidates += [
                Viewpoint((x, y, height_m), remainder(here.yaw_rad + turn, tau))
                for turn in _TURNS
                if turn != 0.0 or height_m != z
            ]
        places_m = self._table.places_m
        gains = self._table.gains(unseen.seen, unseen.weights) / (1.0 + _USED * self._visits)
        level_m = np.sqrt((places_m[:, 0] - x) ** 2 + (places_m[:, 1] - y) ** 2)
        fly_s = _START_S + np.maximum(level_m / SPEED_M_S, np.abs(places_m[:, 2] - z) / CLIMB_M_S)
        turn_s = np.array([abs(remainder(yaw - here.yaw_rad, tau)) for yaw in YAWS]) / TURN_RAD_S
        scores = gains / (np.maximum(fly_s[:, None], turn_s[None, :]) + _START_S)
        best_yaw = np.argmax(scores, axis=1)
        best = np.take_along_axis(scores, best_yaw[:, None], axis=1)[:, 0]
        for place in np.argsort(-best, kind="stable")[:_FAR_PLACES]:
            px, py, pz = places_m[place]
            candidates.append(Viewpoint((float(px), float(py), float(pz)), YAWS[best_yaw[place]]))
        return candidates

    def _scores(self, candidates: Sequence[Viewpoint], here: Pose, unseen: _Unseen) -> list[float]:
        """Gain of each view and of those on the way to it, for its time."""
        times_s = [_time_s(each, here) for each in candidates]
        gains = self._gains(candidates, times_s, here, unseen)
        scores = []
        for index, each in enumerate(candidates):
            place, yaw = self._table.nearest(each.position_m, each.yaw_rad)
            score = float(gains[index]) / (times_s[index] + _START_S)
            score /= 1.0 + _USED * float(self._visits[place, yaw])
            scores.append(score * _KEEP if each is self._last else score)
        return scores

    def _gains(
        self, candidates: Sequence[Viewpoint], times_s: Sequence[float], here: Pose, unseen: _Unseen
    ) -> Doubles:
        """Gains of the views and of those on the way to them."""
        count = len(candidates)
        best_view = np.tile(unseen.seen, (1, count))
        gains = np.zeros(count)
        for sample in range(1, _SAMPLES + 1):
            poses = [
                _on_the_way(here, each, time_s * sample / _SAMPLES)
                for each, time_s in zip(candidates, times_s, strict=True)
            ]
            at = np.array(poses, dtype=np.float32)
            dx, dy, dz = self._x_m - at[:, 0:1], self._y_m - at[:, 1:2], self._z_m - at[:, 2:3]
            cosine, sine = at[:, 3:4], at[:, 4:5]
            ahead, left = dx * cosine + dy * sine, dy * cosine - dx * sine
            in_view = np.flatnonzero(self._visibility.in_view(ahead, left, dz, _SAMPLE_MARGIN_M))
            candidate, block = np.divmod(in_view, self._x_m.size)
            qualities = view_qualities(dx.ravel()[in_view], dy.ravel()[in_view], dz.ravel()[in_view])
            before = np.take(best_view, in_view, axis=1)
            after = np.maximum(before, qualities)
            best_view[:, in_view] = after
            after -= before
            new = after[0]
            for layer in after[1:]:
                new += layer
            gains += np.bincount(candidate, weights=new * unseen.weights[block], minlength=count)
        return gains


def _prior(z_m: Floats, levels_m: Floats) -> Floats:
    """Weight of each block: how much of its height is where frames usually are."""
    half_m = float(levels_m[0])
    low, high = np.maximum(z_m - half_m, _FLOOR_M), np.minimum(z_m + half_m, _CEILING_M)
    share = np.clip((high - low) / (2 * half_m), 0.0, 1.0)
    prior: Floats = (_ELSEWHERE + (1.0 - _ELSEWHERE) * share).astype(np.float32)
    return prior


def _time_s(viewpoint: Viewpoint, here: Pose) -> float:
    """Time to fly to a viewpoint, turning on the way."""
    x, y, z = (to - at for to, at in zip(viewpoint.position_m, here.position_m, strict=True))
    fly_s = max(hypot(x, y) / SPEED_M_S, abs(z) / CLIMB_M_S)
    turn_s = abs(remainder(viewpoint.yaw_rad - here.yaw_rad, tau)) / TURN_RAD_S
    return max(fly_s + _START_S if fly_s > 0.1 else 0.0, turn_s)


def _on_the_way(here: Pose, viewpoint: Viewpoint, time_s: float) -> tuple[float, float, float, float, float]:
    """Position, cosine and sine of the heading some time after leaving for a viewpoint."""
    x, y, z = (to - at for to, at in zip(viewpoint.position_m, here.position_m, strict=True))
    fly_s = max(hypot(x, y) / SPEED_M_S, abs(z) / CLIMB_M_S)
    share = min(max(time_s - _START_S, 0.0) / fly_s, 1.0) if fly_s > 0.1 else 1.0
    turn_rad = remainder(viewpoint.yaw_rad - here.yaw_rad, tau)
    yaw = here.yaw_rad + copysign(min(abs(turn_rad), TURN_RAD_S * time_s), turn_rad)
    px, py, pz = here.position_m
    return (px + share * x, py + share * y, pz + share * z, cos(yaw), sin(yaw))


def _is_clear(viewpoint: Viewpoint, blocked: Sequence[tuple[float, float, float]]) -> bool:
    x, y, _ = viewpoint.position_m
    return all(hypot(x - bx, y - by) >= radius_m for bx, by, radius_m in blocked)
