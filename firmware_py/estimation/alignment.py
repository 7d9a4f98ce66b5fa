"""Alignment: the first attitude and biases, of a vehicle that stands still."""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np

from firmware_py.estimation.error_state import ACCEL_BIAS, ATTITUDE, GYRO_BIAS, POSITION, VELOCITY
from firmware_py.estimation.navigation_filter import NavigationFilter
from firmware_py.estimation.settings import InertialNoise
from firmware_py.estimation.strapdown import GRAVITY_M_S2
from framerunner.geometry.rotations import quaternion_from_euler, rotation
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.measurements import ImuSample

_SAMPLES = 100
_MAX_RATE_RAD_S = 0.3
_MAX_FORCE_DIFFERENCE_M_S2 = 1.0  # from standard gravity
_HEADING_SIGMA_RAD = 0.3
_VELOCITY_SIGMA_M_S = 0.05
_POSITION_SIGMA_M = 0.001  # it starts in the local frame's origin


def is_still(imu: ImuSample) -> bool:
    """Whether a sample may be one of a vehicle at rest: it hardly turns, and feels gravity only."""
    p, q, r = imu.angular_rate_frd_rad_s
    if max(abs(p), abs(q), abs(r)) > _MAX_RATE_RAD_S:
        return False
    x, y, z = imu.specific_force_frd_m_s2
    return abs(sqrt(x * x + y * y + z * z) - GRAVITY_M_S2) <= _MAX_FORCE_DIFFERENCE_M_S2


class ImuAlignment:
    """Averages the IMU, and the heading from whatever measures it, until both are known.

    Attributes:
        heading_rad: None: not measured yet.
    """

    def __init__(self) -> None:
        self.heading_rad: float | None = None
        self.forget()

    def forget(self) -> None:
        """Begin again: the vehicle has moved."""
        self._count = 0
        self._rate: Vec3 = ZERO3
        self._force: Vec3 = ZERO3

    def take(self, imu: ImuSample) -> bool:
        """Take a sample; return whether there are enough."""
        if not is_still(imu):
            self.forget()
            return False
        p, q, r = imu.angular_rate_frd_rad_s
        x, y, z = imu.specific_force_frd_m_s2
        self._count += 1
        self._rate = (self._rate[0] + p, self._rate[1] + q, self._rate[2] + r)
        self._force = (self._force[0] + x, self._force[1] + y, self._force[2] + z)
        return self._count >= _SAMPLES

    @property
    def tilt_rad(self) -> tuple[float, float]:
        """Roll and pitch at which the mean specific force points up."""
        x, y, z = self._force
        return (atan2(-y, -z), atan2(x, sqrt(y * y + z * z)))

    def level(self, field_frd: Vec3) -> tuple[float, float]:
        """Components of a vector in body axes along the level axes ahead and to the right."""
        roll, pitch = self.tilt_rad
        x, y, z = field_frd
        ahead = cos(pitch) * x + sin(pitch) * (sin(roll) * y + cos(roll) * z)
        return (ahead, cos(roll) * y - sin(roll) * z)

    def start(self, into: NavigationFilter, noise: InertialNoise, heading_rad: float) -> None:
        """Set the filter's attitude and biases, at rest in its origin.

        An accelerometer's bias tilts the first attitude, so both errors are correlated: with a global error t
        of attitude, t x down = R bias / g.
        """
        state, covariance = into.state, into.covariance
        roll, pitch = self.tilt_rad
        state.attitude = quaternion_from_euler(roll, pitch, heading_rad)
        count = self._count
        into.gyro_bias_frd_rad_s = (self._rate[0] / count, self._rate[1] / count, self._rate[2] / count)
        gyro = noise.gyro_density**2 * 250.0 / count + noise.gyro_bias_walk**2
        covariance.set_variance(GYRO_BIAS, gyro, gyro, gyro)
        accel = noise.accel_bias_sigma_m_s2**2
        covariance.set_variance(ACCEL_BIAS, accel, accel, accel)
        covariance.set_variance(VELOCITY, *(_VELOCITY_SIGMA_M_S**2,) * 3)
        covariance.set_variance(POSITION, *(_POSITION_SIGMA_M**2,) * 3)
        m = np.array(rotation(state.attitude)).reshape(3, 3)
        tilt = np.array([m[1], -m[0], np.zeros(3)]) / GRAVITY_M_S2
        p = covariance.p
        p[ATTITUDE : ATTITUDE + 3, ATTITUDE : ATTITUDE + 3] = accel * tilt @ tilt.T
        noise_rad2 = (noise.accel_density / GRAVITY_M_S2) ** 2 * 250.0 / count
        p[ATTITUDE, ATTITUDE] += noise_rad2
        p[ATTITUDE + 1, ATTITUDE + 1] += noise_rad2
        p[ATTITUDE + 2, ATTITUDE + 2] = _HEADING_SIGMA_RAD**2
        p[ATTITUDE : ATTITUDE + 3, ACCEL_BIAS : ACCEL_BIAS + 3] = accel * tilt
        p[ACCEL_BIAS : ACCEL_BIAS + 3, ATTITUDE : ATTITUDE + 3] = accel * tilt.T
