"""The error-state Kalman filter: nominal state, biases and their covariance, at one instant.

Samples of the IMU are summed, and state and covariance predicted, only when a measurement is due or the sum
covers some hundredths of a second.
"""

from __future__ import annotations

from math import isfinite

from firmware_py.estimation.error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    GYRO_BIAS,
    INERTIAL_STATES,
    POSITION,
    VELOCITY,
    Drift,
    ErrorCovariance,
)
from firmware_py.estimation.settings import InertialNoise
from firmware_py.estimation.strapdown import Increments, NavigationState
from framerunner.geometry.rotations import rotation
from framerunner.geometry.vectors import ZERO3, Vec3

_MAX_PREDICTION_S = 0.0199
_PREDICTIONS_TO_SYMMETRISE = 100


class NavigationFilter:
    """Attitude, velocity, position, biases of the IMU, and slow errors of other sensors.

    Args:
        noise: of the IMU.
        drifts: errors of scale factors, and slow errors of other sensors.
        considered: so many of them, the first, are not estimated; see `ErrorCovariance`.
        gyro_scale: see `ErrorCovariance`.
        accel_scale: see `ErrorCovariance`.

    Attributes:
        time_us: of the state.
        state: the nominal state.
        gyro_bias_frd_rad_s: shape (3,).
        accel_bias_frd_m_s2: shape (3,).
        drifts: estimated values of the slow errors, in the order given.
        covariance: of all of them.
        white_noise: variances of the white noise in a sample of the IMU: (rad/s)^2 and (m/s^2)^2.
    """

    def __init__(
        self,
        noise: InertialNoise,
        drifts: tuple[Drift, ...] = (),
        considered: int = 0,
        *,
        gyro_scale: int = -1,
        accel_scale: int = -1,
    ) -> None:
        self.time_us = 0
        self.state = NavigationState()
        self.gyro_bias_frd_rad_s: Vec3 = ZERO3
        self.accel_bias_frd_m_s2: Vec3 = ZERO3
        self.drifts = [0.0] * len(drifts)
        self.covariance = ErrorCovariance(drifts, considered, gyro_scale=gyro_scale, accel_scale=accel_scale)
        self.white_noise = (0.0, 0.0)
        self._noise = noise
        self._returning = [(i, kind) for i, kind in enumerate(drifts) if isfinite(kind.time_constant_s)]
        self._sum = Increments()
        self._summed_us = 0
        self._samples = 0
        self._predictions = 0

    def start(self, time_us: int) -> None:
        """Begin at a time."""
        self.time_us = self._summed_us = time_us

    def add(self, time_us: int, period_s: float, rate_frd_rad_s: Vec3, force_frd_m_s2: Vec3) -> None:
        """Take a sample of the IMU.

        Args:
            time_us: end of its interval.
            period_s: length of the interval.
            rate_frd_rad_s: measured, shape (3,).
            force_frd_m_s2: measured specific force, shape (3,).
        """
        total = self._sum
        total.add(period_s, rate_frd_rad_s, force_frd_m_s2)
        self._summed_us = time_us
        self._samples += 1
        if total.period_s >= _MAX_PREDICTION_S:
            self.predict()

    def predict(self) -> None:
        """Bring state and covariance to the last sample's time."""
        total = self._sum
        period_s = total.period_s
        if period_s == 0.0:
            return
        p, q, r = self.gyro_bias_frd_rad_s
        tx, ty, tz = total.turn_frd_rad
        x, y, z = self.accel_bias_frd_m_s2
        vx, vy, vz = total.push_frd_m_s
        turn_frd = (tx - p * period_s, ty - q * period_s, tz - r * period_s)
        push_frd = (vx - x * period_s, vy - y * period_s, vz - z * period_s)
        push_ned = self.state.integrate(turn_frd, push_frd, period_s)
        noise = self._noise
        turn_variance, push_variance = self.white_noise
        sample_s2 = period_s * period_s / self._samples  # sum of the squared periods of equal samples
        self.covariance.predict(
            rotation(self.state.attitude),
            push_ned,
            period_s,
            turn_frd_rad=turn_frd,
            push_frd_m_s=push_frd,
            turn_variance_rad2=turn_variance * sample_s2,
            push_variance_m2_s2=push_variance * sample_s2,
            gyro_bias_variance=noise.gyro_bias_walk**2 * period_s,
            accel_bias_variance=noise.accel_bias_walk**2 * period_s,
        )
        for index, kind in self._returning:
            self.drifts[index] *= kind.over(period_s)[0]
        total.clear()
        self._samples = 0
        self.time_us = self._summed_us
        self._predictions += 1
        if self._predictions % _PREDICTIONS_TO_SYMMETRISE == 0:
            self.covariance.symmetrise()

    def correct(self) -> list[float]:
        """Add the errors that the covariance's corrections have found to the nominal state; return them."""
        error = self.covariance.take_error()
        self.state.correct(
            (error[ATTITUDE], error[ATTITUDE + 1], error[ATTITUDE + 2]),
            (error[VELOCITY], error[VELOCITY + 1], error[VELOCITY + 2]),
            (error[POSITION], error[POSITION + 1], error[POSITION + 2]),
        )
        x, y, z = self.gyro_bias_frd_rad_s
        self.gyro_bias_frd_rad_s = (
            x + error[GYRO_BIAS],
            y + error[GYRO_BIAS + 1],
            z + error[GYRO_BIAS + 2],
        )
        x, y, z = self.accel_bias_frd_m_s2
        self.accel_bias_frd_m_s2 = (
            x + error[ACCEL_BIAS],
            y + error[ACCEL_BIAS + 1],
            z + error[ACCEL_BIAS + 2],
        )
        for index, found in enumerate(error[INERTIAL_STATES:]):
            self.drifts[index] += found
        return error
