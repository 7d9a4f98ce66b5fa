"""What a drone lacks for the challenge: findings, each with what to do. A record in, words out.

How well a drone knows its position: PX4's ESTIMATOR_STATUS shows which sensors are in use and how accurate
the estimate is; parameters show only what was requested.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite, isnan

from framerunner.doctor import ardupilot
from framerunner.doctor.common import (
    CHALLENGE_HEIGHT_M,
    CHALLENGE_REACH_M,
    agreement,
    early_disarming,
    slow_limits,
    takes_velocities,
)
from framerunner.doctor.subjects import Subject, good, missing, note
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.px4_modes import OFFBOARD
from framerunner.wire.session.record import Record
from offboard.safety.check import Check, Checks, failures

WANTED_HZ = 50.0  # as `fly` and `camera` request
LOW_HZ = 20.0  # the mission's own rate
LOST_SHARE = 0.05
BATTERY_PERCENT = 40
ACCURATE_M = 0.1  # standard deviation; PX4 reports 0.3 with GPS, 0.01 with motion capture
WANDER_M = 0.1
_GUIDE = "docs/real-drone.md, step 6"
_SLOWEST: tuple[tuple[Subject, float, str], ...] = (
    ("MPC_XY_VEL_MAX", 1.0, "m/s"),
    ("MPC_Z_VEL_MAX_UP", 1.0, "m/s"),
    ("MPC_Z_VEL_MAX_DN", 1.0, "m/s"),
    ("MC_YAWRATE_MAX", 60.0, "deg/s"),
)
_EV_POSITION, _EV_HEIGHT = 1, 2  # bits of EKF2_EV_CTRL
_SLOW_ESTIMATOR = (
    # name, upper limit, unit
    ("EKF2_EVP_NOISE", 0.05, "m"),
    ("EKF2_EVV_NOISE", 0.05, "m/s"),
    ("EKF2_DELAY_MAX", 50.0, "ms"),
    ("EKF2_TAU_POS", 0.15, "s"),
    ("EKF2_TAU_VEL", 0.15, "s"),
)
_ATTITUDES = ("ATTITUDE", "ATTITUDE_QUATERNION")
_MULTICOPTERS = (
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_HEXAROTOR,
    mavlink.MAV_TYPE_OCTOROTOR,
    mavlink.MAV_TYPE_TRICOPTER,
    mavlink.MAV_TYPE_COAXIAL,
)
_MEASURING = {
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO: "gyroscope",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL: "accelerometer",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG: "compass",
    mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE: "barometer",
    mavlink.MAV_SYS_STATUS_SENSOR_GPS: "GPS",
    mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW: "optical flow",
    mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION: "vision position",
    mavlink.MAV_SYS_STATUS_SENSOR_LASER_POSITION: "range finder",
}
_SENSORS = _MEASURING | {
    mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS: "motor outputs",
    mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER: "radio control",
    mavlink.MAV_SYS_STATUS_GEOFENCE: "geofence",
    mavlink.MAV_SYS_STATUS_AHRS: "attitude estimate",
    mavlink.MAV_SYS_STATUS_LOGGING: "logging",
    mavlink.MAV_SYS_STATUS_SENSOR_BATTERY: "battery",
    mavlink.MAV_SYS_STATUS_SENSOR_PROPULSION: "propulsion",
    mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL: "position control",
    mavlink.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL: "height control",
}
# Values of PX4's parameters.
_OFFBOARD_LOSS = {0: "position mode", 1: "altitude mode", 2: "stabilised mode", 3: "return", 4: "land"}
_OFFBOARD_LOSS |= {5: "hold", 6: "terminate", 7: "disarm"}
_LINK_LOSS = {0: "nothing", 1: "hold", 2: "return", 3: "land", 5: "terminate", 6: "disarm"}
_LOW_BATTERY = {0: "warns", 2: "lands", 3: "returns, then lands"}
_HEIGHT_SOURCE = {0: "barometer", 1: "GPS", 2: "range finder", 3: "vision"}


def can_fly(findings: list[Check]) -> bool:
    """Whether nothing is missing."""
    return not failures(findings)


def examine(record: Record) -> list[Check]:
    """All findings, in the order in which a flight needs them."""
    checks = _ARDUPILOT_CHECKS if record.is_ardupilot else _CHECKS
    return [finding for judge in checks for finding in judge(record)]


def _one_vehicle(record: Record) -> Checks:
    """Whether all packets of the system id are of one vehicle."""
    problem = record.senders.problem
    if problem:
        advice = "switch the other one off, or give it another id (MAV_SYS_ID; ArduPilot: SYSID_THISMAV)"
        yield missing("one vehicle", problem, advice)


def _autopilot(record: Record) -> Checks:
    heartbeat = record.latest["HEARTBEAT"]
    if heartbeat.autopilot != mavlink.MAV_AUTOPILOT_PX4:
        yield missing(
            "autopilot", record.autopilot_name, "fly uses the modes of PX4 and ArduPilot; use one of them"
        )
    elif heartbeat.type not in _MULTICOPTERS:
        yield missing("autopilot", f"PX4, {record.type_name}", "the challenge needs a multicopter")
    else:
        yield good("autopilot", f"PX4, {record.type_name}")


def _armed(record: Record) -> Checks:
    if record.armed:
        yield missing("armed", f"in {record.mode_name}", "land and disarm; fly arms by itself")
    elif record.telemetry.landed is False:
        yield missing("landed", "it reports that it is in the air", "put it down; restart it")
    else:
        yield good("state", f"disarmed on the ground, in {record.mode_name}")
    if record.latest["HEARTBEAT"].system_status >= mavlink.MAV_STATE_CRITICAL:
        yield missing("failsafe", record.state_name, "see its status texts below")


def _health(record: Record) -> Checks:
    """Pre-arm checks and unhealthy sensors.

    PX4's checks are those of its present mode. Hold requires a global position; offboard, which `fly` enters,
    does not.
    """
    status = record.latest.get("SYS_STATUS")
    if status is None:
        yield missing("health", "no SYS_STATUS", "let the link carry it; see MAV_x_MODE")
        return
    unhealthy = status.onboard_control_sensors_enabled & status.onboard_control_sensors_present
    unhealthy &= ~status.onboard_control_sensors_health
    unhealthy_names = _names(unhealthy)
    ready = status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK
    mode = record.mode_name.lower()
    if not ready and not record.armed and record.arming.ready_for_offboard:
        words = "passed for offboard, where fly arms it"
        also = "" if mode == "offboard" else f"; not in {mode}"  # in it they fail until setpoints come
        yield good("pre-arm checks", words + also)
    elif not ready and not record.armed:
        reasons = "; ".join((*record.arming.failures, *((unhealthy_names,) if unhealthy_names else ())))
        words = f"not passed in {mode}" + (f": {reasons}" if reasons else "")
        advice = "correct what is named, here and below"
        if record.arming.armable_modes is None:
            advice = "it reports no reasons; fly may pass in offboard, which needs no global position"
        yield missing("pre-arm checks", words, advice)
    elif unhealthy_names:
        yield note("health", f"unhealthy: {unhealthy_names}", "correct it before flying")
    else:
        yield good("pre-arm checks", "passed")


def _names(bits: int) -> str:
    return ", ".join(name for bit, name in _SENSORS.items() if bits & bit)


def _sensors(record: Record) -> Checks:
    """What the estimator relies on: PX4 enables what is there, the simulated drone what it uses."""
    status = record.latest.get("SYS_STATUS")
    if status is None:
        return
    present = status.onboard_control_sensors_present & sum(_MEASURING)
    used = present & status.onboard_control_sensors_enabled & status.onboard_control_sensors_health
    failing = present & ~status.onboard_control_sensors_health
    idle = present & ~used & ~failing
    words = [f"the estimator relies on {_names(used)}" if used else "the estimator relies on no sensor"]
    words += [f"not on {_names(idle)}"] if idle else []
    words += [f"{_names(failing)} {'fails' if failing.bit_count() == 1 else 'fail'}"] if failing else []
    advice = "correct what fails before flying" if failing else ""
    yield (note if failing else good)("sensors", "; ".join(words), advice)


def _innovations(record: Record) -> Checks:
    """Whether the measurements agree with the estimate."""
    report = record.estimator
    if report is None:
        return
    if not report.has_attitude:
        yield missing("estimator", "it does not know its attitude", "keep the drone still for some seconds")
        return
    if record.latest["ESTIMATOR_STATUS"].flags & mavlink.ESTIMATOR_ACCEL_ERROR:
        yield missing("estimator", "its accelerometer measures wrongly", "calibrate it, damp vibration")
    yield agreement("innovations", report.ratios, 1.0, "ratio")


def _offboard(record: Record) -> Checks:
    advice = "use PX4 1.13 or later"
    if record.modes and OFFBOARD.custom_mode not in record.modes:
        yield missing("offboard", "not among its modes", advice)
    else:
        yield takes_velocities(record, "offboard", advice)


def _streams(record: Record) -> Checks:
    streams: tuple[tuple[tuple[str, ...], Subject], ...] = (
        (_ATTITUDES, "attitude"),
        (("LOCAL_POSITION_NED",), "local position"),
    )
    for kinds, what in streams:
        rate_hz = max(record.rate_hz(kind) for kind in kinds)
        if rate_hz == 0.0:
            advice = "give it GPS, optical flow, vision or motion capture; wait for its estimate"
            yield missing(what, f"no {' or '.join(kinds)} is received", advice)
        elif rate_hz < LOW_HZ:
            advice = f"fly requests {WANTED_HZ:g} Hz; use a link that can carry it"
            yield note(what, f"only {rate_hz:.0f} Hz", advice)
        else:
            yield good(what, f"{rate_hz:.0f} Hz")


def _link(record: Record) -> Checks:
    lost = record.packets.lost_share
    words = f"{lost:.1%} of {record.packets.sent} packets lost"
    if record.silence:
        yield missing("link", f"the vehicle was {record.silence}: all this is old", "is it still running?")
    elif lost > LOST_SHARE:
        yield missing("link", words, "move nearer, or use a better link")
    else:
        yield good("link", words)


def _battery(record: Record) -> Checks:
    percent, volts = record.charge
    if isnan(percent):
        yield note("battery", "its charge is not reported", "measure it")
        return
    words = f"{percent:.0f} %" + ("" if isnan(volts) else f", {volts:.1f} V")
    if percent <= 100 * record.parameters.get("BAT_CRIT_THR", 0.07):
        yield missing("battery", words, "charge it: it would land at once")
    elif percent < BATTERY_PERCENT:
        yield note("battery", words, "charge it: a try takes three minutes")
    else:
        yield good("battery", words)


def _limits(record: Record) -> Checks:
    """Parameters that slow the drone down or end the flight."""
    yield from slow_limits(record, _SLOWEST)
    yield from _fence(record)
    yield from early_disarming(record, "COM_DISARM_PRFLT")


def _fence(record: Record) -> Checks:
    parameters = record.parameters
    limits: tuple[tuple[Subject, float], ...] = (
        ("GF_MAX_VER_DIST", CHALLENGE_HEIGHT_M),
        ("GF_MAX_HOR_DIST", CHALLENGE_REACH_M),
    )
    if not parameters.get("GF_ACTION") or not any(parameters.get(name, 0.0) > 0.0 for name, _ in limits):
        return
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is not None and not status.flags & mavlink.ESTIMATOR_POS_HORIZ_ABS:
        text = "PX4's fence has no effect without a global position"
        yield note("fence", text, "put a net around the flying space")
        return
    for name, minimum_m in limits:
        value = parameters.get(name, 0.0)
        if 0.0 < value < minimum_m:
            yield missing(
                name, f"fence at {value:g} m", f"the challenge needs {minimum_m:g} m; set more, or 0"
            )


def _failsafes(record: Record) -> Checks:
    """What the drone does without commands, for a person to confirm."""
    parameters = record.parameters
    climb_m = parameters.get("RTL_RETURN_ALT")
    climbs = "" if climb_m is None else f", which climbs to {climb_m:g} m first"
    action, loss_s = parameters.get("COM_OBL_RC_ACT"), parameters.get("COM_OF_LOSS_T")
    if action is not None:
        after = "" if loss_s is None else f" after {loss_s:g} s"
        words = _OFFBOARD_LOSS.get(int(action), f"action {action:g}")
        if action <= 2 and parameters.get("NAV_RCL_ACT") == 2:
            words += f" or, without radio control, return{climbs}"
        elif action == 3:
            words += climbs
        advice = "under a roof set COM_OBL_RC_ACT to 4 (land)" if "return" in words else ""
        yield (note if advice else good)("setpoints lost", f"{words}{after}", advice)
    if loss_s is not None and loss_s < 0.5:
        yield missing("COM_OF_LOSS_T", f"{loss_s:g} s", "set it to 1: the app's watchdog needs half a second")
    station = parameters.get("NAV_DLL_ACT")
    if station is not None:
        words = _LINK_LOSS.get(int(station), f"action {station:g}")
        needed = "; it arms only while it receives one's heartbeats, which fly sends" if station else ""
        yield good("ground station lost", words + (climbs if station == 2 else "") + needed)
    low = parameters.get("COM_LOW_BAT_ACT")
    if low is not None:
        yield good("battery low", _LOW_BATTERY.get(int(low), f"action {low:g}"))


def _position(record: Record) -> Checks:
    """Whether the position is accurate to a part of a gate's opening."""
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is None:
        yield note("position", "it does not report what its estimate is made from")
        return
    advice = f"give it its position by motion capture or visual odometry: {_GUIDE}"
    if int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_POSITION:
        advice = (
            "EKF2_EV_CTRL requests vision, but none is used: send ODOMETRY with estimator type VISION (not "
            f"MOCAP) at 50 Hz, as `framerunner mocap` does: {_GUIDE}"
        )
    if not status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL:
        yield missing("position", "no sensor measures the drone's position", advice)
        return
    sources = ["GPS"] if status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS else []
    sources += ["vision"] if _vision_in_use(record, status) else []
    sources += ["optical flow"] if _uses(record, mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW) else []
    source = " and ".join(sources) or "optical flow or another relative sensor"
    accuracy_m = status.pos_horiz_accuracy
    if accuracy_m <= ACCURATE_M:
        yield good("position", f"by {source}, estimated accuracy {accuracy_m:.2f} m")
        return
    accuracy = f"estimated accuracy {accuracy_m:.1f} m" if isfinite(accuracy_m) else "unknown accuracy"
    if _drifts(record, status):
        text = (
            f"by {source}, {accuracy}: it drifts; missions with `vision: frames` find their place themselves"
        )
        yield note("position", text, "framerunner doctor --walk 40 says how well it sees this floor")
        return
    text = f"by {source}, {accuracy}: the drone will stray; a frame's opening is 0.38 m wide"
    yield missing("position", text, advice)


def _height(record: Record) -> Checks:
    """Whether the height is from something better than air pressure or GPS."""
    status, parameters = record.latest.get("ESTIMATOR_STATUS"), record.parameters
    if status is None:
        return
    reference = parameters.get("EKF2_HGT_REF")
    if not status.flags & mavlink.ESTIMATOR_POS_VERT_ABS:
        yield missing("height", "no sensor measures the drone's height", f"see {_GUIDE}")
        return
    accuracy_m = status.pos_vert_accuracy
    accuracy = f"estimated accuracy {accuracy_m:.2f} m"
    if reference is None:
        fine = accuracy_m <= ACCURATE_M
        advice = "" if fine else f"take height from vision or a range finder: {_GUIDE}"
        yield (good if fine else missing)("height", accuracy, advice)
        return
    requested = _HEIGHT_SOURCE.get(int(reference), "unknown means")
    source = _height_source(record, status, requested)
    if source in ("vision", "range finder") and accuracy_m <= ACCURATE_M:
        yield good("height", f"by {source}, {accuracy}")
        return
    advice = "as for the position"
    if requested != "vision":
        advice = f"take height from vision (EKF2_HGT_REF 3) or a range finder (2): {_GUIDE}"
    elif not int(parameters.get("EKF2_EV_CTRL", 0)) & _EV_HEIGHT:
        advice = f"set EKF2_EV_CTRL to 15: {_GUIDE}"
    but = "" if source == requested else f", though EKF2_HGT_REF asks for {requested}"
    text = f"by {source}{but}, {accuracy}; in flight it drifts, and a frame's opening is 0.18 m high"
    if _drifts(record, status) and "DISTANCE_SENSOR" in record.counts:
        yield note("height", text, "missions with `vision: frames` find it themselves")
        return
    yield missing("height", text, advice)


def _vision_settings(record: Record) -> Checks:
    """With vision: whether the estimate follows it closely."""
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
        advice = "set what docs/real-drone.md, step 6, advises, then restart the drone"
        yield missing("estimator", text, advice)


def _still(record: Record) -> Checks:
    """Whether the position stays the same while the drone stands."""
    if not record.places or record.armed:
        return
    wander_m = record.wander_m
    if wander_m > WANDER_M:
        text = f"drifts {wander_m:.2f} m while it stands; a frame's opening is 0.18 m high"
        yield note("estimate", text, f"see {_GUIDE}")
    else:
        yield good("estimate", f"still within {wander_m:.2f} m")


def _drifts(record: Record, status: Message) -> bool:
    """Whether the position is from optical flow, or another sensor that does not know where the drone is."""
    relative = status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
    absolute = status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS
    return bool(relative and not absolute) and not _vision_in_use(record, status)


def _vision_in_use(record: Record, status: Message) -> bool:
    """Whether the position is from external vision, as far as flags and accuracy show."""
    if _uses(record, mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION):
        return True
    asked = int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_POSITION
    aided = status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
    return bool(asked and aided and status.pos_horiz_accuracy <= ACCURATE_M)


def _uses(record: Record, sensor: int) -> bool:
    """Whether the drone reports that it relies on a sensor of which PX4 reports nothing."""
    status = record.latest.get("SYS_STATUS")
    if status is None:
        return False
    return bool(status.onboard_control_sensors_enabled & status.onboard_control_sensors_health & sensor)


def _height_source(record: Record, status: Message, requested: str) -> str:
    """Where the height is from: PX4 falls back to the barometer when its reference is missing."""
    parameters = record.parameters
    present = {
        "barometer": True,
        "GPS": bool(status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS),
        "range finder": bool(parameters.get("EKF2_RNG_CTRL", 1.0)) and "DISTANCE_SENSOR" in record.counts,
        "vision": _vision_in_use(record, status)
        and bool(int(parameters.get("EKF2_EV_CTRL", 0)) & _EV_HEIGHT),
    }
    return requested if present.get(requested) else "barometer"


_CHECKS: tuple[Callable[[Record], Checks], ...] = (
    _one_vehicle,
    _autopilot,
    _armed,
    _health,
    _sensors,
    _innovations,
    _offboard,
    _streams,
    _link,
    _position,
    _height,
    _vision_settings,
    _still,
    _battery,
    _limits,
    _failsafes,
)
_ARDUPILOT_CHECKS: tuple[Callable[[Record], Checks], ...] = (
    _one_vehicle,
    ardupilot.autopilot,
    _armed,
    ardupilot.health,
    _sensors,
    ardupilot.estimator,
    _streams,
    _link,
    ardupilot.position,
    _still,
    _battery,
    ardupilot.limits,
    ardupilot.failsafes,
)
