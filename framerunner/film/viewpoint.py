"""The virtual camera of a film: its pose at each time, and the projection of points into its image."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan

import numpy as np

from framerunner.film.timeline import Floats, Timeline
from scenarios.models import Scenario, start_position

ELEVATION_RAD = radians(27.0)
FIELD_OF_VIEW_RAD = radians(34.0)
NEAR_M = 0.3
_TURN_RAD_S = radians(5.0)  # in film time
_MAX_TURN_RAD = radians(110.0)
_FOLLOWED = 0.35  # share of the drone's movement that the view follows, 0 to 1
_SMOOTHING_S = 2.0  # of that movement, film time
_MARGIN = 0.9  # of half the image
_CENTRE = 0.53  # of the image's height: there is a title above
_SAMPLES = 120
_DISTANCE_SMOOTHING_S = 2.5  # film time


@dataclass(frozen=True, slots=True)
class FilmCamera:
    """A pinhole camera.

    Attributes:
        eye_m: position, arena axes, shape (3,).
        axes: rows are right, down and forward of the image in arena axes, shape (3, 3).
        focal_px: focal length.
        centre_px: principal point.
    """

    eye_m: Floats
    axes: Floats
    focal_px: float
    centre_px: tuple[float, float]

    def _camera_axes(self, points_m: Floats) -> Floats:
        """Points in the camera's axes (right, down, forward), metres, shape (n, 3)."""
        turned: Floats = (points_m - self.eye_m) @ self.axes.T
        return turned

    def project(self, points_m: Floats) -> Floats:
        """Points in the image, pixels, shape (n, 2); NaN for those behind the camera."""
        seen = self._camera_axes(points_m)
        ahead = np.where(seen[:, 2] > NEAR_M, seen[:, 2], np.nan)
        pixels: Floats = self.focal_px * seen[:, :2] / ahead[:, None] + np.array(self.centre_px)
        return pixels

    def polygon(self, corners_m: Floats) -> Floats:
        """Corners of a convex polygon in the image, clipped at the near plane, pixels, shape (k, 2)."""
        seen = self._camera_axes(corners_m)
        if float(seen[:, 2].min()) <= NEAR_M:
            seen = _clipped(seen)
        pixels: Floats = self.focal_px * seen[:, :2] / seen[:, 2:] + np.array(self.centre_px)
        return pixels

    def scaled(self, factor: float) -> FilmCamera:
        """The same camera with an image that is `factor` times as large."""
        u, v = self.centre_px
        return FilmCamera(self.eye_m, self.axes, self.focal_px * factor, (u * factor, v * factor))


class Flyby:
    """A viewpoint that turns slowly around the arena and follows the drone a little.

    The image has width and height; the speed is the ratio of flight time to film time.
    """

    def __init__(self, timeline: Timeline, size_px: tuple[int, int], speed: float) -> None:
        self._timeline = timeline
        self._size_px = size_px
        self._speed = speed
        film_s = (timeline.end_s - timeline.begin_s) / speed
        self._rate = min(_TURN_RAD_S, _MAX_TURN_RAD / max(film_s, 1e-3))
        self._middle = _middle(timeline.scenario)
        # In the middle of the film the camera is behind the start, so that the drone flies away from it.
        x_m, y_m, _ = start_position(timeline.scenario)
        toward = np.array((x_m, y_m)) - self._middle[:2]
        is_far = float(np.hypot(*toward)) > 0.5
        heading_rad = float(np.arctan2(toward[1], toward[0])) if is_far else radians(-120.0)
        self._first_rad = heading_rad + radians(25.0) - self._rate * film_s / 2
        self._focal_px = size_px[0] / 2 / tan(FIELD_OF_VIEW_RAD / 2)
        points = _always_visible(timeline)
        self._samples_s = np.linspace(timeline.begin_s, timeline.end_s, _SAMPLES)
        needed = [self._distance(float(time_s), points) for time_s in self._samples_s]
        reach = round(_DISTANCE_SMOOTHING_S * _SAMPLES / max(film_s, 1.0))
        self._distances_m = _smoothed(np.array(needed), reach)

    def at(self, time_s: float) -> FilmCamera:
        """The viewpoint at a time of the flight, seconds since motors on."""
        axes, target = self._axes(time_s), self._target(time_s)
        distance_m = float(np.interp(time_s, self._samples_s, self._distances_m))
        centre = (self._size_px[0] / 2, _CENTRE * self._size_px[1])
        return FilmCamera(target - distance_m * axes[2], axes, self._focal_px, centre)

    def _target(self, time_s: float) -> Floats:
        flown = self._timeline.mean_position(time_s, _SMOOTHING_S * self._speed)
        target: Floats = self._middle + _FOLLOWED * (flown - self._middle)
        return target

    def _axes(self, time_s: float) -> Floats:
        azimuth = self._first_rad + self._rate * (time_s - self._timeline.begin_s) / self._speed
        c, s = cos(ELEVATION_RAD), sin(ELEVATION_RAD)
        ahead = np.array((-c * cos(azimuth), -c * sin(azimuth), -s))
        right = np.array((-sin(azimuth), cos(azimuth), 0.0))
        return np.stack((right, np.cross(ahead, right), ahead))

    def _distance(self, time_s: float, points_m: Floats) -> float:
        """Distance from which all points, and the drone, are in the image with a margin."""
        drone_m = np.array([self._timeline.at(time_s).position_arena_m])
        offsets = (np.concatenate((points_m, drone_m)) - self._target(time_s)) @ self._axes(time_s).T
        half = np.array(self._size_px) * (_MARGIN / 2, _MARGIN * (1.0 - _CENTRE))
        needed = np.abs(offsets[:, :2]) * self._focal_px / half - offsets[:, 2:]
        return max(2.0, float(needed.max()))


def _smoothed(needed_m: Floats, reach: int) -> Floats:
    """Distances that are never below the needed ones, and change slowly."""
    reach = min(max(reach, 1), len(needed_m) // 2)
    padded = np.pad(needed_m, 2 * reach, mode="edge")
    highest = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    weights = np.hanning(2 * reach + 3)[1:-1]
    smooth: Floats = np.convolve(highest, weights / weights.sum(), mode="valid")
    return smooth


def _always_visible(timeline: Timeline) -> Floats:
    """Points that must always be in the image: around base, gates and obstacles, or the arena's corners."""
    scenario = timeline.scenario
    points = [(scenario.base.x_m, scenario.base.y_m, z_m) for z_m in (0.0, scenario.base.top_m + 0.3)]
    points += [corner for prism in scenario.prisms for corner in prism.corners()]
    for gate in scenario.all_gates:
        points += [(gate.x_m, gate.y_m, z_m) for z_m in (0.0, gate.z_m + gate.outer_height_m)]
    if not scenario.frames:
        half_x, half_y = scenario.arena.length_x_m / 2, scenario.arena.width_y_m / 2
        points += [(x * half_x, y * half_y, 0.0) for x in (-1, 1) for y in (-1, 1)]
    return np.array(points)


def _middle(scenario: Scenario) -> Floats:
    base = scenario.base
    points = np.array([*(f.position_arena_m for f in scenario.frames), (base.x_m, base.y_m, base.top_m)])
    middle: Floats = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle


def _clipped(seen: Floats) -> Floats:
    """The part of a convex polygon, in the camera's axes, that is beyond the near plane."""
    kept: list[Floats] = []
    for i, here in enumerate(seen):
        before = seen[i - 1]
        if (before[2] > NEAR_M) != (here[2] > NEAR_M):
            part = (NEAR_M - before[2]) / (here[2] - before[2])
            kept.append(before + part * (here - before))
        if here[2] > NEAR_M:
            kept.append(here)
    return np.array(kept).reshape(-1, 3)
