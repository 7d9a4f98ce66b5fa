"""Follows a path with a vehicle that answers late.

What is commanded now is flown after the vehicle's dead time, so a command is for the place on the path where
the vehicle will be then. That place moves on smoothly, also when it waits: else its vehicle would be told to
fly back what it has been told to fly already.
"""

from __future__ import annotations

from collections import deque
from math import cos, hypot, pi, remainder, sin, sqrt

from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import DroneState
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response import Prediction, Response

BANDWIDTH_PER_S = 1.2  # of the control, at least
MAX_BANDWIDTH_OF_ONE_PER_S = 2.4  # likewise of a vehicle with one short lag, at most
BANDWIDTH_OF_TWO_PER_S = 1.45  # likewise of a vehicle with two lags, at least
MAX_BANDWIDTH_PER_S = 2.0
BANDWIDTH_OF_SHARE_PER_S = 1.8  # in plan, of a vehicle whose slow part is known: less disturbs it
CLIMB_GAIN_PER_S = 1.6  # safe with a dead time of half a second that is not predicted
MAX_CLIMB_DAMPING = 0.8
MAX_CORRECTION_M_S = 0.6
RATE_CHANGE_PER_S = 1.2  # of the path's time: at the speed of crossings, that of a gentle stop
RATE_S = 0.25  # time constant of that rate
RATE_CHANGE_PER_S2 = 6.0  # how fast its change may change: each jump of it is one of the command, by the lag
WAIT_FROM_M = 0.1  # farther from the path, its time goes slower
WAIT_ASIDE_M = 0.05  # or aside from it
WAIT_M = 0.25  # beyond that, it stands still
GATE_S = (0.8, 2.5)  # before a gate the drone must be straight before it; nearer, it cannot stop any more
GATE_FROM_M = 0.03  # farther off, the path's time goes slower
GATE_WAIT_M = 0.06  # beyond that, it stands still
GATE_TURN_M = 0.15  # by which a turn counts, for each radian
GATE_STEADY_S = (
    0.2  # likewise a wrong velocity, for each m/s: that of a vehicle whose response is not known yet
)
_TICKS = 24
_SOON_S = 0.1  # after which the change of the velocity is compared
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
        rate, before = self._pace
        per_s = 0.0
        if step_s > 0.0:
            jump = RATE_CHANGE_PER_S2 * step_s
            wanted = (self._wanted_rate - rate) / RATE_S
            wanted = min(max(wanted, -RATE_CHANGE_PER_S), RATE_CHANGE_PER_S)
            per_s = max(min(max(wanted, before - jump), before + jump), -rate / step_s)
        change = per_s * step_s
        self._pace = (rate + change, per_s)
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
        dead_s = response.level_dead_s
        level = self._reference(path, 0.0)
        climb = self._reference(path, dead_s - response.climb_dead_s)
        turn = self._reference(path, dead_s - response.yaw_dead_s)
        now = (state.x, state.y, state.z)
        bandwidth_per_s = _bandwidth(dead_s, response.level_lag_s)
        if response.share != 1.0:
            bandwidth_per_s = max(bandwidth_per_s, BANDWIDTH_OF_SHARE_PER_S)
        gains = _gains(response.level_lag_s, response.own_lag_s, bandwidth_per_s)
        climb_gains = _climb_gains(response.climb_lag_s)
        offset, correction = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        for axis, wanted in enumerate((level, level, climb)):
            gain, damping, ease = gains if axis < 2 else climb_gains
            offset[axis] = wanted.position_m[axis] - now[axis] - prediction.moved_m[axis]
            correction[axis] = gain * offset[axis]
            correction[axis] += damping * (wanted.velocity_m_s[axis] - prediction.velocity_m_s[axis])
            if ease:
                change = wanted.acceleration_m_s2[axis] - prediction.acceleration_m_s2[axis]
                correction[axis] += ease * change
        yaw_offset = remainder(turn.yaw_rad - state.yaw - prediction.turned_rad, 2 * pi)
        self.error_m = hypot(*offset)
        error = (offset[0], offset[1], offset[2])
        (vx, vy, _), (coming_x, coming_y, _) = level.velocity_m_s, prediction.velocity_m_s
        unsteady_m = GATE_TURN_M * abs(yaw_offset) + GATE_STEADY_S * hypot(vx - coming_x, vy - coming_y)
        self._wanted_rate = min(
            rate_of(error, level.velocity_m_s),
            rate_before_gate(path, self.ahead_s, GATE_S, error, unsteady_m),
        )
        size = hypot(*correction)
        scale = MAX_CORRECTION_M_S / size if size > MAX_CORRECTION_M_S else 1.0
        x, y, z = (scale * c - w for c, w in zip(correction, prediction.disturbance_m_s, strict=True))
        x, y = x - prediction.slow_m_s[0], y - prediction.slow_m_s[1]
        forward, left = self._level(path, level, (x, y), state.yaw, response)
        forward, left = forward / response.share, left / response.share
        up = climb.velocity_m_s[2] + response.climb_lag_s * climb.acceleration_m_s2[2] + z
        gain, damping, _ = _gains(response.yaw_lag_s)
        rate = turn.yaw_rate_rad_s + response.yaw_lag_s * turn.yaw_acceleration_rad_s2
        rate += gain * yaw_offset + damping * (turn.yaw_rate_rad_s - prediction.yaw_rate_rad_s)
        return forward, left, up, rate

    def _level(
        self, path: Path, level: Motion, add: tuple[float, float], yaw_rad: float, response: Response
    ) -> tuple[float, float]:
        """Speeds forward and to the left: the path's, ahead by the lags, and an addition in arena axes."""
        vx, vy, _ = level.velocity_m_s
        ax, ay = _change(level, turning=response.turning)
        x, y = vx + response.level_lag_s * ax, vy + response.level_lag_s * ay
        if response.turning:
            ahead = self._reference(path, response.level_dead_s)
            yaw_rad += remainder(level.yaw_rad - ahead.yaw_rad, 2 * pi)
        elif response.own_lag_s > 0.0:
            now = _change(level, turning=True)
            soon = _change(self._reference(path, -_SOON_S), turning=True)
            own_s, first = response.own_lag_s, response.level_lag_s / _SOON_S
            x += own_s * (now[0] + first * (soon[0] - now[0]))
            y += own_s * (now[1] + first * (soon[1] - now[1]))
        return turned(x + add[0], y + add[1], -yaw_rad)

    def _reference(self, path: Path, before_s: float) -> Motion:
        """The motion that was commanded some time ago, or will be."""
        at_s, pace = self.before(before_s)
        return path.at(at_s).paced(*pace)


def _change(motion: Motion, *, turning: bool) -> tuple[float, float]:
    """Change of the velocity in plan, maybe as seen from axes that turn with the heading; arena axes."""
    ax, ay, _ = motion.acceleration_m_s2
    if not turning:
        return ax, ay
    vx, vy, _ = motion.velocity_m_s
    return ax + motion.yaw_rate_rad_s * vy, ay - motion.yaw_rate_rad_s * vx


def _gains(
    lag_s: float, second_lag_s: float = 0.0, bandwidth_per_s: float = BANDWIDTH_PER_S
) -> tuple[float, float, float]:
    """Gains of position, velocity and acceleration after the dead time, for a critically damped approach."""
    if second_lag_s > 0.0:
        product_s2, sum_s = lag_s * second_lag_s, lag_s + second_lag_s
        b = max(BANDWIDTH_OF_TWO_PER_S, sum_s / (3.0 * product_s2))  # gains are not negative
        if b > MAX_BANDWIDTH_PER_S:
            return _gains(second_lag_s)  # the first lag is short
        return product_s2 * b**3, 3.0 * product_s2 * b**2 - 1.0, 3.0 * product_s2 * b - sum_s
    slowest_s = 0.5 / bandwidth_per_s
    if lag_s < slowest_s:
        return min(0.25 / lag_s, bandwidth_per_s), 0.0, 0.0
    return lag_s * bandwidth_per_s**2, 2.0 * lag_s * bandwidth_per_s - 1.0, 0.0


def _bandwidth(dead_s: float, lag_s: float) -> float:
    """That of the control of a vehicle with one lag: higher, the sooner it answers.

    What happens in its dead time is only predicted, so that counts twice.
    """
    return min(max(1.0 / (2.0 * dead_s + lag_s), BANDWIDTH_PER_S), MAX_BANDWIDTH_OF_ONE_PER_S)


def _climb_gains(lag_s: float) -> tuple[float, float, float]:
    """Those of `_gains` up and down, that close an offset at the same rate for nearly all lags.

    A climb against drag looks like a longer lag, and a longer dead time, than the vehicle has. So the
    bandwidth b is that of the gain, lag b^2, unless the damping, 2 lag b - 1, would be too high.
    """
    if lag_s * CLIMB_GAIN_PER_S < 0.25:  # this damping would be negative
        return CLIMB_GAIN_PER_S, 0.0, 0.0
    most_per_s = 0.5 * (1.0 + MAX_CLIMB_DAMPING) / lag_s
    return _gains(lag_s, bandwidth_per_s=min(sqrt(CLIMB_GAIN_PER_S / lag_s), most_per_s))


def rate_of(error_m: Vec3, velocity_m_s: Vec3) -> float:
    """How fast the path's time goes: slower while the drone is behind or aside, not while it is ahead."""
    speed = hypot(*velocity_m_s)
    behind_m = sum(e * v for e, v in zip(error_m, velocity_m_s, strict=True)) / speed if speed > 0.05 else 0.0
    aside_m = sqrt(max(sum(e * e for e in error_m) - behind_m * behind_m, 0.0))
    late_m = max(behind_m - WAIT_FROM_M, 0.0) + max(aside_m - WAIT_ASIDE_M, 0.0)
    return max(1.0 - late_m / WAIT_M, 0.0)


def rate_before_gate(
    path: Path,
    at_s: float,
    near_s: tuple[float, float],
    error_m: Vec3,
    unsteady_m: float,
    *,
    from_m: float = GATE_FROM_M,
) -> float:
    """How fast the path's time may go: a drone that is not straight before a gate waits until it is.

    Args:
        path: that is followed.
        at_s: time along it.
        near_s: least and greatest time before the gate in which the drone waits.
        error_m: from the drone to the path, arena axes.
        unsteady_m: what adds to its part across the gate: for a wrong heading or velocity.
        from_m: across the gate; farther off, the path's time goes slower.
    """
    for crossing in path.crossings:
        if near_s[0] < crossing.time_s - at_s < near_s[1]:
            c, s = cos(crossing.heading_rad), sin(crossing.heading_rad)
            off_m = hypot(c * error_m[1] - s * error_m[0], error_m[2]) + unsteady_m
            return max(1.0 - max(off_m - from_m, 0.0) / GATE_WAIT_M, 0.0)
    return 1.0
