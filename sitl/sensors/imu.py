"""Model of an inertial measurement unit."""

from __future__ import annotations

from math import copysign, sqrt

from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.measurements import ImuSample
from sitl.sensors.noise import GaussMarkov, normal_numbers, normal_vector
from sitl.sensors.specs import ImuSpec
from sitl.sensors.truth import TrueMotion

_DRIFT_TICKS = 25  # between steps of the slow bias, whose time constant is minutes


class ImuSensor:
    """Gyroscope and accelerometer at the centre of mass: a sample in each control tick.

    Args:
        spec: figures of the errors.
        airframe: for the rotors' speed at hover, to which the vibration is referred.
        seed: of all random numbers.
    """

    def __init__(self, spec: ImuSpec, airframe: Airframe, seed: int) -> None:
        self._hover_squares = len(airframe.rotors) * airframe.hover_speed_rad_s**2
        gyro, accel = spec.gyroscope, spec.accelerometer
        self._gyroscope = InertialTriad(
            seed,
            "sensors.imu.gyroscope",
            noise_density=gyro.noise_density_rad_s_sqrt_hz,
            turn_on_bias=gyro.turn_on_bias_rad_s,
            drift=gyro.bias_drift_rad_s,
            drift_time_s=gyro.bias_drift_time_s,
            scale_error=gyro.scale_error,
            vibration_at_hover=gyro.vibration_at_hover_rad_s,
            full_scale=gyro.max_rate_rad_s,
        )
        self._accelerometer = InertialTriad(
            seed,
            "sensors.imu.accelerometer",
            noise_density=accel.noise_density_m_s2_sqrt_hz,
            turn_on_bias=accel.turn_on_bias_m_s2,
            drift=accel.bias_drift_m_s2,
            drift_time_s=accel.bias_drift_time_s,
            scale_error=accel.scale_error,
            vibration_at_hover=accel.vibration_at_hover_m_s2,
            full_scale=accel.max_specific_force_m_s2,
        )

    def sample(self, motion: TrueMotion) -> ImuSample:
        """Measure the mean motion of this tick."""
        squares = 0.0
        for speed in motion.motor_speeds_rad_s:
            squares += speed * speed
        vibration = squares / self._hover_squares
        period_us = motion.period_us
        return ImuSample(
            motion.time_us,
            period_us,
            self._gyroscope.measure(motion.angular_rate_frd_rad_s, period_us, vibration),
            self._accelerometer.measure(motion.specific_force_frd_m_s2, period_us, vibration),
        )


class InertialTriad:
    """Three orthogonal inertial sensors of one kind, with the errors of IEEE Std 952's model.

    measured = (1 + scale error) true + turn-on bias + slow bias + white noise + vibration, within full scale.
    White noise of density N has a standard deviation of N / sqrt(period) in a mean over a period. Vibration
    is white too, and its standard deviation grows with the mean squared rotor speed, as rotors' imbalance.

    Args:
        seed: of all random numbers.
        name: of its streams.
        noise_density: the sensor's unit per square root of a hertz.
        turn_on_bias: 1 sigma of each axis.
        drift: 1 sigma of the slow bias of each axis.
        drift_time_s: its time constant.
        scale_error: 1 sigma of each axis.
        vibration_at_hover: 1 sigma of a sample of each axis.
        full_scale: largest value.
    """

    def __init__(
        self,
        seed: int,
        name: str,
        *,
        noise_density: float,
        turn_on_bias: float,
        drift: float,
        drift_time_s: float,
        scale_error: float,
        vibration_at_hover: float,
        full_scale: float,
    ) -> None:
        self._numbers = normal_numbers(seed, f"{name}.noise", 3)
        self._constant_bias = normal_vector(seed, f"{name}.turn_on_bias", turn_on_bias)
        self._drift = GaussMarkov(seed, f"{name}.drift", 3, drift, drift_time_s)
        x, y, z = normal_vector(seed, f"{name}.scale", scale_error)
        self._scale: Vec3 = (1.0 + x, 1.0 + y, 1.0 + z)
        self._noise_density, self._vibration, self._full_scale = noise_density, vibration_at_hover, full_scale
        self._period_us, self._noise_variance = 0, 0.0
        self._ticks = 0
        self._bias: Vec3 = self._constant_bias
        self._add_drift()

    def measure(self, true: Vec3, period_us: int, vibration: float) -> Vec3:
        """Measure the mean over a period, shape (3,).

        Args:
            true: in body axes, shape (3,).
            period_us: length of the period.
            vibration: of this tick, relative to that at hover.
        """
        if period_us != self._period_us:
            self._period_us = period_us
            self._noise_variance = self._noise_density**2 / (period_us * 1e-6)
        self._ticks += 1
        if self._ticks == _DRIFT_TICKS:
            self._ticks = 0
            self._drift.advance(_DRIFT_TICKS * period_us * 1e-6)
            self._add_drift()
        vibration *= self._vibration
        sigma = sqrt(self._noise_variance + vibration * vibration)
        noise_x, noise_y, noise_z = next(self._numbers)
        scale, bias, limit = self._scale, self._bias, self._full_scale
        x = scale[0] * true[0] + bias[0] + sigma * noise_x
        y = scale[1] * true[1] + bias[1] + sigma * noise_y
        z = scale[2] * true[2] + bias[2] + sigma * noise_z
        if -limit < x < limit and -limit < y < limit and -limit < z < limit:
            return (x, y, z)
        return (_limited(x, limit), _limited(y, limit), _limited(z, limit))

    def _add_drift(self) -> None:
        constant, slow = self._constant_bias, self._drift.values
        self._bias = (constant[0] + slow[0], constant[1] + slow[1], constant[2] + slow[2])


def _limited(value: float, limit: float) -> float:
    return value if abs(value) < limit else copysign(limit, value)
