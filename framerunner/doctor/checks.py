"""What stands between a drone and the challenge: findings, each with its mend. A record in, words out."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from framerunner.doctor import names
from framerunner.doctor.findings import Finding, Level
from framerunner.doctor.position import check_height, check_position, check_still, check_vision_settings
from framerunner.doctor.record import Record
from wire.dialect import mavlink

WANTED_HZ = 50.0  # what `fly` and `camera` ask for
LOW_HZ = 20.0  # the mission's own rate
LOST_SHARE = 0.05
BATTERY_PERCENT = 40
CHALLENGE_HEIGHT_M = 3.0  # frames hang up to 2 m, the mission flies up from them
CHALLENGE_REACH_M = 8.0


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
    landed = record.latest.get("EXTENDED_SYS_STATE")
    if record.armed:
        yield Finding(Level.MISSING, "armed", f"in {mode}", "land and disarm; fly arms by itself")
    elif landed is not None and landed.landed_state not in (0, mavlink.MAV_LANDED_STATE_ON_GROUND):
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
        mend = "mend what is named, here and below"
        if record.arming.armable_modes is None:
            mend = "it does not tell why; fly may pass in offboard, which needs no global position"
        yield Finding(Level.MISSING, "pre-arm checks", words, mend)
    elif sick_names:
        yield Finding(Level.NOTE, "health", f"not well: {sick_names}", "mend it before flying")
    else:
        yield Finding(Level.GOOD, "pre-arm checks", "passed")


def check_offboard(record: Record) -> Iterator[Finding]:
    """Offboard mode with velocities."""
    version = record.latest.get("AUTOPILOT_VERSION")
    if record.modes and names.OFFBOARD_MODE not in record.modes:
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
            mend = "give it GPS, optical flow, vision or motion capture; wait for its estimate"
            yield Finding(Level.MISSING, what, f"no {' or '.join(kinds)} comes", mend)
        elif rate_hz < LOW_HZ:
            mend = f"fly asks for {WANTED_HZ:g} Hz; see that the line can carry it"
            yield Finding(Level.NOTE, what, f"only {rate_hz:.0f} Hz", mend)
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
        mend = "set it to 10: take-off begins by a slow ramp"
        yield Finding(Level.MISSING, "COM_DISARM_PRFLT", f"{preflight_s:g} s", mend)


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
            mend = f"the challenge needs {least_m:g} m; set more, or 0"
            yield Finding(Level.MISSING, name, f"fence at {value:g} m", mend)


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
        mend = "under a roof set COM_OBL_RC_ACT to 4 (land)" if "return" in words else ""
        level = Level.NOTE if mend else Level.GOOD
        yield Finding(level, "setpoints lost", f"{words}{after}", mend)
    if loss_s is not None and loss_s < 0.5:
        mend = "set it to 1: the app's watchdog needs half a second"
        yield Finding(Level.MISSING, "COM_OF_LOSS_T", f"{loss_s:g} s", mend)
    station = parameters.get("NAV_DLL_ACT")
    if station is not None:
        words = names.LINK_LOSS.get(int(station), f"action {station:g}")
        needed = "; it arms only while it hears one, as fly is" if station else ""
        yield Finding(Level.GOOD, "ground station lost", words + (climbs if station == 2 else "") + needed)
    low = parameters.get("COM_LOW_BAT_ACT")
    if low is not None:
        yield Finding(Level.GOOD, "battery low", names.LOW_BATTERY.get(int(low), f"action {low:g}"))


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
