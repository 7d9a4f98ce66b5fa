"""The networks that propose and judge gates: their committed weights, and what the finder makes of them."""

from pathlib import Path

import cv2
import matplotlib
import numpy as np
import pytest

from framerunner.vision_evaluation.backgrounds import Backgrounds
from framerunner.vision_evaluation.camera_chain import PRESETS
from framerunner.vision_evaluation.labelled_images import labelled_images
from framerunner.vision_evaluation.scores import detect_all
from scenarios.random_scenarios import load_level
from vision.learned.crops import COLUMNS, ROWS, box_around, cut_out
from vision.learned.judge import find_outlines, judge


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    # Turned upside down, it is none of the pictures of the training.
    source = Path(matplotlib.get_data_path()) / "sample_data" / "grace_hopper.jpg"
    folder = tmp_path_factory.mktemp("photographs")
    cv2.imwrite(str(folder / "turned.png"), cv2.imread(str(source))[::-1])
    backgrounds = Backgrounds.of_folder(folder)
    return list(labelled_images(load_level("calm"), 60, 4242, PRESETS["jpeg"], backgrounds))


def test_networks_are_repeatable_and_find_most_gates_where_they_are(images):
    near = found = 0
    for one in images:
        (chances, outlines), again = (find_outlines(one.image) for _ in range(2))
        assert np.array_equal(chances, again[0])
        assert np.array_equal(outlines, again[1])
        for gate in one.gates:
            if gate.whole and 1.0 < gate.distance_m < 4.0 and gate.angle_deg < 60.0:
                corners = np.array(gate.corners_px) + np.array([159.5, 119.5])
                near += 1
                found += any(np.abs(outline - corners).max() < 4.0 for outline in outlines)
    assert near > 10
    assert found >= 0.8 * near


def test_gates_are_found_in_compressed_images_before_a_photograph_with_few_false_alarms(images):
    scores, _ = detect_all(images)
    (found,) = [row.found for row in scores.in_sum() if row.kind == "frames"]
    assert found >= 0.6
    assert scores.false_alarms["frames"] <= 0.1 * len(images)


def test_what_is_judged_moves_with_the_crop(images):
    """A gate's corners are the same whichever crop shows it, also one that is beside the image in part."""
    image = np.full((240, 320, 3), 190, np.uint8)
    corners = np.array([[3, 60], [63, 58], [63, 90], [3, 92]])
    cv2.polylines(image, [corners.astype(np.int32)], True, (20, 20, 200), 3)
    for move in ((0.0, 0.0), (4.0, -3.0), (-5.0, 2.0)):
        (chance,), (placed,) = judge(image, corners[None] + move)
        assert chance > 0.5
        assert np.abs(placed - corners).max() < 4.0


@pytest.mark.parametrize("size", [12.0, 60.0, 500.0])
def test_a_crop_shows_what_is_in_its_box(size):
    image = np.zeros((240, 320, 3), np.uint8)
    image[:, 160:] = 255
    middle = np.array([159.5, 119.5])  # between two pixels
    corners = middle + 0.5 * size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    crop = cut_out(image, box_around(corners))
    assert crop.shape == (ROWS, COLUMNS, 3)
    assert crop[:, : COLUMNS // 2 - 2].max() <= 2
    assert crop[:, COLUMNS // 2 + 2 :].min() >= 253
