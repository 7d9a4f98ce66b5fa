"""A sample of the autopilot, and the values of topics about its sensors and its estimator.

The order of values is that of the topics in `topics.py`; None: there is no such sensor, or no sample yet.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, nan, sqrt

from firmware_py.autopilot import Autopilot
from firmware_py.estimation.report import EstimatorReport, Sensor
from framerunner.vehicle.atmosphere import pressure_altitude_m
from framerunner.vehicle.geodesy import GeodeticPoint

Values = tuple[float, ...]

_AIR_GAS_CONSTANT = 287.05  # J/(kg K), dry
_KELVIN = 273.15
# Bits of estimator_status.control_mode_flags (EKF2's control_status).
_TILT_ALIGNED, _YAW_ALIGNED = 1 << 0, 1 << 1
_AIDED_BY = {
    Sensor.GPS: 1 << 2 | 1 << 44,  # position, velocity
    Sensor.OPTICAL_FLOW: 1 << 3,
    Sensor.MAGNETOMETER: 1 << 4,
    Sensor.BAROMETER: 1 << 9,
    Sensor.RANGE_FINDER: 1 << 10,
    Sensor.EXTERNAL_POSE: 1 << 12 | 1 << 13 | 1 << 14,  # position, heading, height
}


@dataclass(frozen=True, slots=True)
class Sample:
    """One sample of the autopilot, with values that several topics need.

    Attributes:
        autopilot: which is sampled.
        time_us: vehicle time.
        unix_us: the same since 1970; 0: not known.
        place: position on Earth; None: not known.
        report: of the estimator.
    """

    autopilot: Autopilot
    time_us: int
    unix_us: int
    place: GeodeticPoint | None
    report: EstimatorReport


def control_mode_flags(report: EstimatorReport) -> int:
    """What is known, and what aids the filter."""
    flags = _TILT_ALIGNED | _YAW_ALIGNED if report.has_attitude else 0
    return flags | sum(bits for sensor, bits in _AIDED_BY.items() if sensor in report.relied_on)


def accuracies_and_ratios(report: EstimatorReport) -> Values:
    """Accuracies of position and height, ratios of heading, velocity, position and height."""
    north_m2, east_m2, down_m2 = report.position_variance_m2
    ratios = report.ratios
    return (
        sqrt(north_m2 + east_m2),
        sqrt(down_m2),
        ratios.heading,
        ratios.velocity,
        ratios.position_horizontal,
        ratios.position_vertical,
    )


def gps(sample: Sample) -> Values | None:
    """Values of vehicle_gps_position."""
    fix = sample.report.latest.gps
    if fix is None:
        return None
    north_m_s, east_m_s, down_m_s = fix.velocity_ned_m_s
    return (
        sample.time_us,
        fix.time_us,
        sample.unix_us,
        fix.latitude_deg,
        fix.longitude_deg,
        fix.altitude_m,
        fix.altitude_m,
        fix.speed_accuracy_m_s,
        nan,
        fix.horizontal_accuracy_m,
        fix.vertical_accuracy_m,
        nan,
        nan,
        0,
        0,
        hypot(north_m_s, east_m_s),
        north_m_s,
        east_m_s,
        down_m_s,
        atan2(east_m_s, north_m_s),
        nan,
        *(int(fix.fix_type), 1, 1, True, fix.satellites),
    )


def air_data(sample: Sample) -> Values | None:
    """Values of vehicle_air_data."""
    pressure = sample.report.latest.barometer
    if pressure is None:
        return None
    density_kg_m3 = pressure.pressure_pa / (_AIR_GAS_CONSTANT * pressure.temperature_k)
    return (
        sample.time_us,
        sample.time_us,
        pressure_altitude_m(pressure.pressure_pa),
        pressure.pressure_pa,
        pressure.temperature_k - _KELVIN,
        density_kg_m3,
    )


def magnetometer(sample: Sample) -> Values | None:
    """Values of vehicle_magnetometer."""
    field = sample.report.latest.magnetometer
    return None if field is None else (sample.time_us, field.time_us, *field.field_frd_gauss)


def sensor_combined(sample: Sample) -> Values | None:
    """Values of sensor_combined: the IMU as measured."""
    imu = sample.report.latest.imu
    if imu is None:
        return None
    rate, force, period_us = imu.angular_rate_frd_rad_s, imu.specific_force_frd_m_s2, imu.period_us
    return (sample.time_us, *rate, period_us, 0, *force, period_us, 0, 0, 0, 0)
