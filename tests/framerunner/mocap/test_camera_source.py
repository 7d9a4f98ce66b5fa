"""Poses by camera and IMU, of messages as a vehicle sends them that stands, then slides over a floor."""

import numpy as np
import pytest

from framerunner.flying.detector import true_calibration
from framerunner.flying.plan import FlightPlan
from framerunner.mocap import camera_source
from framerunner.mocap.camera_source import CameraPoses, CameraSettings
from framerunner.wire.dialect import mavlink
from offboard.navigation.camera_model import CameraModel
from scenarios.loader import load_scenario
from vision.types import Detections, PointTracks

IMU_US, TICK_US, IMAGE_US = 4_000, 40_000, 100_000
START = (0.0, 0.0, 0.3, 0.0)
STANDS_S, SPEED_M_S, PULL_M_S2 = 1.0, 0.5, 0.5
G_M_S2 = 9.80665


def way(time_s):
    """How far a drone that was lifted has slid ahead, how fast it is, and its acceleration."""
    t = time_s - STANDS_S
    if t <= 0.0:
        return 0.0, 0.0, 0.0
    rise_s = SPEED_M_S / PULL_M_S2
    if t < rise_s:
        return 0.5 * PULL_M_S2 * t**2, PULL_M_S2 * t, PULL_M_S2
    return 0.5 * PULL_M_S2 * rise_s**2 + SPEED_M_S * (t - rise_s), SPEED_M_S, 0.0


class FakeImages:
    """What the camera shows of points on the floor."""

    problem = ""

    def __init__(self, camera):
        self.found = []

    def note_time(self, time_us):
        """The fake has vehicle time."""

    def take(self):
        taken, self.found = tuple(self.found), []
        return taken

    def close(self):
        """Nothing is open."""


def of_autopilot(message):
    message.get_header().srcSystem, message.get_header().srcComponent = 1, 1
    return message


def imu(time_us, ahead_m_s2):
    return of_autopilot(
        mavlink.MAVLink_highres_imu_message(
            time_us, ahead_m_s2, 0.0, -G_M_S2, *[0.0] * 9, temperature=20.0, fields_updated=63
        )
    )


def reported(time_us, moves):
    """Attitude, and a place and, in motion, a velocity that are wrong."""
    ms, wrong = time_us // 1000, (0.9, 0.9, 0.0) if moves else (0.0, 0.0, 0.0)
    yield of_autopilot(mavlink.MAVLink_local_position_ned_message(ms, *(5.0, 5.0, 0.0), *wrong))
    yield of_autopilot(mavlink.MAVLink_attitude_message(ms, *[0.0] * 6))


def fly(source, seconds):
    """Feed it; the poses, and vehicle times, of the last tick."""
    camera = CameraModel.of(load_scenario("empty").camera)
    floor = np.random.default_rng(1).uniform(-8.0, 8.0, (400, 3)) * (1.0, 1.0, 0.0)
    passed = []
    for time_us in range(1_000_000, round((1.0 + seconds) * 1e6), IMU_US):
        time_s = (time_us - 1_000_000) * 1e-6
        slid_m, _, ahead_m_s2 = way(time_s)
        source.take(imu(time_us, ahead_m_s2), time_s)
        if time_us % IMAGE_US == 0:
            pose = camera.pose((START[0] + slid_m, START[1], START[2]), (1.0, 0.0, 0.0, 0.0))
            seen = {
                number: pixel
                for number, point in enumerate(floor.tolist())
                if (pixel := camera.project(pose, point)) is not None and camera.contains(*pixel)
            }
            pixels = np.array(list(seen.values()))
            tracks = PointTracks(np.array(list(seen)), pixels, pixels[:, 1])
            source._images.found.append(Detections(time_us=time_us, tracks=tracks))
        if time_us % TICK_US == 0:
            if time_s > STANDS_S:
                state = mavlink.MAVLink_extended_sys_state_message(0, mavlink.MAV_LANDED_STATE_IN_AIR)
                source.take(of_autopilot(state), time_s)
            for message in reported(time_us, time_s > STANDS_S):
                source.take(message, time_s)
            passed += source.poll(time_s)
    return passed, slid_m


@pytest.fixture
def source(monkeypatch):
    monkeypatch.setattr(camera_source, "_Images", FakeImages)
    scenario = load_scenario("empty")
    settings = CameraSettings("fake", true_calibration(scenario.camera), 0.05)
    return CameraPoses(settings, FlightPlan(scenario).surroundings, START)


def test_before_the_vehicle_knows_its_place_it_is_told_where_it_stands(source):
    poses = [pose for now_s in np.arange(0.0, 1.0, 0.01) for pose in source.poll(now_s)]
    assert 15 <= len(poses) <= 21
    assert {pose.vehicle_time_us for pose in poses} == {None}
    for pose in poses:
        assert pose.pose.position_ned_m == pytest.approx((0.0, 0.0, -0.3), abs=2e-4)
    assert len({pose.pose.position_ned_m for pose in poses}) > 1  # equal ones would count as stuck


def test_points_and_imu_tell_the_way_whatever_the_vehicle_reports(source):
    poses, slid_m = fly(source, 6.0)
    north_m, east_m, down_m = poses[-1].pose.position_ned_m
    assert slid_m > 2.0
    assert north_m == pytest.approx(slid_m, abs=0.15)  # by the report it would be 4.5 m
    assert east_m == pytest.approx(0.0, abs=0.15)
    assert down_m == pytest.approx(-0.3, abs=0.05)
    assert poses[-1].pose.velocity_ned_m_s == pytest.approx((SPEED_M_S, 0.0, 0.0), abs=0.06)
    assert 1.0 / 0.06 <= len(poses) / 6.0 <= 1.0 / 0.04 + 1.0


def test_a_camera_that_cannot_be_opened_ends_the_poses():
    scenario = load_scenario("empty")
    settings = CameraSettings("http://127.0.0.1:9/video", true_calibration(scenario.camera), 0.05)
    poses = CameraPoses(settings, FlightPlan(scenario).surroundings, START)
    poses._images._thread.join(10.0)
    poses.poll(0.0)
    assert poses.ended
    assert "127.0.0.1:9" in poses.failure
    poses.close()
