"""The error-state Kalman filter: nominal state, biases and their covariance, at one instant.

State and covariance are predicted by several samples of the IMU together, up to a measurement's time or for
some hundredths of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from firmware_py.estimation.strapdown import ImuRecord, NavigationState, increments
from geometry.rotations import rotation
from geometry.vectors import ZERO3, Vec3

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
        self._predictions = 0

    def start(self, time_us: int) -> None:
        """Begin at a time."""
        self.time_us = time_us

    def predict(self, samples: Sequence[ImuRecord]) -> None:
        """Bring state and covariance to the end of some samples of the IMU.

        Args:
            samples: that follow the filter's time, oldest first; one at least.
        """
        period_s, (tx, ty, tz), (vx, vy, vz) = increments(samples)
        p, q, r = self.gyro_bias_frd_rad_s
        x, y, z = self.accel_bias_frd_m_s2
        turn_frd = (tx - p * period_s, ty - q * period_s, tz - r * period_s)
        push_frd = (vx - x * period_s, vy - y * period_s, vz - z * period_s)
        push_ned = self.state.integrate(turn_frd, push_frd, period_s)
        noise = self._noise
        turn_variance, push_variance = self.white_noise
        sample_s2 = period_s * period_s / len(samples)  # sum of the squared periods of equal samples
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
        self.time_us = samples[-1][0]
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
