"""A camera is calibrated from rendered views of the board, and bad sets of views are refused."""

import re

import cv2
import numpy as np
import pytest

from framerunner.geometry.lens import distorted
from tests.vision.calibration.board_images import BOARD, TRUE, board_image, board_images
from vision.calibration.board import CharucoBoard
from vision.calibration.model import CalibrationError


@pytest.fixture(scope="module")
def views():
    found = [BOARD.find(image, f"view {number}") for number, image in enumerate(board_images())]
    return [view for view in found if view is not None]


def test_a_known_camera_is_recovered(views):
    report = BOARD.calibrate(views)
    found = report.calibration
    assert len(views) >= 16
    assert found.rms_px < 0.3
    assert found.fx_px == pytest.approx(TRUE.fx_px, rel=0.004)
    assert found.fy_px == pytest.approx(TRUE.fy_px, rel=0.004)
    assert (found.cx_px, found.cy_px) == pytest.approx((TRUE.cx_px, TRUE.cy_px), abs=1.5)
    assert report.coverage > 0.8
    # What counts is where rays are seen: within a pixel all over the image.
    for x, y in np.array(np.meshgrid([-0.55, -0.2, 0.2, 0.55], [-0.4, 0.0, 0.4])).reshape(2, -1).T:
        (u, v), (true_u, true_v) = (distorted(x, y, camera.distortion) for camera in (found, TRUE))
        right = found.fx_px * u + found.cx_px - TRUE.fx_px * true_u - TRUE.cx_px
        down = found.fy_px * v + found.cy_px - TRUE.fy_px * true_v - TRUE.cy_px
        assert np.hypot(right, down) < 0.8


def test_too_few_views_are_refused(views):
    with pytest.raises(CalibrationError, match=re.escape("5 different views of the board; 8 or more")):
        BOARD.calibrate(views[:5])


def test_views_of_the_middle_only_are_refused():
    images = [board_image(5.0 * n - 20.0, 0.0, 0.0, (0.0, 0.0, 0.9)) for n in range(9)]
    found = [BOARD.find(image, "view") for image in images]
    with pytest.raises(CalibrationError, match="of the image; show it in its corners"):
        BOARD.calibrate([view for view in found if view is not None])


def test_views_without_tilt_are_refused():
    places = [(0.1 * (n % 3 - 1), 0.07 * (n // 3 - 1), 0.4) for n in range(9)]
    found = [BOARD.find(board_image(0.0, 0.0, 0.0, place), "view") for place in places]
    with pytest.raises(CalibrationError, match="the board was tilted by"):
        BOARD.calibrate([view for view in found if view is not None])


def test_images_of_two_sizes_are_refused(views):
    other = BOARD.find(cv2.resize(board_image(10.0, 10.0, 0.0, (0.0, 0.0, 0.3)), (320, 240)), "small.png")
    with pytest.raises(CalibrationError, match=re.escape("small.png has 320 x 240 pixels")):
        BOARD.calibrate([*views[:9], other])


def test_nothing_is_found_without_a_board():
    assert BOARD.find(np.full((480, 640, 3), 128, np.uint8), "grey") is None


def test_the_page_prints_in_true_size():
    page = CharucoBoard().page()
    per_metre = int.from_bytes(page[page.index(b"pHYs") + 4 :][:4], "big")
    picture = cv2.imdecode(np.frombuffer(page, np.uint8), cv2.IMREAD_GRAYSCALE)
    rows, columns = np.nonzero(picture[: int(0.9 * picture.shape[0])] < 128)
    assert (np.ptp(columns) + 1) / per_metre == pytest.approx(0.24, abs=0.001)
    assert (np.ptp(rows) + 1) / per_metre == pytest.approx(0.15, abs=0.001)
    assert "240 x 150 mm" in CharucoBoard().text
