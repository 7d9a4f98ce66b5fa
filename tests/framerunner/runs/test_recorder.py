"""Tracks, the pace and videos of flights."""

from dataclasses import replace
from threading import Event

import cv2
import numpy as np
import pytest

from framerunner.runs.recorder import FlightRecorder, RecordingCamera, VideoFile
from framerunner.runs.track import TrackRecorder
from offboard.app import Moment
from offboard.drone import DroneState, PlaceEstimate, VelocityFluCommand
from offboard.navigation.view import GateEstimate, NavigationView
from tests.disk import disk_that_takes
from vision.types import CameraFrame, Detections


def moment(time_us, mission_state="red.turning", x=0.0):
    return Moment(
        DroneState(time_us, x, 2.0, 3.0, 0.0),
        VelocityFluCommand(),
        Detections(),
        mission_state,
        time_us / 1e6,
    )


def test_an_empty_flight_has_an_empty_track():
    recorder = FlightRecorder()
    assert len(TrackRecorder().track(None)) == 0
    assert recorder.wall_time_s == 0.0
    assert recorder.real_time_factor is None
    assert recorder.latest is None


def test_the_track_counts_from_motors_on():
    recorder = TrackRecorder()
    for tick, state in enumerate(("take_off.start", "red.turning", "red.crossing")):
        recorder.see(moment(5_000_000 + 50_000 * tick, state, x=float(tick)))
    track = recorder.track(5_050_000)
    assert track.time_s == pytest.approx([-0.05, 0.0, 0.05])
    assert track.x == [0.0, 1.0, 2.0]
    assert set(track.y) == {2.0} and set(track.z) == {3.0}
    assert track.mission_state == ["take_off.start", "red.turning", "red.crossing"]
    assert recorder.track(None).time_s[0] == 0.0


def test_the_track_has_the_gates_as_they_were_last_estimated():
    recorder = TrackRecorder()
    gates = [GateEstimate("red", (x, 0, 1), 0, (1, 1, 1), 1, False, False, 1, 0) for x in (1.0, 2.0)]
    for tick, known in enumerate(((), gates[:1], gates[1:], None)):
        view = None if known is None else NavigationView(tuple(known))
        recorder.see(replace(moment(5_000_000 + 50_000 * tick, "a.b"), navigation=view))
    assert recorder.track(None).estimates == (gates[1],)


def test_the_track_has_the_estimated_path_and_the_largest_deviation():
    recorder = TrackRecorder()
    places = (None, (0.04, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01), (0.0,) * 8 + (0.09,), None)
    for tick, covariance in enumerate(places):
        place = None if covariance is None else PlaceEstimate((tick, 0.5, 1.0), 0.0, covariance, 0.1)
        recorder.see(replace(moment(5_000_000 + 50_000 * tick), place=place))
    track = recorder.track(5_000_000, true_path=[(0.0, 0.0, 0.5, 1.0), (0.2, 4.0, 0.5, 1.4)])
    assert track.estimated_path == [(0.05, 1, 0.5, 1.0), (0.1, 2, 0.5, 1.0)]
    assert recorder.largest_std_m == pytest.approx(0.3)
    assert track.largest_error_m(track.estimated_path) == pytest.approx(0.2)
    assert track.place_error_m(0.1) == pytest.approx((0.0, 0.0, -0.2))  # as estimated
    assert track.place_error_m(0.15) == pytest.approx((-3.0, 1.5, 1.7))  # as reported


def test_the_real_time_factor_is_vehicle_time_by_wall_time(monkeypatch):
    wall_s = iter((10.0, 12.0, 14.0))
    monkeypatch.setattr("framerunner.runs.recorder.time.monotonic", lambda: next(wall_s))
    recorder = FlightRecorder()
    for time_us in (1_000_000, 7_000_000, 13_000_000):
        recorder.see(moment(time_us))
    assert recorder.wall_time_s == pytest.approx(4.0)
    assert recorder.real_time_factor == pytest.approx(3.0)
    assert recorder.latest.state.time_us == 13_000_000


class Source:
    def __init__(self, count):
        self._count = count

    async def frames(self):
        for number in range(self._count):
            image = np.full((48, 64, 3), 20 * number, np.uint8)
            yield CameraFrame(image, 100_000 * number, 0.0)


async def test_images_are_yielded_and_written_to_the_video(tmp_path):
    camera = RecordingCamera(Source(8), tmp_path / "video.avi", 10.0)
    handed = [frame.time_us async for frame in camera.frames()]
    camera.close()
    assert handed == [100_000 * number for number in range(8)]
    video = cv2.VideoCapture(str(tmp_path / "video.avi"))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(10.0)
    assert camera.problem == ""
    levels = []
    while (image := video.read()[1]) is not None:
        assert image.shape == (48, 64, 3)
        levels.append(float(image.mean()))
    assert levels == pytest.approx([20.0 * number for number in range(8)], abs=4.0)


async def test_a_video_that_could_not_be_written_says_so(tmp_path):
    camera = RecordingCamera(Source(8), tmp_path / "video.avi", 10.0)
    with disk_that_takes(6000):
        assert len([frame async for frame in camera.frames()]) == 8
        camera.close()
    assert camera.problem == f"'{tmp_path}/video.avi' is incomplete: not all of it could be written"


async def test_without_images_there_is_no_video(tmp_path):
    camera = RecordingCamera(Source(0), tmp_path / "video.avi", 10.0)
    assert [frame async for frame in camera.frames()] == []
    camera.close()
    camera.close()
    assert not (tmp_path / "video.avi").exists()


def test_a_video_that_is_too_slow_leaves_images_out(tmp_path, monkeypatch):
    free = Event()
    compress = VideoFile._compress
    monkeypatch.setattr(VideoFile, "_compress", lambda self, image: (free.wait(10), compress(self, image)))
    video_file = VideoFile(tmp_path / "video.avi", 10.0)
    for _ in range(10):
        video_file.write(np.zeros((1080, 1920, 3), np.uint8), wait=False)
        video_file.write(np.zeros((48, 64, 3), np.uint8), wait=False)  # another size is left out
    free.set()
    video_file.close()
    video = cv2.VideoCapture(str(tmp_path / "video.avi"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 3  # of 6 MB each, and 12 MB may wait
    assert video.read()[1].shape == (1080, 1920, 3)
