"""The covariance of the error state, and its prediction and correction: a Kalman filter on small errors.

The error of attitude is a rotation vector about the axes of NED (R = exp(d) R_estimated), so that the error
of the heading is one of its components. Prediction and correction follow J. Solà, "Quaternion kinematics for
the error-state Kalman filter", 2017 (arXiv 1711.02508), section 7, with global angular errors. numpy does the
algebra; measurements are fused one number after the other (see `joint_update`), which needs no inverse.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, inf

import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import Rotation
from framerunner.geometry.vectors import Vec3

Matrix = npt.NDArray[np.float64]

ATTITUDE, VELOCITY, POSITION, GYRO_BIAS, ACCEL_BIAS = 0, 3, 6, 9, 12
INERTIAL_STATES = 15


@dataclass(frozen=True, slots=True)
class Drift:
    """A state of its own for a slowly changing error of a sensor.

    Attributes:
        noise_density: of the white noise that drives it, unit/s per root of Hz; 0: a constant.
        time_constant_s: of its return to zero; infinite: a random walk, else a first-order Gauss-Markov
            process, whose variance without measurements is noise_density^2 time_constant_s / 2.
    """

    noise_density: float = 0.0
    time_constant_s: float = inf

    def over(self, period_s: float) -> tuple[float, float]:
        """What is left of it after a time, as a share, and the variance added meanwhile."""
        kept = exp(-period_s / self.time_constant_s)
        if kept == 1.0:
            return (1.0, self.noise_density**2 * period_s)
        return (kept, self.noise_density**2 * self.time_constant_s / 2.0 * (1.0 - kept * kept))


class ErrorCovariance:
    """Covariance `p` of the error state, shape (n, n).

    Args:
        drifts: the states behind the fifteen inertial ones.
        considered: so many of them, the first, are not estimated: their uncertainty counts, but measurements
            do not change them (Schmidt-Kalman filter; Gelb, "Applied Optimal Estimation", 1974, section 7.2).
        gyro_scale: index of the first of three errors of the gyroscope's scale factors; -1: there are none.
        accel_scale: the same of the accelerometer.

    Attributes:
        p: the covariance, updated in place.
        error: the errors found by the corrections since `take_error`, shape (n,).
        has_error: whether it has been corrected since.
    """

    def __init__(
        self,
        drifts: tuple[Drift, ...] = (),
        considered: int = 0,
        *,
        gyro_scale: int = -1,
        accel_scale: int = -1,
    ) -> None:
        self.size = size = INERTIAL_STATES + len(drifts)
        self.p: Matrix = np.zeros((size, size))
        self.error: Matrix = np.zeros(size)
        self.has_error = False
        self._drifting = [
            (index, drift)
            for index, drift in enumerate(drifts, start=INERTIAL_STATES)
            if drift.noise_density > 0.0
        ]
        self._gyro_scale, self._accel_scale = gyro_scale, accel_scale
        self._considered = slice(INERTIAL_STATES, INERTIAL_STATES + considered) if considered else None
        self._g: Matrix = np.zeros((GYRO_BIAS, size))  # F less the identity: only the first states change
        self._rows: Matrix = np.zeros((GYRO_BIAS, size))
        self._work: Matrix = np.zeros((size, size))
        self._diagonal = self.p.reshape(-1)[:: size + 1]
        self._noise: Matrix = np.zeros(size)

    def set_variance(self, index: int, *variances: float) -> None:
        """Make states independent of all others, with these variances."""
        for at, variance in enumerate(variances, start=index):
            self.p[at, :] = 0.0
            self.p[:, at] = 0.0
            self.p[at, at] = variance

    def predict(
        self,
        m: Rotation,
        push_ned_m_s: Vec3,
        period_s: float,
        *,
        turn_frd_rad: Vec3,
        push_frd_m_s: Vec3,
        turn_variance_rad2: float,
        push_variance_m2_s2: float,
        gyro_bias_variance: float,
        accel_bias_variance: float,
    ) -> None:
        """Advance by an interval of some hundredths of a second.

        Args:
            m: attitude in the interval's middle.
            push_ned_m_s: change of velocity by the specific force, shape (3,).
            period_s: length of the interval.
            turn_frd_rad: rotation vector, shape (3,).
            push_frd_m_s: change of velocity by the specific force in body axes, shape (3,).
            turn_variance_rad2: by the gyroscope's white noise, per axis.
            push_variance_m2_s2: by the accelerometer's white noise, per axis.
            gyro_bias_variance: by which the biases' variance grows, (rad/s)^2.
            accel_bias_variance: by which the biases' variance grows, (m/s^2)^2.
        """
        g, p, noise = self._g, self.p, self._noise
        n, e, d = push_ned_m_s
        half_s = 0.5 * period_s
        tilt = g[3:6, 0:3]  # -[push]x: a tilt turns the specific force
        tilt[0, 1], tilt[0, 2], tilt[1, 2] = d, -e, n
        tilt[1, 0], tilt[2, 0], tilt[2, 1] = -d, e, -n
        np.multiply(tilt, half_s, out=g[6:9, 0:3])
        g[6, 3] = g[7, 4] = g[8, 5] = period_s
        turn = np.array(m).reshape(3, 3)
        turn *= -period_s
        g[0:3, 9:12] = turn
        g[3:6, 12:15] = turn
        np.multiply(turn, half_s, out=g[6:9, 12:15])
        rate_hz = 1.0 / period_s
        if (at := self._gyro_scale) >= 0:
            p_turn, q_turn, r_turn = turn_frd_rad
            g[0:3, at : at + 3] = turn * (p_turn * rate_hz, q_turn * rate_hz, r_turn * rate_hz)
        if (at := self._accel_scale) >= 0:
            x, y, z = push_frd_m_s
            g[3:6, at : at + 3] = turn * (x * rate_hz, y * rate_hz, z * rate_hz)
        noise[0:3] = turn_variance_rad2
        noise[3:6] = push_variance_m2_s2
        noise[9:12] = gyro_bias_variance
        noise[12:15] = accel_bias_variance
        for index, drift in self._drifting:
            kept, noise[index] = drift.over(period_s)
            if kept != 1.0:
                p[index] *= kept
                p[:, index] *= kept
        np.dot(g, p, out=self._rows)
        p[:GYRO_BIAS] += self._rows
        p[:, :GYRO_BIAS] += np.dot(p, g.T)
        self._diagonal += noise

    def fuse_state(self, index: int, innovation: float, variance: float) -> float:
        """Correct by a measurement of one state.

        Args:
            index: of the state.
            innovation: measured minus predicted by the nominal state.
            variance: of the measurement.

        Returns:
            The normalised innovation squared.
        """
        related: Matrix = self.p[index]
        total = float(related[index]) + variance
        left = innovation - float(self.error[index])  # what earlier numbers have not explained yet
        scale = total**-0.5
        self.correct((scale * related)[:, None], np.array([scale * left]))
        return left * left / total

    def correct(self, gains: Matrix, weights: Matrix) -> None:
        """Correct by measured numbers.

        Args:
            gains: of each number in a column, divided by the root of its innovation's variance, shape (n, k).
            weights: innovations divided by these roots, shape (k,).
        """
        p, considered = self.p, self._considered
        if considered is None:
            p -= np.dot(gains, gains.T)
            self.error += np.dot(gains, weights)
        else:
            kept = p[considered, considered].copy()
            p -= np.dot(gains, gains.T)
            p[considered, considered] = kept
            self.error += np.dot(gains, weights)
            self.error[considered] = 0.0
        self.has_error = True

    def take_error(self) -> list[float]:
        """The errors found since the last call; they are then zero, as the nominal state has them."""
        found: list[float] = self.error.tolist()
        self.error[:] = 0.0
        self.has_error = False
        return found

    def symmetrise(self) -> None:
        """Remove what rounding has made unsymmetrical."""
        np.add(self.p, self.p.T, out=self._work)
        np.multiply(self._work, 0.5, out=self.p)
