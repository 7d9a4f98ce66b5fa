"""Follows a path by velocity commands, with a vehicle whose response is identified in flight.

Of the path, the motion counts that the vehicle should have when a command has its effect. What it will have
by the commands on their way is predicted by the model of its response, and the difference is closed: in plan
by an acceleration, and so by the tilt that the vehicle's loop of velocity must be made to ask for; up, down
and in turns by a velocity.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi, remainder

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import CONTEST, CommandLimits, clamped
from offboard.navigation.control.path_clock import PathClock, rate_before_gate, rate_of
from offboard.navigation.goals import Motion
from offboard.navigation.path import Path
from offboard.response.estimate import LevelComing, ResponseEstimate, YawAhead
from offboard.response.rate_response import Coming
from offboard.response.tilt_loop import HALF_S, STEP_S

OFFSET_GAIN_PER_S2 = 10.0  # an offset in plan is closed within half a second, without swinging
VELOCITY_GAIN_PER_S = 6.0
SOON_S = 0.15  # a vehicle that is later closes it more slowly
MAX_OFFSET_M = 0.3  # a larger one is closed at the speed of this one
CLIMB_GAIN_PER_S = (1.6, 3.5)  # an offset in height is closed at least and at most at this rate,
CLIMB_DAMPING = 0.5  # share of a wrong velocity upwards
YAW_GAIN_PER_S = (1.2, 3.0)  # one of the heading at this,
GAIN_OF_LATE = 0.5  # and at this share of the inverse of twice the dead time and the lag
MAX_CORRECTION_M_S = 0.6
COMING_S = 0.2  # for which a wrong velocity goes on
GATE_TURN_M = 0.15  # by which a wrong heading counts before a gate, for each radian
GATE_S = (0.4, 1.3)  # before a gate the drone must be straight before it; nearer, it cannot stop any more
GATE_LATE = (0.5, 1.6)  # by which shares of the lateness that is earlier
IN_GATE_S = (-0.3, 0.4)  # to a gate; in this time it hardly speeds up
_MAX_STEP_S = 0.5  # for so long a vehicle flies on by its last command


@dataclass(frozen=True, slots=True)
class _Off:
    """From what the drone will have to what its path has, when a command has its effect; arena axes."""

    position_m: Vec3
    velocity_m_s: tuple[float, float]
    heading_rad: float


class PathFollower:
    """Follows one path after another; call `command` once a tick.

    Args:
        limits: of commands.

    Attributes:
        estimate: of the vehicle's response.
        progress_s: time along the path.
        error_m: the drone's distance from the path, when what is commanded now is flown.
    """

    def __init__(self, limits: CommandLimits = CONTEST) -> None:
        self.estimate = ResponseEstimate()
        self.progress_s = 0.0
        self.error_m = 0.0
        self._limits = limits
        self._path: Path | None = None
        self._clock = PathClock(self.estimate.loop.dead_s + HALF_S)
        self._last_s: float | None = None
        self._observed_s: float | None = None  # vehicle time of the state last taken in
        self._sent: VelocityFluCommand | None = None

    @property
    def lead_s(self) -> float:
        """How far ahead of its time the path is commanded already: another one should begin after that."""
        return max(self._clock.ahead_s - self.progress_s, 0.0) + STEP_S

    def reference(self) -> Motion | None:
        """The path's motion `lead_s` ahead, to plan the next path from; None before the first command."""
        return None if self._path is None else self._path.at(self.progress_s + self.lead_s)

    def braking(self) -> Motion | None:
        """The motion of a drone that brakes along the path, which has a heading of its own."""
        if self._path is None:
            return None
        motion, rate = self._path.at(self._clock.ahead_s), self._clock.pace[0]
        x, y, z = motion.velocity_m_s
        return Motion(motion.position_m, (rate * x, rate * y, rate * z))

    def own_motion(self, state: DroneState) -> Motion:
        """The drone's, when the next command is flown, to plan a path from that does not continue another."""
        coming = self.estimate.predict(state, lambda time_s: state.yaw)
        climb, turn = self.estimate.climb.predict(), self.estimate.turn.predict()
        (dx, dy), (vx, vy) = coming.moved_m, coming.velocity_m_s
        z_m = state.z + state.position_age_s * state.velocity_arena_m_s[2] + climb.moved
        yaw_rad = state.yaw + turn.moved
        return Motion((state.x + dx, state.y + dy, z_m), (vx, vy, climb.rate), yaw_rad, turn.rate)

    def continued(self, following: Path) -> Path:
        """What to follow from now on, once a path from the reference has been planned."""
        path, from_s = self._path, self.progress_s
        if path is None:
            return following
        joined = path.then(following, from_s, from_s + self.lead_s)
        self._clock.ahead_s -= from_s
        self._path, self.progress_s = joined, 0.0
        return joined

    def begin(self) -> None:
        """The next path begins now, with the drone's own motion: it does not continue the present one."""
        self._path = None

    def progress_on(self, path: Path) -> float:
        """The time along a path; 0 on one that no command was given for yet."""
        return self.progress_s if path is self._path else 0.0

    @property
    def finished(self) -> bool:
        """The path's end is reached, by its time."""
        return self._path is not None and self.progress_s >= self._path.duration_s

    def observe(
        self, state: DroneState, now_s: float, sent: VelocityFluCommand | None, *, near_gate: bool = False
    ) -> None:
        """Take in a state, also while no path is followed; else `command` does it.

        Args:
            state: of the drone.
            now_s: vehicle time of the state.
            sent: the command that the drone has had since the last tick; None if it had none.
            near_gate: another model of the vehicle would disturb the flight now.
        """
        self._observed_s = now_s
        up_m_s2 = 0.0 if self._path is None else self._motion(self._path, 0.0).acceleration_m_s2[2]
        self.estimate.update(state, sent, up_m_s2=up_m_s2, near_gate=near_gate)

    def command(
        self,
        path: Path,
        state: DroneState,
        now_s: float,
        *,
        turn_rad_s: float | None = None,
        brake_m_s2: float = 0.0,
    ) -> VelocityFluCommand:
        """The command for this tick.

        Args:
            path: another one than at the last tick begins with the drone's own motion, unless it is
                `continued`.
            state: of the drone.
            now_s: vehicle time of the state.
            turn_rad_s: turn with this rate, not as the path says.
            brake_m_s2: brake with this, to a stop on the path; 0 to fly on.
        """
        if self._observed_s != now_s:
            self.observe(state, now_s, self._sent)
        step_s = 0.0 if self._last_s is None else min(max(now_s - self._last_s, 0.0), _MAX_STEP_S)
        self._last_s = now_s
        clock = self._clock
        if path is not self._path:
            self._path = path
            clock = self._clock = PathClock(clock.lead_s)
        else:
            clock.advance(step_s, path.duration_s)
        yaw_ahead = self._yaw_ahead(path, state, turn_rad_s)
        coming = self.estimate.predict(state, yaw_ahead)
        clock.lead(coming.time_s)
        self.progress_s = min(max(clock.in_(0.0)[0], 0.0), path.duration_s)
        command = self._command(
            path, state, coming, yaw_ahead, turn_rad_s=turn_rad_s, step_s=step_s, brake_m_s2=brake_m_s2
        )
        self._sent = self._limits.limited(command)
        return self._sent

    def _motion(self, path: Path, time_s: float) -> Motion:
        """The path's motion in a time from now, as its time goes."""
        at_s, pace = self._clock.in_(time_s)
        return path.at(at_s).paced(*pace)

    def _yaw_ahead(self, path: Path, state: DroneState, turn_rad_s: float | None) -> YawAhead:
        """The heading that the drone will have: it follows the path's, or turns."""
        if turn_rad_s is not None:
            return lambda time_s: state.yaw + turn_rad_s * time_s
        off_rad = state.yaw - path.yaw_at(self._clock.in_(0.0)[0])
        return lambda time_s: path.yaw_at(self._clock.in_(time_s)[0]) + off_rad

    def _command(
        self,
        path: Path,
        state: DroneState,
        coming: LevelComing,
        yaw_ahead: YawAhead,
        *,
        turn_rad_s: float | None,
        step_s: float,
        brake_m_s2: float,
    ) -> VelocityFluCommand:
        """The command before its limits, and how fast the path's time goes on."""
        climb, turn = self.estimate.climb, self.estimate.turn
        climbs, turns = climb.predict(coming.along_m2_s2), turn.predict()
        level = self._motion(path, coming.time_s)
        offset_up_m = self._motion(path, climb.dead_s).position_m[2] - state.z - climbs.moved
        offset_up_m -= state.position_age_s * state.velocity_arena_m_s[2]
        off_rad = 0.0
        if turn_rad_s is None:
            wanted_rad = self._motion(path, turn.dead_s).yaw_rad
            off_rad = remainder(wanted_rad - state.yaw - turns.moved, 2 * pi)
        x, y = (
            level.position_m[axis] - at - moved
            for axis, at, moved in ((0, state.x, coming.moved_m[0]), (1, state.y, coming.moved_m[1]))
        )
        (vx, vy, _), (has_x, has_y) = level.velocity_m_s, coming.velocity_m_s
        off = _Off((x, y, offset_up_m), (vx - has_x, vy - has_y), off_rad)
        self._change_rate(path, level, off, step_s=step_s, brake_m_s2=brake_m_s2)
        forward, left = self._level(path, coming, off, yaw_ahead, turn_rad_s)
        up = self._climb(path, climbs, offset_up_m)
        return VelocityFluCommand(forward, left, up, self._turn(path, off_rad, turn_rad_s))

    def _change_rate(self, path: Path, level: Motion, off: _Off, *, step_s: float, brake_m_s2: float) -> None:
        """Let the path's time wait for a drone that is behind, aside, or not straight before a gate."""
        self.error_m = hypot(*off.position_m)
        (x, y, z), (slower_x, slower_y) = off.position_m, off.velocity_m_s
        coming_m = (x + COMING_S * slower_x, y + COMING_S * slower_y, z)
        at_s, late_s = self._clock.ahead_s, self.estimate.response.late_s
        near_s = (GATE_S[0] + GATE_LATE[0] * late_s, GATE_S[1] + GATE_LATE[1] * late_s)
        rate = min(
            rate_of(off.position_m, level.velocity_m_s),
            rate_before_gate(path, self.progress_s, near_s, coming_m, GATE_TURN_M * abs(off.heading_rad)),
        )
        first_s, last_s = IN_GATE_S
        in_gate = any(
            crossing.time_s - at_s < last_s and crossing.time_s - self.progress_s > first_s
            for crossing in path.crossings
        )
        speed_m_s = hypot(*path.at(at_s).velocity_m_s)
        self._clock.change(rate, speed_m_s, step_s, in_gate=in_gate, brake_m_s2=brake_m_s2)

    def _level(
        self, path: Path, coming: LevelComing, off: _Off, yaw_ahead: YawAhead, turn_rad_s: float | None
    ) -> tuple[float, float]:
        """The command in plan: for the tilt that closes offsets of position and velocity along the path."""
        estimate, time_s, (x, y, _) = self.estimate, coming.time_s, off.position_m
        size_m, share = hypot(x, y), min(1.0, SOON_S / time_s)
        gain = share * share * OFFSET_GAIN_PER_S2 * (MAX_OFFSET_M / size_m if size_m > MAX_OFFSET_M else 1.0)
        slower_x, slower_y = off.velocity_m_s
        ex = gain * x + share * VELOCITY_GAIN_PER_S * slower_x
        ey = gain * y + share * VELOCITY_GAIN_PER_S * slower_y
        times_s = [time_s + beside_s for beside_s in (-STEP_S, 0.0, STEP_S)]
        motions = [self._motion(path, at_s) for at_s in times_s]
        off_rad = coming.yaw_rad - motions[1].yaw_rad
        before, then, after = (
            estimate.motion.tilts_for(
                (
                    motion.acceleration_m_s2[0] + ex,
                    motion.acceleration_m_s2[1] + ey,
                    motion.acceleration_m_s2[2],
                ),
                motion.yaw_rad + off_rad if turn_rad_s is None else yaw_ahead(at_s),
                (motion.velocity_m_s[0] - slower_x, motion.velocity_m_s[1] - slower_y),
                coming.tilts_rad,
            )
            for motion, at_s in zip(motions, times_s, strict=True)
        )
        turn = motions[1].yaw_rate_rad_s if turn_rad_s is None else turn_rad_s
        return estimate.command_for((before, then, after), turn, coming, yaw_ahead)

    def _climb(self, path: Path, climbs: Coming, offset_m: float) -> float:
        """The command up."""
        climb = self.estimate.climb
        motion = self._motion(path, climb.dead_s + STEP_S)
        at = self._motion(path, climb.dead_s)
        close = _gain(CLIMB_GAIN_PER_S, climb.dead_s, climb.lag_s) * offset_m
        close += CLIMB_DAMPING * (at.velocity_m_s[2] - climbs.rate)
        close = clamped(close, MAX_CORRECTION_M_S, MAX_CORRECTION_M_S) - climbs.disturbance
        return motion.velocity_m_s[2] + climb.lag_s * motion.acceleration_m_s2[2] + close

    def _turn(self, path: Path, off_rad: float, turn_rad_s: float | None) -> float:
        """The command of the yaw rate."""
        if turn_rad_s is not None:
            return turn_rad_s
        turn = self.estimate.turn
        motion = self._motion(path, turn.dead_s + STEP_S)
        close = _gain(YAW_GAIN_PER_S, turn.dead_s, turn.lag_s) * off_rad
        return motion.yaw_rate_rad_s + turn.lag_s * motion.yaw_acceleration_rad_s2 + close


def _gain(bounds_per_s: tuple[float, float], dead_s: float, lag_s: float) -> float:
    """How fast an offset is closed: what happens in the dead time is only predicted, so that counts twice."""
    least, most = bounds_per_s
    return min(max(GAIN_OF_LATE / (2.0 * dead_s + lag_s), least), most)
