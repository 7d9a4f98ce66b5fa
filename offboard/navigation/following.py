"""Follows a planned path by velocity commands.

A command is what makes the vehicle fly the path's motion, ahead by its delay, plus a share of the drone's
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
from offboard.navigation.control.feed_forward import MOTOR_S, SPREAD_S, FeedForward
from offboard.navigation.control.late_following import (
    GATE_TURN_M,
    MAX_CORRECTION_M_S,
    WAIT_FROM_M,
    LateFollower,
    rate_before_gate,
    rate_of,
)
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response import Prediction, Response

HOLD_S = 0.025  # half the time for which a command holds
DELAY_S = 0.025  # from a state to the motors, beside
POSITION_GAINS_PER_S = (1.0, 1.0, 3.5)  # the vehicle follows a climb sooner than a level speed
VELOCITY_GAIN = 0.3
YAW_GAIN_PER_S = 3.0
GATE_FROM_M = 0.05  # farther from the path across a gate, the drone waits
COMING_S = 0.3  # for which a wrong velocity goes on
GATE_S = (0.4, 1.3)  # before a gate the drone must be straight before it; nearer, it cannot stop any more
MAX_RATE_CHANGE_PER_S = 1.5  # of the path's time
BRAKE_END_S = 0.25  # in which the last of the speed is braked, so that the drone is not thrown back
INTEGRAL_GAIN_PER_S2 = 0.2
MAX_INTEGRAL_M_S = 0.15
INTEGRAL_REACH_M = 0.15  # farther from the path, the integral does not grow
_STEADY_S = 0.11  # after a longer step the vehicle's velocity is taken for steady
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
        self._rate_change = 0.0  # per second
        self._turn_rad_s: float | None = None  # of the heading, if it is not the path's
        self._integral: list[float] = [0.0, 0.0, 0.0]
        self._past: deque[tuple[float, Motion]] = deque(maxlen=_HISTORY)
        self._feed_forward = FeedForward()

    @property
    def lead_s(self) -> float:
        """How far ahead of its time the path is commanded already: another one should begin after that."""
        if self._late is not None:
            return self._late.ahead_s - self.progress_s
        return HOLD_S + DELAY_S + MOTOR_S + SPREAD_S

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
        if self._late is not None or step_s > _STEADY_S:
            self._feed_forward.restart()
        self._late = None
        if path is not self._path:
            self._path, self.progress_s = path, 0.0
        self.progress_s = min(self.progress_s + self._rate * step_s, path.duration_s)
        motion = path.at(self.progress_s)
        self._past.append((now_s, motion))
        error, slower = self._errors(state, now_s)
        self.error_m = hypot(*error)
        self._turn_rad_s = turn_rad_s
        off_rad = remainder(motion.yaw_rad - state.yaw, 2 * pi)
        x, y, z = (e + COMING_S * v for e, v in zip(error, slower, strict=True))
        rate = min(
            rate_of(error, motion.velocity_m_s),
            rate_before_gate(
                path, self.progress_s, GATE_S, (x, y, z), GATE_TURN_M * abs(off_rad), from_m=GATE_FROM_M
            ),
        )
        self._change_rate(rate, motion, brake_m_s2, step_s)
        self._integrate(error, motion.velocity_m_s, step_s)
        correction = [
            gain * e + VELOCITY_GAIN * v + i
            for gain, e, v, i in zip(POSITION_GAINS_PER_S, error, slower, self._integral, strict=True)
        ]
        size = hypot(*correction)
        scale = MAX_CORRECTION_M_S / size if size > MAX_CORRECTION_M_S else 1.0
        x, y, z = (scale * each for each in correction)
        return self._command_now(path, state, (x, y, z), step_s)

    def _change_rate(self, rate: float, motion: Motion, brake_m_s2: float, step_s: float) -> None:
        """Let the path's time go faster or slower, but not suddenly, or brake it to a stop."""
        before, most = self._rate, MAX_RATE_CHANGE_PER_S * step_s
        rate = min(max(rate, before - most), before + most)
        if brake_m_s2:
            slowing_per_s = brake_m_s2 / max(hypot(*motion.velocity_m_s), _MOVING_M_S)
            slowing_per_s = min(slowing_per_s, before / BRAKE_END_S)
            rate = max(min(rate, before - slowing_per_s * step_s), 0.0)
        self._rate = rate
        self._rate_change = (rate - before) / step_s if step_s else 0.0

    def _command_now(
        self, path: Path, state: DroneState, correction_m_s: Vec3, step_s: float
    ) -> VelocityCommand:
        """The command for the simulated drone; the correction is in arena axes."""
        ahead_s = DELAY_S + HOLD_S
        now, before, soon, later = (
            self._motion_in(path, state, ahead_s + more_s)
            for more_s in (0.0, MOTOR_S - SPREAD_S, MOTOR_S, MOTOR_S + SPREAD_S)
        )
        velocity, turn = self._feed_forward.command(now, (before, soon, later))
        off_rad = 0.0
        if self._turn_rad_s is None:
            off_rad = remainder(self._past[-1][1].yaw_rad - state.yaw, 2 * pi)
        else:
            turn = self._turn_rad_s
        forward, left, _ = turned(velocity, off_rad)  # in the drone's axes, which are not the path's
        x, y, z = turned(correction_m_s, off_rad - now.yaw_rad)
        turn_more = YAW_GAIN_PER_S * off_rad
        command = self._limited(forward + x, left + y, velocity[2] + z, turn + turn_more)
        # What a limit cuts off because of the correction is not made up for: that would wind up.
        sent = self._limited(forward, left, velocity[2], turn)
        sent_m_s = turned((sent.forward_m_s, sent.left_m_s, sent.up_m_s), -off_rad)
        self._feed_forward.sent(sent_m_s, sent.yaw_rate_rad_s, step_s)
        return command

    def _motion_in(self, path: Path, state: DroneState, time_s: float) -> Motion:
        """The motion in a time from now, as its time goes, with the heading that the drone will have."""
        motion = self._slowed(path.at(self.progress_s + self._rate * time_s))
        turn_rad_s = self._turn_rad_s
        if turn_rad_s is None:
            return motion
        yaw_rad = state.yaw + turn_rad_s * time_s
        return replace(motion, yaw_rad=yaw_rad, yaw_rate_rad_s=turn_rad_s, yaw_acceleration_rad_s2=0.0)

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

    def _errors(self, state: DroneState, now_s: float) -> tuple[Vec3, Vec3]:
        """From the drone to the path: position and velocity, both when the drone's were measured."""
        at_s = now_s - state.position_age_s
        later_s, later = self._past[-1]
        position, velocity = later.position_m, self._slowed(later).velocity_m_s
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

    def _slowed(self, motion: Motion) -> Motion:
        """A motion of the path, as its time goes now."""
        rate, change_per_s = self._rate, self._rate_change
        if rate == 1.0 and change_per_s == 0.0:
            return motion
        (vx, vy, vz), (ax, ay, az) = motion.velocity_m_s, motion.acceleration_m_s2
        square, turn = rate * rate, motion.yaw_rate_rad_s
        return replace(
            motion,
            velocity_m_s=(rate * vx, rate * vy, rate * vz),
            acceleration_m_s2=(
                square * ax + change_per_s * vx,
                square * ay + change_per_s * vy,
                square * az + change_per_s * vz,
            ),
            yaw_rate_rad_s=rate * turn,
            yaw_acceleration_rad_s2=square * motion.yaw_acceleration_rad_s2 + change_per_s * turn,
        )

    def _limited(self, forward: float, left: float, up: float, yaw_rate: float) -> VelocityCommand:
        """The command within the limits: an axis at its limit leaves the others as they are."""
        limits = self._limits
        return VelocityCommand(
            *limits.level(forward, left),
            clamped(up, limits.down_m_s, limits.up_m_s),
            clamped(yaw_rate, limits.yaw_rate_rad_s, limits.yaw_rate_rad_s),
        )


def _between(a: Vec3, b: Vec3, share: float) -> Vec3:
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def turned(vector: Vec3, by_rad: float) -> Vec3:
    """A vector turned to the left."""
    c, s = cos(by_rad), sin(by_rad)
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2])
