"""Telemetry of motion: attitude, positions, velocities."""

from __future__ import annotations

from math import degrees, hypot, nan

from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms, degrees_e7, millimetres, whole
from wire.dialect import Message, mavlink

_COVARIANCE_UNKNOWN = [nan] + [0.0] * 20
_MILLI_G = 1000.0 / 9.80665  # of 1 m/s²


def attitude(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ATTITUDE."""
    state = autopilot.state
    return mavlink.MAVLink_attitude_message(
        boot_ms(state.time_us), state.roll_rad, state.pitch_rad, state.yaw_rad, *state.angular_rate_frd_rad_s
    )


def attitude_quaternion(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ATTITUDE_QUATERNION."""
    state = autopilot.state
    return mavlink.MAVLink_attitude_quaternion_message(
        boot_ms(state.time_us), *state.attitude, *state.angular_rate_frd_rad_s
    )


def local_position_ned(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """LOCAL_POSITION_NED, once a position is known."""
    state = autopilot.state
    if autopilot.status.origin is None:
        return None
    return mavlink.MAVLink_local_position_ned_message(
        boot_ms(state.time_us), *state.position_ned_m, *state.velocity_ned_m_s
    )


def global_position_int(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """GLOBAL_POSITION_INT, once a position is known."""
    state, home, place = autopilot.state, autopilot.status.home, autopilot.global_position()
    if place is None:
        return None
    above_home_m = place.altitude_m - home.altitude_m if home else 0.0
    north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
    return mavlink.MAVLink_global_position_int_message(
        boot_ms(state.time_us),
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        millimetres(place.altitude_m),
        millimetres(above_home_m),
        whole(north_m_s * 100, 16),
        whole(east_m_s * 100, 16),
        whole(down_m_s * 100, 16),
        whole(degrees(state.yaw_rad) % 360 * 100, 16, signed=False) % 36000,
    )


def vfr_hud(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """VFR_HUD; airspeed NaN as PX4 has it without such a sensor."""
    state, place = autopilot.state, autopilot.global_position()
    if place is None:
        return None
    north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
    return mavlink.MAVLink_vfr_hud_message(
        nan,
        hypot(north_m_s, east_m_s),
        whole(degrees(state.yaw_rad) % 360, 16) % 360,
        whole(autopilot.output.throttle * 100, 16, signed=False),
        place.altitude_m,
        -down_m_s,
    )


def altitude(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """ALTITUDE; the terrain is not known."""
    state, home, place = autopilot.state, autopilot.status.home, autopilot.global_position()
    if place is None:
        return None
    return mavlink.MAVLink_altitude_message(
        state.time_us,
        place.altitude_m,
        place.altitude_m,
        -state.position_ned_m[2],
        place.altitude_m - home.altitude_m if home else nan,
        nan,
        nan,
    )


def odometry(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """ODOMETRY; velocity in the local frame, as PX4's."""
    state = autopilot.state
    if autopilot.status.origin is None:
        return None
    return mavlink.MAVLink_odometry_message(
        state.time_us,
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_LOCAL_NED,
        *state.position_ned_m,
        state.attitude,
        *state.velocity_ned_m_s,
        *state.angular_rate_frd_rad_s,
        _COVARIANCE_UNKNOWN,
        _COVARIANCE_UNKNOWN,
        0,
        mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        0,
    )


def hil_state_quaternion(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """HIL_STATE_QUATERNION, the true state; the same as the estimate, whose sensors are exact."""
    state, place = autopilot.state, autopilot.global_position()
    if place is None:
        return None
    return mavlink.MAVLink_hil_state_quaternion_message(
        state.time_us,
        state.attitude,
        *state.angular_rate_frd_rad_s,
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        millimetres(place.altitude_m),
        *[whole(velocity_m_s * 100, 16) for velocity_m_s in state.velocity_ned_m_s],
        0,
        0,
        *[whole(force * _MILLI_G, 16) for force in state.specific_force_frd_m_s2],
    )
