"""Model of a motion capture system that sends the drone its pose."""

from __future__ import annotations

from framerunner.geometry.rotations import multiply, normalized, rotation, to_world
from framerunner.geometry.vectors import NAN3, Quaternion, Vec3
from framerunner.vehicle.measurements import ExternalPose
from sitl.sensors.noise import Delay, SamplingTimes, normal_numbers, normal_vector
from sitl.sensors.specs import ExternalPoseSpec
from sitl.sensors.truth import TrueMotion


class MotionCapture:
    """The pose of the drone's markers in the arena's NED frame, late, with white noise.

    The markers' middle and axes differ from the drone's by a constant error. The variances that it reports
    are those of the noise.

    Args:
        spec: figures of the errors.
        seed: of all random numbers.
    """

    def __init__(self, spec: ExternalPoseSpec, seed: int) -> None:
        self._spec = spec
        self._times = SamplingTimes(spec.rate_hz)
        self._delay: Delay[ExternalPose] = Delay(spec.delay_s)
        self._numbers = normal_numbers(seed, "sensors.external_pose.noise", 6)
        self._offset_frd_m = normal_vector(seed, "sensors.external_pose.offset", spec.marker_offset_m)
        self._misalignment = _small_turn(
            normal_vector(seed, "sensors.external_pose.misalignment", spec.marker_misalignment_rad)
        )
        self._position_variance_m2 = _equal(spec.position_noise_m**2)
        self._attitude_variance_rad2 = _equal(spec.attitude_noise_rad**2)

    def sample(self, motion: TrueMotion) -> ExternalPose | None:
        """Measure, if a pose is due; the newest pose that has arrived in this tick."""
        time_us = motion.time_us
        if self._times.due(time_us):
            self._delay.send(time_us, self._pose(motion))
        return self._delay.newest(time_us)

    def _pose(self, motion: TrueMotion) -> ExternalPose:
        x, y, z, turn_x, turn_y, turn_z = next(self._numbers)
        sigma_m, sigma_rad = self._spec.position_noise_m, self._spec.attitude_noise_rad
        north_m, east_m, down_m = motion.position_ned_m
        offset_ned_m = to_world(rotation(motion.attitude), *self._offset_frd_m)
        noise = _small_turn((sigma_rad * turn_x, sigma_rad * turn_y, sigma_rad * turn_z))
        return ExternalPose(
            motion.time_us,
            (
                north_m + offset_ned_m[0] + sigma_m * x,
                east_m + offset_ned_m[1] + sigma_m * y,
                down_m + offset_ned_m[2] + sigma_m * z,
            ),
            multiply(motion.attitude, multiply(self._misalignment, noise)),
            None,
            self._position_variance_m2,
            self._attitude_variance_rad2,
            NAN3,
        )


def _small_turn(vector_rad: Vec3) -> Quaternion:
    """The quaternion of a rotation vector of at most some degrees."""
    x, y, z = vector_rad
    return normalized((1.0, x / 2, y / 2, z / 2))


def _equal(value: float) -> Vec3:
    return (value, value, value)
