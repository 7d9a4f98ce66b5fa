"""Telemetry of a vehicle whose sensors have errors: it comes from the estimator's report."""

from math import isnan, nan, sqrt

import pytest

from firmware_py.estimation.report import EstimatorReport, Ratios, Sensor
from firmware_py.mavlink.ground_station.events import assess
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from firmware_py.status import VehicleStatus
from framerunner.vehicle.measurements import BarometerSample, FixType, GpsSample, Readings
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from scenarios.loader import load_scenario
from sitl.simulation import Simulation
from tests.firmware_py.mavlink.conftest import HOME

GPS_BIT = mavlink.MAV_SYS_STATUS_SENSOR_GPS
VISION_BIT = mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION
BAROMETER_BIT = mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
INDOORS = frozenset({Sensor.GYROSCOPE, Sensor.ACCELEROMETER, Sensor.BAROMETER, Sensor.EXTERNAL_POSE})


def report(**changes):
    known = {
        "present": INDOORS,
        "healthy": INDOORS,
        "relied_on": INDOORS,
        "has_attitude": True,
        "has_velocity": True,
        "has_position": True,
        "has_height": True,
        "position_variance_m2": (1e-4, 3e-4, 9e-4),
        "velocity_variance_m2_s2": (1e-3, 2e-3, 3e-3),
        "attitude_variance_rad2": (1e-5, 2e-5, 3e-5),
        "ratios": Ratios(0.1, 0.2, 0.3, 0.4, 0.5),
        "resets": 258,
    }
    return EstimatorReport(**known | changes)


def reply(peer, message_id):
    answers = peer.ask(peer.long(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id))
    return next((each for each in answers if each.get_msgId() == message_id), None)


def test_sensor_bits_are_of_what_is_present_used_and_healthy(autopilot, peer):
    autopilot.report = report(
        healthy=INDOORS - {Sensor.BAROMETER}, relied_on=INDOORS - {Sensor.BAROMETER, Sensor.EXTERNAL_POSE}
    )
    status = reply(peer, mavlink.MAVLINK_MSG_ID_SYS_STATUS)
    present, enabled = status.onboard_control_sensors_present, status.onboard_control_sensors_enabled
    health = status.onboard_control_sensors_health
    assert present & (VISION_BIT | BAROMETER_BIT | GPS_BIT) == VISION_BIT | BAROMETER_BIT
    assert not health & BAROMETER_BIT
    assert enabled & BAROMETER_BIT  # as in PX4, what fails is enabled
    assert health & VISION_BIT
    assert not enabled & VISION_BIT
    assert not present & mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG


def test_estimator_status_has_ratios_accuracies_and_px4s_flags(autopilot, peer):
    autopilot.report = report()
    status = reply(peer, mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS)
    ratios = (status.vel_ratio, status.pos_horiz_ratio, status.pos_vert_ratio, status.mag_ratio)
    assert (*ratios, status.hagl_ratio) == pytest.approx((0.1, 0.2, 0.3, 0.4, 0.5))
    assert status.pos_horiz_accuracy == pytest.approx(0.02)
    assert status.pos_vert_accuracy == pytest.approx(0.03)
    assert status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
    assert not status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS  # no GPS
    assert not status.flags & mavlink.ESTIMATOR_POS_VERT_AGL
    autopilot.report = report(relied_on=frozenset(), has_position=False, has_velocity=False)
    flags = reply(peer, mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS).flags
    lost = mavlink.ESTIMATOR_POS_HORIZ_REL | mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
    assert not flags & (lost | mavlink.ESTIMATOR_VELOCITY_HORIZ | mavlink.ESTIMATOR_POS_HORIZ_ABS)
    assert flags & mavlink.ESTIMATOR_CONST_POS_MODE


def test_odometry_has_variances_as_px4(autopilot, peer):
    autopilot.report = report()
    autopilot.state.attitude = (sqrt(0.5), 0.0, 0.0, sqrt(0.5))  # looking east: forward is about east
    odometry = reply(peer, mavlink.MAVLINK_MSG_ID_ODOMETRY)
    pose = odometry.pose_covariance
    assert [pose[index] for index in (0, 6, 11)] == pytest.approx([1e-4, 3e-4, 9e-4])
    assert [pose[index] for index in (15, 18, 20)] == pytest.approx([2e-5, 1e-5, 3e-5])
    assert isnan(pose[1])
    assert [odometry.velocity_covariance[i] for i in (0, 6, 11)] == pytest.approx([1e-3, 2e-3, 3e-3])
    assert isnan(odometry.velocity_covariance[15])
    assert odometry.reset_counter == 2
    assert odometry.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT


def test_sensor_messages_are_the_newest_samples_and_missing_sensors_send_none(autopilot, peer):
    pressure = BarometerSample(1_000_000, 95_000.0, 290.0)
    autopilot.report = report(latest=Readings(1_000_000, barometer=pressure))
    sent = reply(peer, mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE)
    assert (sent.press_abs, sent.temperature) == (950.0, 1685)
    for missing in ("GPS_RAW_INT", "DISTANCE_SENSOR", "OPTICAL_FLOW_RAD", "HIGHRES_IMU", "GNSS_INTEGRITY"):
        assert reply(peer, getattr(mavlink, f"MAVLINK_MSG_ID_{missing}")) is None


def test_a_receiver_without_a_fix_says_so_and_one_with_a_fix_its_accuracy(autopilot, peer):
    outdoors = INDOORS | {Sensor.GPS}
    autopilot.report = report(present=outdoors, latest=Readings(5))
    assert reply(peer, mavlink.MAVLINK_MSG_ID_GPS_RAW_INT).fix_type == mavlink.GPS_FIX_TYPE_NO_FIX
    fix = GpsSample(7, FixType.RTK_FIXED, 47.5, 8.5, 500.0, (3.0, 4.0, 0.0), 0.02, 0.03, 0.1 / sqrt(3.0), 21)
    autopilot.report = report(present=outdoors, latest=Readings(8, gps=fix))
    sent = reply(peer, mavlink.MAVLINK_MSG_ID_GPS_RAW_INT)
    assert (sent.time_usec, sent.fix_type, sent.lat, sent.alt) == (7, 6, 475000000, 500000)
    assert (sent.vel, sent.satellites_visible) == (500, 21)
    assert (sent.h_acc, sent.v_acc, sent.vel_acc) == (20, 30, 100)


def test_health_report_names_the_failing_part(autopilot):
    autopilot.status = VehicleStatus(origin=HOME, not_ready="Arming denied: barometer is stuck")
    autopilot.report = report(healthy=INDOORS - {Sensor.BAROMETER})
    found = assess(autopilot)
    assert found.failing.name == "ABSOLUTE_PRESSURE"
    assert found.check.part.name == "ABSOLUTE_PRESSURE"
    assert found.check.kind.message == "Barometer is stuck"
    assert "MAGNETOMETER" not in str(found.present)


@pytest.fixture(scope="module")
def outdoors():
    """A drone outdoors, its streams, and its reasons not to arm with their times, over eight seconds."""
    scenario = load_scenario("open-field").model_copy(update={"sensors": "outdoor"})
    simulation = Simulation(scenario, seed=3)
    node = MavlinkNode(simulation.autopilot, (ONBOARD,), NodeOptions(truth=simulation.true_state))
    reader, messages, reasons = PacketReader(), [], {}
    while simulation.time_us < 8_000_000:
        now_us = simulation.time_us
        simulation.tick()
        node.update(now_us)
        messages += [message for _, data in node.take_output() for message in reader.feed(data)]
        reasons[simulation.autopilot.status.not_ready] = now_us / 1e6
    return simulation, messages, reasons, node


def test_outdoors_it_can_be_armed_only_with_a_position(outdoors):
    _, messages, reasons, _ = outdoors
    assert reasons["Arming denied: GPS fix too low"] == pytest.approx(5.1, abs=0.2)
    assert reasons["Arming denied: no position estimate"] < 6.5
    assert list(reasons)[-1] == ""
    states = {m.time_usec: m.fix_type for m in messages if m.get_type() == "GPS_RAW_INT"}
    assert set(states.values()) == {mavlink.GPS_FIX_TYPE_NO_FIX, mavlink.GPS_FIX_TYPE_3D_FIX}


def test_its_true_state_is_not_its_estimate(outdoors):
    simulation, _, _, node = outdoors
    packer, reader = mavlink.MAVLink(None, 245, 191), PacketReader()
    request = mavlink.MAVLink_command_long_message(1, 1, 512, 0, 115, *[nan] * 6)
    node.add_input("onboard", request.pack(packer))
    node.process_input("onboard", 10)
    answers = [message for _, data in node.take_output() for message in reader.feed(data)]
    truth = next(message for message in answers if message.get_type() == "HIL_STATE_QUATERNION")
    origin = simulation.scenario.origin
    assert truth.lat == pytest.approx(origin.latitude_deg * 1e7, abs=2)
    assert (truth.vx, truth.vy) == (0, 0)
    estimate = simulation.autopilot.global_position()
    assert abs(estimate.latitude_deg - origin.latitude_deg) * 111_319 > 0.02
