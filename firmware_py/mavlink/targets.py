"""Telemetry of what is being followed: position, velocity, attitude, and the time to get home."""

from __future__ import annotations

from math import hypot, isfinite, isnan, nan

from firmware_py.geodesy import LocalProjection
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms, degrees_e7, whole
from firmware_py.setpoints import AttitudeSetpoint, BodyRateSetpoint, TrajectorySetpoint
from firmware_py.status import FlightMode
from geometry.vectors import NAN3, Quaternion
from wire.dialect import Message, mavlink

_GLOBAL_MODES = frozenset(
    {
        FlightMode.TAKEOFF,
        FlightMode.HOLD,
        FlightMode.MISSION,
        FlightMode.RETURN,
        FlightMode.LAND,
        FlightMode.FOLLOW,
        FlightMode.ORBIT,
    }
)
_NO_ATTITUDE: Quaternion = (nan, nan, nan, nan)
_RATES_IGNORED = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
    | mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
    | mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
)
_NOT_TOLD = -1


def position_target_local_ned(autopilot: AutopilotPort, _time_us: int) -> Message:
    """POSITION_TARGET_LOCAL_NED: what is followed now. A component not controlled is NaN and masked out."""
    followed = autopilot.status.setpoint.trajectory
    return mavlink.MAVLink_position_target_local_ned_message(
        boot_ms(autopilot.state.time_us),
        mavlink.MAV_FRAME_LOCAL_NED,
        _mask(followed),
        *followed.position_ned_m,
        *followed.velocity_ned_m_s,
        *followed.acceleration_ned_m_s2,
        followed.yaw_rad,
        followed.yaw_rate_rad_s,
    )


def position_target_global_int(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT, while armed in a mode that flies to a place, as PX4."""
    status = autopilot.status
    followed, origin = status.setpoint.trajectory, status.origin
    north_m, east_m, down_m = followed.position_ned_m
    if not status.armed or status.mode not in _GLOBAL_MODES or origin is None:
        return None
    if not (isfinite(north_m) and isfinite(east_m)):
        return None
    place = LocalProjection(origin).to_geodetic((north_m, east_m, down_m))
    return mavlink.MAVLink_position_target_global_int_message(
        boot_ms(autopilot.state.time_us),
        mavlink.MAV_FRAME_GLOBAL_INT,
        _mask(followed),
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        place.altitude_m,
        *followed.velocity_ned_m_s,
        *followed.acceleration_ned_m_s2,
        followed.yaw_rad,
        followed.yaw_rate_rad_s,
    )


def attitude_target(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ATTITUDE_TARGET: attitude and rates if somebody asks for them, else masked; the thrust always.

    A stabiliser that goes from velocity straight to motors has no attitude it aims at, so none is made up.
    """
    followed = autopilot.status.setpoint
    mask = 0
    attitude, rates, thrust = _NO_ATTITUDE, NAN3, autopilot.output.throttle
    if isinstance(followed, AttitudeSetpoint):
        attitude, thrust = followed.attitude, followed.thrust
    else:
        mask |= mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
    if isinstance(followed, BodyRateSetpoint):
        rates, thrust = followed.rate_frd_rad_s, followed.thrust
    else:
        mask |= _RATES_IGNORED
    return mavlink.MAVLink_attitude_target_message(
        boot_ms(autopilot.state.time_us), mask, attitude, *rates, thrust
    )


def time_estimate_to_target(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """TIME_ESTIMATE_TO_TARGET: seconds that a return would take; -1 for what PX4 does not tell either.

    Climb to RTL_RETURN_ALT, cruise home, descend, wait RTL_LAND_DELAY, land: distances over the speeds of
    the parameters, without acceleration and without PX4's reserve.
    """
    status, state = autopilot.status, autopilot.state
    if status.home is None:
        return None
    value = autopilot.parameters.value
    height_m = status.home_ned_m[2] - state.position_ned_m[2]
    distance_m = hypot(
        state.position_ned_m[0] - status.home_ned_m[0], state.position_ned_m[1] - status.home_ned_m[1]
    )
    top_m = max(height_m, value("RTL_RETURN_ALT")) if distance_m > value("RTL_MIN_DIST") else height_m
    slow_from_m = min(top_m, max(0.0, value("RTL_DESCEND_ALT")))
    seconds = (
        (top_m - height_m) / value("MPC_Z_V_AUTO_UP")
        + distance_m / value("MPC_XY_CRUISE")
        + (top_m - slow_from_m) / value("MPC_Z_V_AUTO_DN")
        + max(0.0, value("RTL_LAND_DELAY"))
        + slow_from_m / value("MPC_LAND_SPEED")
    )
    return mavlink.MAVLink_time_estimate_to_target_message(
        whole(seconds, 32), _NOT_TOLD, _NOT_TOLD, _NOT_TOLD, _NOT_TOLD
    )


def _mask(followed: TrajectorySetpoint) -> int:
    """POSITION_TARGET_TYPEMASK: the components that are not controlled."""
    components = (*followed.position_ned_m, *followed.velocity_ned_m_s, *followed.acceleration_ned_m_s2)
    mask = sum(1 << bit for bit, value in enumerate(components) if isnan(value))
    if isnan(followed.yaw_rad):
        mask |= int(mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE)
    if isnan(followed.yaw_rate_rad_s):
        mask |= int(mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE)
    return mask
