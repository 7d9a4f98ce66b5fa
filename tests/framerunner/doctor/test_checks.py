"""What a drone lacks, and what the doctor says about it."""

import struct

import pytest

from framerunner.doctor.checks import can_fly, examine
from framerunner.wire.dialect import event_id, mavlink
from framerunner.wire.session.record import SUMMARY, Record
from offboard.safety.check import Outcome

GOOD_PARAMETERS = {
    "BAT_CRIT_THR": 0.07,
    "COM_DISARM_PRFLT": 10.0,
    "COM_LOW_BAT_ACT": 2.0,
    "COM_OBL_RC_ACT": 4.0,
    "COM_OF_LOSS_T": 1.0,
    "EKF2_DELAY_MAX": 20.0,
    "EKF2_EVP_NOISE": 0.01,
    "EKF2_EV_CTRL": 15.0,
    "EKF2_HGT_REF": 3.0,
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


def estimator_status(flags=431, horizontal_m=0.0028, vertical_m=0.002):
    return mavlink.MAVLink_estimator_status_message(0, flags, 0, 0, 0, 0, 0, 0, horizontal_m, vertical_m)


def event(name, layout, *arguments, level=3):
    packed = struct.pack(layout, *arguments).ljust(40, b"\0")
    return mavlink.MAVLink_event_message(0, 0, event_id(name), 0, 0, level << 4 | level, list(packed))


def summary(armable_modes):
    return event("commander_arming_check_summary", "<BIIII", 0, 0x1100000, 0x80, armable_modes, armable_modes)


def put(record, message):
    """Put a message into a record, without its counts."""
    record.latest[message.get_type()] = message
    record.telemetry.take(message)


def healthy(**parameters):
    record = Record(system_id=1)
    for message in (
        heartbeat(),
        sys_status(),
        version(),
        estimator_status(),
        mavlink.MAVLink_extended_sys_state_message(0, mavlink.MAV_LANDED_STATE_ON_GROUND),
    ):
        put(record, message)
    for name, count in (("ATTITUDE", 301), ("LOCAL_POSITION_NED", 181)):
        record.counts[name], record.times_s[name] = count, (0.0, 6.0)
    for number in range(200):
        record.packets.take(number)
    record.places += [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0)]
    record.parameters.update({**GOOD_PARAMETERS, **parameters})
    return record


def missing(record):
    return {finding.name for finding in examine(record) if finding.outcome is Outcome.FAIL}


def notes(record):
    return {finding.name for finding in examine(record) if finding.outcome is Outcome.NOTE}


def test_a_healthy_drone_can_fly():
    findings = examine(healthy())
    assert can_fly(findings)
    assert {finding.outcome for finding in findings} == {Outcome.PASS}


@pytest.mark.parametrize(
    ("message", "subject"),
    [
        (heartbeat(autopilot=15), "autopilot"),
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
    put(record, message)
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
    record = healthy(**{name: value})
    put(record, estimator_status(*VISION_AND_GPS[0]))
    assert missing(record) == {name}


def test_a_fence_that_does_nothing_is_no_fence():
    assert missing(healthy(GF_MAX_VER_DIST=2.0, GF_ACTION=0.0)) == set()


@pytest.mark.parametrize("name", ["ATTITUDE", "LOCAL_POSITION_NED"])
def test_streams_that_are_not_received_are_missing_and_slow_ones_noted(name):
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


def test_a_vehicle_that_died_while_it_was_listened_to_cannot_fly():
    record = healthy()
    record.heard_s, record.listened_s = 10.0, 13.0
    assert missing(record) == {"link"}


def test_an_estimate_that_drifts_is_noted():
    record = healthy()
    record.places.append((0.0, 0.0, 0.4))
    assert notes(record) == {"estimate"}


# What PX4 v1.17.0 sent (SIH quadrotor): ESTIMATOR_STATUS, whether hold's checks passed, their summary.
GPS = (1023, 0.2928, 0.0716), True, 0x807F3AB0
GPS_AND_RANGE_FINDER = (959, 0.2917, 0.0646), True, 0x807F3AB0
VISION = (431, 0.0028, 0.0020), False, 0x807F3A80
VISION_REQUESTED = (165, 0.0127, 0.3256), False, 0x80013A80  # not sent, or with estimator type MOCAP
VISION_AND_GPS = (959, 0.0183, 0.0170), True, 0x807F3AB0


@pytest.mark.parametrize(
    ("reported", "parameters", "lacks"),
    [
        (GPS, {"EKF2_EV_CTRL": 0.0, "EKF2_HGT_REF": 1.0}, {"position", "height"}),
        (GPS, {"EKF2_EV_CTRL": 15.0, "EKF2_HGT_REF": 3.0}, {"position", "height"}),
        (GPS_AND_RANGE_FINDER, {"EKF2_EV_CTRL": 0.0, "EKF2_HGT_REF": 2.0}, {"position"}),
        (VISION, {}, set()),
        (VISION, {"EKF2_HGT_REF": 0.0}, {"height"}),
        (VISION, {"EKF2_EV_CTRL": 13.0}, {"height"}),
        (VISION, {"EKF2_HGT_REF": 2.0, "EKF2_RNG_CTRL": 0.0}, {"height"}),
        (VISION, {"EKF2_DELAY_MAX": 110.0}, {"estimator"}),
        (VISION_REQUESTED, {}, {"pre-arm checks", "position", "height"}),
        (VISION_AND_GPS, {}, set()),
    ],
)
def test_the_verdict_on_what_px4_reports_of_its_estimate(reported, parameters, lacks):
    estimate, passed, armable_modes = reported
    record = healthy(**parameters)
    record.counts["DISTANCE_SENSOR"] = 60
    put(record, estimator_status(*estimate))
    put(record, sys_status(health=ALL if passed else ALL & ~0x10000000))
    record.arming.take(summary(armable_modes))
    assert missing(record) == lacks


def finding_of(record, subject):
    (finding,) = (finding for finding in examine(record) if finding.name == subject)
    return finding


def test_the_source_of_height_is_the_one_in_use_not_the_one_requested():
    record = healthy()
    assert finding_of(record, "height").value == "by vision, estimated accuracy 0.00 m"
    put(record, estimator_status(*VISION_REQUESTED[0]))
    height = finding_of(record, "height")
    assert height.value.startswith(
        "by barometer, though EKF2_HGT_REF asks for vision, estimated accuracy 0.33 m"
    )
    assert "not MOCAP" in finding_of(record, "position").advice
    assert height.advice == "as for the position"
    put(record, estimator_status(*GPS[0]))
    assert "the drone will stray" in finding_of(record, "position").value


def test_an_ideal_drone_with_a_position_from_gps_can_fly():
    record = healthy()
    del record.parameters["EKF2_HGT_REF"], record.parameters["EKF2_EV_CTRL"]
    put(record, estimator_status(959, 0.0, 0.0))
    assert missing(record) == set()


def test_what_keeps_it_from_arming_in_offboard_is_named():
    record = healthy()
    put(record, sys_status(health=0x2F))
    assert "it reports no reasons" in finding_of(record, "pre-arm checks").advice
    for message in (
        summary(0),
        event("check_modes_global_pos", "<IB", 0x38, 24),
        event("check_modes_offboard_signal", "<IB", 0x4000, 20),
        event("check_modes_manual_control", "<IB", 0xFFFFFFFF, 7, level=4),  # a warning
        event("check_rc_dl_no_dllink", "<IB", 0xFFFFFFFF, 12),
    ):
        record.arming.take(message)
    checks = finding_of(record, "pre-arm checks")
    assert (checks.outcome, checks.value) == (Outcome.FAIL, "not passed in hold: no ground station is heard")
    record.arming.take(summary(VISION[2]))
    assert finding_of(record, "pre-arm checks").value == "passed for offboard, where fly arms it; not in hold"


def test_the_summary_has_px4_s_number():
    assert SUMMARY == 0x01A893E0  # as PX4 sends it


def test_a_fence_of_px4_without_a_global_position_is_noted():
    record = healthy(GF_MAX_VER_DIST=3.5)
    assert notes(record) == {"fence"}
    put(record, estimator_status(*VISION_AND_GPS[0]))
    assert notes(record) == set()


@pytest.mark.parametrize("action", [0.0, 3.0])
def test_a_return_under_a_roof_is_warned_of(action):
    record = healthy(COM_OBL_RC_ACT=action)
    (finding,) = (finding for finding in examine(record) if finding.name == "setpoints lost")
    assert finding.outcome is Outcome.NOTE
    assert "climbs to 30 m first" in finding.value


def test_a_drone_that_sends_little_is_judged_by_that():
    record = Record(system_id=1)
    put(record, heartbeat())
    assert missing(record) == {"health", "attitude", "local position"}
    assert "parameters" in notes(record)


def test_offboard_must_be_among_the_modes_if_they_are_listed():
    record = healthy()
    record.modes.update({4 << 16 | 3 << 24: "Hold"})
    assert missing(record) == {"offboard"}
    record.modes[6 << 16] = "Offboard"
    assert missing(record) == set()


GYRO_ACCEL_BARO, GPS_BIT, VISION_BIT = 0x1 | 0x2 | 0x8, 0x20, 0x80


def sensors(present, enabled, health):
    return mavlink.MAVLink_sys_status_message(
        present, enabled, health | 0x10000000, 0, 16200, -1, 80, 0, 0, 0, 0, 0, 0
    )


def test_which_sensors_the_estimator_relies_on():
    record, everything = healthy(), GYRO_ACCEL_BARO | GPS_BIT | VISION_BIT
    put(record, sensors(everything, everything & ~GPS_BIT, everything))
    finding = finding_of(record, "sensors")
    assert finding.outcome is Outcome.PASS
    assert finding.value == (
        "the estimator relies on gyroscope, accelerometer, barometer, vision position; not on GPS"
    )
    put(record, sensors(everything, everything, everything & ~0x8))
    finding = finding_of(record, "sensors")
    assert finding.outcome is Outcome.NOTE
    assert finding.value.endswith("; barometer fails")


def test_a_drone_that_relies_on_external_poses_has_its_position_by_vision():
    record = healthy(EKF2_EV_CTRL=0.0)
    put(
        record,
        sensors(GYRO_ACCEL_BARO | VISION_BIT, GYRO_ACCEL_BARO | VISION_BIT, GYRO_ACCEL_BARO | VISION_BIT),
    )
    assert finding_of(record, "position").value.startswith("by vision")


@pytest.mark.parametrize(
    ("ratios", "level", "words"),
    [
        ((0.1, 0.2, 0.3, 0.0, 0.0), Outcome.PASS, "largest ratio 0.30"),
        ((0.1, 0.7, 0.3, 0.0, 0.0), Outcome.NOTE, "position 0.70"),
        ((0.1, 0.7, 0.3, 1.4, 0.0), Outcome.FAIL, "position 0.70, heading 1.40"),
        ((float("nan"), 0.2, 0.0, 0.0, 0.0), Outcome.PASS, "largest ratio 0.20"),
    ],
)
def test_how_well_measurements_agree(ratios, level, words):
    record = healthy()
    velocity, position, height, heading, above_ground = ratios
    put(
        record,
        mavlink.MAVLink_estimator_status_message(
            0, 431, velocity, position, height, heading, above_ground, 0, 0.01, 0.01
        ),
    )
    assert finding_of(record, "innovations").outcome is level
    assert words in finding_of(record, "innovations").value


def test_an_estimator_that_is_not_aligned_is_named():
    record = healthy()
    put(record, estimator_status(flags=128))
    assert "estimator" in missing(record)


def test_a_position_by_optical_flow_is_no_reason_not_to_fly():
    """Flags: a relative position predicted and no absolute one; a range finder is heard."""
    record = healthy(EKF2_HGT_REF=0.0, EKF2_EV_CTRL=0.0)
    flags = 431 & ~(mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS | mavlink.ESTIMATOR_POS_HORIZ_ABS)
    put(
        record,
        estimator_status(flags | mavlink.ESTIMATOR_PRED_POS_HORIZ_REL, horizontal_m=1.2, vertical_m=0.3),
    )
    assert "height" in missing(record)
    record.counts["DISTANCE_SENSOR"] = 60
    assert {"position", "height"} <= notes(record)
    assert not {"position", "height"} & missing(record)
    (advice,) = (check.advice for check in examine(record) if check.name == "position")
    assert "doctor --walk" in advice
