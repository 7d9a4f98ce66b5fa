"""Poses of motion capture over MAVLink, and the clocks that their time stamps are of."""

from math import hypot, nan, sqrt

import pytest

from firmware_py.estimation.report import Sensor
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from firmware_py.mavlink.time_sync import TimeSync
from firmware_py.status import CommandResult, FlightMode
from framerunner.geometry.rotations import quaternion_from_yaw
from framerunner.wire.dialect import mavlink
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

NED, FRD = mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_FRD
ENU, FLU = mavlink.MAV_FRAME_LOCAL_ENU, mavlink.MAV_FRAME_LOCAL_FLU
VISION = mavlink.MAV_ESTIMATOR_TYPE_VISION
LEVEL = [1.0, 0.0, 0.0, 0.0]


def covariance(position, attitude):
    entries = [nan] * 21
    for index, value in zip((0, 6, 11, 15, 18, 20), (*position, *attitude), strict=True):
        entries[index] = value
    return entries


KNOWN = covariance((0.04, 0.05, 0.06), (0.07, 0.08, 0.09))


def odometry(
    position=(1.0, 2.0, -3.0),
    q=LEVEL,
    *,
    time_us=0,
    frame=NED,
    variances=KNOWN,
    kind=VISION,
    resets=0,
    quality=0,
):
    return mavlink.MAVLink_odometry_message(
        time_us,
        frame,
        mavlink.MAV_FRAME_BODY_FRD,
        *position,
        list(q),
        *[nan] * 6,
        variances,
        [nan] * 21,
        resets,
        kind,
        quality,
    )


@pytest.fixture
def vision(autopilot):
    autopilot.parameters.set("EKF2_EV_CTRL", 15)
    return autopilot


def test_nothing_is_used_unless_the_parameter_says_so(autopilot, peer):
    peer.send(odometry())
    assert autopilot.poses == []
    autopilot.parameters.set("EKF2_EV_CTRL", 1)  # without height
    peer.send(odometry())
    assert autopilot.poses == []


def test_a_pose_and_its_variances(vision, peer):
    peer.advance(1.0)
    peer.send(odometry(q=quaternion_from_yaw(0.5), resets=3))
    (pose,) = vision.poses
    assert pose.position_ned_m == (1.0, 2.0, -3.0)
    assert pose.attitude == pytest.approx(quaternion_from_yaw(0.5))
    assert pose.position_variance_m2 == pytest.approx((0.04, 0.05, 0.06))
    assert pose.attitude_variance_rad2 == pytest.approx((0.07, 0.08, 0.09))
    assert (pose.time_us, pose.reset_counter) == (1_000_000, 3)


@pytest.mark.parametrize(
    ("variances", "mode", "expected"),
    [
        (KNOWN, 0, (0.04, 0.05, 0.06)),
        (covariance((1e-6,) * 3, (1e-6,) * 3), 0, (0.01,) * 3),  # the parameter is a lower limit
        (covariance((nan, 1.0, 1.0), (nan,) * 3), 0, (0.01,) * 3),
        ([nan] * 21, 0, (0.01,) * 3),
        (KNOWN, 1, (0.01,) * 3),
    ],
)
def test_variances_and_the_parameters(vision, peer, variances, mode, expected):
    vision.parameters.set("EKF2_EV_NOISE_MD", mode)
    peer.send(odometry(variances=variances))
    assert vision.poses[0].position_variance_m2 == pytest.approx(expected)


@pytest.mark.parametrize(
    ("frame", "expected"),
    [(NED, (1.0, 2.0, -3.0)), (FRD, (1.0, 2.0, -3.0)), (ENU, (2.0, 1.0, 3.0)), (FLU, (1.0, -2.0, 3.0))],
)
def test_frames_are_read_as_px4_reads_them(vision, peer, frame, expected):
    peer.send(odometry(frame=frame))
    assert vision.poses[0].position_ned_m == expected


def test_poses_that_cannot_be_used(vision, peer):
    peer.send(odometry(frame=mavlink.MAV_FRAME_GLOBAL))
    peer.send(odometry(position=(nan, 0.0, 0.0)))
    peer.send(odometry(kind=mavlink.MAV_ESTIMATOR_TYPE_MOCAP))  # as PX4, without a word
    peer.send(mavlink.MAVLink_att_pos_mocap_message(0, LEVEL, 1.0, 2.0, 3.0, KNOWN))
    assert vision.texts == []
    vision.parameters.set("EKF2_EV_QMIN", 50)
    peer.send(odometry(quality=49))
    assert vision.poses == []
    peer.send(odometry(quality=50))
    assert len(vision.poses) == 1


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (1.1, 0.0, 0.0, 0.0), (nan, 0.0, 0.0, 0.0)])
def test_an_invalid_attitude_leaves_the_position(vision, peer, q):
    peer.send(odometry(q=q))
    assert vision.poses[0].attitude is None
    assert vision.poses[0].position_ned_m == (1.0, 2.0, -3.0)


def test_another_estimators_odometry_is_refused_once_a_second(vision, peer):
    for _ in range(5):
        peer.send(odometry(kind=mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT))
    assert [text.text for text in vision.texts] == ["ODOMETRY: estimator_type 8 unsupported"]


def test_vision_position_estimate(vision, peer):
    vision.parameters.set("EKF2_EV_DELAY", 40.0)
    peer.advance(2.0)
    peer.send(mavlink.MAVLink_vision_position_estimate_message(9, 1.0, 2.0, -3.0, 0.1, -0.2, 0.3, KNOWN, 4))
    (pose,) = vision.poses
    assert (pose.time_us, pose.position_ned_m, pose.reset_counter) == (1_960_000, (1.0, 2.0, -3.0), 4)
    assert pose.position_variance_m2 == pytest.approx((0.04, 0.05, 0.06))


def test_a_clock_is_used_after_500_answers_and_follows_a_jump():
    clock, skew = TimeSync(), 1.0 + 50e-6
    for number in range(500):
        now_us = 100_000 * number
        assert clock.vehicle_time_us(123, now_us) == now_us
        remote_ns = round((now_us * skew + 5e12) * 1000)
        clock.take(now_us + 1500, remote_ns, (now_us - 1500) * 1000)
    assert clock.converged
    later_us = 50_000_000
    assert clock.vehicle_time_us(round(later_us * skew + 5e12), later_us) == pytest.approx(later_us, abs=200)
    clock.take(later_us + 20_000, round(5e15 + 1e12), later_us * 1000)  # too long on its way
    for number in range(11):
        now_us = later_us + 100_000 * number
        clock.take(now_us, round((now_us + 7e12) * 1000), now_us * 1000)
    assert not clock.converged


def test_answers_to_the_vehicles_timesync_give_the_time_of_a_pose(vision, peer):
    ahead_us = 77_000_000
    for _ in range(501):
        requests = [m for link, m in peer.advance(0.1) if link == "onboard" and m.get_type() == "TIMESYNC"]
        for request in requests:
            now_ns = (peer.time_us + ahead_us) * 1000
            peer.send(mavlink.MAVLink_timesync_message(now_ns, peer.time_us * 1000))
            assert request.tc1 == 0
    peer.send(odometry(time_us=peer.time_us + ahead_us - 30_000))
    assert vision.poses[-1].time_us == pytest.approx(peer.time_us - 30_000, abs=10)
    peer.send(odometry(time_us=peer.time_us + ahead_us + 5_000_000))
    assert vision.poses[-1].time_us == peer.time_us  # none is of the future


class Flown:
    """A simulated drone that gets its poses over MAVLink, 50 a second."""

    def __init__(self):
        scenario = load_scenario("open-field").model_copy(update={"sensors": "external"})
        self.simulation = Simulation(scenario, seed=5)
        self.node = MavlinkNode(self.simulation.autopilot, (ONBOARD,), NodeOptions())
        self._packer = mavlink.MAVLink(None, 1, mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)

    def fly(self, seconds, *, poses=True):
        simulation, ticks = self.simulation, round(seconds * 250)
        for tick in range(ticks):
            if poses and tick % 5 == 0:
                true, _ = simulation.true_state()
                message = odometry(
                    true.position_ned_m, true.attitude, variances=covariance((1e-6,) * 3, (1e-5,) * 3)
                )
                self.node.add_input("onboard", message.pack(self._packer))
                self.node.process_input("onboard", 10)
            now_us = simulation.time_us
            simulation.tick()
            self.node.update(now_us)
            self.node.take_output()
        return simulation.autopilot


def test_a_drone_flies_by_poses_over_mavlink_and_lands_when_they_stop():
    flown = Flown()
    autopilot = flown.fly(2.0, poses=False)
    assert autopilot.status.not_ready == "Arming denied: no valid data from external pose"
    assert autopilot.arm() is CommandResult.TEMPORARILY_REJECTED
    flown.fly(3.0)
    assert autopilot.status.not_ready == ""
    assert Sensor.EXTERNAL_POSE in autopilot.estimator.report().relied_on
    assert autopilot.takeoff() is CommandResult.ACCEPTED
    autopilot.arm()
    flown.fly(12.0)
    assert autopilot.status.mode is FlightMode.HOLD
    true, _ = flown.simulation.true_state()
    estimate = autopilot.state.position_ned_m
    error = [a - b for a, b in zip(estimate, true.position_ned_m, strict=True)]
    assert hypot(*error) < 0.05
    report = autopilot.estimator.report()
    assert sqrt(report.position_variance_m2[0]) < 0.02
    flown.fly(8.0, poses=False)
    assert autopilot.status.failsafe
    assert autopilot.status.mode is FlightMode.LAND
