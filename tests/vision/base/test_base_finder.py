"""The base finder on painted images of known geometry."""

from dataclasses import replace
from math import atan2, cos, hypot, pi, radians, sin

import cv2
import numpy as np
import pytest

from framerunner.flying.detector import base_shape, true_calibration
from framerunner.geometry.rotations import multiply, quaternion_from_euler, quaternion_from_yaw
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.vision_evaluation.base_scores import rate_base
from framerunner.vision_evaluation.camera_chain import CameraChain
from offboard.navigation.camera_model import CameraModel
from scenarios.models import Base, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from sitl.camera import SimulatedCamera
from vision.base.finder import BaseFinder
from vision.base.model import BaseShape
from vision.calibration.lens import Lens
from vision.types import BaseExpectation, BaseSighting, Image

BASE = Base(x_m=0.5, y_m=-0.3)
SCENARIO = Scenario(name="base", base=BASE)
MODEL = CameraModel.of(SCENARIO.camera)
FINDER = BaseFinder(base_shape(BASE), SCENARIO.camera.focal_px)
FINE = 4  # the painter's edges are on whole pixels: images are painted larger, and made small by their mean
POSES = [
    (away, around, BASE.top_m + above * away, aside)
    for away in (1.2, 2.0, 3.0)
    for around, above, aside in ((0.2, 0.3, 0.1), (1.0, 0.25, -0.2), (2.6, 0.4, 0.3), (-2.0, 0.2, 0.0))
]


def camera_of(scenario: Scenario) -> SimulatedCamera:
    camera = scenario.camera
    large = {"width_px": FINE * camera.width_px, "height_px": FINE * camera.height_px}
    return SimulatedCamera(scenario.model_copy(update={"camera": camera.model_copy(update=large)}))


CAMERA = camera_of(SCENARIO)


def pose(away: float, around: float, height: float, aside: float) -> tuple[Vec3, Quaternion]:
    """A drone that looks towards the base."""
    x, y = BASE.x_m + away * cos(around), BASE.y_m + away * sin(around)
    yaw = atan2(BASE.y_m - y, BASE.x_m - x) + aside
    return (x, y, height), quaternion_from_euler(0.05, -0.04, yaw)


def painted(position: Vec3, attitude: Quaternion, camera: SimulatedCamera = CAMERA) -> Image:
    large = camera.render(position, attitude)
    return np.asarray(cv2.resize(large, None, fx=1 / FINE, fy=1 / FINE, interpolation=cv2.INTER_AREA))


def expectation(
    position: Vec3,
    attitude: Quaternion,
    *,
    off_m: Vec3 = (0.0, 0.0, 0.0),
    turn: float = 0.0,
    std: float = 1.0,
) -> BaseExpectation:
    """What is expected of a pose, with errors; `std` is of them, in units of 0.15 m and 2 degrees."""
    place = MODEL.pose(position, attitude).position_m
    x, y, z = (p - b + off for p, b, off in zip(place, (BASE.x_m, BASE.y_m, 0.0), off_m, strict=True))
    turned = multiply(quaternion_from_yaw(turn), attitude)
    return BaseExpectation((x, y, z), turned, (0.15 * std, 0.15 * std, 0.05), radians(2.0) * std)


def errors(sighting: BaseSighting, position: Vec3, attitude: Quaternion) -> list[float]:
    """Of the corners' coordinates in the image, pixels."""
    found: list[float] = []
    for point, pixel in zip(sighting.points_m.tolist(), sighting.pixels, strict=True):
        at = (BASE.x_m + point[0], BASE.y_m + point[1], point[2])
        true = MODEL.project(MODEL.pose(position, attitude), at)
        if true is not None and MODEL.contains(*true):
            found += np.abs(pixel - true).tolist()
    return found


def test_corners_are_exact_to_a_part_of_a_pixel() -> None:
    off: list[float] = []
    for one in POSES:
        position, attitude = pose(*one)
        expected = expectation(position, attitude, off_m=(0.1, -0.12, 0.03), turn=0.03)
        sighting = FINDER.find(painted(position, attitude), expected)
        assert sighting is not None, one
        off += errors(sighting, position, attitude)
    assert len(off) > 100
    assert np.median(off) < 0.2
    assert np.percentile(off, 95) < 0.8


@pytest.mark.parametrize("one", POSES[4:8])
def test_it_is_found_where_little_is_known(one: tuple[float, float, float, float]) -> None:
    position, attitude = pose(*one)
    expected = expectation(position, attitude, off_m=(0.5, 0.4, 0.05), turn=radians(8.0), std=4.0)
    sighting = FINDER.find(painted(position, attitude), expected)
    assert sighting is not None
    assert np.median(errors(sighting, position, attitude)) < 0.3


@pytest.mark.parametrize(
    "worse",
    [
        lambda image: cv2.GaussianBlur(image, (0, 0), 0.9),
        lambda image: (image * 0.4).astype(np.uint8),
        lambda image: np.clip(image + np.random.default_rng(3).normal(0, 6, image.shape), 0, 255).astype(
            np.uint8
        ),
        lambda image: cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])[1], 1),
    ],
    ids=["blur", "dark", "noise", "jpeg"],
)
def test_it_is_found_in_worse_images(worse) -> None:  # type: ignore[no-untyped-def]
    off: list[float] = []
    for one in POSES[:8]:
        position, attitude = pose(*one)
        expected = expectation(position, attitude, off_m=(0.05, 0.08, -0.02), turn=-0.02)
        sighting = FINDER.find(worse(painted(position, attitude)), expected)
        if sighting is not None:
            off.append(float(np.median(errors(sighting, position, attitude))))
    assert len(off) >= 6
    assert np.median(off) < 0.4


def test_its_covariance_is_that_of_its_errors() -> None:
    deviations: list[float] = []
    for one in POSES:
        position, attitude = pose(*one)
        sighting = FINDER.find(painted(position, attitude), expectation(position, attitude, turn=0.02))
        assert sighting is not None
        off = np.array(
            [
                MODEL.project(MODEL.pose(position, attitude), (BASE.x_m + x, BASE.y_m + y, z))
                for x, y, z in sighting.points_m.tolist()
            ]
        )
        residual = (sighting.pixels - off).ravel()
        squared = residual @ np.linalg.solve(sighting.covariance_px2, residual)
        deviations.append(float(squared) / 6.0)  # a rigid cube moves in six ways
    assert 0.05 < np.median(deviations) < 3.0


def test_a_lens_is_corrected() -> None:
    scenario = random_scenario(load_level("indoor"), 71)
    scenario = scenario.model_copy(update={"base": BASE, "patches": ()})
    lens = Lens(true_calibration(scenario.camera))
    finder = BaseFinder(base_shape(BASE), scenario.camera.focal_px, lens)
    camera = SimulatedCamera(scenario)
    off: list[float] = []
    for one in POSES[:8]:
        position, attitude = pose(*one)
        sighting = finder.find(camera.render(position, attitude), expectation(position, attitude, turn=0.02))
        if sighting is not None:
            off += errors(sighting, position, attitude)
    assert len(off) > 60
    assert np.median(off) < 0.5


def test_a_base_without_a_mark_is_found() -> None:
    bare = BASE.model_copy(update={"mark_share": 0.0})
    camera = camera_of(SCENARIO.model_copy(update={"base": bare}))
    finder = BaseFinder(BaseShape(bare.edge_m, bare.top_m), SCENARIO.camera.focal_px)
    position, attitude = pose(*POSES[5])
    sighting = finder.find(painted(position, attitude, camera), expectation(position, attitude, turn=0.03))
    assert sighting is not None
    assert len(sighting.points_m) <= 8
    assert np.median(errors(sighting, position, attitude)) < 0.3


@pytest.mark.parametrize("size_m", [0.35, 0.8])
def test_a_base_of_another_size_is_not_taken_for_it(size_m: float) -> None:
    other = BASE.model_copy(update={"edge_m": size_m, "top_m": size_m})
    camera = camera_of(SCENARIO.model_copy(update={"base": other}))
    for one in POSES:
        position, attitude = pose(*one)
        assert FINDER.find(painted(position, attitude, camera), expectation(position, attitude)) is None


def test_nothing_is_found_where_nothing_is() -> None:
    assert FINDER.find(np.full((240, 320, 3), 90, np.uint8), expectation(*pose(*POSES[0]))) is None
    stream = np.random.default_rng(5)
    for one in POSES:
        noise = stream.integers(0, 256, (240, 320, 3)).astype(np.uint8)
        assert FINDER.find(noise, expectation(*pose(*one))) is None


def test_what_is_behind_the_camera_is_not_looked_for() -> None:
    position, attitude = pose(*POSES[0])
    behind = multiply(quaternion_from_yaw(pi), attitude)
    expected = replace(expectation(position, behind), eye_std_m=(0.02, 0.02, 0.02), heading_std_rad=0.02)
    assert FINDER.find(painted(position, attitude), expected) is None


def test_it_is_rated_on_a_level() -> None:
    scores = rate_base(load_level("crowded"), 60, 3, CameraChain())
    assert scores.others >= 25
    assert scores.false_alarms == 0
    assert sum(found for _, found, _, _ in scores.samples) > 0.5 * len(scores.samples)
    assert hypot(*(row.images for row in scores.rows())) > 0
