"""What an ArduPilot drone lacks, and what the doctor says about it."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from framerunner.doctor.checks import can_fly, examine
from framerunner.doctor.listen import ARDUPILOT_PARAMETERS, PARAMETERS, open_requests
from framerunner.wire.dialect import mavlink
from offboard.safety.check import Outcome
from tests.framerunner.doctor.test_checks import healthy, heartbeat, put, sys_status

GOOD = {
    "DISARM_DELAY": 10.0,
    "EK3_SRC1_POSXY": 6.0,
    "EK3_SRC1_POSZ": 6.0,
    "FENCE_ENABLE": 0.0,
    "FS_GCS_ENABLE": 0.0,
    "FS_THR_ENABLE": 0.0,
    "GUID_OPTIONS": 0.0,
    "GUID_TIMEOUT": 1.0,
    "RTL_ALT": 200.0,
    "WPNAV_SPEED": 500.0,
    "WPNAV_SPEED_DN": 150.0,
    "WPNAV_SPEED_UP": 250.0,
}


def ekf(flags=0x33F, variance=0.05):
    return ardupilotmega.MAVLink_ekf_status_report_message(flags, variance, variance, variance, variance, 0.0)


def copter(**parameters):
    record = healthy()
    record.parameters.clear()
    record.parameters.update({**GOOD, **parameters})
    put(record, heartbeat(autopilot=3))
    record.latest["EKF_STATUS_REPORT"] = ekf()
    return record


def subjects(record, level):
    return {finding.name for finding in examine(record) if finding.outcome is level}


def test_a_copter_with_external_navigation_can_fly():
    assert can_fly(examine(copter()))
    assert subjects(copter(), Outcome.NOTE) == set()


@pytest.mark.parametrize(
    ("name", "value", "subject"),
    [
        ("EK3_SRC1_POSXY", 3.0, "position"),
        ("DISARM_DELAY", 2.0, "DISARM_DELAY"),
        ("GUID_OPTIONS", 16.0, "GUID_OPTIONS"),
        ("WPNAV_SPEED", 50.0, "WPNAV_SPEED"),
    ],
)
def test_what_a_parameter_shows_to_be_missing(name, value, subject):
    assert subjects(copter(**{name: value}), Outcome.FAIL) == {subject}


@pytest.mark.parametrize(
    ("name", "value", "subject"),
    [
        ("GUID_TIMEOUT", 3.0, "setpoints lost"),
        ("FS_GCS_ENABLE", 1.0, "ground station lost"),
        ("FS_THR_ENABLE", 1.0, "radio control lost"),
        ("EK3_SRC1_POSZ", 1.0, "height"),
    ],
)
def test_what_a_parameter_shows_to_be_in_doubt(name, value, subject):
    record = copter(**{name: value})
    assert subjects(record, Outcome.NOTE) == {subject}
    assert can_fly(examine(record))


def test_an_exact_gps_is_enough_and_a_usual_one_is_not():
    record = copter(EK3_SRC1_POSXY=3.0)
    for accuracy_mm, level in ((50, Outcome.PASS), (900, Outcome.FAIL)):
        put(record, mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 0, 0, 0, 0, 10, 0, accuracy_mm))
        assert "position" in subjects(record, level)


def test_an_estimator_that_rejects_measurements_is_found():
    record = copter()
    record.latest["EKF_STATUS_REPORT"] = ekf(variance=0.9)
    assert subjects(record, Outcome.FAIL) == {"estimator"}


def test_its_texts_are_the_reasons_of_failed_checks():
    record = copter()
    put(record, sys_status(health=0x2F))
    record.texts.append((3, "PreArm: Gyros inconsistent"))
    (finding,) = [one for one in examine(record) if one.name == "pre-arm checks"]
    assert (finding.outcome, finding.value) == (Outcome.FAIL, "not passed: Gyros inconsistent")


def test_a_plane_is_refused():
    record = copter()
    put(record, heartbeat(autopilot=3, kind=1))
    assert "autopilot" in subjects(record, Outcome.FAIL)


def test_it_is_asked_for_its_own_parameters_and_for_streams():
    record = copter()
    record.parameters.clear()
    asked = list(open_requests(record))
    names = {message.param_id for message in asked if message.get_type() == "PARAM_REQUEST_READ"}
    assert names == set(ARDUPILOT_PARAMETERS)
    assert not names & set(PARAMETERS)
    commands = {message.command for message in asked if message.get_type() == "COMMAND_LONG"}
    assert mavlink.MAV_CMD_SET_MESSAGE_INTERVAL in commands
    assert mavlink.MAV_CMD_COMPONENT_ARM_DISARM not in commands
