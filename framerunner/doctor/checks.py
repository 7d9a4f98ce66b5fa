"""What stands between a drone and the challenge: findings, each with what to do. A record in, words out.

How well a drone knows where it is: PX4's ESTIMATOR_STATUS tells which sensors are in use and how accurate the
estimate is; parameters tell only what was asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from math import isfinite

from framerunner.doctor import names
from framerunner.doctor.record import Record
from wire.dialect import Message, mavlink
from wire.px4_modes import OFFBOARD

WANTED_HZ = 50.0  # what `fly` and `camera` ask for
LOW_HZ = 20.0  # the mission's own rate
LOST_SHARE = 0.05
BATTERY_PERCENT = 40
CHALLENGE_HEIGHT_M = 3.0  # frames hang up to 2 m, the mission flies up from them
CHALLENGE_REACH_M = 8.0
ACCURATE_M = 0.1  # standard deviation; PX4 with GPS says 0.3, with motion capture 0.01
WANDER_M = 0.1
_GUIDE = "docs/real-drone.md, section 3"
_EV_POSITION, _EV_HEIGHT = 1, 2  # bits of EKF2_EV_CTRL
_SLOW_ESTIMATOR = (
    # name, more than this is too much, unit
    ("EKF2_EVP_NOISE", 0.05, "m"),
    ("EKF2_EVV_NOISE", 0.05, "m/s"),
    ("EKF2_DELAY_MAX", 50.0, "ms"),
    ("EKF2_TAU_POS", 0.15, "s"),
    ("EKF2_TAU_VEL", 0.15, "s"),
)


class Level(Enum):
    """How much a finding matters."""

    GOOD = "good"
    NOTE = "note"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing about the drone.

    Attributes:
        level: whether the challenge can be flown with it.
        subject: a word or two.
        text: what is the case.
        advice: what to do; empty if nothing.
    """

    level: Level
    subject: str
    text: str
    advice: str = ""


def can_fly(findings: list[Finding]) -> bool:
    """Whether nothing is missing."""
    return all(finding.level is not Level.MISSING for finding in findings)


def examine(record: Record) -> list[Finding]:
    """Everything there is to say, in the order of a flight's needs."""
    return [finding for check in CHECKS for finding in check(record)]


def check_autopilot(record: Record) -> Iterator[Finding]:
    """PX4, and a multicopter."""
    heartbeat = record.latest["HEARTBEAT"]
    kind = names.kind_name(heartbeat.type)
    if heartbeat.autopilot != mavlink.MAV_AUTOPILOT_PX4:
        name = names.AUTOPILOTS.get(heartbeat.autopilot, f"autopilot {heartbeat.autopilot}")
        yield Finding(Level.MISSING, "autopilot", name, "fly speaks PX4's modes; use a PX4 vehicle")
    elif heartbeat.type not in _MULTICOPTERS:
        yield Finding(Level.MISSING, "autopilot", f"PX4, {kind}", "the challenge needs a multicopter")
    else:
        yield Finding(Level.GOOD, "autopilot", f"PX4, {kind}")


def check_armed(record: Record) -> Iterator[Finding]:
    """Disarmed, on the ground, no failsafe."""
    heartbeat = record.latest["HEARTBEAT"]
    mode = names.mode_name(heartbeat.custom_mode, record.modes)
    if record.armed:
        yield Finding(Level.MISSING, "armed", f"in {mode}", "land and disarm; fly arms by itself")
    elif record.telemetry.landed is False:
        yield Finding(Level.MISSING, "landed", "it takes itself to be in the air", "put it down; restart it")
    else:
        yield Finding(Level.GOOD, "state", f"disarmed on the ground, in {mode}")
    if heartbeat.system_status >= mavlink.MAV_STATE_CRITICAL:
        yield Finding(
            Level.MISSING, "failsafe", names.STATES[heartbeat.system_status], "see what it says below"
        )


def check_health(record: Record) -> Iterator[Finding]:
    """Pre-arm checks, and which sensors are not well.

    PX4's checks are those of its present mode. Hold wants a global position; offboard, to which `fly` goes,
    does not.
    """
    status = record.latest.get("SYS_STATUS")
    if status is None:
        yield Finding(Level.MISSING, "health", "no SYS_STATUS", "let the link carry it; see MAV_x_MODE")
        return
    sick = status.onboard_control_sensors_enabled & status.onboard_control_sensors_present
    sick &= ~status.onboard_control_sensors_health
    sick_names = ", ".join(name for bit, name in names.SENSORS.items() if sick & bit)
    ready = status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK
    mode = names.mode_name(record.latest["HEARTBEAT"].custom_mode, record.modes).lower()
    if not ready and not record.armed and record.arming.ready_for_offboard:
        text = f"passed for offboard, where fly arms it; not in {mode}"
        yield Finding(Level.GOOD, "pre-arm checks", text)
    elif not ready and not record.armed:
        reasons = "; ".join((*record.arming.failures, *((sick_names,) if sick_names else ())))
        words = f"not passed in {mode}" + (f": {reasons}" if reasons else "")
        advice = "mend what is named, here and below"
        if record.arming.armable_modes is None:
            advice = "it does not tell why; fly may pass in offboard, which needs no global position"
        yield Finding(Level.MISSING, "pre-arm checks", words, advice)
    elif sick_names:
        yield Finding(Level.NOTE, "health", f"not well: {sick_names}", "mend it before flying")
    else:
        yield Finding(Level.GOOD, "pre-arm checks", "passed")


def check_offboard(record: Record) -> Iterator[Finding]:
    """Offboard mode with velocities."""
    version = record.latest.get("AUTOPILOT_VERSION")
    if record.modes and OFFBOARD.custom_mode not in record.modes:
        yield Finding(Level.MISSING, "offboard", "not among its modes", "use PX4 1.13 or later")
    elif version is None:
        yield Finding(Level.NOTE, "offboard", "it does not say what it can do", "use PX4 1.13 or later")
    elif not version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED:
        yield Finding(Level.MISSING, "offboard", "takes no local setpoints", "use PX4 1.13 or later")
    else:
        yield Finding(Level.GOOD, "offboard", "takes velocities in body axes")


def check_streams(record: Record) -> Iterator[Finding]:
    """Attitude and position, often enough."""
    for kinds, what in ((_ATTITUDES, "attitude"), (("LOCAL_POSITION_NED",), "local position")):
        rate_hz = max(record.rate_hz(kind) for kind in kinds)
        if rate_hz == 0.0:
            advice = "give it GPS, optical flow, vision or motion capture; wait for its estimate"
            yield Finding(Level.MISSING, what, f"no {' or '.join(kinds)} comes", advice)
        elif rate_hz < LOW_HZ:
            advice = f"fly asks for {WANTED_HZ:g} Hz; see that the line can carry it"
            yield Finding(Level.NOTE, what, f"only {rate_hz:.0f} Hz", advice)
        else:
            yield Finding(Level.GOOD, what, f"{rate_hz:.0f} Hz")


def check_link(record: Record) -> Iterator[Finding]:
    """Packets lost on the way."""
    lost = record.packets.lost_share
    words = f"{lost:.1%} of {record.packets.passed} packets lost"
    if lost > LOST_SHARE:
        yield Finding(Level.MISSING, "link", words, "come nearer, or use a better line")
    else:
        yield Finding(Level.GOOD, "link", words)


def check_battery(record: Record) -> Iterator[Finding]:
    """Enough for a try."""
    status = record.latest.get("SYS_STATUS")
    if status is None or status.battery_remaining < 0:
        yield Finding(Level.NOTE, "battery", "it does not say how full it is", "measure it")
        return
    volts = "" if status.voltage_battery in (0, 65535) else f", {status.voltage_battery / 1000:.1f} V"
    words = f"{status.battery_remaining} %{volts}"
    critical = 100 * record.parameters.get("BAT_CRIT_THR", 0.07)
    if status.battery_remaining <= critical:
        yield Finding(Level.MISSING, "battery", words, "charge it: it would land at once")
    elif status.battery_remaining < BATTERY_PERCENT:
        yield Finding(Level.NOTE, "battery", words, "charge it: a try takes three minutes")
    else:
        yield Finding(Level.GOOD, "battery", words)


def check_limits(record: Record) -> Iterator[Finding]:
    """Parameters that hold the drone back or end the flight."""
    parameters = record.parameters
    if not parameters:
        yield Finding(Level.NOTE, "parameters", "none was answered", "see that the link is not read-only")
        return
    for name, least, unit in (
        ("MPC_XY_VEL_MAX", 1.0, "m/s"),
        ("MPC_Z_VEL_MAX_UP", 1.0, "m/s"),
        ("MPC_Z_VEL_MAX_DN", 1.0, "m/s"),
        ("MC_YAWRATE_MAX", 60.0, "deg/s"),
    ):
        value = parameters.get(name)
        if value is not None and value < least:
            yield Finding(Level.MISSING, name, f"{value:g} {unit}", f"set it to {least:g} or more")
    yield from _fence(record)
    preflight_s = parameters.get("COM_DISARM_PRFLT", 0.0)
    if 0.0 < preflight_s < 5.0:
        advice = "set it to 10: take-off begins by a slow ramp"
        yield Finding(Level.MISSING, "COM_DISARM_PRFLT", f"{preflight_s:g} s", advice)


def _fence(record: Record) -> Iterator[Finding]:
    parameters = record.parameters
    limits = (("GF_MAX_VER_DIST", CHALLENGE_HEIGHT_M), ("GF_MAX_HOR_DIST", CHALLENGE_REACH_M))
    if not parameters.get("GF_ACTION") or not any(parameters.get(name, 0.0) > 0.0 for name, _ in limits):
        return
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is not None and not status.flags & mavlink.ESTIMATOR_POS_HORIZ_ABS:
        text = "PX4's fence does nothing without a global position"
        yield Finding(Level.NOTE, "fence", text, "put a net around the flying space")
        return
    for name, least_m in limits:
        value = parameters.get(name, 0.0)
        if 0.0 < value < least_m:
            advice = f"the challenge needs {least_m:g} m; set more, or 0"
            yield Finding(Level.MISSING, name, f"fence at {value:g} m", advice)


def check_failsafes(record: Record) -> Iterator[Finding]:
    """What the drone does when it is left alone: a person must have wanted it so."""
    parameters = record.parameters
    climb_m = parameters.get("RTL_RETURN_ALT")
    climbs = "" if climb_m is None else f", which climbs to {climb_m:g} m first"
    action, loss_s = parameters.get("COM_OBL_RC_ACT"), parameters.get("COM_OF_LOSS_T")
    if action is not None:
        after = "" if loss_s is None else f" after {loss_s:g} s"
        words = names.OFFBOARD_LOSS.get(int(action), f"action {action:g}")
        if action <= 2 and parameters.get("NAV_RCL_ACT") == 2:
            words += f" or, without radio control, return{climbs}"
        elif action == 3:
            words += climbs
        advice = "under a roof set COM_OBL_RC_ACT to 4 (land)" if "return" in words else ""
        level = Level.NOTE if advice else Level.GOOD
        yield Finding(level, "setpoints lost", f"{words}{after}", advice)
    if loss_s is not None and loss_s < 0.5:
        advice = "set it to 1: the app's watchdog needs half a second"
        yield Finding(Level.MISSING, "COM_OF_LOSS_T", f"{loss_s:g} s", advice)
    station = parameters.get("NAV_DLL_ACT")
    if station is not None:
        words = names.LINK_LOSS.get(int(station), f"action {station:g}")
        needed = "; it arms only while it hears one, as fly is" if station else ""
        yield Finding(Level.GOOD, "ground station lost", words + (climbs if station == 2 else "") + needed)
    low = parameters.get("COM_LOW_BAT_ACT")
    if low is not None:
        yield Finding(Level.GOOD, "battery low", names.LOW_BATTERY.get(int(low), f"action {low:g}"))


def check_position(record: Record) -> Iterator[Finding]:
    """Something tells the drone its place, to within a part of a frame's opening."""
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is None:
        yield Finding(Level.NOTE, "position", "it does not say what its estimate is made from")
        return
    if not status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL:
        yield Finding(
            Level.MISSING, "position", "no sensor tells the drone where it is", _position_advice(record)
        )
        return
    source, accuracy_m = _position_source(record, status), status.pos_horiz_accuracy
    if accuracy_m <= ACCURATE_M:
        yield Finding(Level.GOOD, "position", f"by {source}, estimated accuracy {accuracy_m:.2f} m")
        return
    accuracy = f"estimated accuracy {accuracy_m:.1f} m" if isfinite(accuracy_m) else "unknown accuracy"
    text = f"by {source}, {accuracy}: the drone will stray; a frame's opening is 0.38 m wide"
    yield Finding(Level.MISSING, "position", text, _position_advice(record))


def check_height(record: Record) -> Iterator[Finding]:
    """The height comes from something better than air pressure or GPS."""
    status, parameters = record.latest.get("ESTIMATOR_STATUS"), record.parameters
    if status is None:
        return
    reference = parameters.get("EKF2_HGT_REF")
    if not status.flags & mavlink.ESTIMATOR_POS_VERT_ABS:
        yield Finding(Level.MISSING, "height", "no sensor tells the drone its height", f"see {_GUIDE}")
        return
    accuracy_m = status.pos_vert_accuracy
    accuracy = f"estimated accuracy {accuracy_m:.2f} m"
    if reference is None:
        fine = accuracy_m <= ACCURATE_M
        advice = "" if fine else f"take height from vision or a range finder: {_GUIDE}"
        yield Finding(Level.GOOD if fine else Level.MISSING, "height", accuracy, advice)
        return
    wished = names.HEIGHT_SOURCE.get(int(reference), "unknown means")
    source = _height_source(record, status, wished)
    if source in ("vision", "range finder") and accuracy_m <= ACCURATE_M:
        yield Finding(Level.GOOD, "height", f"by {source}, {accuracy}")
        return
    but = "" if source == wished else f", though EKF2_HGT_REF asks for {wished}"
    text = f"by {source}{but}, {accuracy}; in flight it wanders, and a frame's opening is 0.18 m high"
    yield Finding(Level.MISSING, "height", text, _height_advice(record, wished))


def check_vision_settings(record: Record) -> Iterator[Finding]:
    """With vision: the estimate follows it closely."""
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is None or not _vision_in_use(record, status):
        return
    slow = [
        f"{name} {record.parameters[name]:g} {unit}"
        for name, limit, unit in _SLOW_ESTIMATOR
        if record.parameters.get(name, 0.0) > limit
    ]
    if slow:
        text = f"follows vision too slowly for the frames: {', '.join(slow)}"
        advice = "set what docs/real-drone.md, section 7.3, advises, then restart the drone"
        yield Finding(Level.MISSING, "estimator", text, advice)


def check_still(record: Record) -> Iterator[Finding]:
    """The position stays where the drone stands."""
    if not record.places or record.armed:
        return
    wander_m = record.wander_m
    if wander_m > WANDER_M:
        text = f"wanders {wander_m:.2f} m while it stands; a frame's opening is 0.18 m high"
        yield Finding(Level.NOTE, "estimate", text, f"see {_GUIDE}")
    else:
        yield Finding(Level.GOOD, "estimate", f"still within {wander_m:.2f} m")


def _position_advice(record: Record) -> str:
    if int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_POSITION:
        return (
            "EKF2_EV_CTRL asks for vision, but none is used: send ODOMETRY with estimator type VISION (not "
            f"MOCAP), or VISION_POSITION_ESTIMATE, at 50 Hz: {_GUIDE}"
        )
    return f"give it its position by motion capture or visual odometry: {_GUIDE}"


def _height_advice(record: Record, wished: str) -> str:
    if wished != "vision":
        return f"take height from vision (EKF2_HGT_REF 3) or a range finder (2): {_GUIDE}"
    if not int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_HEIGHT:
        return f"set EKF2_EV_CTRL to 15: {_GUIDE}"
    return "as for the position"


def _vision_in_use(record: Record, status: Message) -> bool:
    """Whether external vision is what the position is made from, as far as flags and accuracy can tell."""
    asked = int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_POSITION
    aided = status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
    return bool(asked and aided and status.pos_horiz_accuracy <= ACCURATE_M)


def _position_source(record: Record, status: Message) -> str:
    sources = []
    if status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS:
        sources.append("GPS")
    if _vision_in_use(record, status):
        sources.append("vision")
    return " and ".join(sources) or "optical flow or another relative sensor"


def _height_source(record: Record, status: Message, wished: str) -> str:
    """Where the height comes from: PX4 turns to the barometer when its reference is not there."""
    parameters = record.parameters
    there = {
        "barometer": True,
        "GPS": bool(status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS),
        "range finder": bool(parameters.get("EKF2_RNG_CTRL", 1.0)) and "DISTANCE_SENSOR" in record.counts,
        "vision": _vision_in_use(record, status) and bool(int(parameters["EKF2_EV_CTRL"]) & _EV_HEIGHT),
    }
    return wished if there.get(wished) else "barometer"


_ATTITUDES = ("ATTITUDE", "ATTITUDE_QUATERNION")
_MULTICOPTERS = (
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_HEXAROTOR,
    mavlink.MAV_TYPE_OCTOROTOR,
    mavlink.MAV_TYPE_TRICOPTER,
    mavlink.MAV_TYPE_COAXIAL,
)
CHECKS: tuple[Callable[[Record], Iterator[Finding]], ...] = (
    check_autopilot,
    check_armed,
    check_health,
    check_offboard,
    check_streams,
    check_link,
    check_position,
    check_height,
    check_vision_settings,
    check_still,
    check_battery,
    check_limits,
    check_failsafes,
)
