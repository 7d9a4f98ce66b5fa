"""`framerunner camera calibrate`, from the board to a file that `fly` takes."""

import cv2
import pytest

from framerunner.camera_calibration import calibrate
from framerunner.camera_calibration.calibration_file import load_calibration
from framerunner.cli import run
from tests.vision.calibration.board_images import TRUE, board_images
from vision.calibration.model import CalibrationError
from vision.sources import FolderSource
from vision.types import CameraError


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    for number, image in enumerate(board_images(14)):
        cv2.imwrite(str(folder / f"{number:02d}.png"), image)
        if number == 0:
            cv2.imwrite(str(folder / "00-again.png"), image)
    return folder


def test_a_folder_of_photos_becomes_a_calibration(photos, tmp_path, capsys):
    out = tmp_path / "camera.yaml"
    assert run(["camera", "calibrate", str(photos), "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert "15 images: 13 different views; 2 like another one" in printed.err
    assert "px RMS" in printed.out
    assert "of the image covered" in printed.out
    found = load_calibration(out)
    assert found.fx_px == pytest.approx(TRUE.fx_px, rel=0.01)
    assert found.rms_px < 0.4


def test_too_few_photos_are_refused_in_one_line(photos, tmp_path, capsys):
    files = [str(path) for path in sorted(photos.glob("0[1-4].png"))]
    assert run(["camera", "calibrate", *files, "--out", str(tmp_path / "camera.yaml")]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("error: calibration: 4 different views of the board; 8 or more are needed")
    assert not (tmp_path / "camera.yaml").exists()


def test_the_views_of_a_camera_that_fails_are_used(photos, tmp_path, capsys, monkeypatch):
    class FailingSource(FolderSource):
        async def frames(self):
            if url == "rtsp://ends":
                async for each in super().frames():
                    yield each
            raise CameraError("camera rtsp://ends: the stream ended")

    def failing(source):
        nonlocal url
        url = source
        return FailingSource(photos)

    url = ""
    monkeypatch.setattr(calibrate, "open_source", failing)
    out = tmp_path / "camera.yaml"
    assert run(["camera", "calibrate", "rtsp://gone", "--out", str(out)]) == 2
    assert run(["camera", "calibrate", "rtsp://ends", "--out", str(out)]) == 0
    assert "the stream ended; the 13 views so far are used" in capsys.readouterr().err
    assert load_calibration(out).made_on is not None


def test_the_board_is_written_with_its_measures(tmp_path, capsys):
    assert run(["camera", "calibrate", "board", "--out", str(tmp_path / "board.png")]) == 0
    assert "8 x 5 squares of 30 mm" in capsys.readouterr().out
    assert cv2.imread(str(tmp_path / "board.png")) is not None


def test_a_bad_file_is_refused(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text("width_px: 640\nheight_px: 480\nfx_px: -3\nfy_px: 500\ncx_px: 320\ncy_px: 240\n")
    with pytest.raises(CalibrationError, match=r":3: fx_px is -3: must be above 1"):
        load_calibration(path)


def test_a_flight_with_a_calibration_that_does_not_exist_is_refused(tmp_path, capsys):
    assert run(["fly", "--calibration", str(tmp_path / "camera.yaml")]) == 2
    assert "no such file" in capsys.readouterr().err
