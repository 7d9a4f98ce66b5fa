"""`framerunner vision`: the labelled images, the report and the data set."""

import json

import cv2
import pytest

from framerunner.cli import run
from framerunner.vision_evaluation.labelled_images import Disturbance, labelled_images
from scenarios.random_scenarios import load_level
from vision.detectors import new_detector


def test_the_report_compares_both_detectors(tmp_path, capsys):
    assert run(["vision", "evaluate", "--images", "40", "--seed", "5", "--out", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "vision.json").read_text())
    boxes, gates = report["detectors"]
    assert (boxes["kind"], gates["kind"]) == ("boxes", "frames")
    assert gates["frames"] >= 20
    assert gates["found"] == 1.0
    assert gates["distance_median"] < 0.02 < boxes["distance_median"]
    assert gates["deviation_rms"] < 1.5
    assert report["false_alarms"]["frames"] == 0
    assert sum(row["frames"] for row in report["by_angle_deg"] if row["kind"] == "frames") == gates["frames"]
    assert cv2.imread(str(tmp_path / "vision.png")).shape[0] > 500
    printed = capsys.readouterr().out
    assert "by distance" in printed
    assert "false alarms" in printed


def test_the_data_set_has_what_is_in_each_image(tmp_path):
    options = ["--level", "crowded", "--images", "6", "--noise", "3", "--jpeg", "95"]
    assert run(["vision", "dataset", str(tmp_path), *options]) == 0
    labels = json.loads((tmp_path / "labels.json").read_text())
    assert len(labels) == 6
    for entry in labels:
        assert cv2.imread(str(tmp_path / entry["image"])).shape == (240, 320, 3)
        assert len(entry["frames"]) == 5
        for gate in entry["frames"]:
            assert len(gate["corners_px"]) in (0, 4)
    before = (tmp_path / "labels.json").read_bytes()
    assert run(["vision", "dataset", str(tmp_path), *options]) == 2
    assert (tmp_path / "labels.json").read_bytes() == before


@pytest.mark.parametrize(
    "disturbance", [Disturbance(), Disturbance(noise=3, blur_px=0.6, light=0.7, jpeg=98)]
)
def test_gates_of_crowded_scenes_are_found_where_they_are(disturbance):
    find = None
    found = whole = 0
    for labelled in labelled_images(load_level("crowded"), 60, 40, disturbance):
        find = find or new_detector("frames", focal_px=labelled.focal_px)
        sightings = find(labelled.image, None).frames
        for label in labelled.gates:
            if label.whole and label.distance_m < 4 and label.angle_deg < 70:
                whole += 1
                found += any(
                    sighting.colour == label.colour
                    and all(
                        corner is not None
                        and abs(corner.right_px - right) < 5 * corner.std_right_px
                        and abs(corner.down_px - down) < 5 * corner.std_down_px
                        for corner, (right, down) in zip(sighting.corners, label.corners_px, strict=True)
                    )
                    for sighting in sightings
                )
    assert whole >= 12
    assert found >= whole - (disturbance != Disturbance())


def test_the_same_seed_gives_the_same_images():
    one, two = (list(labelled_images(load_level("calm"), 3, 9, Disturbance(noise=2))) for _ in range(2))
    for a, b in zip(one, two, strict=True):
        assert (a.image == b.image).all()
        assert a.gates == b.gates


def test_a_bad_option_is_named(capsys):
    assert run(["vision", "evaluate", "--jpeg", "0"]) == 2
    assert "--jpeg 0" in capsys.readouterr().err
