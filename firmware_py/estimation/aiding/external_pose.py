"""Aiding by poses of motion capture or visual odometry."""

from __future__ import annotations

from math import cos, pi, remainder, sin, tan

from firmware_py.estimation.aiding.aid import Aid
from firmware_py.estimation.aiding.target import MAX_RESETS, Target
from firmware_py.estimation.error_state import ATTITUDE, POSITION
from firmware_py.estimation.settings import EstimatorSettings
from firmware_py.measurements import ExternalPose
from geometry.rotations import Rotation, euler_from_quaternion, rotation, yaw_of
from geometry.vectors import Vec3

_MAX_PITCH_RAD = 1.3  # beyond, there is no heading


class PoseAiding:
    """Position and heading from outside.

    Args:
        target: that is aided.
        settings: gates.

    Attributes:
        horizontal: of the horizontal position.
        vertical: of the height.
        heading: of the heading.
    """

    def __init__(self, target: Target, settings: EstimatorSettings) -> None:
        self._target = target
        gate, reset_us = settings.gate, settings.reset_us
        self.horizontal = Aid("external position", 2, gate, reset_us, MAX_RESETS)
        self.vertical = Aid("external height", 1, gate, reset_us, MAX_RESETS)
        self.heading = Aid("external heading", 1, gate, reset_us, MAX_RESETS)
        self._resets: int | None = None

    def fuse(self, pose: ExternalPose) -> None:
        """Correct by a pose; a source that says that its frame has jumped is followed."""
        into = self._target.filter
        jumped = self._resets is not None and self._resets != pose.reset_counter
        self._resets = pose.reset_counter
        late_s = (pose.time_us - into.time_us) / 1e6
        vn, ve, vd = into.state.velocity_ned_m_s
        n, e, d = pose.position_ned_m
        position = (n - vn * late_s, e - ve * late_s, d - vd * late_s)
        m = rotation(into.state.attitude)
        for aid, axes in ((self.horizontal, (0, 1)), (self.vertical, (2,))):
            overdue = aid.is_overdue(into.time_us)
            if overdue and not jumped:
                self._target.doubt()
            if jumped or overdue or aid.is_needed(into.time_us):
                self._target.move(axes, position)
                aid.accept_any()
            if not self._fuse_position(aid, axes, position, pose.position_variance_m2, m):
                return  # what else the pose says is not believed either
        if pose.attitude is not None:
            self._fuse_heading(yaw_of(pose.attitude), pose.attitude_variance_rad2[2], jumped=jumped)

    def _fuse_position(
        self, aid: Aid, axes: tuple[int, ...], position: Vec3, variance: Vec3, m: Rotation
    ) -> bool:
        """Correct by coordinates of the markers, whose place on the vehicle is not known exactly."""
        target, index = self._target, self._target.layout.offset
        own = target.filter.state.position_ned_m
        innovations = tuple([position[axis] - own[axis] for axis in axes])
        least = aid.variance(innovations, max([variance[axis] for axis in axes]), target.filter.time_us)
        variances = tuple([max(variance[axis], least) for axis in axes])
        if index < 0:
            return aid.fuse_states(target.filter, POSITION + axes[0], innovations, variances)
        rows = []
        for axis in axes:
            row = target.row()
            row[POSITION + axis] = 1.0
            row[index : index + 3] = m[3 * axis : 3 * axis + 3]
            rows.append(row)
        return aid.fuse_rows(target.filter, tuple(rows), innovations, variances)

    def _fuse_heading(self, yaw_rad: float, variance: float, *, jumped: bool) -> None:
        """Correct by a heading y: its change by the error of attitude is (cos y tan p, sin y tan p, 1)."""
        target, aid = self._target, self.heading
        into = target.filter
        _, pitch_rad, estimated_rad = euler_from_quaternion(into.state.attitude)
        if abs(pitch_rad) > _MAX_PITCH_RAD:
            return
        slope = tan(pitch_rad)
        row = target.row()
        row[ATTITUDE : ATTITUDE + 3] = (cos(estimated_rad) * slope, sin(estimated_rad) * slope, 1.0)
        if target.layout.turn >= 0:
            row[target.layout.turn] = 1.0
        innovation = remainder(yaw_rad - estimated_rad, 2.0 * pi)
        if jumped or aid.is_overdue(into.time_us):
            target.turn(innovation)
            innovation = 0.0
            aid.accept_any()
        aid.fuse_rows(into, (row,), (innovation,), (variance,))
