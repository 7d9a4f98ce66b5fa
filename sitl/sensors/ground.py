"""Models of the sensors that look at the ground along body down: range finder and optical flow."""

from __future__ import annotations

from math import floor, hypot, inf, nan, sqrt

from framerunner.geometry.rotations import rotation, to_body
from framerunner.vehicle.measurements import FlowSample, RangeSample
from scenarios.random_numbers import random_stream
from sitl.sensors.noise import SamplingTimes, normal_numbers, normal_vector
from sitl.sensors.specs import OpticalFlowSpec, RangeFinderSpec
from sitl.sensors.truth import TrueMotion

_MIN_DOWN = 0.1  # cosine of the steepest angle to a surface that is measured, 84 degrees
_SQUARES = 64  # in each direction, until the pattern of what reflects repeats itself


def distance_down_m(motion: TrueMotion) -> float:
    """Distance along body down to the level surface below; infinite if the body's down axis misses it.

    The surface is taken for wide: beside the edge of a base it is at the height of what is straight below.
    """
    _, qx, qy, _ = motion.attitude
    down = 1.0 - 2.0 * (qx * qx + qy * qy)  # of the body's down axis, in the world
    if down < _MIN_DOWN:
        return inf
    return max(0.0, -motion.position_ned_m[2] - motion.ground_z_m) / down


class RangeFinder:
    """The distance along body down, with a constant error and white noise; NaN out of its range.

    Args:
        spec: figures of the errors.
        seed: of all random numbers.
    """

    def __init__(self, spec: RangeFinderSpec, seed: int) -> None:
        self._spec = spec
        self._times = SamplingTimes(spec.rate_hz)
        self._numbers = normal_numbers(seed, "sensors.range_finder.noise", 1)
        self._offset_m = spec.offset_m * next(normal_numbers(seed, "sensors.range_finder.offset", 1))[0]

    def sample(self, motion: TrueMotion) -> RangeSample | None:
        """Measure, if a sample is due."""
        if not self._times.due(motion.time_us):
            return None
        spec = self._spec
        distance_m = distance_down_m(motion)
        (noise,) = next(self._numbers)
        if not spec.min_distance_m <= distance_m <= spec.max_distance_m:
            return RangeSample(motion.time_us, nan)
        measured_m = distance_m + self._offset_m + spec.noise_m * noise
        return RangeSample(motion.time_us, min(max(measured_m, spec.min_distance_m), spec.max_distance_m))


class OpticalFlow:
    """How far the image of the ground turns about body forward and right.

    A point of the ground straight ahead of the sensor at the distance d moves in body axes by -v - w x (0, 0,
    d). With the gyroscope's signs, so that a drone that only turns with rates w has the flow w, the flow is

        about forward: w_forward - v_right / d,    about right: w_right + v_forward / d.

    These are the signs of MAVLink's OPTICAL_FLOW_RAD: motion forwards gives a positive flow about body right.

    Args:
        spec: figures of the errors.
        seed: of all random numbers.
    """

    def __init__(self, spec: OpticalFlowSpec, seed: int) -> None:
        self._spec = spec
        self._times = SamplingTimes(spec.rate_hz)
        self._numbers = normal_numbers(seed, "sensors.optical_flow.noise", 4)
        self._bias_rad_s = normal_vector(seed, "sensors.optical_flow.gyro_bias", spec.gyro_bias_rad_s)
        scale = next(normal_numbers(seed, "sensors.optical_flow.scale", 1))[0]
        self._scale = 1.0 + spec.scale_error * scale
        self._flow_rad = self._gyro_rad = (0.0, 0.0)
        self._integration_us = 0
        self._usable = True
        stream = random_stream(seed, "sensors.optical_flow.shiny")
        self._shiny = (stream.random((_SQUARES, _SQUARES)) < spec.shiny_share).tolist()

    def sample(self, motion: TrueMotion) -> FlowSample | None:
        """Integrate the flow of this tick; the sum since the sample before, if one is due."""
        self._integrate(motion)
        if not self._times.due(motion.time_us):
            return None
        spec, integration_us = self._spec, self._integration_us
        time_s = integration_us * 1e-6
        noise = next(self._numbers)
        sigma_rad = spec.noise_rad_s * time_s
        gyro_sigma_rad = spec.gyro_noise_density_rad_s_sqrt_hz * sqrt(time_s)
        flow, gyro, bias = self._flow_rad, self._gyro_rad, self._bias_rad_s
        quality = spec.quality if self._usable else 0
        self._reset()
        return FlowSample(
            motion.time_us,
            integration_us,
            (self._scale * flow[0] + sigma_rad * noise[0], self._scale * flow[1] + sigma_rad * noise[1]),
            (
                gyro[0] + bias[0] * time_s + gyro_sigma_rad * noise[2],
                gyro[1] + bias[1] * time_s + gyro_sigma_rad * noise[3],
            ),
            quality,
        )

    def _integrate(self, motion: TrueMotion) -> None:
        spec = self._spec
        period_s = motion.period_us * 1e-6
        forward_rad_s, right_rad_s, _ = motion.angular_rate_frd_rad_s
        gyro = self._gyro_rad
        self._gyro_rad = (gyro[0] + forward_rad_s * period_s, gyro[1] + right_rad_s * period_s)
        distance_m = distance_down_m(motion)
        if spec.min_distance_m <= distance_m <= spec.max_distance_m and not self._is_shiny(motion):
            forward_m_s, right_m_s, _ = to_body(rotation(motion.attitude), *motion.velocity_ned_m_s)
            forward_rad_s -= right_m_s / distance_m
            right_rad_s += forward_m_s / distance_m
            if hypot(forward_rad_s, right_rad_s) > spec.max_flow_rad_s:
                self._usable = False
        else:
            self._usable = False
        flow = self._flow_rad
        self._flow_rad = (flow[0] + forward_rad_s * period_s, flow[1] + right_rad_s * period_s)
        self._integration_us += motion.period_us

    def _is_shiny(self, motion: TrueMotion) -> bool:
        """Whether the floor straight below reflects."""
        north_m, east_m, _ = motion.position_ned_m
        size_m = self._spec.shiny_size_m
        return bool(self._shiny[floor(north_m / size_m) % _SQUARES][floor(east_m / size_m) % _SQUARES])

    def _reset(self) -> None:
        self._flow_rad = self._gyro_rad = (0.0, 0.0)
        self._integration_us = 0
        self._usable = True
