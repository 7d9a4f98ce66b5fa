"""Telemetry of sensors.

Ideal sensors have no samples: what they would measure, such as pressure and magnetic field, is computed from
the state. For others see `measured.py`.
"""

from __future__ import annotations

from math import atan2, degrees, hypot, nan

from firmware_py.autopilot import Autopilot
from firmware_py.estimation.report import Sensor
from firmware_py.mavlink.telemetry import measured
from firmware_py.mavlink.telemetry.streams import AutopilotSource
from framerunner.geometry.rotations import rotation, to_body
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.vehicle.atmosphere import pressure_hpa, temperature_k
from framerunner.wire.dialect import Message, boot_ms, degrees_e7, mavlink, millimetres, whole

# North, east, down at PX4's simulated home (Zurich), gauss; World Magnetic Model 2025, two digits.
EARTH_FIELD_NED_GAUSS: Vec3 = (0.22, 0.013, 0.43)
_MILLI_G = 1000.0 / 9.80665  # of 1 m/s²
_RANGE_M = 100.0
_MIN_DOWN = 0.01
_UNKNOWN_8, _UNKNOWN_16 = 0xFF, 0xFFFF
_IMU_FIELDS = 0b1_1011_1111_1111  # all but differential pressure


def earth_field_frd_gauss(attitude: Quaternion) -> Vec3:
    """Earth's magnetic field in body axes, by the attitude's unit quaternion."""
    return to_body(rotation(attitude), *EARTH_FIELD_NED_GAUSS)


def highres_imu(autopilot: Autopilot) -> Message | None:
    """HIGHRES_IMU."""
    report = autopilot.estimator.report()
    if not report.ideal:
        return measured.highres_imu(report)
    state, place = autopilot.state, autopilot.global_position()
    altitude_m = place.altitude_m if place else 0.0
    return mavlink.MAVLink_highres_imu_message(
        state.time_us,
        *state.specific_force_frd_m_s2,
        *state.angular_rate_frd_rad_s,
        *earth_field_frd_gauss(state.attitude),
        pressure_hpa(altitude_m),
        0.0,
        altitude_m,
        temperature_k(altitude_m) - 273.15,
        _IMU_FIELDS,
    )


def scaled_imu(autopilot: Autopilot) -> Message | None:
    """SCALED_IMU: thousandths of g, rad/s and gauss, hundredths of a degree (0 would be unknown)."""
    report = autopilot.estimator.report()
    if not report.ideal:
        return measured.scaled_imu(report)
    state, place = autopilot.state, autopilot.global_position()
    field_gauss = earth_field_frd_gauss(state.attitude)
    celsius = temperature_k(place.altitude_m if place else 0.0) - 273.15
    return mavlink.MAVLink_scaled_imu_message(
        boot_ms(state.time_us),
        *[whole(force * _MILLI_G, 16) for force in state.specific_force_frd_m_s2],
        *[whole(rate * 1e3, 16) for rate in state.angular_rate_frd_rad_s],
        *[whole(component * 1e3, 16) for component in field_gauss],
        whole(celsius * 100, 16) or 1,
    )


def distance_sensor(autopilot: Autopilot) -> Message | None:
    """DISTANCE_SENSOR: the range along body down to flat ground at the height where the vehicle booted.

    PX4's simulation computes it from the state too. Out of range, or pointing up, it is 0, as in PX4.
    """
    report = autopilot.estimator.report()
    if not report.ideal:
        return measured.distance_sensor(report)
    state = autopilot.state
    if autopilot.status.origin is None:
        return None
    _, qx, qy, _ = state.attitude
    down = 1.0 - 2.0 * (qx * qx + qy * qy)  # of the body's down axis, in the world
    range_m = -state.position_ned_m[2] / down if down > _MIN_DOWN else 0.0
    if not 0.0 < range_m < _RANGE_M:
        range_m = 0.0
    return mavlink.MAVLink_distance_sensor_message(
        boot_ms(state.time_us),
        0,
        round(_RANGE_M * 100),
        round(range_m * 100),
        mavlink.MAV_DISTANCE_SENSOR_LASER,
        0,
        mavlink.MAV_SENSOR_ROTATION_PITCH_270,
        0,
    )


def gnss_integrity(autopilot: Autopilot) -> Message | None:
    """GNSS_INTEGRITY: jamming and spoofing are not monitored."""
    report = autopilot.estimator.report()
    has_gps = report.ideal or Sensor.GPS in report.present
    if autopilot.status.origin is None or not has_gps:
        return None
    return mavlink.MAVLink_gnss_integrity_message(*[0] * 6, *[_UNKNOWN_16] * 2, *[_UNKNOWN_8] * 4)


def scaled_pressure(autopilot: Autopilot) -> Message | None:
    """SCALED_PRESSURE."""
    report = autopilot.estimator.report()
    if not report.ideal:
        return measured.scaled_pressure(report)
    place = autopilot.global_position()
    if place is None:
        return None
    return mavlink.MAVLink_scaled_pressure_message(
        boot_ms(autopilot.state.time_us),
        pressure_hpa(place.altitude_m),
        0.0,
        whole((temperature_k(place.altitude_m) - 273.15) * 100, 16),
    )


def optical_flow_rad(autopilot: Autopilot) -> Message | None:
    """OPTICAL_FLOW_RAD; ideal sensors have none."""
    report = autopilot.estimator.report()
    return None if report.ideal else measured.optical_flow_rad(report)


def gps_raw_int(autopilot: Autopilot) -> Message | None:
    """GPS_RAW_INT: a 3D fix with the values of PX4's simulation, or no fix yet."""
    report = autopilot.estimator.report()
    if not report.ideal:
        return measured.gps_raw_int(report)
    state, place = autopilot.state, autopilot.global_position()
    if place is None:
        return mavlink.MAVLink_gps_raw_int_message(
            state.time_us, mavlink.GPS_FIX_TYPE_NO_FIX, 0, 0, 0, *[_UNKNOWN_16] * 4, 0
        )
    north_m_s, east_m_s, _ = state.velocity_ned_m_s
    altitude_mm = millimetres(place.altitude_m)
    return mavlink.MAVLink_gps_raw_int_message(
        state.time_us,
        mavlink.GPS_FIX_TYPE_3D_FIX,
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        altitude_mm,
        70,
        110,
        whole(hypot(north_m_s, east_m_s) * 100, 16, signed=False),
        whole(degrees(atan2(east_m_s, north_m_s)) % 360 * 100, 16, signed=False) % 36000,
        10,
        altitude_mm,
        900,
        1780,
        400,
    )


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


SENSORS: dict[int, AutopilotSource] = {
    mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR: distance_sensor,
    mavlink.MAVLINK_MSG_ID_GNSS_INTEGRITY: gnss_integrity,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: gps_raw_int,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: highres_imu,
    mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD: optical_flow_rad,
    mavlink.MAVLINK_MSG_ID_SCALED_IMU: scaled_imu,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE: scaled_pressure,
    mavlink.MAVLINK_MSG_ID_WIND_COV: wind_cov,
}
