"""`framerunner camera colours` as its user calls it."""

import resource
from pathlib import Path

import cv2
import numpy as np
import pytest

from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.camera_calibration.colours import learn
from framerunner.errors import SettingError
from vision.calibration.model import Calibration, CalibrationError

PAINT = {"red": (72, 88, 190), "green": (80, 150, 104), "blue": (140, 104, 76)}


def ask(what: str) -> None:
    raise AssertionError(what)


def write(folder: Path) -> list[str]:
    save_calibration(Calibration.ideal(320, 240, 200.0), folder / "camera.yaml")
    for name, colour in PAINT.items():
        image = np.full((240, 320, 3), 127, np.uint8)
        image[80:160, 100:220] = colour
        cv2.imwrite(str(folder / f"{name}.png"), image)
    return [f"{name}={folder / name}.png" for name in PAINT]


def test_the_colours_are_added_to_the_calibration(tmp_path: Path) -> None:
    learn(write(tmp_path), tmp_path / "camera.yaml", ask)
    after = load_calibration(tmp_path / "camera.yaml")
    assert after.colour_matrix is not None
    assert after.fx_px == 200.0


def test_wrong_sources_are_one_line(tmp_path: Path) -> None:
    pairs = write(tmp_path)
    with pytest.raises(SettingError, match=r"'pink=a\.png': write COLOUR=SOURCE"):
        learn([*pairs, "pink=a.png"], tmp_path / "camera.yaml", ask)
    with pytest.raises(CalibrationError, match="not an image"):
        learn([*pairs, f"blue={tmp_path}/none.png"], tmp_path / "camera.yaml", ask)
    assert load_calibration(tmp_path / "camera.yaml").colour_matrix is None


def test_a_calibration_that_cannot_be_written_again_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "camera.yaml"
    save_calibration(Calibration.ideal(320, 240, 200.0), file)
    before, limits = file.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(SettingError, match=r"camera\.yaml: cannot be written to \(File too large\)"):
            save_calibration(Calibration.ideal(640, 480, 400.0), file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert file.read_bytes() == before
    assert not list(tmp_path.glob(".*"))
