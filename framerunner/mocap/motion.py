"""Whether poses move as the vehicle does: axes and delay, from the poses sent and what the vehicle reports.

The vehicle's gyroscope is independent of the poses, whatever its estimator does with them. So the body rates
of the poses are correlated with it: over delays, and over all ways in which axes can be swapped or mirrored.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product
from math import acos, degrees, hypot, nan, remainder

import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import Rotation, multiply, rotation, to_world, yaw_of
from framerunner.geometry.vectors import Quaternion, Vec3, minus
from framerunner.wire.vehicle_telemetry import VehiclePose, VehicleTelemetry

Array = npt.NDArray[np.float64]

_SPAN_US = 20_000_000
_RATE_SPAN = 3  # poses between two whose difference gives a rate
_MAX_GAP_US = 200_000
_GRID_S = 0.01
_DELAYS_S = np.arange(-0.10, 0.4001, _GRID_S)
_MOVES_RAD_S = 0.15  # root mean square of the gyroscope, from which rates are compared
_CLEAR, _BETTER = 0.7, 0.2  # correlations
_MOVED_M = 0.5
_COMPARE_US = 1_000_000
_NAMES = ("forward", "right", "down")


@dataclass(frozen=True, slots=True)
class SentPose:
    """A pose that was sent, with the vehicle time that it was given."""

    time_us: int
    position_ned_m: Vec3
    attitude: Quaternion


@dataclass(frozen=True, slots=True)
class PoseComparison:
    """Poses against the vehicle's reports; NaN or None: it cannot be told yet.

    Attributes:
        distance_m: between the vehicle's position and the pose of the same time.
        heading_deg: the vehicle's less the pose's, -180 to 180.
        tilt_deg: between the directions of gravity in the body.
        moves: whether the vehicle turns enough to compare rates.
        delay_s: by which poses are later than their time stamps say.
        correlation: of the body rates, at that delay.
        axes: which body axes are wrong, in words; empty: none is.
        track: how the vehicle's track differs from that of the poses, in words; empty: it does not.
    """

    distance_m: float = nan
    heading_deg: float = nan
    tilt_deg: float = nan
    moves: bool = False
    delay_s: float = nan
    correlation: float = nan
    axes: str = ""
    track: str = ""


class MotionCheck:
    """Keeps the last twenty seconds of both."""

    def __init__(self) -> None:
        self._sent: deque[SentPose] = deque()

    def note(self, pose: SentPose) -> None:
        """Note a pose that has been sent."""
        self._sent.append(pose)
        while self._sent[0].time_us < pose.time_us - _SPAN_US:
            self._sent.popleft()

    def compare(
        self, telemetry: VehicleTelemetry, rates_rad_s: Sequence[tuple[int, float, float, float]]
    ) -> PoseComparison:
        """Compare with the vehicle's attitude and position, and with its body rates by vehicle time."""
        distance_m, heading_deg, tilt_deg = self._offsets(telemetry)
        moves, delay_s, correlation, axes = _rates(list(self._sent), rates_rad_s)
        track = "" if axes else self._track(telemetry)
        return PoseComparison(distance_m, heading_deg, tilt_deg, moves, delay_s, correlation, axes, track)

    def _pairs(self, telemetry: VehicleTelemetry) -> list[tuple[SentPose, VehiclePose]]:
        """Poses of the last seconds with the vehicle's of the same time, oldest first."""
        covered_us = telemetry.covered_us
        if covered_us is None:
            return []
        found = []
        for sent in self._sent:
            reported = telemetry.pose(sent.time_us) if sent.time_us <= covered_us else None
            if reported is not None:
                found.append((sent, reported))
        return found

    def _offsets(self, telemetry: VehicleTelemetry) -> Vec3:
        """Medians of distance, heading and tilt over the last second."""
        pairs = self._pairs(telemetry)[-50:]
        attitude = telemetry.attitude
        if not pairs:
            if attitude is None or not self._sent:
                return (nan, nan, nan)
            newest = self._sent[-1]  # before the vehicle knows a position
            heading, tilt = _turns(newest.attitude, attitude.attitude_ned)
            return (nan, heading, tilt)
        distances = [hypot(*minus(reported.position_ned_m, sent.position_ned_m)) for sent, reported in pairs]
        turns = [_turns(sent.attitude, reported.attitude_ned) for sent, reported in pairs]
        headings, tilts = zip(*turns, strict=True)
        return (float(np.median(distances)), float(np.median(headings)), float(np.median(tilts)))

    def _track(self, telemetry: VehicleTelemetry) -> str:
        """Compare what both move within a second, over all planar ways to swap and mirror."""
        steps = []
        start: tuple[SentPose, VehiclePose] | None = None
        for sent, reported in self._pairs(telemetry):
            if start is None:
                start = (sent, reported)
            elif sent.time_us - start[0].time_us >= _COMPARE_US:
                reported_step = minus(reported.position_ned_m, start[1].position_ned_m)
                steps.append((minus(sent.position_ned_m, start[0].position_ned_m), reported_step))
                start = (sent, reported)
        if not steps:
            return ""
        ours = np.array([step[0] for step in steps])
        theirs = np.array([step[1] for step in steps])
        if np.abs(ours[:, :2]).sum() < _MOVED_M or np.abs(theirs[:, :2]).sum() < _MOVED_M:
            return ""
        return _planar_words(ours, theirs)


def _planar_words(ours: Array, theirs: Array) -> str:
    """The way to swap and mirror north and east that fits clearly better than none, in words."""
    size = float(np.sqrt((ours**2).sum() * (theirs**2).sum()))
    ways = {
        "north and east are both reversed": ((-1, 0), (0, -1)),
        "north is mirrored": ((-1, 0), (0, 1)),
        "east is mirrored": ((1, 0), (0, -1)),
        "north and east are swapped": ((0, 1), (1, 0)),
        "they are turned by 90 degrees": ((0, 1), (-1, 0)),
        "they are turned by -90 degrees": ((0, -1), (1, 0)),
    }
    vertical = float((ours[:, 2] * theirs[:, 2]).sum())
    plain = float((ours[:, :2] * theirs[:, :2]).sum() + vertical) / size
    scored = {
        words: float(((ours[:, :2] @ np.array(way, float).T) * theirs[:, :2]).sum() + vertical) / size
        for words, way in ways.items()
    }
    best = max(scored, key=lambda words: scored[words])
    return best if scored[best] > _CLEAR and scored[best] - plain > _BETTER else ""


def _rates(
    sent: list[SentPose], rates_rad_s: Sequence[tuple[int, float, float, float]]
) -> tuple[bool, float, float, str]:
    """Whether there is motion; delay, correlation and wrong axes, if there is."""
    ours = _pose_rates(sent)
    if len(ours) < 50 or len(rates_rad_s) < 50:
        return False, nan, nan, ""
    gyro = np.array(rates_rad_s)
    times_s, zero_s = ours[:, 0], ours[0, 0]
    gyro_s = gyro[:, 0] / 1e6
    within = (gyro_s > zero_s - 0.5) & (gyro_s < times_s[-1] + 0.5)
    if within.sum() < 50:
        return False, nan, nan, ""
    gyro, gyro_s = gyro[within], gyro_s[within]
    grid = np.arange(max(zero_s, gyro_s[0]) + 0.4, min(times_s[-1], gyro_s[-1]) - 0.1, _GRID_S)
    if len(grid) < 100:
        return False, nan, nan, ""
    theirs = _smoothed(np.column_stack([np.interp(grid, gyro_s, gyro[:, axis]) for axis in (1, 2, 3)]))
    moves = bool(np.sqrt((theirs**2).sum(axis=1).mean()) > _MOVES_RAD_S)
    if not moves:
        return False, nan, nan, ""
    matrices = []
    for delay_s in _DELAYS_S:
        shifted = np.column_stack([np.interp(grid + delay_s, times_s, ours[:, axis]) for axis in (1, 2, 3)])
        size = np.sqrt((shifted**2).sum() * (theirs**2).sum())
        matrices.append(shifted.T @ theirs / max(size, 1e-9))
    plain = np.array([np.trace(matrix) for matrix in matrices])
    best, way = max(
        (
            (float(max(sum(sign * m[p, i] for i, (p, sign) in enumerate(way)) for m in matrices)), way)
            for way in _WAYS
        ),
        key=lambda found: found[0],
    )
    if best > _CLEAR and best - plain.max() > _BETTER:
        return True, nan, float(plain.max()), _axis_words(way)
    return True, _peak_s(plain), float(plain.max()), ""


_WAYS = [
    tuple(zip(order, signs, strict=True))
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
]
"""For each axis of the vehicle, the axis of the poses and its sign."""


def _axis_words(way: tuple[tuple[int, float], ...]) -> str:
    wrong = [
        f"the vehicle's {_NAMES[axis]} is the poses' {'' if sign > 0 else 'reversed '}{_NAMES[source]}"
        for axis, (source, sign) in enumerate(way)
        if source != axis or sign < 0
    ]
    return ", ".join(wrong)


def _peak_s(correlations: Array) -> float:
    """The delay of the largest correlation, between the grid's by a parabola; NaN if it is at an end."""
    index = int(correlations.argmax())
    if not 0 < index < len(correlations) - 1:
        return nan
    before, top, after = correlations[index - 1 : index + 2]
    bend = before - 2.0 * top + after
    return float(_DELAYS_S[index] + (0.5 * (before - after) / bend * _GRID_S if bend < 0.0 else 0.0))


def _pose_rates(sent: list[SentPose]) -> Array:
    """Body rates from differences of attitudes: rows of time in s and rad/s, shape (n, 4)."""
    rows = []
    for first, second in zip(sent, sent[_RATE_SPAN:], strict=False):
        span_us = second.time_us - first.time_us
        if not 0 < span_us < _MAX_GAP_US:
            continue
        w, x, y, z = first.attitude
        turn = multiply((w, -x, -y, -z), second.attitude)
        scale = (2.0 if turn[0] >= 0.0 else -2.0) / (span_us / 1e6)
        rows.append(((first.time_us + second.time_us) / 2e6, *(scale * part for part in turn[1:])))
    return np.array(rows) if rows else np.empty((0, 4))


def _smoothed(values: Array) -> Array:
    """Means over the time between the poses of a rate, so that both are alike."""
    kernel = np.ones(7) / 7.0  # an odd number, so that nothing is shifted
    return np.column_stack([np.convolve(values[:, axis], kernel, "same") for axis in range(3)])


def _turns(pose: Quaternion, vehicle: Quaternion) -> tuple[float, float]:
    """Difference of heading and of tilt, degrees."""
    heading = remainder(degrees(yaw_of(vehicle) - yaw_of(pose)), 360.0)
    cosine = sum(a * b for a, b in zip(_down(rotation(pose)), _down(rotation(vehicle)), strict=True))
    return heading, degrees(acos(min(1.0, max(-1.0, cosine))))


def _down(m: Rotation) -> Vec3:
    """World down in body axes."""
    return (m[6], m[7], m[8])


def body_velocity(attitude: Quaternion, velocity_ned_m_s: Vec3) -> Vec3:
    """A velocity in body axes."""
    w, x, y, z = attitude
    return to_world(rotation((w, -x, -y, -z)), *velocity_ned_m_s)
