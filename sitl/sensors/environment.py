"""Models of the sensors of Earth's surroundings: magnetometer, barometer, GNSS receiver."""

from __future__ import annotations

from math import hypot

from framerunner.geometry.rotations import rotation, to_body
from framerunner.geometry.vectors import ZERO3
from framerunner.vehicle.atmosphere import pressure_pa, temperature_k
from framerunner.vehicle.earth_field import earth_field_ned_gauss
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import BarometerSample, FixType, GpsSample, MagnetometerSample
from sitl.sensors.noise import Delay, GaussMarkov, SamplingTimes, normal_numbers, normal_vector
from sitl.sensors.specs import BarometerSpec, GpsSpec, MagnetometerSpec
from sitl.sensors.truth import TrueMotion

UNKNOWN_ACCURACY_M = 4_294_967.295
"""What u-blox receivers report without a fix: 2^32 - 1 millimetres."""


class Magnetometer:
    """Earth's field at the scenario's origin, in body axes, with what calibration leaves of its errors.

    measured = (1 + scale error) true + hard iron + white noise.

    Args:
        spec: figures of the errors.
        origin: where on Earth the scenario is.
        seed: of all random numbers.
    """

    def __init__(self, spec: MagnetometerSpec, origin: GeodeticPoint, seed: int) -> None:
        self._field_ned_gauss = earth_field_ned_gauss(
            origin.latitude_deg, origin.longitude_deg, origin.altitude_m
        )
        self._times = SamplingTimes(spec.rate_hz)
        self._noise_gauss = spec.noise_gauss
        self._numbers = normal_numbers(seed, "sensors.magnetometer.noise", 3)
        self._hard_iron_gauss = normal_vector(seed, "sensors.magnetometer.hard_iron", spec.hard_iron_gauss)
        x, y, z = normal_vector(seed, "sensors.magnetometer.scale", spec.scale_error)
        self._scale = (1.0 + x, 1.0 + y, 1.0 + z)

    def sample(self, motion: TrueMotion) -> MagnetometerSample | None:
        """Measure, if a sample is due."""
        if not self._times.due(motion.time_us):
            return None
        x, y, z = to_body(rotation(motion.attitude), *self._field_ned_gauss)
        noise_x, noise_y, noise_z = next(self._numbers)
        sigma, scale, iron = self._noise_gauss, self._scale, self._hard_iron_gauss
        field = (
            scale[0] * x + iron[0] + sigma * noise_x,
            scale[1] * y + iron[1] + sigma * noise_y,
            scale[2] * z + iron[2] + sigma * noise_z,
        )
        return MagnetometerSample(motion.time_us, field)


class Barometer:
    """Static pressure of the standard atmosphere, with a constant and a slow error and white noise.

    Args:
        spec: figures of the errors.
        origin: where on Earth the scenario is.
        seed: of all random numbers.
    """

    def __init__(self, spec: BarometerSpec, origin: GeodeticPoint, seed: int) -> None:
        self._floor_m = origin.altitude_m
        self._times = SamplingTimes(spec.rate_hz)
        self._period_s = 1.0 / spec.rate_hz
        self._noise_pa, self._noise_k = spec.noise_pa, spec.temperature_noise_k
        self._numbers = normal_numbers(seed, "sensors.barometer.noise", 2)
        self._bias_pa = spec.turn_on_bias_pa * next(normal_numbers(seed, "sensors.barometer.bias", 1))[0]
        self._drift_pa = GaussMarkov(seed, "sensors.barometer.drift", 1, spec.drift_pa, spec.drift_time_s)

    def sample(self, motion: TrueMotion) -> BarometerSample | None:
        """Measure, if a sample is due."""
        if not self._times.due(motion.time_us):
            return None
        altitude_m = self._floor_m - motion.position_ned_m[2]
        (drift_pa,) = self._drift_pa.advance(self._period_s)
        noise, noise_k = next(self._numbers)
        return BarometerSample(
            motion.time_us,
            pressure_pa(altitude_m) + self._bias_pa + drift_pa + self._noise_pa * noise,
            temperature_k(altitude_m) + self._noise_k * noise_k,
        )


class Gps:
    """A GNSS receiver: no fix at first, then solutions with slow and white errors that arrive late.

    The accuracies that it reports are those of its model: the root of the summed variances of one axis.

    Args:
        spec: figures of the errors.
        origin: where on Earth the scenario is.
        seed: of all random numbers.
    """

    def __init__(self, spec: GpsSpec, origin: GeodeticPoint, seed: int) -> None:
        self._spec = spec
        self._projection = LocalProjection(origin)
        self._first_fix_us = round(spec.first_fix_s * 1e6)
        self._times, self._period_s = SamplingTimes(spec.rate_hz), 1.0 / spec.rate_hz
        self._delay: Delay[GpsSample] = Delay(spec.delay_s)
        self._numbers = normal_numbers(seed, "sensors.gps.noise", 6)
        self._drift = GaussMarkov(seed, "sensors.gps.drift", 3, 1.0, spec.drift_time_s)
        self._horizontal_accuracy_m = hypot(spec.horizontal_drift_m, spec.horizontal_noise_m)
        self._vertical_accuracy_m = hypot(spec.vertical_drift_m, spec.vertical_noise_m)

    def sample(self, motion: TrueMotion) -> GpsSample | None:
        """Measure, if a solution is due; the newest solution that has arrived in this tick."""
        time_us = motion.time_us
        if self._times.due(time_us):
            self._delay.send(time_us, self._solution(motion))
        return self._delay.newest(time_us)

    def _solution(self, motion: TrueMotion) -> GpsSample:
        spec = self._spec
        drift = self._drift.advance(self._period_s)
        noise = next(self._numbers)
        if motion.time_us < self._first_fix_us:
            unknown = UNKNOWN_ACCURACY_M
            return GpsSample(
                motion.time_us, FixType.NO_FIX, 0.0, 0.0, 0.0, ZERO3, unknown, unknown, unknown, 0
            )
        north_m, east_m, down_m = motion.position_ned_m
        place = self._projection.to_geodetic(
            (
                north_m + spec.horizontal_drift_m * drift[0] + spec.horizontal_noise_m * noise[0],
                east_m + spec.horizontal_drift_m * drift[1] + spec.horizontal_noise_m * noise[1],
                down_m + spec.vertical_drift_m * drift[2] + spec.vertical_noise_m * noise[2],
            )
        )
        north_m_s, east_m_s, down_m_s = motion.velocity_ned_m_s
        sigma_m_s = spec.velocity_noise_m_s
        return GpsSample(
            motion.time_us,
            FixType.FIX_3D,
            place.latitude_deg,
            place.longitude_deg,
            place.altitude_m,
            (
                north_m_s + sigma_m_s * noise[3],
                east_m_s + sigma_m_s * noise[4],
                down_m_s + sigma_m_s * noise[5],
            ),
            self._horizontal_accuracy_m,
            self._vertical_accuracy_m,
            sigma_m_s,
            spec.satellites,
        )
