"""Calibration files: what a user wrote in them stays, and those of ROS and OpenCV are read."""

import cv2
import numpy as np
import pytest

from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.cli import run
from vision.calibration.model import Calibration, CalibrationError, Mounting

ROS = """\
image_width: 640
image_height: 480
camera_name: cam
camera_matrix:
  rows: 3
  cols: 3
  data: [500.0, 0.0, 320.5, 0.0, 501.0, 240.0, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.2, 0.06, 0.001, 0.002, 0.003]
"""
WANTED = Calibration(
    width_px=640,
    height_px=480,
    fx_px=500.0,
    fy_px=501.0,
    cx_px=320.5,
    cy_px=240.0,
    distortion=(-0.2, 0.06, 0.001, 0.002, 0.003),
)
OWN = """\
# The camera of drone 3, by Ana
width_px: 640
height_px: 480   # full size
fx_px: 500.0
fy_px: 501.0
cx_px: 320.5
cy_px: 240.0
distortion: [-0.2, 0.06,
  0.001, 0.002, 0.003]
readout_s: 0.012  # by the data sheet
mounting:
  angles_frd_rad: [0.1, 0.0, 0.0]
  measured_on: '2026-11-01'
# taped, not glued
made_on: '2026-10-01'  # rainy
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "camera.yaml"


def test_a_calibration_of_ros_is_read(path):
    path.write_text(ROS)
    assert load_calibration(path) == WANTED
    path.write_text(ROS.replace("cols: 5", "cols: 8").replace("0.003]", "0.003, 0, 0, 0]"))
    assert load_calibration(path) == WANTED


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
@pytest.mark.parametrize("names", ["camera_matrix distortion_coefficients", "cameraMatrix distCoeffs"])
def test_a_calibration_of_opencv_is_read(path, suffix, names):
    path = path.with_suffix(f".{suffix}")
    matrix, distortion = names.split()
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("calibration_time", "Fri Nov 27")
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write(matrix, np.array([[500.0, 0.0, 320.5], [0.0, 501.0, 240.0], [0.0, 0.0, 1.0]]))
    storage.write(distortion, np.array([[-0.2, 0.06, 0.001, 0.002, 0.003]]).T)
    storage.release()
    assert load_calibration(path) == WANTED


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("plumb_bob", "equidistant", "ROS's camera_info: the lens is equidistant; only plumb_bob"),
        ("image_height: 480\n", "", "image_height is missing; add it"),
        ("image_height: 480", "image_height: many", "image_height is 'many'; must be a number"),
        ("0.003]", "0.003, 0.1]", "distortion_coefficients: has 6; must be k1, k2, p1, p2, k3"),
        ("500.0, 0.0", "500.0, 3.0", "camera_matrix: must be fx 0 cx"),
        ("500.0, 0.0", "-5.0, 0.0", "fx_px: Input should be greater than 1"),
        ("data: [500.0", "data: [[500.0]", "camera_matrix has (500.0,); must be numbers"),
        ("image_width: 640", "image_width: {data: []}", "image_width is missing; add it"),
        ("image_width: 640", f"image_width: 1{400 * '0'}", "width_px: Input should be a finite number"),
        ("image_width: 640", "image_width: &a 640\nb: *a", "anchor &a is not allowed"),
        ("image_width: 640", "%YAML:1.0\n---\n{{", "OpenCV's FileStorage: "),
    ],
)
def test_a_foreign_calibration_that_cannot_be_used_names_its_format(path, old, new, reason):
    path.write_text(ROS.replace(old, new))
    with pytest.raises(CalibrationError) as caught:
        load_calibration(path)
    assert reason in str(caught.value)
    assert str(caught.value).startswith(f"{path}:")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_what_a_user_wrote_stays_when_a_mounting_is_measured(path, end):
    path.write_bytes(b"\xef\xbb\xbf" + OWN.replace("\n", end).encode())
    known = load_calibration(path)
    save_calibration(known, path)
    assert path.read_bytes() == b"\xef\xbb\xbf" + OWN.replace("\n", end).encode()
    mounting = Mounting(angles_frd_rad=(0.0, 0.2, 0.0), measured_on="2026-11-28")
    save_calibration(known.model_copy(update={"mounting": mounting, "delay_s": 0.1, "fx_px": 499.0}), path)
    wanted = OWN.replace("[0.1, 0.0, 0.0]", "[0.0, 0.2, 0.0]").replace("11-01", "11-28") + "delay_s: 0.1\n"
    wanted = wanted.replace("fx_px: 500.0", "fx_px: 499.0")
    assert path.read_bytes() == b"\xef\xbb\xbf" + wanted.replace("\n", end).encode()


def test_a_new_calibration_of_the_lens_keeps_what_else_is_known(path, tmp_path):
    path.write_text(OWN)
    (tmp_path / "ost.yaml").write_text(ROS.replace("-0.2,", "-0.3,"))
    assert run(["camera", "calibrate", str(tmp_path / "ost.yaml"), "--out", str(path)]) == 0
    text = path.read_text()
    assert load_calibration(path).distortion[0] == -0.3
    assert "readout_s: 0.012  # by the data sheet\n" in text
    assert "# taped, not glued\n" in text
    assert "made_on" not in text  # the day of another calibration


@pytest.mark.parametrize("text", [ROS, "name: a scenario\n", "{" + ", ".join(OWN.split("\n")[4:7]) + "}"])
def test_what_is_not_understood_is_not_replaced(path, text, capsys):
    path.write_text(text)
    with pytest.raises(CalibrationError):
        save_calibration(WANTED, path)
    assert run(["camera", "calibrate", "photos", "--out", str(path)]) == 2
    assert run(["camera", "colours", "red=a.png", "--calibration", str(path)]) == 2
    assert all(line.startswith("error: ") for line in capsys.readouterr().err.splitlines())
    assert path.read_text() == text


def test_yaml_of_another_form_is_left_as_it_is(path):
    text = "{width_px: 640, height_px: 480, fx_px: 500, fy_px: 501, cx_px: 320, cy_px: 240}  # mine\n"
    path.write_text(text)
    with pytest.raises(CalibrationError, match="its values cannot be replaced"):
        save_calibration(WANTED, path)
    assert path.read_text() == text
