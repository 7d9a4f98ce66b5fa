"""Telemetry of the vehicle's condition: health, landed or not, battery, home, mode, flight times.

Differences from PX4: innovation ratios and vibration are 0, because the state is exact, and so is the load,
because the autopilot reads no clock.
"""

from __future__ import annotations

from math import ceil, isfinite

from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms, degrees_e7, millimetres, whole
from firmware_py.status import LandedState
from wire.dialect import Message, mavlink

_POSITION = mavlink.MAV_SYS_STATUS_SENSOR_GPS | mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
_PRESENT = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    | _POSITION
)
# PX4 calls healthy what nothing is wrong with, there or not; but a remote control it misses.
_HEALTHY = (
    _PRESENT
    | mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
    | mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    | mavlink.MAV_SYS_STATUS_AHRS
    | mavlink.MAV_SYS_STATUS_LOGGING
)
_CHECKED = _HEALTHY | mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
_UNKNOWN_16 = 0xFFFF
_TEMPERATURE_UNKNOWN = 0x7FFF


def sys_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """SYS_STATUS: the health bits that clients wait for, and the battery in short."""
    status, battery = autopilot.status, autopilot.battery
    missing = 0 if status.origin is not None else _POSITION
    present = _PRESENT & ~missing
    if status.armed and autopilot.parameters.value("SDLOG_MODE") >= 0:
        present |= mavlink.MAV_SYS_STATUS_LOGGING
    healthy = _HEALTHY & ~missing
    if battery.warning > mavlink.MAV_BATTERY_CHARGE_STATE_OK:
        healthy &= ~mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    if status.ready:
        healthy |= mavlink.MAV_SYS_STATUS_PREARM_CHECK
    return mavlink.MAVLink_sys_status_message(
        present,
        present | _CHECKED & ~healthy,
        healthy,
        0,
        whole(battery.voltage_v * 1e3, 16, signed=False),
        whole(battery.current_a * 100, 16),
        min(100, whole(ceil(battery.remaining * 100) if isfinite(battery.remaining) else -1, 8)),
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        mavlink.MAV_SYS_STATUS_RECOVERY_SYSTEM,
    )


def extended_sys_state(autopilot: AutopilotPort, _time_us: int) -> Message:
    """EXTENDED_SYS_STATE."""
    return mavlink.MAVLink_extended_sys_state_message(
        mavlink.MAV_VTOL_STATE_UNDEFINED, int(autopilot.status.landed_state)
    )


def battery_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """BATTERY_STATUS: one pack, whose whole voltage stands where the first cell's would, as PX4 tells it."""
    battery = autopilot.battery
    return mavlink.MAVLink_battery_status_message(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        _TEMPERATURE_UNKNOWN,
        [min(whole(battery.voltage_v * 1e3, 16, signed=False), _UNKNOWN_16 - 1)] + [_UNKNOWN_16] * 9,
        whole(battery.current_a * 100, 16),
        whole(battery.used_mah, 32),
        -1,
        min(100, whole(battery.remaining * 100, 8)),
        0,
        battery.warning,
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
        status.mode.value.standard,
        status.mode.custom_mode,
        status.intended_mode.custom_mode,
    )


def estimator_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ESTIMATOR_STATUS: the flags PX4 shows, 895 in flight and 959 standing."""
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
    elif status.origin is not None:
        flags |= mavlink.ESTIMATOR_POS_VERT_AGL
    return mavlink.MAVLink_estimator_status_message(
        autopilot.state.time_us, flags, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    )


def vibration(autopilot: AutopilotPort, _time_us: int) -> Message:
    """VIBRATION: none."""
    return mavlink.MAVLink_vibration_message(autopilot.state.time_us, 0.0, 0.0, 0.0, 0, 0, 0)


def flight_information(autopilot: AutopilotPort, _time_us: int) -> Message:
    """FLIGHT_INFORMATION: since when it is armed and in the air, in vehicle time as PX4; 0: it is not."""
    status, flight = autopilot.status, autopilot.flight
    flying = status.armed and flight.takeoff_us > flight.landed_us
    return mavlink.MAVLink_flight_information_message(
        boot_ms(autopilot.state.time_us),
        flight.armed_us if status.armed else 0,
        flight.takeoff_us if flying else 0,
        flight.number,
        boot_ms(flight.landed_us),
    )
