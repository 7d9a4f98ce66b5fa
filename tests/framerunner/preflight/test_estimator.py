"""What is made of the reports of PX4's and ArduPilot's estimators."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from framerunner.wire.dialect import mavlink
from framerunner.wire.session.record import Record
from offboard.safety.check import Outcome
from offboard.safety.vehicle_checks import estimator_check

ALL = 1 | 2 | 4 | 8 | 16 | 32  # EKF_STATUS_FLAGS: attitude, velocities, positions, height
NAME = "EKF_STATUS_REPORT"


def record(flags=ALL, position=0.1, *, origin=True, autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA):
    found = Record(system_id=1)
    found.telemetry.autopilot = autopilot
    found.latest[NAME] = ardupilotmega.MAVLink_ekf_status_report_message(flags, 0.1, position, 0.1, 0.1, 0.1)
    if origin:
        found.latest["GPS_GLOBAL_ORIGIN"] = mavlink.MAVLink_gps_global_origin_message(1, 2, 3)
    return found


@pytest.mark.parametrize(
    ("found", "outcome", "words"),
    [
        (record(), Outcome.PASS, "largest ratio of an innovation 0.10"),
        (record(position=0.7), Outcome.FAIL, "largest ratio of an innovation 0.70"),
        (record(ALL & ~(8 | 16)), Outcome.FAIL, "it does not know its position"),
        (record(ALL | 128), Outcome.FAIL, "it does not know its position"),
        (record(2), Outcome.FAIL, "it does not know its attitude and position and height"),
        (Record(), Outcome.FAIL, "no EKF_STATUS_REPORT is received"),
    ],
)
def test_ardupilots_report_is_judged(found, outcome, words):
    check = estimator_check(found.estimator, NAME)
    assert (check.outcome, check.value) == (outcome, words)


def test_a_fence_needs_a_position_and_the_estimators_origin():
    assert record().has_global_position
    assert not record(origin=False).has_global_position
    assert not record(ALL & ~16).has_global_position
    assert not record(autopilot=mavlink.MAV_AUTOPILOT_PX4).has_global_position


def test_px4_needs_no_measurement_of_the_height_above_ground():
    found = Record(system_id=1)
    found.latest["ESTIMATOR_STATUS"] = mavlink.MAVLink_estimator_status_message(
        1, ALL, 0.1, 0.2, 0.3, 0.15, 0.9, 0.0, 0.1, 0.1
    )
    assert found.estimator.largest_ratio == 0.3
    assert found.estimator.ratios["height above ground"] == 0.9
