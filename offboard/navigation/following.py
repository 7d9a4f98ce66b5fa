"""Follows a planned path by velocity commands.

A command is the path's velocity and acceleration, ahead by the vehicle's delay, plus a share of the drone's
offset from where the path was when its position was measured. The path's time waits for a drone that falls
behind, so corners are never cut.
"""

from __future__ import annotations

from collections import deque
from math import cos, hypot, pi, remainder, sin, sqrt

from geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityCommand
from offboard.limits import CONTEST, CommandLimits, clamped
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response import Prediction, Response

HOLD_S = 0.025  # half the time for which a command holds
POSITION_GAIN_PER_S = 1.0
VELOCITY_GAIN = 0.2
YAW_GAIN_PER_S = 2.0
BANDWIDTH_PER_S = 1.2  # of the control of a vehicle that answers late
INTEGRAL_GAIN_PER_S2 = 0.2
MAX_INTEGRAL_M_S = 0.15
INTEGRAL_REACH_M = 0.15  # farther from the path, the integral does not grow
MAX_CORRECTION_M_S = 0.6
WAIT_FROM_M = 0.1  # farther from the path, its time goes slower
WAIT_ASIDE_M = 0.05  # or aside from it
WAIT_M = 0.25  # beyond that, it stands still
GATE_NEAR_S = 3.0  # before a gate; then a drone that answers late must be straight before it
GATE_TOO_NEAR_S = 1.0  # then it cannot stop any more
GATE_FROM_M = 0.03  # farther off, the path's time goes slower
GATE_WAIT_M = 0.06  # beyond that, it stands still
GATE_TURN_M = 0.15  # by which a turn counts, for each radian
_MAX_STEP_S = 0.5  # for so long a vehicle flies on by its last command
_MOVING_M_S = 0.2
_HISTORY = 16  # ticks


class PathFollower:
    """Follows one path after another; call `command` once a tick.

    Args:
        response: of the vehicle.
        limits: of commands.

    Attributes:
        progress_s: time along the path.
        error_m: the drone's distance from the path when its position was measured.
    """

    def __init__(self, response: Response | None = None, limits: CommandLimits = CONTEST) -> None:
        self.response = response or Response()
        self.progress_s = 0.0
        self.error_m = 0.0
        self._limits = limits
        self._path: Path | None = None
        self._last_s: float | None = None
        self._rate = 1.0  # of the path's time
        self._integral: list[float] = [0.0, 0.0, 0.0]
        self._past: deque[tuple[float, Motion]] = deque(maxlen=_HISTORY)

    @property
    def lead_s(self) -> float:
        """How far ahead of its time the path is commanded already: another one should begin after that."""
        return self.response.level_dead_s + HOLD_S

    def reference(self) -> Motion | None:
        """The path's motion `lead_s` ahead, to plan the next path from; None before the first command."""
        return None if self._path is None else self._path.at(self.progress_s + self.lead_s)

    def continued(self, following: Path) -> Path:
        """What to follow from now on, once a path from the reference has been planned."""
        path = self._path
        return (
            following
            if path is None
            else path.then(following, self.progress_s, self.progress_s + self.lead_s)
        )

    def progress_on(self, path: Path) -> float:
        """The time along a path; 0 on one that no command was given for yet."""
        return self.progress_s if path is self._path else 0.0

    @property
    def finished(self) -> bool:
        """The path's end is reached, by its time."""
        return self._path is not None and self.progress_s >= self._path.duration_s

    def command(
        self, path: Path, state: DroneState, now_s: float, prediction: Prediction | None = None
    ) -> VelocityCommand:
        """The command for this tick.

        Args:
            path: another one than at the last tick begins with the motion that the last one had then: see
                `continued`.
            state: of the drone.
            now_s: vehicle time of the state.
            prediction: of the motion of a vehicle that answers late.
        """
        step_s = 0.0 if self._last_s is None else min(max(now_s - self._last_s, 0.0), _MAX_STEP_S)
        self._last_s = now_s
        if path is not self._path:
            self._path, self.progress_s = path, 0.0
        self.progress_s = min(self.progress_s + self._rate * step_s, path.duration_s)
        motion = path.at(self.progress_s)
        self._past.append((now_s, motion))
        error, slower = self._errors(state, now_s)
        self.error_m = hypot(*error)
        self._rate = _rate_of(error, motion.velocity_m_s)
        if prediction is not None:
            self._rate = min(self._rate, self._rate_before_gate(path, state, prediction))
            return self._command_ahead(path, state, prediction)
        self._integrate(error, motion.velocity_m_s, step_s)
        correction = [
            POSITION_GAIN_PER_S * e + VELOCITY_GAIN * v + i
            for e, v, i in zip(error, slower, self._integral, strict=True)
        ]
        size = hypot(*correction)
        scale = MAX_CORRECTION_M_S / size if size > MAX_CORRECTION_M_S else 1.0
        forward, left = self._level(path, state, scale * correction[0], scale * correction[1])
        up = self._climb(path) + scale * correction[2]
        return self._limited(forward, left, up, self._yaw_rate(path, state))

    def _command_ahead(self, path: Path, state: DroneState, prediction: Prediction) -> VelocityCommand:
        """The command for a vehicle that answers late: corrects the offset from the path that is to come."""
        response, rate = self.response, self._rate
        dead_s = (response.level_dead_s, response.level_dead_s, response.climb_dead_s)
        lag_s = (response.level_lag_s, response.level_lag_s, response.climb_lag_s)
        correction = [0.0, 0.0, 0.0]
        position = (state.x, state.y, state.z)
        for axis in range(3):
            ahead = path.at(self.progress_s + rate * (dead_s[axis] + HOLD_S))
            gain, damping = _gains(lag_s[axis])
            offset = ahead.position_m[axis] - position[axis] - prediction.moved_m[axis]
            slower = rate * ahead.velocity_m_s[axis] - prediction.velocity_m_s[axis]
            correction[axis] = gain * offset + damping * slower
        size = hypot(*correction)
        scale = MAX_CORRECTION_M_S / size if size > MAX_CORRECTION_M_S else 1.0
        x, y, z = (scale * c - w for c, w in zip(correction, prediction.disturbance_m_s, strict=True))
        forward, left = self._level(path, state, x, y)
        up = self._climb(path) + z
        at_s = self.progress_s + rate * (response.yaw_dead_s + HOLD_S)
        ahead = path.at(at_s)
        change = ahead.yaw_acceleration_rad_s2
        gain, damping = _gains(response.yaw_lag_s)
        wanted = rate * ahead.yaw_rate_rad_s
        turn = wanted + rate * rate * response.yaw_lag_s * change
        turn += gain * remainder(ahead.yaw_rad - state.yaw - prediction.turned_rad, 2 * pi)
        turn += damping * (wanted - prediction.yaw_rate_rad_s)
        return self._limited(forward, left, up, turn)

    def _rate_before_gate(self, path: Path, state: DroneState, prediction: Prediction) -> float:
        """How fast the path's time goes: a drone that is not straight before a gate waits until it is."""
        for crossing in path.crossings:
            left_s = crossing.time_s - self.progress_s
            if GATE_TOO_NEAR_S < left_s < GATE_NEAR_S:
                break
        else:
            return 1.0
        ahead = path.at(self.progress_s + self._rate * self.response.level_dead_s)
        x, y, z = (
            to - at - moved
            for to, at, moved in zip(
                ahead.position_m, (state.x, state.y, state.z), prediction.moved_m, strict=True
            )
        )
        c, s = cos(crossing.heading_rad), sin(crossing.heading_rad)
        turn = remainder(ahead.yaw_rad - state.yaw - prediction.turned_rad, 2 * pi)
        off_m = hypot(c * y - s * x, z) + GATE_TURN_M * abs(turn)
        return max(1.0 - max(off_m - GATE_FROM_M, 0.0) / GATE_WAIT_M, 0.0)

    def _level(self, path: Path, state: DroneState, add_x: float, add_y: float) -> tuple[float, float]:
        """Speeds forward and to the left: the path's, ahead of time, and a correction in arena axes."""
        response, rate = self.response, self._rate
        at_s = self.progress_s + rate * (response.level_dead_s + HOLD_S)
        ahead, later = path.at(at_s), path.at(at_s + rate * response.level_tilt_s)
        (vx, vy, _), (ax, ay, _) = _slowed(ahead, rate)[0], _slowed(later, rate)[1]
        now = self._past[-1][1]
        if response.turning:
            yaw = state.yaw + remainder(ahead.yaw_rad - now.yaw_rad, 2 * pi)
            turn_rate = rate * ahead.yaw_rate_rad_s
            ax, ay = ax + turn_rate * vy, ay - turn_rate * vx  # as seen from axes that turn
        else:
            yaw = state.yaw + rate * now.yaw_rate_rad_s * HOLD_S
        x, y = vx + response.level_lag_s * ax + add_x, vy + response.level_lag_s * ay + add_y
        c, s = cos(yaw), sin(yaw)
        return c * x + s * y, c * y - s * x

    def _climb(self, path: Path) -> float:
        response, rate = self.response, self._rate
        ahead = path.at(self.progress_s + rate * (response.climb_dead_s + HOLD_S))
        velocity, acceleration = _slowed(ahead, rate)
        return velocity[2] + response.climb_lag_s * acceleration[2]

    def _errors(self, state: DroneState, now_s: float) -> tuple[Vec3, Vec3]:
        """From the drone to the path: position and velocity, both when the drone's were measured."""
        at_s = now_s - state.position_age_s
        later_s, later = self._past[-1]
        position, velocity = later.position_m, _slowed(later, self._rate)[0]
        for before_s, before in reversed(self._past):
            if before_s <= at_s:
                if later_s > before_s:
                    share = (at_s - before_s) / (later_s - before_s)
                    position = _between(before.position_m, later.position_m, share)
                break
            later_s, later = before_s, before
        return _minus(position, (state.x, state.y, state.z)), _minus(velocity, state.velocity_arena_m_s)

    def _integrate(self, error: Vec3, velocity_m_s: Vec3, step_s: float) -> None:
        """Add up the error, but along the path only what its time waits for.

        A lag or lead of the drone itself is along the path: added up, it would push aside after a turn.
        """
        if self.error_m > INTEGRAL_REACH_M:
            return
        speed = hypot(*velocity_m_s)
        along_m = sum(e * v for e, v in zip(error, velocity_m_s, strict=True)) / max(speed, 1e-6)
        excused_m = min(max(along_m, -WAIT_FROM_M), WAIT_FROM_M) if speed > _MOVING_M_S else 0.0
        for axis in range(3):
            counted_m = error[axis] - excused_m * velocity_m_s[axis] / max(speed, 1e-6)
            value = self._integral[axis] + INTEGRAL_GAIN_PER_S2 * counted_m * step_s
            self._integral[axis] = min(max(value, -MAX_INTEGRAL_M_S), MAX_INTEGRAL_M_S)

    def _yaw_rate(self, path: Path, state: DroneState) -> float:
        response, rate = self.response, self._rate
        at_s = self.progress_s + rate * (response.yaw_dead_s + HOLD_S)
        ahead = path.at(at_s)
        now = self._past[-1][1]
        change = ahead.yaw_acceleration_rad_s2
        error = remainder(now.yaw_rad - state.yaw, 2 * pi)
        return (
            rate * ahead.yaw_rate_rad_s + rate * rate * response.yaw_lag_s * change + YAW_GAIN_PER_S * error
        )

    def _limited(self, forward: float, left: float, up: float, yaw_rate: float) -> VelocityCommand:
        """The command within the limits: an axis at its limit leaves the others as they are."""
        limits = self._limits
        return VelocityCommand(
            *limits.level(forward, left),
            clamped(up, limits.down_m_s, limits.up_m_s),
            clamped(yaw_rate, limits.yaw_rate_rad_s, limits.yaw_rate_rad_s),
        )


def _gains(lag_s: float) -> tuple[float, float]:
    """Gains of position and velocity after the dead time, for a critically damped approach."""
    slowest_s = 0.5 / BANDWIDTH_PER_S
    if lag_s < slowest_s:
        return min(0.25 / lag_s, BANDWIDTH_PER_S), 0.0
    return lag_s * BANDWIDTH_PER_S**2, 2.0 * lag_s * BANDWIDTH_PER_S - 1.0


def _rate_of(error_m: Vec3, velocity_m_s: Vec3) -> float:
    """How fast the path's time goes: slower while the drone is behind or aside, not while it is ahead."""
    speed = hypot(*velocity_m_s)
    behind_m = sum(e * v for e, v in zip(error_m, velocity_m_s, strict=True)) / speed if speed > 0.05 else 0.0
    aside_m = sqrt(max(sum(e * e for e in error_m) - behind_m * behind_m, 0.0))
    late_m = max(behind_m - WAIT_FROM_M, 0.0) + max(aside_m - WAIT_ASIDE_M, 0.0)
    return max(1.0 - late_m / WAIT_M, 0.0)


def _slowed(motion: Motion, rate: float) -> tuple[Vec3, Vec3]:
    """Velocity and acceleration of a motion whose time goes at a constant rate."""
    vx, vy, vz = motion.velocity_m_s
    ax, ay, az = motion.acceleration_m_s2
    square = rate * rate
    return (rate * vx, rate * vy, rate * vz), (square * ax, square * ay, square * az)


def _between(a: Vec3, b: Vec3, share: float) -> Vec3:
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
