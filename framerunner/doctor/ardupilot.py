"""What an ArduPilot drone lacks for the challenge; what it shares with PX4 is in `checks.py`.

ArduPilot reports no accuracy of its estimate. EKF_STATUS_REPORT shows which states it has and how well
measurements agree; its sources are parameters, EK3_SRC1_*.
"""

from __future__ import annotations

from framerunner.doctor.common import (
    CHALLENGE_HEIGHT_M,
    CHALLENGE_REACH_M,
    agreement,
    early_disarming,
    slow_limits,
    takes_velocities,
)
from framerunner.doctor.subjects import Subject, good, missing, note
from framerunner.wire import ardupilot_modes
from framerunner.wire.ardupilot_messages import EXTERNAL_NAVIGATION
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.record import Record
from offboard.safety.check import Checks

_GUIDE = "docs/ardupilot.md, section 5"
_GPS = 3
_POSITION_SOURCES = {0: "nothing", 2: "beacons", _GPS: "GPS", 4: "beacons", 5: "optical flow"}
_POSITION_SOURCES |= {EXTERNAL_NAVIGATION: "external navigation"}
_HEIGHT_SOURCES = {0: "nothing", 1: "barometer", 2: "range finder", _GPS: "GPS", 4: "beacons"}
_HEIGHT_SOURCES |= {EXTERNAL_NAVIGATION: "external navigation"}
_ACCURATE_MM = 100.0
_BAD_VARIANCE = 0.8  # of EKF_STATUS_REPORT: ArduPilot's FS_EKF_THRESH


_SLOWEST: tuple[tuple[Subject, float, str], ...] = (
    ("WPNAV_SPEED", 100.0, "cm/s"),
    ("WPNAV_SPEED_UP", 100.0, "cm/s"),
    ("WPNAV_SPEED_DN", 50.0, "cm/s"),
)


def autopilot(record: Record) -> Checks:
    """Whether it is ArduCopter, whose GUIDED mode takes velocities."""
    heartbeat = record.latest["HEARTBEAT"]
    if not ardupilot_modes.is_arducopter(heartbeat):
        yield missing("autopilot", f"ArduPilot, {record.type_name}", "the challenge needs a multicopter")
        return
    yield good("autopilot", f"ArduPilot, {record.type_name}")
    yield takes_velocities(record, "guided", "use ArduCopter 4.5 or later")


def health(record: Record) -> Checks:
    """The pre-arm checks; ArduPilot reports its reasons as texts."""
    status = record.latest.get("SYS_STATUS")
    if status is None:
        yield missing("health", "no SYS_STATUS", "let the link carry it")
        return
    if status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK or record.armed:
        yield good("pre-arm checks", "passed")
        return
    found = [text.partition(": ")[2] for _, text in record.texts if text.startswith(("PreArm: ", "Arm: "))]
    reasons = "; ".join(dict.fromkeys(found))
    advice = "correct what is named" if reasons else "its estimator needs some 40 s after its start"
    yield missing("pre-arm checks", f"not passed: {reasons}" if reasons else "not passed", advice)


def estimator(record: Record) -> Checks:
    """Which states the estimator has, and whether measurements agree with them."""
    report = record.estimator
    if report is None:
        yield note("estimator", "it does not report its state (EKF_STATUS_REPORT)")
        return
    if not report.has_attitude:
        yield missing("estimator", "it does not know its attitude", "keep the drone still for some seconds")
        return
    yield agreement("estimator", report.ratios, _BAD_VARIANCE, "variance")


def position(record: Record) -> Checks:
    """Where its position and height are from."""
    report, parameters = record.estimator, record.parameters
    source = int(parameters.get("EK3_SRC1_POSXY", _GPS))
    words = _POSITION_SOURCES.get(source, f"source {source}")
    advice = f"give it its position by motion capture or visual odometry: {_GUIDE}"
    if report is not None and not report.has_position:
        if source == EXTERNAL_NAVIGATION:
            advice = f"send poses and set its origin, as `framerunner mocap --origin` does: {_GUIDE}"
        yield missing("position", f"the estimator has none; its source is {words}", advice)
    elif source == EXTERNAL_NAVIGATION:
        yield good("position", f"by {words}")
    else:
        gps = record.latest.get("GPS_RAW_INT")
        accuracy_mm = 0 if gps is None or source != _GPS else gps.h_acc
        if 0 < accuracy_mm <= _ACCURATE_MM:
            yield good("position", f"by {words}, estimated accuracy {accuracy_mm / 1000:.2f} m")
        else:
            accuracy = f", estimated accuracy {accuracy_mm / 1000:.1f} m" if accuracy_mm else ""
            text = f"by {words}{accuracy}: the drone will stray; a frame's opening is 0.38 m wide"
            yield missing("position", text, advice)
    yield from _height(record, advice)


def _height(record: Record, advice: str) -> Checks:
    report = record.estimator
    source = int(record.parameters.get("EK3_SRC1_POSZ", 1))
    words = _HEIGHT_SOURCES.get(source, f"source {source}")
    if report is not None and not report.has_height:
        yield missing("height", f"the estimator has none; its source is {words}", advice)
    elif source == EXTERNAL_NAVIGATION:
        yield good("height", f"by {words}")
    else:
        text = f"by {words}, which drifts in flight; a frame's opening is 0.18 m high"
        yield note("height", text, f"take it from external navigation (EK3_SRC1_POSZ 6): {_GUIDE}")


def limits(record: Record) -> Checks:
    """Parameters that slow the drone down or end the flight."""
    parameters = record.parameters
    yield from slow_limits(record, _SLOWEST)
    yield from early_disarming(record, "DISARM_DELAY")
    if int(parameters.get("GUID_OPTIONS", 0)) & 48:
        advice = "set GUID_OPTIONS to 0: the app needs position and velocity control"
        yield missing("GUID_OPTIONS", f"{parameters['GUID_OPTIONS']:g}", advice)
    if parameters.get("FENCE_ENABLE"):
        fences: tuple[tuple[Subject, float], ...] = (
            ("FENCE_ALT_MAX", CHALLENGE_HEIGHT_M),
            ("FENCE_RADIUS", CHALLENGE_REACH_M),
        )
        for name, minimum in fences:
            value = parameters.get(name)
            if value is not None and value < minimum:
                yield missing(name, f"fence at {value:g} m", f"the challenge needs {minimum:g} m")


def failsafes(record: Record) -> Checks:
    """What the drone does without commands, for a person to confirm."""
    parameters = record.parameters
    timeout_s = parameters.get("GUID_TIMEOUT")
    if timeout_s is not None:
        advice = "" if 0.5 <= timeout_s <= 1.0 else "set GUID_TIMEOUT to 1: until then it flies on"
        yield (note if advice else good)(
            "setpoints lost", f"it stops and hovers after {timeout_s:g} s", advice
        )
    station = parameters.get("FS_GCS_ENABLE")
    if station is not None:
        climb_m = parameters.get("RTL_ALT", 1500.0) / 100
        words = "nothing" if not station else f"action {station:g}"
        advice = ""
        if station in (1.0, 3.0, 4.0):
            words = f"return, which climbs to {climb_m:g} m first"
            advice = "under a roof set FS_GCS_ENABLE to 5 (land)"
        elif station == 5.0:
            words = "land"
        yield (note if advice else good)("ground station lost", words, advice)
    if parameters.get("FS_THR_ENABLE") == 1.0:
        advice = "under a roof set FS_THR_ENABLE to 3 (land)"
        yield note("radio control lost", "return, which climbs to RTL_ALT first", advice)
