"""Aiding by poses of motion capture or visual odometry."""

from __future__ import annotations

from math import cos, isfinite, nan, pi, remainder, sin, tan

import numpy as np

from firmware_py.estimation.aiding.aid import Aid
from firmware_py.estimation.aiding.target import MAX_RESETS, Target
from firmware_py.estimation.error_state import ATTITUDE, POSITION, Matrix
from firmware_py.estimation.joint_update import JointUpdate
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.geometry.rotations import euler_from_quaternion, rotation, yaw_of
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.measurements import ExternalPose

_MAX_PITCH_RAD = 1.3  # beyond, there is no heading
_HEADING = 3  # index of its row, behind those of the position


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
        self._rows = rows = target.rows(_HEADING + 1)
        rows[:_HEADING, POSITION : POSITION + 3] = np.eye(3)
        offset, turn = target.layout.offset, target.layout.turn
        self._offset_rows: Matrix | None = rows[:_HEADING, offset : offset + 3] if offset >= 0 else None
        if turn >= 0:
            rows[_HEADING, turn] = 1.0

    def fuse(self, pose: ExternalPose) -> None:
        """Correct by a pose; a source that says that its frame has jumped is followed."""
        into = self._target.filter
        jumped = self._resets is not None and self._resets != pose.reset_counter
        self._resets = pose.reset_counter
        late_s = (pose.time_us - into.time_us) / 1e6
        vn, ve, vd = into.state.velocity_ned_m_s
        n, e, d = pose.position_ned_m
        position = (n - vn * late_s, e - ve * late_s, d - vd * late_s)
        if self._offset_rows is not None:  # the place of the markers on the vehicle is not known exactly
            self._offset_rows[:] = np.array(rotation(into.state.attitude)).reshape(3, 3)
        turned_rad = self._prepare_heading(pose)
        aids = (self.horizontal, self.vertical, self.heading)
        if jumped or any(aid.is_needed(into.time_us) for aid in aids):
            self._fuse_singly(pose, position, turned_rad, jumped=jumped)
            return
        innovations = self._innovations(position)
        level = self._variances(self.horizontal, innovations[:2], pose.position_variance_m2[:2])
        upright = self._variances(self.vertical, innovations[2:], pose.position_variance_m2[2:])
        update = JointUpdate(into.covariance, self._rows, (*innovations, turned_rad))
        # What else a pose says is not believed either if one part does not fit.
        if (
            self.horizontal.fuse_part(into, update, 0, level)
            and self.vertical.fuse_part(into, update, 2, upright)
            and isfinite(turned_rad)
        ):
            self.heading.fuse_part(into, update, _HEADING, (pose.attitude_variance_rad2[2],))
        update.apply()

    def _fuse_singly(self, pose: ExternalPose, position: Vec3, turned_rad: float, *, jumped: bool) -> None:
        """Correct by one part after the other, some of which set the state to what is measured."""
        target = self._target
        into = target.filter
        reported: tuple[float, ...] = pose.position_variance_m2
        for aid, axes in ((self.horizontal, (0, 1)), (self.vertical, (2,))):
            overdue = aid.is_overdue(into.time_us)
            if overdue and not jumped:
                target.doubt()
            if jumped or overdue or aid.is_needed(into.time_us):
                target.move(axes, position)
                aid.accept_any()
            part = slice(axes[0], axes[-1] + 1)
            innovations = self._innovations(position)[part]
            variances = self._variances(aid, innovations, reported[part])
            if not aid.fuse_rows(into, self._rows[part], innovations, variances):
                return
        if not isfinite(turned_rad):
            return
        if jumped or self.heading.is_overdue(into.time_us):
            target.turn(turned_rad)
            turned_rad = 0.0
            self.heading.accept_any()
        row = self._rows[_HEADING:]
        self.heading.fuse_rows(into, row, (turned_rad,), (pose.attitude_variance_rad2[2],))

    def _innovations(self, position: Vec3) -> tuple[float, ...]:
        n, e, d = self._target.filter.state.position_ned_m
        return (position[0] - n, position[1] - e, position[2] - d)

    def _variances(
        self, aid: Aid, innovations: tuple[float, ...], reported: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Of each coordinate, as reported or as measured."""
        least = aid.variance(innovations, max(reported), self._target.filter.time_us)
        return tuple([max(variance, least) for variance in reported])

    def _prepare_heading(self, pose: ExternalPose) -> float:
        """Write the heading's row and return its innovation, rad; NaN: there is no heading.

        The change of a heading y by the error of attitude is (cos y tan p, sin y tan p, 1).
        """
        _, pitch_rad, estimated_rad = euler_from_quaternion(self._target.filter.state.attitude)
        if pose.attitude is None or abs(pitch_rad) > _MAX_PITCH_RAD:
            return nan
        slope = tan(pitch_rad)
        self._rows[_HEADING, ATTITUDE : ATTITUDE + 3] = (
            cos(estimated_rad) * slope,
            sin(estimated_rad) * slope,
            1.0,
        )
        return remainder(yaw_of(pose.attitude) - estimated_rad, 2.0 * pi)
