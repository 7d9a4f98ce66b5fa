"""What an estimator reports that is given the true state: samples of sensors without errors, no variances."""

from __future__ import annotations

from math import nan, sqrt

from firmware_py.estimation.report import IMU, EstimatorReport, Sensor
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import rotation, to_body
from framerunner.geometry.vectors import ZERO3
from framerunner.vehicle.atmosphere import pressure_pa, temperature_k
from framerunner.vehicle.earth_field import earth_field_ned_gauss
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import (
    BarometerSample,
    FixType,
    GpsSample,
    ImuSample,
    MagnetometerSample,
    RangeSample,
    Readings,
)

_SENSORS = IMU | {Sensor.MAGNETOMETER, Sensor.BAROMETER, Sensor.GPS}
_PERIOD_US = 4000  # of the IMU
_GPS_ACCURACIES = (0.9, 1.78, 0.4 / sqrt(3.0))  # m, m and m/s, as PX4's simulated receiver reports them
_SATELLITES = 10
_MAX_RANGE_M = 100.0
_MIN_HEIGHT_M = 0.1
_MIN_DOWN = 0.01


def ideal_report(state: VehicleState, origin: GeodeticPoint | None, *, has_position: bool) -> EstimatorReport:
    """The condition of an estimator.

    Args:
        state: the true one.
        origin: of the local frame; None: nothing is known yet.
        has_position: whether the horizontal position is delivered.
    """
    known = origin is not None
    placed = known and has_position
    working = _SENSORS if placed else _SENSORS - {Sensor.GPS}
    range_m = _range_m(state)
    return EstimatorReport(
        present=_SENSORS,
        healthy=working,
        relied_on=working if known else frozenset(),
        has_attitude=known,
        has_velocity=placed,
        has_position=placed,
        has_height=known,
        position_variance_m2=ZERO3,
        velocity_variance_m2_s2=ZERO3,
        attitude_variance_rad2=ZERO3,
        height_above_ground_m=range_m if range_m >= _MIN_HEIGHT_M else nan,
        latest=Readings(state.time_us) if origin is None else _samples(state, origin, range_m, placed=placed),
    )


def _samples(state: VehicleState, origin: GeodeticPoint, range_m: float, *, placed: bool) -> Readings:
    time_us = state.time_us
    place = LocalProjection(origin).to_geodetic(state.position_ned_m)
    altitude_m = place.altitude_m
    field = earth_field_ned_gauss(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
    fix = GpsSample(
        time_us,
        FixType.FIX_3D,
        place.latitude_deg,
        place.longitude_deg,
        altitude_m,
        state.velocity_ned_m_s,
        *_GPS_ACCURACIES,
        _SATELLITES,
    )
    return Readings(
        time_us,
        ImuSample(time_us, _PERIOD_US, state.angular_rate_frd_rad_s, state.specific_force_frd_m_s2),
        MagnetometerSample(time_us, to_body(rotation(state.attitude), *field)),
        BarometerSample(time_us, pressure_pa(altitude_m), temperature_k(altitude_m)),
        fix if placed else None,
        RangeSample(time_us, range_m),
    )


def _range_m(state: VehicleState) -> float:
    """Range along body down to flat ground at the height where the vehicle booted; NaN out of range.

    PX4's simulation computes it from the state too.
    """
    _, x, y, _ = state.attitude
    down = 1.0 - 2.0 * (x * x + y * y)  # of the body's down axis, in the world
    range_m = -state.position_ned_m[2] / down if down > _MIN_DOWN else nan
    return range_m if 0.0 < range_m < _MAX_RANGE_M else nan
