"""The IMU's samples, integrated once, so that motion between any two times is a difference of two sums.

The sums are in the axes of the reported attitude, which is known from tick to tick; a filter that finds these
axes turned about the vertical turns the difference. Gravity is vertical and stays what it is.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from math import remainder, tau

from framerunner.geometry.rotations import Rotation, rotated_by_rate, rotation, to_world, yaw_of
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.drone import ImuInterval

GRAVITY_M_S2 = 9.80665
KEPT_US = 2_000_000
LONGEST_GAP_US = 300_000  # of lost samples, for which the next one stands
BEYOND_US = 60_000  # after the last sample, for which it stands

_Sums = tuple[Vec3, Vec3, float]  # velocity, position, heading less the reported one


@dataclass(frozen=True, slots=True)
class InertialMotion:
    """What the IMU says of the motion between two times, in the axes of the reported attitude.

    Attributes:
        duration_s: of the time between.
        velocity_m_s: by which the velocity has changed.
        position_m: by which the position has changed, beside the first velocity times the duration.
        attitude: body FLU to these axes, in the middle.
        turn_rad: by which the drone has turned more to the left, by its gyroscope, than its reported heading.
    """

    duration_s: float
    velocity_m_s: Vec3
    position_m: Vec3
    attitude: Rotation
    turn_rad: float = 0.0


class InertialTrack:
    """The last two seconds of the IMU's samples."""

    def __init__(self) -> None:
        self._times_us: list[int] = []
        self._sums: list[_Sums] = []
        self._attitudes: list[Quaternion] = []

    def add(self, samples: tuple[ImuInterval, ...], time_us: int, attitude: Quaternion) -> bool:
        """Add the samples since the last call.

        Args:
            samples: oldest first.
            time_us: of the attitude, not much later than the last sample.
            attitude: reported, body FLU to arena.

        Returns:
            Whether they continue those before.
        """
        if not self._times_us or self.is_interrupted(samples, time_us):
            self._times_us, self._sums, self._attitudes = (
                [time_us],
                [((0.0,) * 3, (0.0,) * 3, 0.0)],
                [attitude],
            )
            return False
        turn = self._integrate(samples, self._attitudes[-1])
        if samples:
            after_s = (self._times_us[-1] - time_us) * 1e-6
            reported = rotated_by_rate(attitude, samples[-1].angular_rate_flu_rad_s, after_s)
            self._attitudes[-1] = reported
            more_rad = remainder(yaw_of(turn) - yaw_of(reported), tau)
            velocity_m_s, position_m, turn_rad = self._sums[-1]
            self._sums[-1] = (velocity_m_s, position_m, turn_rad + more_rad)
        old = bisect_left(self._times_us, self._times_us[-1] - KEPT_US)
        del self._times_us[:old], self._sums[:old], self._attitudes[:old]
        return True

    def is_interrupted(self, samples: tuple[ImuInterval, ...], time_us: int) -> bool:
        """Whether so many samples are missing before these, or before a time if there are none."""
        next_us = samples[0].time_us if samples else time_us
        return bool(self._times_us) and next_us - self._times_us[-1] > LONGEST_GAP_US

    def _integrate(self, samples: tuple[ImuInterval, ...], attitude: Quaternion) -> Quaternion:
        """Add samples, each of which stands for the time since the one before; the attitude at their end."""
        times, sums, attitudes = self._times_us, self._sums, self._attitudes
        (vx, vy, vz), (x, y, z), turn_rad = sums[-1]
        for sample in samples:
            step_s = (sample.time_us - times[-1]) * 1e-6
            if step_s <= 0.0:
                continue
            rate, half_s = sample.angular_rate_flu_rad_s, 0.5 * step_s
            middle = rotated_by_rate(attitude, rate, half_s)
            ax, ay, az = to_world(rotation(middle), *sample.specific_force_flu_m_s2)
            ux, uy, uz = ax * step_s, ay * step_s, (az - GRAVITY_M_S2) * step_s
            x, y, z = (
                x + vx * step_s + ux * half_s,
                y + vy * step_s + uy * half_s,
                z + vz * step_s + uz * half_s,
            )
            vx, vy, vz = vx + ux, vy + uy, vz + uz
            attitude = rotated_by_rate(middle, rate, half_s)
            times.append(sample.time_us)
            sums.append(((vx, vy, vz), (x, y, z), turn_rad))
            attitudes.append(attitude)
        return attitude

    def between(self, from_us: int, to_us: int) -> InertialMotion | None:
        """The motion between two times, also backwards; None if samples of that time are missing."""
        start, end = self._at(from_us), self._at(to_us)
        if start is None or end is None:
            return None
        step_s = (to_us - from_us) * 1e-6
        (v0, p0, turn0_rad), (v1, p1, turn1_rad) = start, end
        near = min(bisect_left(self._times_us, (from_us + to_us) // 2), len(self._times_us) - 1)
        return InertialMotion(
            step_s,
            (v1[0] - v0[0], v1[1] - v0[1], v1[2] - v0[2]),
            (
                p1[0] - p0[0] - v0[0] * step_s,
                p1[1] - p0[1] - v0[1] * step_s,
                p1[2] - p0[2] - v0[2] * step_s,
            ),
            rotation(self._attitudes[near]),
            turn1_rad - turn0_rad,
        )

    def _at(self, time_us: int) -> _Sums | None:
        """The sums at a time: between two samples the acceleration is constant."""
        times = self._times_us
        if len(times) < 2 or time_us < times[0] or time_us > times[-1] + BEYOND_US:
            return None
        after = min(max(bisect_left(times, time_us), 1), len(times) - 1)
        (v0, p0, turn_rad), (v1, _, turn1_rad) = self._sums[after - 1], self._sums[after]
        whole_s = (times[after] - times[after - 1]) * 1e-6
        step_s = (time_us - times[after - 1]) * 1e-6
        share, half = step_s / whole_s, 0.5 * step_s * step_s / whole_s
        (vx, vy, vz), (x, y, z) = v0, p0
        ax, ay, az = v1[0] - vx, v1[1] - vy, v1[2] - vz  # times whole_s
        return (
            (vx + ax * share, vy + ay * share, vz + az * share),
            (x + vx * step_s + ax * half, y + vy * step_s + ay * half, z + vz * step_s + az * half),
            turn1_rad if time_us >= times[after] else turn_rad,
        )
