"""Printed markers on the base, painted and read."""

import numpy as np
import pytest

import framerunner
from framerunner.flying.detector import base_finder, true_calibration
from framerunner.geometry.base_marker import BaseMarkers
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.vision_evaluation.base_scores import rate_base
from framerunner.vision_evaluation.camera_chain import CameraChain
from scenarios.models import Base, BaseMarker, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from sitl.camera import SimulatedCamera
from vision.base.markers import MarkerReader
from vision.types import BaseExpectation

ANYWHERE = BaseExpectation((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (9.0, 9.0, 9.0), 3.0)
MARKED = Scenario(name="marked", base=Base(marker=BaseMarker()))


def finder_of(scenario):
    return base_finder(scenario.base, true_calibration(scenario.camera))


@pytest.mark.parametrize("name", ["calm", "indoor"])  # the second one's camera has a lens, and turns
def test_markers_are_read_from_afar_and_their_corners_are_as_exact_as_stated(name):
    level = load_level(name).model_copy(update={"base_marker": BaseMarker()})
    scores = rate_base(level, 120, 8300, CameraChain())
    rows = [row for row in scores.rows() if row.images >= 4]
    assert sum(row.images * row.found for row in rows) >= 0.85 * sum(row.images for row in rows)
    assert all(row.error_p95_px < 0.5 for row in rows if row.error_p95_px is not None)
    assert all(0.3 < row.deviation_rms < 1.7 for row in rows if row.deviation_rms is not None)
    assert rows[-1].high_m > 5.0
    assert scores.others > 30
    assert scores.false_alarms == 0


def test_each_face_has_its_marker():
    camera, finder = SimulatedCamera(MARKED), finder_of(MARKED)
    for yaw, normal in ((0.0, (-1, 0)), (np.pi / 2, (0, -1)), (np.pi, (1, 0)), (-np.pi / 2, (0, 1))):
        place = (-1.5 * np.cos(yaw), -1.5 * np.sin(yaw), 0.6)
        found = finder.find(camera.render(place, quaternion_from_euler(0.0, 0.1, yaw)), ANYWHERE)
        side = found.points_m[np.abs(found.points_m[:, 2] - MARKED.base.top_m) > 0.01]
        assert side[:, :2] @ normal == pytest.approx(MARKED.base.edge_m / 2)
        assert side[:, 2].max() - side[:, 2].min() == pytest.approx(0.27)
    down = camera.render((-0.4, 0.0, 1.3), quaternion_from_euler(0.0, 1.2, 0.0))
    assert finder.find(down, ANYWHERE).points_m[:, 2] == pytest.approx(MARKED.base.top_m)


def test_apriltags_are_read_and_markers_of_others_are_not():
    tags = Scenario(name="tags", base=Base(marker=BaseMarker(family="apriltag_36h11", first=20)))
    image = SimulatedCamera(tags).render((-1.3, 0.2, 0.6), quaternion_from_euler(0.0, 0.1, -0.1))
    assert len(finder_of(tags).find(image, ANYWHERE).points_m) == 4
    assert finder_of(MARKED).find(image, ANYWHERE) is None
    others = MarkerReader(BaseMarkers("apriltag_36h11", 40, 0.27), 0.5, 0.51)
    assert others.find(image, ANYWHERE) is None


def test_a_drone_without_motion_capture_lands_by_them(monkeypatch):
    read = []
    find = MarkerReader.find

    def noted(self, image, expected):
        found = find(self, image, expected)
        read.append(found is not None)
        return found

    monkeypatch.setattr(MarkerReader, "find", noted)
    level = load_level("calm").model_copy(update={"base_marker": BaseMarker(), "sensors": "flow"})
    result = framerunner.fly(random_scenario(level, 8401))
    assert result.completed, result.reason
    assert result.landing_error_m < 0.1
    assert sum(read) >= 4
    assert sum(read) > 0.5 * len(read)
