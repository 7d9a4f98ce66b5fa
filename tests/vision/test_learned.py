"""The network that proposes gates: its committed weights, and what the finder makes of them."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest

from framerunner.vision_evaluation.backgrounds import Backgrounds
from framerunner.vision_evaluation.camera_chain import PRESETS
from framerunner.vision_evaluation.labelled_images import labelled_images
from framerunner.vision_evaluation.scores import detect_all
from scenarios.random_scenarios import load_level
from vision.learned.proposals import GateProposals


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    # Turned upside down, it is none of the pictures of the training.
    import cv2

    source = Path(matplotlib.get_data_path()) / "sample_data" / "grace_hopper.jpg"
    folder = tmp_path_factory.mktemp("photographs")
    cv2.imwrite(str(folder / "turned.png"), cv2.imread(str(source))[::-1])
    backgrounds = Backgrounds.of_folder(folder)
    return list(labelled_images(load_level("calm"), 60, 4242, PRESETS["jpeg"], backgrounds))


def test_the_network_is_repeatable_and_proposes_most_gates(images):
    near = found = 0
    for one in images:
        proposals, again = (GateProposals(one.image, 0.2) for _ in range(2))
        assert np.array_equal(proposals.chances, again.chances)
        assert np.array_equal(proposals.corners, again.corners)
        for gate in one.gates:
            if gate.whole and 1.0 < gate.distance_m < 4.0 and gate.angle_deg < 60.0:
                column, row = np.mean(gate.corners_px, axis=0) + np.array([159.5, 119.5])
                near += 1
                found += proposals.chance_near(column, row) > 0.2
    assert near > 10
    assert found >= 0.7 * near


def test_it_finds_more_gates_in_compressed_images_with_no_more_false_alarms(images):
    scores, _ = detect_all(images, "learned")
    found = {row.kind: row.found for row in scores.in_sum()}
    assert found["learned frames"] >= found["frames"]
    assert scores.false_alarms["learned frames"] <= scores.false_alarms["frames"]
