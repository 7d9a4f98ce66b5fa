"""Follows a path with a vehicle that answers late.

What is commanded now is flown after the vehicle's dead time, so a command is for the place on the path where
the vehicle will be then. That place moves on smoothly, also when it waits: else its vehicle would be told to
fly back what it has been told to fly already.
"""

from __future__ import annotations

from collections import deque
from math import cos, hypot, pi, remainder, sin, sqrt

from geometry.vectors import Vec3
from offboard.drone import DroneState
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response import Prediction, Response

BANDWIDTH_PER_S = 1.2  # of the control
MAX_CORRECTION_M_S = 0.6
RATE_CHANGE_PER_S = 1.2  # of the path's time: at the speed of crossings, that of a gentle stop
WAIT_FROM_M = 0.1  # farther from the path, its time goes slower
WAIT_ASIDE_M = 0.05  # or aside from it
WAIT_M = 0.25  # beyond that, it stands still
GATE_NEAR_S = 2.5  # before a gate; then the drone must be straight before it
GATE_TOO_NEAR_S = 0.8  # then it cannot stop any more
GATE_FROM_M = 0.03  # farther off, the path's time goes slower
GATE_WAIT_M = 0.06  # beyond that, it stands still
GATE_TURN_M = 0.15  # by which a turn counts, for each radian
_TICKS = 24
_Pace = tuple[float, float]
"""How fast the path's time goes, and how fast that changes, 1/s."""


class LateFollower:
    """Where on a path the commands are, and the commands; call `advance` and `command` once a tick.

    Args:
        ahead_s: time along the path for which commands begin.
        lead_s: time that was commanded ahead already.

    Attributes:
        ahead_s: time along the path that is commanded now.
        error_m: distance from the path, when what is commanded now is flown.
    """

    def __init__(self, ahead_s: float, lead_s: float) -> None:
        self.ahead_s = ahead_s
        self.error_m = 0.0
        self._pace: _Pace = (1.0, 0.0)
        self._wanted_rate = 1.0
        self._ticks: deque[tuple[float, float, _Pace]] = deque(maxlen=_TICKS)  # duration, advance, pace
        if lead_s > 0.0:
            self._ticks.append((lead_s, lead_s, self._pace))

    def advance(self, step_s: float, path: Path) -> None:
        """Go on along the path, by a tick."""
        rate, most = self._pace[0], RATE_CHANGE_PER_S * step_s
        change = min(max(self._wanted_rate - rate, -most), most)
        self._pace = (rate + change, change / step_s if step_s > 0.0 else 0.0)
        advance_s = min((rate + 0.5 * change) * step_s, path.duration_s - self.ahead_s)
        self.ahead_s += advance_s
        self._ticks.append((step_s, advance_s, self._pace))

    def before(self, time_s: float) -> tuple[float, _Pace]:
        """Time along the path that was commanded some time ago, or will be, and the pace of it then."""
        at_s, pace = self.ahead_s, self._pace
        if time_s <= 0.0:
            return at_s - pace[0] * time_s, pace
        for step_s, advance_s, pace in reversed(self._ticks):
            if time_s < step_s:
                return at_s - advance_s * time_s / step_s, pace
            at_s -= advance_s
            time_s -= step_s
        return at_s, pace

    def command(
        self, path: Path, state: DroneState, prediction: Prediction, response: Response
    ) -> tuple[float, float, float, float]:
        """Speeds forward, to the left and up, and the yaw rate, before their limits."""
        dead_s, lag_s = response.level_dead_s, response.level_lag_s
        level = self._reference(path, 0.0)
        climb = self._reference(path, dead_s - response.climb_dead_s)
        turn = self._reference(path, dead_s - response.yaw_dead_s)
        now = (state.x, state.y, state.z)
        offset, correction = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        for axis, (wanted, axis_lag_s) in enumerate(
            ((level, lag_s), (level, lag_s), (climb, response.climb_lag_s))
        ):
            gain, damping = _gains(axis_lag_s)
            offset[axis] = wanted.position_m[axis] - now[axis] - prediction.moved_m[axis]
            slower = wanted.velocity_m_s[axis] - prediction.velocity_m_s[axis]
            correction[axis] = gain * offset[axis] + damping * slower
        yaw_offset = remainder(turn.yaw_rad - state.yaw - prediction.turned_rad, 2 * pi)
        self.error_m = hypot(*offset)
        error = (offset[0], offset[1], offset[2])
        self._wanted_rate = min(
            rate_of(error, level.velocity_m_s), self._rate_before_gate(path, error, yaw_offset)
        )
        size = hypot(*correction)
        scale = MAX_CORRECTION_M_S / size if size > MAX_CORRECTION_M_S else 1.0
        x, y, z = (scale * c - w for c, w in zip(correction, prediction.disturbance_m_s, strict=True))
        (vx, vy, _), (ax, ay, _) = level.velocity_m_s, level.acceleration_m_s2
        if response.turning:
            yaw = state.yaw + remainder(level.yaw_rad - self._reference(path, dead_s).yaw_rad, 2 * pi)
            ax, ay = ax + level.yaw_rate_rad_s * vy, ay - level.yaw_rate_rad_s * vx  # in axes that turn
        else:
            yaw = state.yaw
        x, y = x + vx + lag_s * ax, y + vy + lag_s * ay
        c, s = cos(yaw), sin(yaw)
        up = climb.velocity_m_s[2] + response.climb_lag_s * climb.acceleration_m_s2[2] + z
        gain, damping = _gains(response.yaw_lag_s)
        rate = turn.yaw_rate_rad_s + response.yaw_lag_s * turn.yaw_acceleration_rad_s2
        rate += gain * yaw_offset + damping * (turn.yaw_rate_rad_s - prediction.yaw_rate_rad_s)
        return c * x + s * y, c * y - s * x, up, rate

    def _reference(self, path: Path, before_s: float) -> Motion:
        """The motion that was commanded some time ago, or will be."""
        at_s, (rate, change) = self.before(before_s)
        motion = path.at(at_s)
        velocity = motion.velocity_m_s
        vx, vy, vz = velocity
        ax, ay, az = motion.acceleration_m_s2
        square = rate * rate
        return Motion(
            motion.position_m,
            (rate * vx, rate * vy, rate * vz),
            motion.yaw_rad,
            rate * motion.yaw_rate_rad_s,
            (square * ax + change * vx, square * ay + change * vy, square * az + change * vz),
            square * motion.yaw_acceleration_rad_s2 + change * motion.yaw_rate_rad_s,
        )

    def _rate_before_gate(self, path: Path, error: Vec3, yaw_offset: float) -> float:
        """How fast the path's time may go: a drone that is not straight before a gate waits until it is."""
        for crossing in path.crossings:
            if GATE_TOO_NEAR_S < crossing.time_s - self.ahead_s < GATE_NEAR_S:
                c, s = cos(crossing.heading_rad), sin(crossing.heading_rad)
                off_m = hypot(c * error[1] - s * error[0], error[2]) + GATE_TURN_M * abs(yaw_offset)
                return max(1.0 - max(off_m - GATE_FROM_M, 0.0) / GATE_WAIT_M, 0.0)
        return 1.0


def _gains(lag_s: float) -> tuple[float, float]:
    """Gains of position and velocity after the dead time, for a critically damped approach."""
    slowest_s = 0.5 / BANDWIDTH_PER_S
    if lag_s < slowest_s:
        return min(0.25 / lag_s, BANDWIDTH_PER_S), 0.0
    return lag_s * BANDWIDTH_PER_S**2, 2.0 * lag_s * BANDWIDTH_PER_S - 1.0


def rate_of(error_m: Vec3, velocity_m_s: Vec3) -> float:
    """How fast the path's time goes: slower while the drone is behind or aside, not while it is ahead."""
    speed = hypot(*velocity_m_s)
    behind_m = sum(e * v for e, v in zip(error_m, velocity_m_s, strict=True)) / speed if speed > 0.05 else 0.0
    aside_m = sqrt(max(sum(e * e for e in error_m) - behind_m * behind_m, 0.0))
    late_m = max(behind_m - WAIT_FROM_M, 0.0) + max(aside_m - WAIT_ASIDE_M, 0.0)
    return max(1.0 - late_m / WAIT_M, 0.0)
