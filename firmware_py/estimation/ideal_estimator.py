"""The vehicle state from ideal sensors: samples are checked and given in the local frame.

It reports samples of sensors without errors, and no variances.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, isnan, nan, sqrt

from firmware_py.estimation.report import IMU, EstimatorReport, Sensor
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import euler_from_quaternion, rotation, to_body, to_world
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.atmosphere import pressure_pa, temperature_k
from framerunner.vehicle.earth_field import earth_field_ned_gauss
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import (
    BarometerSample,
    ExternalPose,
    FixType,
    GpsSample,
    ImuSample,
    MagnetometerSample,
    RangeSample,
    Readings,
    Sensors,
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


_MAX_GAP_S = 0.1  # between samples, for dead reckoning
_NORM_TOLERANCE = 0.05  # of the attitude quaternion's squared length; more than rounding, so it is a fault


class IdealEstimator:
    """Estimates the vehicle state; positions are relative to the first usable sample (PX4's local frame).

    Args:
        sensor_origin: where on Earth the sensors' positions are measured from.

    Attributes:
        state: the estimate, updated in place; it keeps its last value while samples are unusable.
        origin_ned_m: the local frame's origin in the sensors' frame, shape (3,); None before a first sample.
        has_position: whether the last sample had a horizontal position; else it is dead reckoning.
        stands: not used.
        imu: None: the ideal sensors deliver a state.
    """

    imu = None

    def __init__(self, sensor_origin: GeodeticPoint) -> None:
        self.state = VehicleState()
        self.origin_ned_m: Vec3 | None = None
        self.has_position = False
        self.stands = True
        self._sensor_origin = sensor_origin

    @property
    def origin(self) -> GeodeticPoint | None:
        """Where on Earth the local frame's origin is; None before a first sample."""
        if self.origin_ned_m is None:
            return None
        return LocalProjection(self._sensor_origin).to_geodetic(self.origin_ned_m)

    def report(self) -> EstimatorReport:
        """The condition now: all that is known, without error."""
        return ideal_report(self.state, self.origin, has_position=self.has_position)

    def take_external_pose(self, pose: ExternalPose) -> None:
        """Ignore a pose from outside: ideal sensors know theirs."""

    def update(self, sensors: Sensors | Readings) -> bool:
        """Take one sample.

        Returns:
            Whether it was usable: finite, the attitude a unit quaternion, and newer than the last.
        """
        if type(sensors) is not Sensors:
            raise TypeError("ideal sensors deliver Sensors; Readings need an InertialEstimator")
        state = self.state
        origin = self.origin_ned_m
        if not _is_usable(sensors):
            sensors = self._without_position(sensors)
            if not _is_usable(sensors):
                return False
            self.has_position = False
        else:
            self.has_position = True
        if origin is not None and sensors.time_us <= state.time_us:
            return False
        position = sensors.position_ned_m
        if origin is None:
            origin = self.origin_ned_m = position
        state.time_us = sensors.time_us
        state.position_ned_m = (position[0] - origin[0], position[1] - origin[1], position[2] - origin[2])
        state.velocity_ned_m_s = sensors.velocity_ned_m_s
        state.attitude = sensors.attitude
        state.roll_rad, state.pitch_rad, state.yaw_rad = euler_from_quaternion(sensors.attitude)
        state.angular_rate_frd_rad_s = sensors.angular_rate_frd_rad_s
        state.specific_force_frd_m_s2 = sensors.specific_force_frd_m_s2
        return True

    def _without_position(self, sensors: Sensors) -> Sensors:
        """Complete a sample without horizontal position and velocity (NaN) by dead reckoning.

        The accelerometer is integrated from the last state: v += (R f + g) dt, p += v dt. It drifts, but the
        commander uses it for a second only.
        """
        origin, state = self.origin_ned_m, self.state
        lost = (*sensors.position_ned_m[:2], *sensors.velocity_ned_m_s[:2])
        period_s = (sensors.time_us - state.time_us) / 1e6
        if origin is None or not all(map(isnan, lost)) or not 0.0 < period_s < _MAX_GAP_S:
            return sensors
        north_m_s2, east_m_s2, _ = to_world(rotation(sensors.attitude), *sensors.specific_force_frd_m_s2)
        north_m_s = state.velocity_ned_m_s[0] + north_m_s2 * period_s
        east_m_s = state.velocity_ned_m_s[1] + east_m_s2 * period_s
        return replace(
            sensors,
            position_ned_m=(
                origin[0] + state.position_ned_m[0] + north_m_s * period_s,
                origin[1] + state.position_ned_m[1] + east_m_s * period_s,
                sensors.position_ned_m[2],
            ),
            velocity_ned_m_s=(north_m_s, east_m_s, sensors.velocity_ned_m_s[2]),
        )


def _is_usable(sensors: Sensors) -> bool:
    px, py, pz = sensors.position_ned_m
    vx, vy, vz = sensors.velocity_ned_m_s
    w, x, y, z = sensors.attitude
    p, q, r = sensors.angular_rate_frd_rad_s
    ax, ay, az = sensors.specific_force_frd_m_s2
    # A sum is finite only if every term is: one check instead of sixteen on the per-tick path.
    if not isfinite(px + py + pz + vx + vy + vz + p + q + r + ax + ay + az):
        return False
    return abs(w * w + x * x + y * y + z * z - 1.0) < _NORM_TOLERANCE  # false for NaN too
