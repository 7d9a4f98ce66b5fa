"""Telemetry of sensors: their newest samples, as the estimator has taken them.

What the vehicle does not have is not sent, as in PX4; a field of a message that no sensor measures is 0 or
unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, degrees, hypot, isfinite, nan, sqrt

from firmware_py.autopilot import Autopilot
from firmware_py.estimation.report import EstimatorReport, Sensor
from firmware_py.mavlink.telemetry.streams import AutopilotSource
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.atmosphere import pressure_altitude_m
from framerunner.vehicle.measurements import FixType, MagnetometerSample
from framerunner.wire.dialect import Message, boot_ms, degrees_e7, mavlink, millimetres, whole

_MILLI_G = 1000.0 / 9.80665  # of 1 m/s²
_KELVIN = 273.15
_RANGE_M = 100.0
_UNKNOWN_8, _UNKNOWN_16 = 0xFF, 0xFFFF
_IMU_FIELDS, _MAGNETOMETER_FIELDS, _BAROMETER_FIELDS = 0x003F, 0x01C0, 0x1A00
_NO_DISTANCE = -1.0


def _highres_imu(report: EstimatorReport) -> Message | None:
    """HIGHRES_IMU: rates and forces less their estimated biases, as in PX4."""
    latest = report.latest
    imu, pressure = latest.imu, latest.barometer
    if imu is None:
        return None
    imu = imu.less(report.gyro_bias_frd_rad_s, report.accel_bias_frd_m_s2)
    fields = _IMU_FIELDS
    fields |= _MAGNETOMETER_FIELDS if latest.magnetometer is not None else 0
    fields |= _BAROMETER_FIELDS if pressure is not None else 0
    return mavlink.MAVLink_highres_imu_message(
        imu.time_us,
        *imu.specific_force_frd_m_s2,
        *imu.angular_rate_frd_rad_s,
        *_field(latest.magnetometer),
        0.0 if pressure is None else pressure.pressure_pa / 100.0,
        0.0,
        0.0 if pressure is None else pressure_altitude_m(pressure.pressure_pa),
        0.0 if pressure is None else pressure.temperature_k - _KELVIN,
        fields,
    )


def _scaled_imu(report: EstimatorReport) -> Message | None:
    """SCALED_IMU: thousandths of g, rad/s and gauss, as measured; the IMU's temperature is not known."""
    imu = report.latest.imu
    if imu is None:
        return None
    return mavlink.MAVLink_scaled_imu_message(
        boot_ms(imu.time_us),
        *[whole(force * _MILLI_G, 16) for force in imu.specific_force_frd_m_s2],
        *[whole(rate * 1e3, 16) for rate in imu.angular_rate_frd_rad_s],
        *[whole(component * 1e3, 16) for component in _field(report.latest.magnetometer)],
        0,
    )


def _scaled_pressure(report: EstimatorReport) -> Message | None:
    """SCALED_PRESSURE."""
    pressure = report.latest.barometer
    if pressure is None:
        return None
    return mavlink.MAVLink_scaled_pressure_message(
        boot_ms(pressure.time_us),
        pressure.pressure_pa / 100.0,
        0.0,
        whole((pressure.temperature_k - _KELVIN) * 100, 16),
    )


def _distance_sensor(report: EstimatorReport) -> Message | None:
    """DISTANCE_SENSOR: 0 out of the range finder's range, as in PX4."""
    sample = report.latest.range_finder
    if sample is None:
        return None
    distance_m = sample.distance_m if isfinite(sample.distance_m) else 0.0
    return mavlink.MAVLink_distance_sensor_message(
        boot_ms(sample.time_us),
        0,
        round(_RANGE_M * 100),
        whole(distance_m * 100, 16, signed=False),
        mavlink.MAV_DISTANCE_SENSOR_LASER,
        0,
        mavlink.MAV_SENSOR_ROTATION_PITCH_270,
        0,
    )


def _optical_flow_rad(report: EstimatorReport) -> Message | None:
    """OPTICAL_FLOW_RAD, with the range finder's distance."""
    flow, distance = report.latest.optical_flow, report.latest.range_finder
    if flow is None:
        return None
    is_measured = distance is not None and isfinite(distance.distance_m)
    return mavlink.MAVLink_optical_flow_rad_message(
        flow.time_us,
        0,
        flow.integration_us,
        *flow.flow_rad,
        *flow.gyro_rad,
        0.0,
        0,
        flow.quality,
        0,
        distance.distance_m if distance is not None and is_measured else _NO_DISTANCE,
    )


def _gps_raw_int(report: EstimatorReport) -> Message | None:
    """GPS_RAW_INT: what the receiver reports; it gives accuracies, and no dilution of precision."""
    if Sensor.GPS not in report.present:
        return None
    fix, now_us = report.latest.gps, report.latest.time_us
    if fix is None or fix.fix_type < FixType.FIX_3D:
        kind = mavlink.GPS_FIX_TYPE_NO_FIX
        return mavlink.MAVLink_gps_raw_int_message(now_us, kind, 0, 0, 0, *[_UNKNOWN_16] * 4, 0)
    north_m_s, east_m_s, _ = fix.velocity_ned_m_s
    altitude_mm = millimetres(fix.altitude_m)
    return mavlink.MAVLink_gps_raw_int_message(
        fix.time_us,
        int(fix.fix_type),
        degrees_e7(fix.latitude_deg),
        degrees_e7(fix.longitude_deg),
        altitude_mm,
        _UNKNOWN_16,
        _UNKNOWN_16,
        whole(hypot(north_m_s, east_m_s) * 100, 16, signed=False),
        whole(degrees(atan2(east_m_s, north_m_s)) % 360 * 100, 16, signed=False) % 36000,
        fix.satellites,
        altitude_mm,
        whole(fix.horizontal_accuracy_m * 1e3, 32, signed=False),
        whole(fix.vertical_accuracy_m * 1e3, 32, signed=False),
        whole(fix.speed_accuracy_m_s * sqrt(3.0) * 1e3, 32, signed=False),
    )


def gnss_integrity(autopilot: Autopilot) -> Message | None:
    """GNSS_INTEGRITY: jamming and spoofing are not monitored."""
    if autopilot.status.origin is None or Sensor.GPS not in autopilot.estimator.report().present:
        return None
    return mavlink.MAVLink_gnss_integrity_message(*[0] * 6, *[_UNKNOWN_16] * 2, *[_UNKNOWN_8] * 4)


def wind_cov(autopilot: Autopilot) -> Message | None:
    """WIND_COV: the air's velocity, as estimated by drag; the vertical one is not known."""
    found = autopilot.wind.estimate if autopilot.wind is not None else None
    if found is None:
        return None
    north_m_s, east_m_s = found.velocity_ned_m_s
    return mavlink.MAVLink_wind_cov_message(
        autopilot.state.time_us,
        north_m_s,
        east_m_s,
        nan,
        found.sigma_m_s**2,
        nan,
        nan,
        nan,
        nan,
    )


def _field(sample: MagnetometerSample | None) -> Vec3:
    return ZERO3 if sample is None else sample.field_frd_gauss


def _reported(measure: Callable[[EstimatorReport], Message | None]) -> AutopilotSource:
    """The source of a message that is made from the estimator's report."""
    return lambda autopilot: measure(autopilot.estimator.report())


SENSORS: dict[int, AutopilotSource] = {
    mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR: _reported(_distance_sensor),
    mavlink.MAVLINK_MSG_ID_GNSS_INTEGRITY: gnss_integrity,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: _reported(_gps_raw_int),
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: _reported(_highres_imu),
    mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD: _reported(_optical_flow_rad),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU: _reported(_scaled_imu),
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE: _reported(_scaled_pressure),
    mavlink.MAVLINK_MSG_ID_WIND_COV: wind_cov,
}
