"""How well the base is found: in images from all around it, and not in images turned away from it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import atan2, cos, hypot, pi, radians, sin

import numpy as np

from framerunner.flying.detector import base_finder, true_calibration
from framerunner.geometry.rotations import multiply, quaternion_from_euler, quaternion_from_yaw
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.vision_evaluation.camera_chain import CLIP_IMAGES, CameraChain
from offboard.navigation.camera_model import CameraModel
from scenarios.models import Scenario
from scenarios.random_scenarios import Level, random_scenario
from sitl.camera import SimulatedCamera
from vision.types import BaseExpectation, BaseSighting

DISTANCES_M = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0)
_NEAREST_M = 0.5
_HEIGHTS_M = (0.15, 1.3)  # of the drone above the base
_ASIDE_RAD, _TILT_RAD = radians(35.0), radians(5.0)
_EXPECTED_STD_M: Vec3 = (0.15, 0.15, 0.05)
_EXPECTED_STD_RAD = radians(2.0)
_LEAST_CORNERS = 3  # in the image, for the base to be in view
IMAGES_OF_A_SCENE = 5


@dataclass(frozen=True, slots=True)
class BaseRow:
    """The images with the base in view in a range of distances; errors are None if it was never found."""

    low_m: float
    high_m: float
    images: int
    found: float | None  # share
    error_median_px: float | None  # of the corners' coordinates that are in the image
    error_p95_px: float | None
    deviation_rms: float | None  # in standard deviations


@dataclass(slots=True)
class BaseScores:
    """What was counted.

    Attributes:
        samples: of each image with the base in view: distance, whether it was found, errors of its corners'
            coordinates in pixels, and in standard deviations.
        others: images without the base where it was expected.
        false_alarms: how many of them showed it all the same.
        times_ms: of each search.
    """

    samples: list[tuple[float, bool, list[float], list[float]]] = field(default_factory=list)
    others: int = 0
    false_alarms: int = 0
    times_ms: list[float] = field(default_factory=list)

    def rows(self) -> list[BaseRow]:
        """By distance."""
        return [self._row(low, high) for low, high in pairwise(DISTANCES_M)]

    def _row(self, low_m: float, high_m: float) -> BaseRow:
        samples = [sample for sample in self.samples if low_m <= sample[0] < high_m]
        errors = np.abs([error for sample in samples for error in sample[2]])
        deviations = np.array([deviation for sample in samples for deviation in sample[3]])
        seen = len(errors) > 0
        return BaseRow(
            low_m,
            high_m,
            len(samples),
            sum(sample[1] for sample in samples) / len(samples) if samples else None,
            float(np.median(errors)) if seen else None,
            float(np.percentile(errors, 95)) if seen else None,
            float(np.sqrt(np.mean(deviations**2))) if seen else None,
        )


def rate_base(level: Level, images: int, seed: int, chain: CameraChain) -> BaseScores:
    """Look for the base in images of a level, half of which are turned away from it.

    The drone's place is expected within some errors, as it is known on the way home.
    """
    scores = BaseScores()
    stream = np.random.Generator(np.random.PCG64([seed, 3]))
    view: _BaseView | None = None
    for number in range(images // 2):
        if view is None or number % IMAGES_OF_A_SCENE == 0:
            drawn = seed + number // IMAGES_OF_A_SCENE
            view = _BaseView(chain.applied_to(random_scenario(level, drawn), stream), drawn)
        position_m, attitude = view.draw_pose(stream)
        expected = view.expectation(position_m, attitude, stream)
        image = chain.compressed([view.camera.render(position_m, attitude)] * CLIP_IMAGES)
        begun_s = time.thread_time()
        sighting = view.finder.find(image, expected)
        scores.times_ms.append(1e3 * (time.thread_time() - begun_s))
        if view.corners_in_view(position_m, attitude) >= _LEAST_CORNERS:
            errors, deviations = view.errors(position_m, attitude, sighting)
            away_m = hypot(expected.eye_m[0], expected.eye_m[1])
            scores.samples.append((away_m, sighting is not None, errors, deviations))
        turned_away = multiply(quaternion_from_yaw(pi), attitude)
        if view.corners_in_view(position_m, turned_away) == 0:
            image = chain.compressed([view.camera.render(position_m, turned_away)] * CLIP_IMAGES)
            scores.others += 1
            scores.false_alarms += view.finder.find(image, expected) is not None
    return scores


class _BaseView:
    """A scenario's base and its camera."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self._scenario = scenario
        self.camera = SimulatedCamera(scenario, seed)
        self._model = CameraModel.of(scenario.camera)
        self.finder = base_finder(scenario.base, true_calibration(scenario.camera))

    def draw_pose(self, stream: np.random.Generator) -> tuple[Vec3, Quaternion]:
        """A pose of the drone inside the arena, turned to the base."""
        base, arena = self._scenario.base, self._scenario.arena
        while True:
            away_m, around = stream.uniform(_NEAREST_M, DISTANCES_M[-1]), stream.uniform(-pi, pi)
            x, y = base.x_m + away_m * cos(around), base.y_m + away_m * sin(around)
            if abs(x) < arena.length_x_m / 2 and abs(y) < arena.width_y_m / 2:
                break
        z = base.top_m + stream.uniform(*_HEIGHTS_M)
        yaw = atan2(base.y_m - y, base.x_m - x) + stream.uniform(-_ASIDE_RAD, _ASIDE_RAD)
        roll, pitch = (float(angle) for angle in stream.normal(0.0, _TILT_RAD, 2))
        return (x, y, z), quaternion_from_euler(roll, pitch, yaw)

    def expectation(
        self, position_m: Vec3, attitude: Quaternion, stream: np.random.Generator
    ) -> BaseExpectation:
        """What is expected of a pose that is known with errors."""
        base = self._scenario.base
        x, y, z = self._model.pose(position_m, attitude).position_m
        dx, dy, dz = stream.normal(0.0, _EXPECTED_STD_M).tolist()
        turned = multiply(quaternion_from_yaw(float(stream.normal(0.0, _EXPECTED_STD_RAD))), attitude)
        eye_m = (x - base.x_m + dx, y - base.y_m + dy, z + dz)
        return BaseExpectation(eye_m, turned, _EXPECTED_STD_M, _EXPECTED_STD_RAD)

    def corners_in_view(self, position_m: Vec3, attitude: Quaternion) -> int:
        """How many of the eight corners are in the image."""
        base = self._scenario.base
        half_m = base.edge_m / 2
        corners = [(x, y, z) for x in (-half_m, half_m) for y in (-half_m, half_m) for z in (0.0, base.top_m)]
        return sum(self._is_inside(self._project(position_m, attitude, corner)) for corner in corners)

    def errors(
        self, position_m: Vec3, attitude: Quaternion, sighting: BaseSighting | None
    ) -> tuple[list[float], list[float]]:
        """Of the corners' coordinates in the image: in pixels, and in standard deviations."""
        errors: list[float] = []
        deviations: list[float] = []
        if sighting is not None:
            stds = np.sqrt(np.diag(sighting.covariance_px2)).reshape(-1, 2)
            for point, pixel, std in zip(sighting.points_m, sighting.pixels, stds, strict=True):
                true = self._project(position_m, attitude, point.tolist())
                if true is not None and self._is_inside(true):
                    off = pixel - np.array(true)
                    errors += off.tolist()
                    deviations += (off / std).tolist()
        return errors, deviations

    def _project(
        self, position_m: Vec3, attitude: Quaternion, point_m: Sequence[float]
    ) -> tuple[float, float] | None:
        base, (x, y, z) = self._scenario.base, point_m
        return self._model.project(self._model.pose(position_m, attitude), (base.x_m + x, base.y_m + y, z))

    def _is_inside(self, pixel: tuple[float, float] | None) -> bool:
        return pixel is not None and self._model.contains(*pixel)
