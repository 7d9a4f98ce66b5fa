"""Where a vehicle was: its reports of attitude and of position, put on one clock and filled in between."""

from __future__ import annotations

from bisect import bisect_right, insort
from dataclasses import dataclass
from math import cos, hypot, isfinite, sin
from operator import attrgetter
from typing import Generic, Protocol, TypeVar

from geometry.vectors import Quaternion, Vec3

SPAN_US = 1_500_000  # kept
AHEAD_US = 60_000  # as far as a pose is carried on beyond the last report
GAP_US = 300_000  # between two reports farther apart nothing is made up
RESTART_US = 3_000_000  # a clock that goes back farther has started again; less far back is a late report


@dataclass(frozen=True, slots=True)
class AttitudeReport:
    """What ATTITUDE or ATTITUDE_QUATERNION says.

    Attributes:
        time_us: vehicle time, microseconds since boot.
        attitude_ned: unit quaternion (w, x, y, z), body FRD to NED.
        rate_frd_rad_s: of turning, body axes, shape (3,).
    """

    time_us: int
    attitude_ned: Quaternion
    rate_frd_rad_s: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class PositionReport:
    """What LOCAL_POSITION_NED says.

    Attributes:
        time_us: vehicle time, microseconds since boot.
        position_ned_m: local, shape (3,).
        velocity_ned_m_s: shape (3,).
    """

    time_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3


@dataclass(frozen=True, slots=True)
class VehiclePose:
    """Where the vehicle was at one instant.

    Attributes:
        time_us: vehicle time, microseconds since boot.
        position_ned_m: local, shape (3,).
        velocity_ned_m_s: shape (3,).
        attitude_ned: unit quaternion (w, x, y, z), body FRD to NED.
    """

    time_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    attitude_ned: Quaternion


class _Timed(Protocol):
    @property
    def time_us(self) -> int: ...


T = TypeVar("T", bound=_Timed)
_time = attrgetter("time_us")


class _Track(Generic[T]):
    """Reports in order of their own time, whatever the order they came in; doubles are left out."""

    __slots__ = ("reports",)

    def __init__(self) -> None:
        self.reports: list[T] = []

    def add(self, report: T) -> None:
        reports = self.reports
        if reports and reports[-1].time_us >= report.time_us:
            index = bisect_right(reports, report.time_us, key=_time)
            if index == 0 or reports[index - 1].time_us != report.time_us:
                insort(reports, report, key=_time)
        else:
            reports.append(report)
        if reports[0].time_us < reports[-1].time_us - 2 * SPAN_US:  # seldom, so that it costs nothing
            del reports[: bisect_right(reports, reports[-1].time_us - SPAN_US, key=_time)]

    def around(self, time_us: int) -> tuple[T, T | None] | None:
        """The report at or before a time and the next one; None if it is older than all, or beyond reach."""
        index = bisect_right(self.reports, time_us, key=_time)
        if index == 0:
            return None
        before = self.reports[index - 1]
        after = self.reports[index] if index < len(self.reports) else None
        if after is None:
            return (before, None) if time_us - before.time_us <= AHEAD_US else None
        return (before, after) if after.time_us - before.time_us <= GAP_US else None

    @property
    def newest_us(self) -> int | None:
        return self.reports[-1].time_us if self.reports else None


class PoseHistory:
    """The last second and a half of a vehicle's reports.

    Attributes:
        restarts: how often the vehicle's clock began anew.
    """

    def __init__(self) -> None:
        self._attitudes: _Track[AttitudeReport] = _Track()
        self._positions: _Track[PositionReport] = _Track()
        self.restarts = 0

    def add_attitude(self, report: AttitudeReport) -> None:
        """Take a report; one with a number that is not finite, or no attitude, is passed over."""
        norm = hypot(*report.attitude_ned)
        if not (isfinite(norm) and norm > 0.5 and isfinite(sum(report.rate_frd_rad_s))):
            return
        self._watch_clock(report.time_us)
        self._attitudes.add(report)

    def add_position(self, report: PositionReport) -> None:
        """Take a report; one with a number that is not finite is passed over."""
        if not isfinite(sum(report.position_ned_m) + sum(report.velocity_ned_m_s)):
            return
        self._watch_clock(report.time_us)
        self._positions.add(report)

    @property
    def newest_us(self) -> int | None:
        """The vehicle's clock, as far as it is known; None before the first report."""
        times = [time for time in (self._attitudes.newest_us, self._positions.newest_us) if time is not None]
        return max(times) if times else None

    @property
    def covered_us(self) -> int | None:
        """Up to here attitude and position are both reported; None while one has not come."""
        attitude_us, position_us = self._attitudes.newest_us, self._positions.newest_us
        return None if attitude_us is None or position_us is None else min(attitude_us, position_us)

    def pose(self, time_us: int) -> VehiclePose | None:
        """Where the vehicle was.

        Between two reports the position goes straight and the attitude turns evenly; beyond the last one
        both are carried on with velocity and body rates, for `AHEAD_US` at most.

        Args:
            time_us: vehicle time, microseconds.

        Returns:
            The pose; None outside the reports or in a hole of them.
        """
        attitudes, positions = self._attitudes.around(time_us), self._positions.around(time_us)
        if attitudes is None or positions is None:
            return None
        position_m, velocity_m_s = _position(*positions, time_us)
        return VehiclePose(time_us, position_m, velocity_m_s, _attitude(*attitudes, time_us))

    def _watch_clock(self, time_us: int) -> None:
        newest_us = self.newest_us
        if newest_us is not None and time_us < newest_us - RESTART_US:
            self._attitudes, self._positions = _Track(), _Track()
            self.restarts += 1


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Attitude from ATTITUDE's angles (turned about z, then y, then x, as MAVLink has them).

    Returns:
        Unit quaternion (w, x, y, z), body FRD to NED.
    """
    cr, sr = cos(roll_rad / 2), sin(roll_rad / 2)
    cp, sp = cos(pitch_rad / 2), sin(pitch_rad / 2)
    cy, sy = cos(yaw_rad / 2), sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _position(before: PositionReport, after: PositionReport | None, time_us: int) -> tuple[Vec3, Vec3]:
    if after is None:
        step_s = (time_us - before.time_us) * 1e-6
        velocity = before.velocity_ned_m_s
        return _blend(before.position_ned_m, velocity, 1.0, step_s), velocity
    share = (time_us - before.time_us) / (after.time_us - before.time_us)
    return (
        _blend(before.position_ned_m, after.position_ned_m, 1.0 - share, share),
        _blend(before.velocity_ned_m_s, after.velocity_ned_m_s, 1.0 - share, share),
    )


def _attitude(before: AttitudeReport, after: AttitudeReport | None, time_us: int) -> Quaternion:
    step_s = (time_us - before.time_us) * 1e-6
    if after is None:
        return _turned(before.attitude_ned, before.rate_frd_rad_s, step_s)
    share = step_s * 1e6 / (after.time_us - before.time_us)
    a, b = before.attitude_ned, after.attitude_ned
    # The two quaternions of one attitude differ in sign; go the short way.
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    w, x, y, z = ((1.0 - share) * p + sign * share * q for p, q in zip(a, b, strict=True))
    return _unit((w, x, y, z))


def _turned(attitude: Quaternion, rate_rad_s: Vec3, step_s: float) -> Quaternion:
    """Turn on with constant body rates: q times exp(rate step / 2)."""
    rate = hypot(*rate_rad_s)
    half = rate * step_s / 2
    scale = sin(half) / rate if rate > 1e-9 else step_s / 2
    dx, dy, dz = (component * scale for component in rate_rad_s)
    return _unit(multiply(attitude, (cos(half), dx, dy, dz)))


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """The turn b, then a: Hamilton's product of two quaternions (w, x, y, z)."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def _unit(q: Quaternion) -> Quaternion:
    norm = hypot(*q)
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


def _blend(a: Vec3, b: Vec3, share_a: float, share_b: float) -> Vec3:
    return (share_a * a[0] + share_b * b[0], share_a * a[1] + share_b * b[1], share_a * a[2] + share_b * b[2])
