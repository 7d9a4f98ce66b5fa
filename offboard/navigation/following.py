"""Follows a planned path by velocity commands.

A command is what makes the vehicle fly, ahead by its delay, the path's motion and one that closes the drone's
offset from where the path was when its position was measured. The path's time waits for a drone that falls
behind, so corners are never cut.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from math import hypot, pi, remainder

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import CONTEST, CommandLimits
from offboard.navigation.control.late_following import (
    GATE_TURN_M,
    MAX_CORRECTION_M_S,
    LateFollower,
    rate_before_gate,
    rate_of,
)
from offboard.navigation.control.loop_inverse import (
    ANSWER_S,
    HOLD_S,
    SPREAD_S,
    LoopInverse,
    Own,
    OwnMotion,
    axes_of,
    level_of,
    thrust_of,
    tilts_of,
)
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response import Prediction, Response

DELAY_S = 0.005  # from a state to the autopilot: that of the simulated drone's link, over UDP too
ACTS_S = DELAY_S + HOLD_S  # from a state to the middle of the time for which its command holds
OFFSET_GAIN_PER_S2 = 10.0  # an offset in plan is closed within half a second, without swinging
VELOCITY_GAIN_PER_S = 6.0
MAX_OFFSET_M = 0.3  # a larger one is closed at the speed of this one
CLIMB_GAIN_PER_S = 3.5  # an offset in height is closed at this rate
CLIMB_DAMPING_PER_S = 3.0
YAW_GAIN_PER_S = 3.0
GATE_FROM_M = 0.05  # farther from the path across a gate, the drone waits
COMING_S = 0.3  # for which a wrong velocity goes on
GATE_S = (0.4, 1.3)  # before a gate the drone must be straight before it; nearer, it cannot stop any more
IN_GATE_S = (-0.3, 0.4)  # to a gate; in this time a drone
IN_GATE_M_S2 = 0.4  # does not speed up by more than this to fly as fast as planned
MAX_RATE_CHANGE_PER_S = 1.5  # of the path's time
RATE_S = 0.12  # time constant of that rate, which the wanted one depends on: without it, both would swing
BRAKE_END_S = 0.25  # in which the last of the speed is braked, so that the drone is not thrown back
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
        self._past: deque[tuple[float, Motion]] = deque(maxlen=_HISTORY)
        self._inverse = LoopInverse()
        self._own = OwnMotion()
        self._own_s: float | None = None  # vehicle time of the state last taken in
        self._own_yaw_rad = 0.0
        self._sent: VelocityFluCommand | None = None

    @property
    def lead_s(self) -> float:
        """How far ahead of its time the path is commanded already: another one should begin after that."""
        if self._late is not None:
            return self._late.ahead_s - self.progress_s
        return ACTS_S + ANSWER_S + SPREAD_S

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

    def begin(self, now_s: float) -> None:
        """The next path begins now, with the drone's own motion: it does not continue the present one."""
        self._last_s = now_s
        self._rate, self._rate_change = 1.0, 0.0
        self._past.clear()

    def progress_on(self, path: Path) -> float:
        """The time along a path; 0 on one that no command was given for yet."""
        return self.progress_s if path is self._path else 0.0

    @property
    def finished(self) -> bool:
        """The path's end is reached, by its time."""
        return self._path is not None and self.progress_s >= self._path.duration_s

    def observe(self, state: DroneState, now_s: float, sent: VelocityFluCommand | None) -> None:
        """Take in a state, also while no path is followed; else `command` does it.

        Args:
            state: of the drone.
            now_s: vehicle time of the state.
            sent: the command that the drone has had since the last tick; None if it had none.
        """
        before_s, self._own_s = self._own_s, now_s
        step_s = 0.0 if before_s is None else now_s - before_s
        up_m_s2 = (
            self._past[-1][1].paced(self._rate, self._rate_change).acceleration_m_s2[2] if self._past else 0.0
        )
        self._own.update(state, up_m_s2)
        turned_rad = remainder(state.yaw - self._own_yaw_rad, 2 * pi)
        self._own_yaw_rad = state.yaw
        known = 0.0 < step_s < _MAX_STEP_S
        turn_rad_s = turned_rad / step_s if known else 0.0
        axes = axes_of(state.yaw + ACTS_S * turn_rad_s)
        forward, left, _ = level_of((*self._own.velocity_in(ACTS_S), 0.0), axes)
        level_sent = None if sent is None or not known else (sent.forward_m_s, sent.left_m_s)
        own = Own((forward, left), tilts_of(thrust_of(state)), turn_rad_s)
        self._inverse.observe(own, level_sent, step_s)

    def command(
        self,
        path: Path,
        state: DroneState,
        now_s: float,
        prediction: Prediction | None = None,
        *,
        turn_rad_s: float | None = None,
        brake_m_s2: float = 0.0,
    ) -> VelocityFluCommand:
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
        if self._own_s != now_s:
            self.observe(state, now_s, self._sent)
        if self._late is not None or step_s > _STEADY_S:
            self._inverse.restart(in_plan=self._late is not None)
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
        self._change_rate(rate, motion, brake_m_s2, step_s, self._is_in_gate(path))
        self._sent = self._command_now(path, state, (error, slower), step_s)
        return self._sent

    def _is_in_gate(self, path: Path) -> bool:
        """Whether a gate is so near that a drone that speeds up would be tilted in it."""
        first_s, last_s = IN_GATE_S
        return any(first_s < crossing.time_s - self.progress_s < last_s for crossing in path.crossings)

    def _change_rate(
        self, rate: float, motion: Motion, brake_m_s2: float, step_s: float, in_gate: bool
    ) -> None:
        """Let the path's time go faster or slower, but not suddenly, or brake it to a stop."""
        before, most = self._rate, MAX_RATE_CHANGE_PER_S * step_s
        faster = most
        if in_gate:
            faster = min(most, IN_GATE_M_S2 * step_s / max(hypot(*motion.velocity_m_s), _MOVING_M_S))
        rate = before + (rate - before) * step_s / (step_s + RATE_S)
        rate = min(max(rate, before - most), before + faster)
        if brake_m_s2:
            slowing_per_s = brake_m_s2 / max(hypot(*motion.velocity_m_s), _MOVING_M_S)
            slowing_per_s = min(slowing_per_s, before / BRAKE_END_S)
            rate = max(min(rate, before - slowing_per_s * step_s), 0.0)
        self._rate = rate
        self._rate_change = (rate - before) / step_s if step_s else 0.0

    def _command_now(
        self, path: Path, state: DroneState, errors: tuple[Vec3, Vec3], step_s: float
    ) -> VelocityFluCommand:
        """The command for the simulated drone; the errors are of position and velocity, arena axes."""
        now, before, soon, later = (
            self._motion_in(path, state, ACTS_S + more_s)
            for more_s in (0.0, ANSWER_S - SPREAD_S, ANSWER_S, ANSWER_S + SPREAD_S)
        )
        off_rad = 0.0
        if self._turn_rad_s is None:
            off_rad = remainder(self._past[-1][1].yaw_rad - state.yaw, 2 * pi)
        closing = self._closing(now, errors, state.position_age_s + ACTS_S)
        (forward, left, up), turn = self._inverse.command(now, (before, soon, later), closing, off_rad)
        if self._turn_rad_s is not None:
            turn = self._turn_rad_s
        limits = self._limits
        command = limits.limited(VelocityFluCommand(forward, left, up, turn + YAW_GAIN_PER_S * off_rad))
        turn_sent = limits.limited(VelocityFluCommand(yaw_rate_rad_s=turn)).yaw_rate_rad_s
        self._inverse.sent(command.up_m_s, turn_sent, step_s)
        return command

    def _closing(self, now: Motion, errors: tuple[Vec3, Vec3], ahead_s: float) -> tuple[Vec3, Vec3]:
        """Velocity and acceleration that the drone has, and should have, beside those of its path.

        Args:
            now: the path's motion when the command acts.
            errors: from the drone to the path when its position was measured.
            ahead_s: time between both.
        """
        (ex, ey, ez), (sx, sy, sz) = errors
        has = self._own.velocity_in(ACTS_S)
        slower = [v - own for v, own in zip(now.velocity_m_s, has, strict=False)]
        offset = [e + 0.5 * ahead_s * (s + v) for e, s, v in zip((ex, ey), (sx, sy), slower, strict=True)]
        size_m = hypot(*offset)
        gain = OFFSET_GAIN_PER_S2 * (MAX_OFFSET_M / size_m if size_m > MAX_OFFSET_M else 1.0)
        ax, ay = (
            gain * e + VELOCITY_GAIN_PER_S * v - pushed
            for e, v, pushed in zip(offset, slower, self._own.disturbance_m_s2, strict=True)
        )
        climb = min(max(CLIMB_GAIN_PER_S * ez, -MAX_CORRECTION_M_S), MAX_CORRECTION_M_S)
        az = CLIMB_GAIN_PER_S * sz + CLIMB_DAMPING_PER_S * (sz + climb)
        return (-slower[0], -slower[1], climb), (ax, ay, az)

    def _motion_in(self, path: Path, state: DroneState, time_s: float) -> Motion:
        """The motion in a time from now, as its time goes, with the heading that the drone will have."""
        motion = path.at(self.progress_s + self._rate * time_s).paced(self._rate, self._rate_change)
        turn_rad_s = self._turn_rad_s
        if turn_rad_s is None:
            return motion
        yaw_rad = state.yaw + turn_rad_s * time_s
        return replace(motion, yaw_rad=yaw_rad, yaw_rate_rad_s=turn_rad_s, yaw_acceleration_rad_s2=0.0)

    def _command_late(
        self, path: Path, state: DroneState, prediction: Prediction, step_s: float
    ) -> VelocityFluCommand:
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
        return self._limits.limited(VelocityFluCommand(*command))

    def _errors(self, state: DroneState, now_s: float) -> tuple[Vec3, Vec3]:
        """From the drone to the path: position and velocity, both when the drone's were measured."""
        at_s = now_s - state.position_age_s
        later_s, later = self._past[-1]
        position, velocity = later.position_m, later.paced(self._rate, self._rate_change).velocity_m_s
        for before_s, before in reversed(self._past):
            if before_s <= at_s:
                if later_s > before_s:
                    share = (at_s - before_s) / (later_s - before_s)
                    position = _between(before.position_m, later.position_m, share)
                break
            later_s, later = before_s, before
        return _minus(position, (state.x, state.y, state.z)), _minus(velocity, state.velocity_arena_m_s)


def _between(a: Vec3, b: Vec3, share: float) -> Vec3:
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
