"""`framerunner vision`: the labelled images, the report and the data set."""

import json
from math import atan
from pathlib import Path

import cv2
import numpy as np
import pytest
import skimage

from framerunner.cli import run
from framerunner.geometry.gate_shape import PAPER_GATE, GateShape
from framerunner.geometry.rotations import quaternion_from_euler, rotation, rotation_rows
from framerunner.vision_evaluation.backgrounds import Backgrounds
from framerunner.vision_evaluation.camera_chain import PRESETS, CameraChain
from framerunner.vision_evaluation.labelled_images import labelled_images
from framerunner.vision_evaluation.openings import opening_of, outline_of
from framerunner.vision_evaluation.own_pictures import OwnPictures
from framerunner.vision_evaluation.scores import RATED_ANGLE_DEG, detect_all
from scenarios.models import Camera
from scenarios.random_scenarios import load_level
from sitl.camera_projection import Pinhole
from vision.calibration.lens import Lens
from vision.detectors import new_detector
from vision.types import GateCorner


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


TII_SHAPE = ("--opening", "0.38", "0.18", "--bar", "0.02")


def _write_tii_flight(folder, level, count):
    """Painted pictures as the data set of TII has them; all gates in view."""
    pictures, texts = folder / "camera_flight", folder / "label_flight"
    pictures.mkdir()
    texts.mkdir()
    labelled = []
    for number, one in enumerate(labelled_images(load_level(level), count, 70, CameraChain())):
        lens, size = Lens(one.calibration), np.array(one.image.shape[1::-1])
        cv2.imwrite(str(pictures / f"{number:05d}.png"), one.image)
        lines = []
        for gate in one.gates:
            if gate.colour == "red" and gate.seen and gate.corners_px:
                opening = opening_of([GateCorner(*place, 1, 1) for place in gate.corners_px], PAPER_GATE)
                seen = lens.all_seen(np.array([(corner.right_px, corner.down_px) for corner in opening]))
                shares = (seen + size / 2) / size
                inside = ((shares >= 0) & (shares <= 1)).all(axis=1)
                clipped = np.where(inside[:, None], shares, 0.0)
                low, high = np.clip([shares.min(axis=0), shares.max(axis=0)], 0, 1)
                words = [0, *(low + high) / 2, *(high - low)]
                words += [word for k in range(4) for word in (*clipped[k], 2 * inside[k])]
                lines.append(" ".join(f"{word:.7g}" for word in words))
                labelled.append(gate)
        (texts / f"{number:05d}.txt").write_text("\n".join(lines))
        camera = one.calibration
    matrix = [[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]]
    (folder / "calib.json").write_text(json.dumps({"mtx": matrix, "dist": [camera.distortion]}))
    return labelled


@pytest.mark.parametrize(("level", "count"), [("calm", 25), ("indoor", 5)])  # those of one lens
def test_labels_of_the_tii_data_set_are_rated_by_the_corners_of_openings(tmp_path, capsys, level, count):
    expected = _write_tii_flight(tmp_path, level, count)
    (tmp_path / "camera_flight" / "99999.png").write_bytes(
        (tmp_path / "camera_flight/00000.png").read_bytes()
    )
    command = ["vision", "labels", str(tmp_path), "--from", "tii", *TII_SHAPE]
    command += ["--calibration", str(tmp_path / "calib.json")]
    assert run(command) == 0
    assert "1 pictures have no text file" in capsys.readouterr().err
    assert run(command) == 2  # it is not overwritten
    images = list(OwnPictures.of_folder(tmp_path).images())
    whole = [gate for image in images for gate in image.gates if gate.whole]
    assert len(whole) >= 0.9 * sum(gate.whole for gate in expected) > 0
    for gate in whole:
        assert min(abs(gate.distance_m / other.distance_m - 1) for other in expected) < 0.01
    out = tmp_path / "out"
    assert run(["vision", "evaluate", "--labelled", str(tmp_path), "--out", str(out)]) == 0
    frames = json.loads((out / "vision.json").read_text())["detectors"][1]
    assert frames["frames"] >= 2
    assert frames["found"] == 1.0
    assert frames["distance_median"] < 0.02
    assert frames["deviation_rms"] < 2.0


def test_corners_of_thick_bars_are_compared_at_the_opening():
    shape = GateShape(2.1, 2.1, 0.3, 0.3)
    outline = [GateCorner(x, y, 0.2, 0.3) for x, y in ((-60, -50), (55, -62), (58, 66), (-62, 49))]
    opening = opening_of(outline, shape)
    back = outline_of([(corner.right_px, corner.down_px) for corner in opening], shape)
    assert np.array(back) == pytest.approx(np.array([(c.right_px, c.down_px) for c in outline]), abs=1e-3)
    assert all(corner.right_px**2 < seen.right_px**2 for corner, seen in zip(opening, outline, strict=True))
    assert all(0.1 < corner.std_right_px < 0.2 for corner in opening)


@pytest.mark.parametrize("line", ["0 0.5 0.5 0.1", "0 a b c d" + " 0.5" * 12])
def test_a_line_that_is_no_label_is_named(tmp_path, capsys, line):
    _write_tii_flight(tmp_path, "calm", 1)
    (tmp_path / "label_flight" / "00000.txt").write_text(f"\n{line}\n")
    command = ["vision", "labels", str(tmp_path), "--from", "tii", *TII_SHAPE]
    assert run([*command, "--calibration", str(tmp_path / "calib.json")]) == 2
    assert "00000.txt:2" in capsys.readouterr().err
    assert not (tmp_path / "labels.json").exists()


def _write_own_pictures(folder, count):
    """Painted pictures, and their labels as one would click them; the gates that are labelled."""
    camera, images, gates = None, [], []
    for number, one in enumerate(labelled_images(load_level("calm"), count, 70, CameraChain())):
        camera = one.calibration
        cv2.imwrite(str(folder / f"{number}.png"), one.image)
        seen = [gate for gate in one.gates if gate.seen and gate.corners_px]
        clicked = []
        for gate in seen:
            corners = [(x + camera.cx_px, y + camera.cy_px) for x, y in gate.corners_px]
            clicked.append({"colour": gate.colour, "corners": corners, "whole": gate.whole})
        images.append({"image": f"{number}.png", "frames": clicked})
        gates += seen
    labels = {"focal_px": camera.fx_px, "images": images}
    (folder / "labels.json").write_text(json.dumps(labels))
    return labels, gates


def test_own_pictures_are_rated_by_the_corners_of_their_gates(tmp_path):
    _, gates = _write_own_pictures(tmp_path, 15)
    known = [gate for image in OwnPictures.of_folder(tmp_path).images() for gate in image.gates]
    assert [gate.distance_m for gate in known] == pytest.approx([gate.distance_m for gate in gates], rel=1e-3)
    out = tmp_path / "out"
    assert run(["vision", "evaluate", "--labelled", str(tmp_path), "--out", str(out)]) == 0
    report = json.loads((out / "vision.json").read_text())
    assert report["images"] == 15
    assert report["detectors"][1]["found"] == 1.0
    assert report["false_alarms"]["frames"] == 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"focal_px": None}, "focal_px or calibration"),
        ({"images": [{"image": "none.png"}]}, "none.png"),
        ({"images": [{"image": "0.png", "frames": [{"colour": "pink", "corners": [[0, 0]] * 4}]}]}, "colour"),
        ({"images": [{"image": "0.png", "frames": [{"colour": "red", "corners": [[5, 5]] * 4}]}]}, "corners"),
    ],
)
def test_labels_that_cannot_be_used_are_named(tmp_path, capsys, change, said):
    labels, _ = _write_own_pictures(tmp_path, 1)
    (tmp_path / "labels.json").write_text(json.dumps(labels | change))
    assert run(["vision", "evaluate", "--labelled", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("chain", [CameraChain(), CameraChain(noise=3, blur_px=(0.6, 0.6), light=(0.7, 0.7))])
def test_gates_of_crowded_scenes_are_found_where_they_are(chain):
    find = None
    found = whole = 0
    for labelled in labelled_images(load_level("crowded"), 60, 40, chain):
        find = find or new_detector("frames", calibration=labelled.calibration)
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
    assert found >= whole - (chain != CameraChain())


def test_the_same_seed_gives_the_same_images():
    one, two = (list(labelled_images(load_level("calm"), 3, 9, CameraChain(noise=2))) for _ in range(2))
    for a, b in zip(one, two, strict=True):
        assert (a.image == b.image).all()
        assert a.gates == b.gates


def test_a_bad_option_is_named(capsys):
    assert run(["vision", "evaluate", "--jpeg", "0"]) == 2
    assert "--jpeg 0" in capsys.readouterr().err


NAMES = ("astronaut.png", "brick.png", "chelsea.png", "coffee.png", "grass.png", "gravel.png", "rocket.jpg")
PHOTOGRAPHS = [  # NASA's, in the public domain, or CC0; docs/vision.md
    np.asarray(cv2.imread(str(Path(skimage.__file__).parent / "data" / name)))
    for name in (*NAMES, "hubble_deep_field.jpg")
]
LEAST_FOUND = {"plain": 0.985, "tint": 0.98, "jpeg": 0.89}  # up to 5 m: a better detector raises these
MOST_FALSE_ALARMS = {"plain": 0.03, "tint": 0.03, "jpeg": 0.05}  # an image: and lowers these


def with_photographs(preset, count, seed, photographs=PHOTOGRAPHS[:1]):
    backgrounds = Backgrounds(tuple(photographs))
    return list(labelled_images(load_level("calm"), count, seed, PRESETS[preset], backgrounds))


@pytest.mark.parametrize("preset", LEAST_FOUND)
def test_gates_before_photographs_are_found(preset):
    scores, _ = detect_all(with_photographs(preset, 200, 7300, PHOTOGRAPHS))
    near = [
        sample.found
        for sample in scores.samples
        if sample.kind == "frames" and sample.distance_m < 5 and sample.angle_deg < RATED_ANGLE_DEG
    ]
    assert len(near) > 100
    assert sum(near) >= LEAST_FOUND[preset] * len(near)
    assert scores.false_alarms["frames"] <= MOST_FALSE_ALARMS[preset] * scores.images


def test_a_photograph_is_behind_the_gates():
    plain = list(labelled_images(load_level("calm"), 12, 3, PRESETS["plain"]))
    compared = 0
    for before, behind in zip(plain, with_photographs("plain", 12, 3), strict=True):
        assert before.gates == behind.gates
        same = (
            np.abs(before.image.astype(int) - behind.image).max(axis=2) < 60
        )  # edges mix with what is behind
        assert same.mean() < 0.5  # of sky and floor nothing is left
        for label in before.gates:
            if label.whole and label.distance_m < 3.0:
                for right, down in label.corners_px:
                    row, column = round(down + 119.5), round(right + 159.5)
                    assert same[row - 1 : row + 2, column - 1 : column + 2].any()
                    compared += 1
    assert compared >= 8


def test_a_photograph_turns_with_the_camera():
    camera = Camera()
    level = rotation_rows(rotation((1.0, 0.0, 0.0, 0.0)))
    backdrop = Backgrounds((PHOTOGRAPHS[0],)).draw(camera, level, np.random.default_rng(4))
    pinhole = Pinhole(320, 240, camera.focal_px, camera.near_m, camera.far_m)
    straight, turned = np.empty((2, 240, 320, 3), np.uint8)
    backdrop.paint(straight, level, pinhole)
    left = 10.0 / camera.focal_px  # tangent of the turn: 10 pixels in the middle
    backdrop.paint(turned, rotation_rows(rotation(quaternion_from_euler(0.0, 0.0, atan(left)))), pinhole)
    moved = np.abs(turned[115:125, 155:165].astype(int) - straight[115:125, 145:155]).mean()
    unmoved = np.abs(turned[115:125, 155:165].astype(int) - straight[115:125, 155:165]).mean()
    assert moved < 0.3 * unmoved


@pytest.mark.parametrize("preset", ["jpeg", "h264"])
def test_compression_halves_the_resolution_of_colour_and_keeps_the_scene(preset):
    for clear, sent in zip(with_photographs("tint", 5, 8), with_photographs(preset, 5, 8), strict=True):
        assert clear.gates == sent.gates
        luma, chroma = (
            np.abs(
                cv2.cvtColor(clear.image, cv2.COLOR_BGR2YCrCb).astype(int)[..., channels]
                - cv2.cvtColor(sent.image, cv2.COLOR_BGR2YCrCb)[..., channels]
            ).mean()
            for channels in (slice(0, 1), slice(1, 3))
        )
        assert 0.0 < luma < 12.0
        assert 0.0 < chroma < 8.0


def test_the_same_seed_gives_the_same_stream():
    for a, b in zip(with_photographs("h264", 3, 9), with_photographs("h264", 3, 9), strict=True):
        assert (a.image == b.image).all()


def test_a_folder_without_photographs_is_named(tmp_path, capsys):
    assert run(["vision", "evaluate", "--backgrounds", str(tmp_path)]) == 2
    assert f"--backgrounds {tmp_path}: has no photographs" in capsys.readouterr().err
    (tmp_path / "a.png").write_text("no image")
    assert run(["vision", "evaluate", "--backgrounds", str(tmp_path)]) == 2
    assert "a.png" in capsys.readouterr().err
