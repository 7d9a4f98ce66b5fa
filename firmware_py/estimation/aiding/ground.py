"""Aiding by sensors that look at the ground: range finder and optical flow.

The ground's height is a state of its own. It may change only where the vehicle flies over it, so a hovering
vehicle holds its height by the range; at a step, such as the edge of a base, the ground moves and not the
vehicle.
"""

from __future__ import annotations

from math import hypot, isfinite, nan

from firmware_py.estimation.aiding.aid import NEVER_US, Aid
from firmware_py.estimation.aiding.target import UNKNOWN_M2, Target
from firmware_py.estimation.error_state import ATTITUDE, POSITION, VELOCITY
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.geometry.rotations import rotation, to_body
from framerunner.vehicle.measurements import FlowSample, RangeSample

_MIN_DOWN = 0.7  # cosine of the largest tilt at which the ground is measured
_MOVE_US = 200_000
_STEP_US = 100_000  # ranges that do not fit for so long: the ground has changed
_MIN_FLOW_QUALITY = 50
_MIN_DISTANCE_M = 0.05


class GroundAiding:
    """Height above ground, and velocity over it.

    Args:
        target: that is aided.
        settings: gates and noise.

    Attributes:
        height: of ranges.
        flow: of optical flow.
        walk: noise that drives the height of the ground, m per root of m flown over it.
    """

    def __init__(self, target: Target, settings: EstimatorSettings) -> None:
        self._target = target
        self._range_variance_m2 = (settings.range_sigma_m or 0.0) ** 2
        self._flow_sigma_rad_s = settings.flow_sigma_rad_s or 0.0
        self.walk = settings.ground_walk
        self.height = Aid("range", 1, settings.gate, _STEP_US)
        self.flow = Aid("optical flow", 2, settings.gate, settings.reset_us)
        self._moved_us = NEVER_US

    def height_above_ground_m(self) -> float:
        """The estimated height above ground; NaN: no range yet."""
        if self.height.fused_us == NEVER_US:
            return nan
        return -self._target.filter.state.position_ned_m[2] - self._ground_m()

    def fuse_range(self, sample: RangeSample) -> None:
        """Correct by a distance along body down to level ground."""
        target, index, aid = self._target, self._target.layout.ground, self.height
        into = target.filter
        m = rotation(into.state.attitude)
        if not isfinite(sample.distance_m) or m[8] < _MIN_DOWN:
            return
        height_m = -into.state.position_ned_m[2]
        self.move()
        measured_m = sample.distance_m * m[8]  # vertical
        if aid.is_needed(into.time_us):
            target.set_drift(index, height_m - measured_m, UNKNOWN_M2)
            aid.accept_any()
        row = target.rows(1)
        row[0, POSITION + 2] = row[0, index] = -1.0
        # A tilt by t about north and east changes the vertical part of the measured line.
        row[0, ATTITUDE] = -m[5] * sample.distance_m
        row[0, ATTITUDE + 1] = m[2] * sample.distance_m
        innovation = measured_m - (height_m - target.drift(index))
        aid.fuse_rows(into, row, (innovation,), (self._range_variance_m2,))

    def fuse_flow(self, sample: FlowSample) -> None:
        """Correct by the velocity in body axes that optical flow and height above ground give."""
        target, into = self._target, self._target.filter
        distance_m, m = self.height_above_ground_m(), rotation(into.state.attitude)
        period_s = sample.integration_us * 1e-6
        if sample.quality < _MIN_FLOW_QUALITY or m[8] < _MIN_DOWN or period_s <= 0.0:
            return
        if not distance_m > _MIN_DISTANCE_M:
            return
        along_m = distance_m / m[8]
        about_forward = (sample.flow_rad[0] - sample.gyro_rad[0]) / period_s
        about_right = (sample.flow_rad[1] - sample.gyro_rad[1]) / period_s
        measured = (about_right * along_m, -about_forward * along_m)  # forward and right, m/s
        known = to_body(m, *into.state.velocity_ned_m_s)
        rows, innovations = target.rows(2), []
        scale, bias = target.layout.flow_scale, target.layout.flow_gyro
        for axis, row in enumerate(rows):
            row[VELOCITY : VELOCITY + 3] = (m[axis], m[axis + 3], m[axis + 6])
            lever_m = along_m if axis == 0 else -along_m
            if scale >= 0:  # of the whole flow, which the turn is part of
                row[scale] = known[axis] + lever_m * sample.gyro_rad[1 - axis] / period_s
            if bias >= 0:  # a turn about right measured too large: forward too slow
                row[bias + 1 - axis] = -lever_m
            innovations.append(measured[axis] - known[axis])
        sigma_m_s = self._flow_sigma_rad_s * along_m
        variance = sigma_m_s * sigma_m_s
        self.flow.fuse_rows(into, rows, innovations, (variance, variance))

    def move(self) -> None:
        """Let the ground's variance grow with the way flown over it since the last call."""
        into, index = self._target.filter, self._target.layout.ground
        period_s = (into.time_us - self._moved_us) / 1e6 if self._moved_us != NEVER_US else 0.0
        self._moved_us = into.time_us
        north, east, _ = into.state.velocity_ned_m_s
        into.covariance.p[index, index] += self.walk * self.walk * hypot(north, east) * period_s

    def move_if_due(self) -> None:
        """The same a few times a second, also while there are no ranges."""
        if self._target.layout.ground >= 0 and self._target.filter.time_us - self._moved_us > _MOVE_US:
            self.move()

    def _ground_m(self) -> float:
        return self._target.drift(self._target.layout.ground)
