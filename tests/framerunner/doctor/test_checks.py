"""What a drone lacks, and what is said of it."""

import pytest

from firmware_py.mavlink.dialect import mavlink
from framerunner.doctor.checks import Level, can_fly, examine
from framerunner.doctor.record import Record

GOOD_PARAMETERS = {
    "BAT_CRIT_THR": 0.07,
    "COM_DISARM_PRFLT": 10.0,
    "COM_LOW_BAT_ACT": 2.0,
    "COM_OBL_RC_ACT": 4.0,
    "COM_OF_LOSS_T": 1.0,
    "EKF2_HGT_REF": 2.0,
    "GF_ACTION": 2.0,
    "GF_MAX_VER_DIST": 0.0,
    "MC_YAWRATE_MAX": 200.0,
    "MPC_XY_VEL_MAX": 12.0,
    "NAV_DLL_ACT": 0.0,
    "NAV_RCL_ACT": 2.0,
    "RTL_RETURN_ALT": 30.0,
}
ALL = 0x10000000 | 0x2F


def sys_status(health=ALL, battery=80):
    return mavlink.MAVLink_sys_status_message(ALL, ALL, health, 0, 16200, -1, battery, 0, 0, 0, 0, 0, 0)


def heartbeat(autopilot=12, kind=2, base_mode=29, state=3):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, base_mode, 3 << 24 | 4 << 16, state, 3)


def version(capabilities=0xE8FF):
    return mavlink.MAVLink_autopilot_version_message(
        capabilities, 0x011100FF, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0
    )


def healthy(**parameters):
    record = Record(system_id=1)
    for message in (
        heartbeat(),
        sys_status(),
        version(),
        mavlink.MAVLink_extended_sys_state_message(0, mavlink.MAV_LANDED_STATE_ON_GROUND),
    ):
        record.latest[message.get_type()] = message
    for name, count in (("ATTITUDE", 301), ("LOCAL_POSITION_NED", 181)):
        record.counts[name], record.times_s[name] = count, (0.0, 6.0)
    for number in range(200):
        record.packets.take(number)
    record.places += [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0)]
    record.parameters.update({**GOOD_PARAMETERS, **parameters})
    return record


def missing(record):
    return {finding.subject for finding in examine(record) if finding.level is Level.MISSING}


def notes(record):
    return {finding.subject for finding in examine(record) if finding.level is Level.NOTE}


def test_a_healthy_drone_can_fly():
    findings = examine(healthy())
    assert can_fly(findings)
    assert {finding.level for finding in findings} == {Level.GOOD}


@pytest.mark.parametrize(
    ("message", "subject"),
    [
        (heartbeat(autopilot=3), "autopilot"),
        (heartbeat(kind=1), "autopilot"),
        (heartbeat(base_mode=157, state=4), "armed"),
        (heartbeat(state=5), "failsafe"),
        (mavlink.MAVLink_extended_sys_state_message(0, mavlink.MAV_LANDED_STATE_IN_AIR), "landed"),
        (sys_status(health=0x2F), "pre-arm checks"),
        (sys_status(battery=5), "battery"),
        (version(capabilities=0x2000), "offboard"),
    ],
)
def test_what_a_message_shows_to_be_missing(message, subject):
    record = healthy()
    record.latest[message.get_type()] = message
    assert missing(record) == {subject}
    assert not can_fly(examine(record))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("COM_OF_LOSS_T", 0.2),
        ("COM_DISARM_PRFLT", 2.0),
        ("MPC_XY_VEL_MAX", 0.5),
        ("MC_YAWRATE_MAX", 30.0),
        ("GF_MAX_VER_DIST", 2.0),
        ("GF_MAX_HOR_DIST", 5.0),
    ],
)
def test_parameters_that_would_end_the_flight(name, value):
    assert missing(healthy(**{name: value})) == {name}


def test_a_fence_that_does_nothing_is_no_fence():
    assert missing(healthy(GF_MAX_VER_DIST=2.0, GF_ACTION=0.0)) == set()


@pytest.mark.parametrize("name", ["ATTITUDE", "LOCAL_POSITION_NED"])
def test_streams_that_do_not_come_are_missing_and_slow_ones_noted(name):
    what = {"ATTITUDE": "attitude", "LOCAL_POSITION_NED": "local position"}[name]
    record = healthy()
    record.counts[name] = 13
    assert (missing(record), notes(record)) == (set(), {what})
    del record.counts[name]
    assert missing(record) == {what}


def test_a_quaternion_is_an_attitude_too():
    record = healthy()
    record.counts["ATTITUDE_QUATERNION"] = record.counts.pop("ATTITUDE")
    record.times_s["ATTITUDE_QUATERNION"] = record.times_s.pop("ATTITUDE")
    assert can_fly(examine(record))


def test_a_bad_link_is_missing():
    record = healthy()
    for number in range(200, 255, 3):
        record.packets.take(number)
    assert missing(record) == {"link"}


def test_an_estimate_that_wanders_is_noted():
    record = healthy()
    record.places.append((0.0, 0.0, 0.4))
    assert notes(record) == {"estimate"}


@pytest.mark.parametrize("action", [0.0, 3.0])
def test_a_return_under_a_roof_is_warned_of(action):
    record = healthy(COM_OBL_RC_ACT=action)
    (finding,) = (finding for finding in examine(record) if finding.subject == "setpoints lost")
    assert finding.level is Level.NOTE
    assert "climbs to 30 m first" in finding.text


def test_a_silent_drone_is_judged_by_what_there_is():
    record = Record(system_id=1)
    record.latest["HEARTBEAT"] = heartbeat()
    assert missing(record) == {"health", "attitude", "local position"}
    assert "parameters" in notes(record)


def test_offboard_must_be_among_the_modes_if_they_are_listed():
    record = healthy()
    record.modes.update({4 << 16 | 3 << 24: "Hold"})
    assert missing(record) == {"offboard"}
    record.modes[6 << 16] = "Offboard"
    assert missing(record) == set()
