"""Sightings made of corners, as a detector of others makes them."""

from math import hypot

import numpy as np
import pytest

import framerunner
from framerunner.vision_evaluation.camera_chain import CameraChain
from framerunner.vision_evaluation.labelled_images import labelled_images
from scenarios.random_scenarios import load_level
from vision.calibration.lens import Lens


def test_a_sighting_has_the_pose_of_its_corners_behind_any_lens():
    checked = 0
    for one in labelled_images(load_level("indoor"), 20, 90, CameraChain()):
        lens, maker = Lens(one.calibration), framerunner.SightingMaker(one.calibration, one.shapes)
        height, width = one.image.shape[:2]
        for gate in one.gates:
            if gate.whole and gate.angle_deg < 75:
                middle = np.array([(width - 1) / 2, (height - 1) / 2])
                seen = lens.all_seen(np.array(gate.corners_px)) + middle
                sighting = maker.sighting(gate.colour, seen.tolist(), 0.3)
                places = [(corner.right_px, corner.down_px) for corner in sighting.corners]
                assert np.array(places) == pytest.approx(np.array(gate.corners_px), abs=0.05)
                assert hypot(*sighting.poses[0].position_flu_m) == pytest.approx(gate.distance_m, rel=0.01)
                tilts = [np.dot(pose.normal_flu, gate.normal_flu) for pose in sighting.poses]
                assert max(tilts) > 0.98
                checked += 1
    assert checked >= 8


def test_corners_of_no_upright_gate_have_no_pose():
    calibration = framerunner.Calibration.ideal(320, 240, 160.0)
    sighting = framerunner.SightingMaker(calibration).sighting(
        "red", [(100, 100), (120, 100), (200, 101), (90, 99)]
    )
    assert sighting.poses == ()
    assert len(sighting.corners) == 4
