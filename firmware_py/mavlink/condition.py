"""Telemetry of the vehicle's condition: health, landed or not, battery, home, motors, mode.

Differences from PX4: no battery exists yet, so voltage and charge are said to be unknown (PX4 simulates a 4S
pack). FLIGHT_INFORMATION carries no times. Innovation ratios are 0, because the state is exact.
"""

from __future__ import annotations

from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms, degrees_e7, millimetres, whole
from firmware_py.status import FlightMode, LandedState
from firmware_py.types import MotorSpeeds

_IMU = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
)
_POSITION = mavlink.MAV_SYS_STATUS_SENSOR_GPS | mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
_UNKNOWN_16 = 0xFFFF
_STANDARD_MODES = {
    FlightMode.LAND: mavlink.MAV_STANDARD_MODE_LAND,
    FlightMode.TAKEOFF: mavlink.MAV_STANDARD_MODE_TAKEOFF,
}
_PWM_DISARMED_US, _PWM_LOW_US, _PWM_SPAN_US = 900, 1000, 1000
_SERVOS = 16


def sys_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """SYS_STATUS: the health bits that clients wait for."""
    status = autopilot.status
    working = _IMU | (_POSITION if status.origin is not None else 0)
    healthy = working | mavlink.MAV_SYS_STATUS_AHRS
    if status.ready:
        healthy |= mavlink.MAV_SYS_STATUS_PREARM_CHECK
    return mavlink.MAVLink_sys_status_message(
        working, working, healthy, 0, _UNKNOWN_16, -1, -1, 0, 0, 0, 0, 0, 0
    )


def extended_sys_state(autopilot: AutopilotPort, _time_us: int) -> Message:
    """EXTENDED_SYS_STATE."""
    return mavlink.MAVLink_extended_sys_state_message(
        mavlink.MAV_VTOL_STATE_UNDEFINED, int(autopilot.status.landed_state)
    )


def battery_status(_autopilot: AutopilotPort, _time_us: int) -> Message:
    """BATTERY_STATUS with everything unknown."""
    return mavlink.MAVLink_battery_status_message(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_UNKNOWN,
        0x7FFF,
        [_UNKNOWN_16] * 10,
        -1,
        -1,
        -1,
        -1,
    )


def home_position(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """HOME_POSITION, once there is one."""
    status = autopilot.status
    if status.home is None:
        return None
    return mavlink.MAVLink_home_position_message(
        degrees_e7(status.home.latitude_deg),
        degrees_e7(status.home.longitude_deg),
        millimetres(status.home.altitude_m),
        *status.home_ned_m,
        (1.0, 0.0, 0.0, 0.0),
        0.0,
        0.0,
        0.0,
        autopilot.state.time_us,
    )


def gps_global_origin(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """GPS_GLOBAL_ORIGIN, once there is one."""
    origin = autopilot.status.origin
    if origin is None:
        return None
    return mavlink.MAVLink_gps_global_origin_message(
        degrees_e7(origin.latitude_deg),
        degrees_e7(origin.longitude_deg),
        millimetres(origin.altitude_m),
        autopilot.state.time_us,
    )


def current_mode(autopilot: AutopilotPort, _time_us: int) -> Message:
    """CURRENT_MODE: the mode flown and the one asked for."""
    status = autopilot.status
    return mavlink.MAVLink_current_mode_message(
        _STANDARD_MODES.get(status.mode, mavlink.MAV_STANDARD_MODE_NON_STANDARD),
        status.mode.custom_mode,
        status.intended_mode.custom_mode,
    )


def estimator_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ESTIMATOR_STATUS: the flags PX4 shows, 831 in flight and 959 standing."""
    status = autopilot.status
    flags = mavlink.ESTIMATOR_ATTITUDE
    if status.origin is not None:
        flags |= (
            mavlink.ESTIMATOR_VELOCITY_HORIZ
            | mavlink.ESTIMATOR_VELOCITY_VERT
            | mavlink.ESTIMATOR_POS_HORIZ_REL
            | mavlink.ESTIMATOR_POS_HORIZ_ABS
            | mavlink.ESTIMATOR_POS_VERT_ABS
            | mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
            | mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS
        )
    if status.landed_state is LandedState.ON_GROUND:
        flags |= mavlink.ESTIMATOR_CONST_POS_MODE
    return mavlink.MAVLink_estimator_status_message(
        autopilot.state.time_us, flags, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    )


def servo_output_raw(autopilot: AutopilotPort, _time_us: int) -> Message:
    """SERVO_OUTPUT_RAW: motor speeds as pulses, 900 µs disarmed, 1000 to 2000 µs from rest to full speed."""
    pulses = _pulses(
        autopilot.output.speeds_rad_s, autopilot.airframe.motor.max_speed_rad_s, autopilot.status.armed
    )
    return mavlink.MAVLink_servo_output_raw_message(autopilot.state.time_us & 0xFFFFFFFF, 0, *pulses)


def _pulses(speeds_rad_s: MotorSpeeds, full_rad_s: float, armed: bool) -> list[int]:
    pulses = [
        whole(_PWM_LOW_US + _PWM_SPAN_US * speed / full_rad_s, 16, signed=False)
        if armed
        else _PWM_DISARMED_US
        for speed in speeds_rad_s[:_SERVOS]
    ]
    return pulses + [0] * (_SERVOS - len(pulses))


def mission_current(_autopilot: AutopilotPort, _time_us: int) -> Message:
    """MISSION_CURRENT: there is no mission."""
    return mavlink.MAVLink_mission_current_message(0, 0xFFFF, mavlink.MISSION_STATE_NO_MISSION, 2)


def vibration(autopilot: AutopilotPort, _time_us: int) -> Message:
    """VIBRATION: none."""
    return mavlink.MAVLink_vibration_message(autopilot.state.time_us, 0.0, 0.0, 0.0, 0, 0, 0)


def flight_information(autopilot: AutopilotPort, _time_us: int) -> Message:
    """FLIGHT_INFORMATION; only the time since boot is known."""
    return mavlink.MAVLink_flight_information_message(boot_ms(autopilot.state.time_us), 0, 0, 0)
