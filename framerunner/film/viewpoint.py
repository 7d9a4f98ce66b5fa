"""From where the arena is looked at, and how it comes onto the picture."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import TYPE_CHECKING

import numpy as np

from framerunner.film.story import Floats
from scenarios.models import Scenario, start_position

if TYPE_CHECKING:
    from framerunner.film.story import Story

ELEVATION_RAD = radians(27.0)
FIELD_OF_VIEW_RAD = radians(34.0)
NEAR_M = 0.3
_TURN_RAD_S = radians(5.0)  # of the film's time: slow enough not to make anybody dizzy
_TURN_AT_MOST_RAD = radians(110.0)
_FOLLOWED = 0.35  # how far the view goes along with the drone, 0 stands still, 1 follows it
_SMOOTH_S = 2.0  # of the film's time
_MARGIN = 0.9  # of half the picture
_CENTRE = 0.53  # of the picture's height: there is a title above
_SAMPLES = 120
_CALM_S = 2.5  # of the film's time: it comes nearer and goes farther no quicker


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """An eye with a pinhole before it.

    Attributes:
        eye_m: arena axes, shape (3,).
        axes: rows are right, down and ahead of the picture in arena axes, shape (3, 3).
        focal_px: focal length.
        centre_px: where the line of sight meets the picture.
    """

    eye_m: Floats
    axes: Floats
    focal_px: float
    centre_px: tuple[float, float]

    def seen(self, points_m: Floats) -> Floats:
        """Points in the eye's own axes (right, down, ahead), metres, shape (n, 3)."""
        turned: Floats = (points_m - self.eye_m) @ self.axes.T
        return turned

    def project(self, points_m: Floats) -> Floats:
        """Where points come onto the picture, pixels, shape (n, 2); NaN for those behind the eye."""
        seen = self.seen(points_m)
        ahead = np.where(seen[:, 2] > NEAR_M, seen[:, 2], np.nan)
        pixels: Floats = self.focal_px * seen[:, :2] / ahead[:, None] + np.array(self.centre_px)
        return pixels

    def polygon(self, corners_m: Floats) -> Floats:
        """Corners of a convex polygon on the picture, cut where it reaches behind the eye, shape (k, 2)."""
        seen = self.seen(corners_m)
        if float(seen[:, 2].min()) <= NEAR_M:
            seen = _cut_near(seen)
        pixels: Floats = self.focal_px * seen[:, :2] / seen[:, 2:] + np.array(self.centre_px)
        return pixels

    def scaled(self, factor: float) -> Viewpoint:
        """The same for a picture that many times as large."""
        u, v = self.centre_px
        return Viewpoint(self.eye_m, self.axes, self.focal_px * factor, (u * factor, v * factor))


class Flyby:
    """A viewpoint that turns slowly around the arena and goes along a little with the drone.

    Args:
        story: what is shown.
        size_px: width and height of the picture.
        speed: flight time a film time.
    """

    def __init__(self, story: Story, size_px: tuple[int, int], speed: float) -> None:
        self._story = story
        self._size_px = size_px
        self._speed = speed
        film_s = (story.end_s - story.begin_s) / speed
        self._rate = min(_TURN_RAD_S, _TURN_AT_MOST_RAD / max(film_s, 1e-3))
        self._middle = _middle(story.scenario)
        # At the film's middle the arena is seen over the drone's start, so that it flies away from the eye.
        x_m, y_m, _ = start_position(story.scenario)
        toward = np.array((x_m, y_m)) - self._middle[:2]
        heading = (
            float(np.arctan2(toward[1], toward[0])) if float(np.hypot(*toward)) > 0.5 else radians(-120.0)
        )
        self._first_rad = heading + radians(25.0) - self._rate * film_s / 2
        self._focal_px = size_px[0] / 2 / tan(FIELD_OF_VIEW_RAD / 2)
        things = _things(story)
        self._samples_s = np.linspace(story.begin_s, story.end_s, _SAMPLES)
        needed = [self._distance(float(time_s), things) for time_s in self._samples_s]
        self._distances_m = _calmed(np.array(needed), round(_CALM_S * _SAMPLES / max(film_s, 1.0)))

    def at(self, time_s: float) -> Viewpoint:
        """From where it is looked at a time of the flight, seconds since motors on."""
        axes, target = self._axes(time_s), self._target(time_s)
        distance_m = float(np.interp(time_s, self._samples_s, self._distances_m))
        centre = (self._size_px[0] / 2, _CENTRE * self._size_px[1])
        return Viewpoint(target - distance_m * axes[2], axes, self._focal_px, centre)

    def _target(self, time_s: float) -> Floats:
        flown = self._story.mean_position(time_s, _SMOOTH_S * self._speed)
        target: Floats = self._middle + _FOLLOWED * (flown - self._middle)
        return target

    def _axes(self, time_s: float) -> Floats:
        azimuth = self._first_rad + self._rate * (time_s - self._story.begin_s) / self._speed
        c, s = cos(ELEVATION_RAD), sin(ELEVATION_RAD)
        ahead = np.array((-c * cos(azimuth), -c * sin(azimuth), -s))
        right = np.array((-sin(azimuth), cos(azimuth), 0.0))
        return np.stack((right, np.cross(ahead, right), ahead))

    def _distance(self, time_s: float, things_m: Floats) -> float:
        """How far away all things, and the drone, come onto the picture with a margin."""
        place = np.array([self._story.at(time_s).position_arena_m])
        offsets = (np.concatenate((things_m, place)) - self._target(time_s)) @ self._axes(time_s).T
        half = np.array(self._size_px) * (_MARGIN / 2, _MARGIN * (1.0 - _CENTRE))
        needed = np.abs(offsets[:, :2]) * self._focal_px / half - offsets[:, 2:]
        return max(2.0, float(needed.max()))


def _calmed(needed_m: Floats, reach: int) -> Floats:
    """Distances that are never too small, and change slowly."""
    reach = min(max(reach, 1), len(needed_m) // 2)
    padded = np.pad(needed_m, 2 * reach, mode="edge")
    highest = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    weights = np.hanning(2 * reach + 3)[1:-1]
    smooth: Floats = np.convolve(highest, weights / weights.sum(), mode="valid")
    return smooth


def _things(story: Story) -> Floats:
    """What must be seen all the time: base and frames with a little around them."""
    scenario = story.scenario
    points = [(scenario.base.x_m, scenario.base.y_m, z_m) for z_m in (0.0, scenario.base.top_m + 0.3)]
    for frame in scenario.frames:
        points += [(frame.x_m, frame.y_m, z_m) for z_m in (0.0, frame.z_m + frame.outer_height_m)]
    if not scenario.frames:
        half_x, half_y = scenario.arena.length_x_m / 2, scenario.arena.width_y_m / 2
        points += [(x * half_x, y * half_y, 0.0) for x in (-1, 1) for y in (-1, 1)]
    return np.array(points)


def _middle(scenario: Scenario) -> Floats:
    places = [(frame.x_m, frame.y_m, frame.z_m) for frame in scenario.frames]
    places.append((scenario.base.x_m, scenario.base.y_m, scenario.base.top_m))
    array = np.array(places)
    middle: Floats = (array.min(axis=0) + array.max(axis=0)) / 2
    return middle


def _cut_near(seen: Floats) -> Floats:
    kept: list[Floats] = []
    for i, here in enumerate(seen):
        before = seen[i - 1]
        if (before[2] > NEAR_M) != (here[2] > NEAR_M):
            part = (NEAR_M - before[2]) / (here[2] - before[2])
            kept.append(before + part * (here - before))
        if here[2] > NEAR_M:
            kept.append(here)
    return np.array(kept).reshape(-1, 3)
