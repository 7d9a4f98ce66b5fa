"""A drone's motion from reported states, for many times at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from framerunner.geometry.rotations import mounting_flu, rotation, rotation_rows
from framerunner.geometry.vectors import Quaternion, Vec3

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MAX_GAP_S = 0.3
"""Between two reports; what happened in a longer gap is not known."""
END_S = 0.05
"""Motion is known this long before its end, so that delays and rolling shutters stay within it."""


@dataclass(frozen=True, slots=True)
class MotionReport:
    """A state of the drone, upright axes x, y, z (z up) that are fixed to the world.

    Attributes:
        time_us: vehicle time of the attitude.
        position_time_us: vehicle time of position and velocity.
        position_m: of the drone's centre.
        velocity_m_s: of it.
        attitude: body forward, left, up to the world.
    """

    time_us: int
    position_time_us: int
    position_m: Vec3
    velocity_m_s: Vec3
    attitude: Quaternion


class Motion:
    """The drone's poses between reports: positions by cubic Hermite splines, attitudes with a constant rate.

    Args:
        reports: in any order; those of a time that is known already are left out.

    Attributes:
        start_us: the time from which seconds are counted.
        span_s: the first and the last second at which the pose is known; empty if the first is the larger.
    """

    def __init__(self, reports: Sequence[MotionReport]) -> None:
        self.start_us = min((report.position_time_us for report in reports), default=0)
        times_s = self.seconds([report.position_time_us for report in reports])
        self._position_s, first = np.unique(times_s, return_index=True)
        positions = np.array([report.position_m for report in reports]).reshape(-1, 3)[first]
        velocities = np.array([report.velocity_m_s for report in reports]).reshape(-1, 3)[first]
        times_s = self.seconds([report.time_us for report in reports])
        self._attitude_s, first = np.unique(times_s, return_index=True)
        quaternions = np.array([report.attitude for report in reports]).reshape(-1, 4)[first]
        tracks = (self._position_s, self._attitude_s)
        self._place: CubicHermiteSpline[np.float64] | None = None
        self._attitude: Slerp | None = None
        self.span_s = (0.0, -1.0)
        if min(map(len, tracks)) >= 2:
            self._place = CubicHermiteSpline(self._position_s, positions, velocities)
            self._attitude = Slerp(self._attitude_s, Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]))
            start_s, end_s = (
                max(float(track[0]) for track in tracks),
                min(float(track[-1]) for track in tracks),
            )
            self.span_s = (start_s, end_s - END_S)

    def seconds(self, times_us: Sequence[int]) -> Floats:
        """Vehicle times as seconds since the start."""
        return np.array([(time_us - self.start_us) * 1e-6 for time_us in times_us], np.float64)

    def is_known(self, times_s: Floats) -> Bools:
        """Whether times are within the reports, and in none of their gaps."""
        known: Bools = (times_s >= self.span_s[0]) & (times_s <= self.span_s[1])
        if self.span_s[1] < self.span_s[0]:
            return known
        for track in (self._position_s, self._attitude_s):
            after = np.clip(np.searchsorted(track, times_s), 1, len(track) - 1)
            known &= track[after] - track[after - 1] <= MAX_GAP_S
        return known

    def positions(self, times_s: Floats) -> Floats:
        """Where the drone's centre is, shape (n, 3)."""
        if self._place is None:
            return np.empty((0, 3))
        at: Floats = self._place(np.clip(times_s, self._position_s[0], self._position_s[-1]))
        return at

    def rotations(self, times_s: Floats) -> Floats:
        """Matrices from body to world, shape (n, 3, 3)."""
        if self._attitude is None:
            return np.empty((0, 3, 3))
        turned = self._attitude(np.clip(times_s, self._attitude_s[0], self._attitude_s[-1]))
        return np.asarray(turned.as_matrix(), np.float64)


def mounting_matrix(angles_frd_rad: Vec3) -> Floats:
    """The matrix from a camera's axes to the body's, forward, left, up, by its roll, pitch and yaw."""
    return np.array(rotation_rows(rotation(mounting_flu(angles_frd_rad))))
