"""Telemetry of health: SYS_STATUS, ESTIMATOR_STATUS and VIBRATION, from the estimator's report.

The load is 0, because the autopilot reads no clock.
"""

from __future__ import annotations

from math import ceil, isfinite, sqrt

from firmware_py.autopilot import Autopilot
from firmware_py.estimation.report import EstimatorReport, Sensor
from firmware_py.mavlink.telemetry.streams import AutopilotSource
from firmware_py.status import LandedState
from framerunner.wire.dialect import Message, mavlink, whole

_ATTITUDE = mavlink.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION | mavlink.MAV_SYS_STATUS_AHRS
# PX4 reports a part without faults as healthy even if it is absent, except for a remote control.
_HEALTHY = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS
    | mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
    | mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    | mavlink.MAV_SYS_STATUS_LOGGING
    | _ATTITUDE
)
_CHECKED = _HEALTHY | mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
_SENSOR_BITS = {
    Sensor.GYROSCOPE: mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    Sensor.ACCELEROMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
    Sensor.MAGNETOMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    Sensor.BAROMETER: mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    Sensor.GPS: mavlink.MAV_SYS_STATUS_SENSOR_GPS,
    Sensor.EXTERNAL_POSE: mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION,
    Sensor.RANGE_FINDER: mavlink.MAV_SYS_STATUS_SENSOR_LASER_POSITION,
    Sensor.OPTICAL_FLOW: mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW,
}
_HORIZONTAL_AIDS = frozenset({Sensor.GPS, Sensor.EXTERNAL_POSE, Sensor.OPTICAL_FLOW})


def sys_status(autopilot: Autopilot) -> Message:
    """SYS_STATUS: health bits, voltage, current and remaining charge.

    Of the sensors, those are enabled that the estimator relies on, and those that fail.
    """
    status, battery = autopilot.status, autopilot.battery
    present, enabled, healthy = _sensor_bits(autopilot.estimator.report())
    if status.armed and autopilot.parameters.value("SDLOG_MODE") >= 0:
        present |= mavlink.MAV_SYS_STATUS_LOGGING
        enabled |= mavlink.MAV_SYS_STATUS_LOGGING
    if battery.warning > mavlink.MAV_BATTERY_CHARGE_STATE_OK:
        healthy &= ~mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    enabled |= (_CHECKED | present) & ~healthy
    if status.ready:
        healthy |= mavlink.MAV_SYS_STATUS_PREARM_CHECK
    return mavlink.MAVLink_sys_status_message(
        present,
        enabled,
        healthy,
        0,
        whole(battery.voltage_v * 1e3, 16, signed=False),
        whole(battery.current_a * 100, 16),
        min(100, whole(ceil(battery.remaining * 100) if isfinite(battery.remaining) else -1, 8)),
        *[0] * 8,
        mavlink.MAV_SYS_STATUS_RECOVERY_SYSTEM,
    )


def _sensor_bits(report: EstimatorReport) -> tuple[int, int, int]:
    """Bits of what is present, used and healthy."""
    position = mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
    battery = mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    present = enabled = battery
    healthy = _HEALTHY
    for sensor, bit in _SENSOR_BITS.items():
        if sensor not in report.present:
            continue
        present |= bit
        if sensor in report.relied_on:
            enabled |= bit
        healthy = healthy | bit if sensor in report.healthy else healthy & ~bit
    if report.has_position:
        present |= position
        enabled |= position
    else:
        healthy &= ~position
    if not report.has_attitude:
        healthy &= ~_ATTITUDE
    return present, enabled, healthy


def solution_flags(autopilot: Autopilot, report: EstimatorReport) -> int:
    """ESTIMATOR_STATUS_FLAGS, as PX4's EKF2 fills them."""
    has_origin = autopilot.status.origin is not None
    on_ground = autopilot.status.landed_state is LandedState.ON_GROUND
    aids = report.relied_on & _HORIZONTAL_AIDS
    ratios = report.ratios
    glitch = Sensor.GPS in report.present and max(ratios.velocity, ratios.position_horizontal) > 1.0
    bits = {
        mavlink.ESTIMATOR_ATTITUDE: report.has_attitude,
        mavlink.ESTIMATOR_VELOCITY_HORIZ: report.has_velocity,
        mavlink.ESTIMATOR_VELOCITY_VERT: report.has_height,
        mavlink.ESTIMATOR_POS_HORIZ_REL: report.has_position,
        mavlink.ESTIMATOR_POS_HORIZ_ABS: report.has_position and has_origin,
        mavlink.ESTIMATOR_POS_VERT_ABS: report.has_height,
        mavlink.ESTIMATOR_POS_VERT_AGL: isfinite(report.height_above_ground_m),
        mavlink.ESTIMATOR_CONST_POS_MODE: on_ground or not report.has_velocity,
        mavlink.ESTIMATOR_PRED_POS_HORIZ_REL: bool(aids),
        mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS: Sensor.GPS in aids,
        mavlink.ESTIMATOR_GPS_GLITCH: glitch,
    }
    return sum(int(bit) for bit, holds in bits.items() if holds)


def accuracy_m(report: EstimatorReport) -> tuple[float, float]:
    """Standard deviation of the horizontal position and of the height, as PX4 computes them."""
    north_m2, east_m2, down_m2 = report.position_variance_m2
    return (sqrt(north_m2 + east_m2), sqrt(down_m2))


def estimator_status(autopilot: Autopilot) -> Message:
    """ESTIMATOR_STATUS."""
    report, time_us = autopilot.estimator.report(), autopilot.state.time_us
    ratios = report.ratios
    return mavlink.MAVLink_estimator_status_message(
        time_us,
        solution_flags(autopilot, report),
        ratios.velocity,
        ratios.position_horizontal,
        ratios.position_vertical,
        ratios.heading,
        ratios.height_above_ground,
        0.0,
        *accuracy_m(report),
    )


def vibration(autopilot: Autopilot) -> Message:
    """VIBRATION with PX4's contents: y is of the gyroscope, rad/s, z of the accelerometer, m/s²."""
    report = autopilot.estimator.report()
    return mavlink.MAVLink_vibration_message(
        autopilot.state.time_us, 0.0, report.vibration_rad_s, report.vibration_m_s2, 0, 0, 0
    )


HEALTH: dict[int, AutopilotSource] = {
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: estimator_status,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mavlink.MAVLINK_MSG_ID_VIBRATION: vibration,
}
