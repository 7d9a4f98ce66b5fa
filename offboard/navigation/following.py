"""Follows a planned path by velocity commands.

A command is the path's velocity and acceleration, ahead by the vehicle's delay, plus a share of the drone's
offset from where the path was when its position was measured. The path's time waits for a drone that falls
behind, so corners are never cut.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from math import cos, hypot, pi, remainder, sin

from geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityCommand
from offboard.limits import CONTEST, CommandLimits, clamped
from offboard.navigation.control.late_following import MAX_CORRECTION_M_S, WAIT_FROM_M, LateFollower, rate_of
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response import Prediction, Response

HOLD_S = 0.025  # half the time for which a command holds
POSITION_GAIN_PER_S = 1.0
VELOCITY_GAIN = 0.2
YAW_GAIN_PER_S = 2.0
INTEGRAL_GAIN_PER_S2 = 0.2
MAX_INTEGRAL_M_S = 0.15
INTEGRAL_REACH_M = 0.15  # farther from the path, the integral does not grow
_MAX_STEP_S = 0.5  # for so long a vehicle flies on by its last command
_MOVING_M_S = 0.2
_HISTORY = 16  # ticks
_SHORTEST_S = 0.005  # of the present path that is kept before the next one


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
        self._late: LateFollower | None = None
        self._last_s: float | None = None
        self._rate = 1.0  # of the path's time
        self._slowing_per_s = 0.0  # of that rate
        self._turn_rad_s: float | None = None  # of the heading, if it is not the path's
        self._integral: list[float] = [0.0, 0.0, 0.0]
        self._past: deque[tuple[float, Motion]] = deque(maxlen=_HISTORY)

    @property
    def lead_s(self) -> float:
        """How far ahead of its time the path is commanded already: another one should begin after that."""
        if self._late is not None:
            return self._late.ahead_s - self.progress_s
        return self.response.level_dead_s + HOLD_S

    def reference(self) -> Motion | None:
        """The path's motion `lead_s` ahead, to plan the next path from; None before the first command."""
        return None if self._path is None else self._path.at(self.progress_s + self.lead_s)

    def braking(self) -> Motion | None:
        """The motion of a drone that brakes along the path, which has a heading of its own."""
        if self._path is None:
            return None
        motion, rate = self._path.at(self.progress_s), self._rate
        x, y, z = motion.velocity_m_s
        return Motion(motion.position_m, (rate * x, rate * y, rate * z))

    def continued(self, following: Path) -> Path:
        """What to follow from now on, once a path from the reference has been planned."""
        path, late = self._path, self._late
        if path is None:
            return following
        from_s, lead_s = self.progress_s, self.lead_s
        joined = following if lead_s < _SHORTEST_S else path.then(following, from_s, from_s + lead_s)
        if late is not None:
            late.ahead_s = 0.0 if joined is following else lead_s
            self._path, self.progress_s = joined, 0.0
        return joined

    def progress_on(self, path: Path) -> float:
        """The time along a path; 0 on one that no command was given for yet."""
        return self.progress_s if path is self._path else 0.0

    @property
    def finished(self) -> bool:
        """The path's end is reached, by its time."""
        return self._path is not None and self.progress_s >= self._path.duration_s

    def command(
        self,
        path: Path,
        state: DroneState,
        now_s: float,
        prediction: Prediction | None = None,
        *,
        turn_rad_s: float | None = None,
        brake_m_s2: float = 0.0,
    ) -> VelocityCommand:
        """The command for this tick.

        Args:
            path: another one than at the last tick begins with the motion that the last one had then: see
                `continued`.
            state: of the drone.
            now_s: vehicle time of the state.
            prediction: of the motion of a vehicle that answers late; None for one that does not.
            turn_rad_s: turn with this rate, not as the path says.
            brake_m_s2: brake with this, to a stop on the path; 0 to fly on. Vehicles that answer late do not.
        """
        step_s = 0.0 if self._last_s is None else min(max(now_s - self._last_s, 0.0), _MAX_STEP_S)
        self._last_s = now_s
        if prediction is not None:
            command = self._command_late(path, state, prediction, step_s)
            return command if turn_rad_s is None else replace(command, yaw_rate_rad_s=turn_rad_s)
        self._late = None
        if path is not self._path:
            self._path, self.progress_s = path, 0.0
        self.progress_s = min(self.progress_s + self._rate * step_s, path.duration_s)
        motion = path.at(self.progress_s)
        self._past.append((now_s, motion))
        error, slower = self._errors(state, now_s)
        self.error_m = hypot(*error)
        self._turn_rad_s = turn_rad_s
        before, self._rate = self._rate, rate_of(error, motion.velocity_m_s)
        self._slowing_per_s = 0.0
        if brake_m_s2:
            self._slowing_per_s = brake_m_s2 / max(hypot(*motion.velocity_m_s), _MOVING_M_S)
            self._rate = max(min(self._rate, before - self._slowing_per_s * step_s), 0.0)
            self._slowing_per_s *= self._rate > 0.0
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

    def _command_late(
        self, path: Path, state: DroneState, prediction: Prediction, step_s: float
    ) -> VelocityCommand:
        """The command for a vehicle that answers late."""
        dead_s = self.response.level_dead_s
        if path is not self._path:
            self._late = LateFollower(0.0, 0.0)
        elif self._late is None:
            self._late = LateFollower(self.progress_s + dead_s, dead_s)
        self._path, late = path, self._late
        assert late is not None
        late.advance(step_s, path)
        self.progress_s = max(late.before(dead_s)[0], 0.0)
        command = late.command(path, state, prediction, self.response)
        self.error_m = late.error_m
        return self._limited(*command)

    def _level(self, path: Path, state: DroneState, add_x: float, add_y: float) -> tuple[float, float]:
        """Speeds forward and to the left: the path's, ahead of time, and a correction in arena axes."""
        response, rate = self.response, self._rate
        at_s = self.progress_s + rate * (response.level_dead_s + HOLD_S)
        ahead, later = path.at(at_s), path.at(at_s + rate * response.level_tilt_s)
        (vx, vy, _), (ax, ay, _) = _slowed(ahead, rate)[0], _slowed(later, rate)[1]
        ax -= self._slowing_per_s * later.velocity_m_s[0]
        ay -= self._slowing_per_s * later.velocity_m_s[1]
        now, turn_rate = self._past[-1][1], self._turn_rad_s
        if turn_rate is None:
            turn_rate = rate * ahead.yaw_rate_rad_s
            turned = remainder(ahead.yaw_rad - now.yaw_rad, 2 * pi)
        else:
            turned = turn_rate * (response.level_dead_s + HOLD_S)
        yaw = state.yaw + turned
        ax, ay = ax + turn_rate * vy, ay - turn_rate * vx  # as seen from axes that turn
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
        if self._turn_rad_s is not None:
            return self._turn_rad_s
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
