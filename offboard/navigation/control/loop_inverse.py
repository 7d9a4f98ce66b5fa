"""The commands that make the simulated drone fly a motion: its autopilot's velocity loops, inverted.

An axis makes a demand u (a tilt, a thrust, a moment) of its velocity v and the command r:
u = k (b r - v) + ki * (integral of r - v), beside a compensation of drag. The motion needs a certain demand,
drag in body axes included, ahead by the time in which the motors answer; r follows from it (feedback
linearisation). In plan v is the drone's own velocity; up and in turns, it is that of the motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin, sqrt

from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import DroneState
from offboard.navigation.goals import Motion

GRAVITY_M_S2 = 9.80665


Level = tuple[float, float]
"""Forward and to the left."""


@dataclass(frozen=True, slots=True)
class Loop:
    """A velocity loop: the demand by the error and its integral.

    Attributes:
        gain: k; tilts are rad, so rad s/m; thrusts and moments are accelerations, so 1/s.
        integral_gain: ki, likewise, by one second.
        weight: b, how much of the command acts at once.
    """

    gain: float
    integral_gain: float
    weight: float


@dataclass(frozen=True, slots=True)
class Drag:
    """Quadratic drag in body axes, by mass and by moment of inertia.

    Attributes:
        level_per_m: along the drone, to any side.
        up_per_m: along its thrust.
        turn: about its thrust.
    """

    level_per_m: float
    up_per_m: float
    turn: float


# Of the airframe abejorro in `framerunner/vehicle/airframes/`: gains of `firmware_py.control.design`, weights
# of `level_law`, by its mass and inertia.
TILT = Loop(0.4945, 0.6597, 0.5)
CLIMB = Loop(12.451, 29.25, 0.8)
TURN = Loop(15.95, 58.1, 0.8)
DRAG = Drag(0.635 / 0.3, 2.352 / 0.3, 0.0039 / 0.002)
TILT_RATE_S = 0.0967  # gain of the body rate, by that of the tilt
TILT_DRAG_S2 = 0.212  # drag's moment by the rate's square, likewise
TILT_INERTIA_S2 = 0.0035  # likewise
MAX_TILT_RAD = 0.5  # that is asked for; less than the limit
MOTOR_S = 0.03  # the motors' lag
ANSWER_S = MOTOR_S + 0.01  # until the motors answer: the control's period too
OBSERVED_PER_S = 0.5  # how fast the integrals come to what the drone's tilts show of them
STEADY_RAD_S = 0.5  # a tilt that changes faster shows less of it
LEAST_UPRIGHT = 0.5  # cosine of the tilt
HOLD_S = 0.025  # half the time for which a command holds
SPREAD_S = 0.05
"""Between motions of which the tilt's rate and acceleration are taken."""


@dataclass(frozen=True, slots=True)
class Own:
    """The drone's own motion.

    Attributes:
        level_m_s: velocity when this tick's command acts, forward and to the left.
        tilts_rad: likewise, now.
        turn_rad_s: of the heading.
    """

    level_m_s: Level
    tilts_rad: Level
    turn_rad_s: float


class LoopInverse:
    """Commands for one motion after another; call `observe` and then `command` once a tick."""

    def __init__(self) -> None:
        self._tilts: list[float] | None = None  # integrals of forward and left
        self._others: list[float] | None = None  # of climb and turn
        self._wanted = (0.0, 0.0)  # climb and turn
        self._own: Own | None = None

    def observe(self, own: Own, sent_m_s: Level | None, step_s: float) -> None:
        """Follow the tilts' integrals: by what was sent, and slowly by the tilts themselves.

        Args:
            own: the drone's motion.
            sent_m_s: the command of the last tick, forward and to the left; None if there was none, or it is
                not known: the drone's velocity is then taken for steady.
            step_s: time since the last tick.
        """
        before, self._own = self._own, own
        if before is None or sent_m_s is None or self._tilts is None:
            self._tilts = [_steady(TILT, speed) for speed in own.level_m_s]
            return
        (f0, l0), (f1, l1) = before.tilts_rad, own.tilts_rad
        rates = _body_rates((f1, l1), ((f1 - f0) / step_s, (l1 - l0) / step_s), own.turn_rad_s)
        helped = _helped(own.level_m_s, own.turn_rad_s * cos(f1) * cos(l1))
        share = OBSERVED_PER_S * step_s
        for i, command in enumerate(sent_m_s):
            speed = own.level_m_s[i]
            self._tilts[i] += (command - 0.5 * (before.level_m_s[i] + speed)) * step_s
            demand = own.tilts_rad[i] + (TILT_RATE_S + MOTOR_S) * rates[i] - helped[i]
            made = demand - TILT.gain * (TILT.weight * command - speed)
            seen = made / TILT.integral_gain - HOLD_S * command
            if abs(rates[i]) < STEADY_RAD_S:
                self._tilts[i] += share * (seen - self._tilts[i])

    def command(
        self, now: Motion, soon: tuple[Motion, Motion, Motion], closing: tuple[Vec3, Vec3], off_rad: float
    ) -> tuple[Vec3, float]:
        """Velocity in the drone's level axes, and yaw rate.

        Args:
            now: the motion when the command acts.
            soon: those when the motors answer to it, and `SPREAD_S` before and after.
            closing: velocity and acceleration to add to these motions, arena axes: with it, the velocity in
                plan is the drone's.
            off_rad: from the drone's heading to that of the motions.
        """
        up = now.velocity_m_s[2] + closing[0][2]
        (f0, l0, _), (f1, l1, lift_m_s2), (f2, l2, _) = (
            _forces(motion, axes_of(motion.yaw_rad - off_rad), closing) for motion in soon
        )
        changes = (f2 - f0) / (2.0 * SPREAD_S), (l2 - l0) / (2.0 * SPREAD_S)
        answer = soon[1]
        rates = _body_rates((f1, l1), changes, answer.yaw_rate_rad_s)
        turns = [each.yaw_rate_rad_s * cos(f1) * cos(l1) + changes[0] * sin(l1) for each in (now, answer)]
        tilts = _limited(
            _tilt_demand(f1, rates[0], (f0 - 2.0 * f1 + f2) / SPREAD_S**2),
            _tilt_demand(l1, rates[1], (l0 - 2.0 * l1 + l2) / SPREAD_S**2),
        )
        climb = lift_m_s2 - DRAG.up_per_m * up * abs(up)
        alpha = answer.yaw_acceleration_rad_s2 + DRAG.turn * turns[1] * abs(turns[1])
        if self._others is None:
            self._others = [_steady(CLIMB, up), _steady(TURN, turns[0])]
        self._wanted = (up, turns[0])
        up_m_s, turn_rad_s = (
            _asked(loop, demand, value, integral)
            for loop, demand, value, integral in zip(
                (CLIMB, TURN), (climb, alpha), self._wanted, self._others, strict=True
            )
        )
        return (*self._level(tilts, turns[0]), up_m_s), turn_rad_s

    def _level(self, tilts: Level, turn_rad_s: float) -> Level:
        """The commands for tilts at the drone's own velocity."""
        own, integrals = self._own, self._tilts
        if own is None or integrals is None:
            raise RuntimeError("observe() comes before command()")
        x, y = (
            _asked(TILT, tilt - helped, speed, integral)
            for tilt, helped, speed, integral in zip(
                tilts, _helped(own.level_m_s, turn_rad_s), own.level_m_s, integrals, strict=True
            )
        )
        return x, y

    def restart(self, *, in_plan: bool = True) -> None:
        """Forget the past: the drone's climb and turn are steady, and its velocity in plan if so said."""
        self._others = None
        if in_plan and self._own is not None:
            self._tilts = [_steady(TILT, speed) for speed in self._own.level_m_s]

    def sent(self, up_m_s: float, turn_rad_s: float, step_s: float) -> None:
        """Note what was commanded, until the next call."""
        if self._others is not None:
            for i, (command, value) in enumerate(zip((up_m_s, turn_rad_s), self._wanted, strict=True)):
                self._others[i] += (command - value) * step_s


def _body_rates(tilts_rad: Level, changes_rad_s: Level, turn_rad_s: float) -> Level:
    """Of the drone about its own axes, for tilts that change while its heading turns."""
    forward, left = tilts_rad
    return (
        changes_rad_s[0] * cos(left) - turn_rad_s * cos(forward) * sin(left),
        changes_rad_s[1] + turn_rad_s * sin(forward),
    )


def _helped(level_m_s: Level, turn_rad_s: float) -> Level:
    """The tilts that the autopilot adds by itself: against drag, and for level axes that turn."""
    forward, left = level_m_s
    share, centripetal = DRAG.level_per_m / GRAVITY_M_S2, turn_rad_s / GRAVITY_M_S2
    return (
        share * forward * abs(forward) - centripetal * left,
        share * left * abs(left) + centripetal * forward,
    )


def _steady(loop: Loop, value: float) -> float:
    """The integral in steady motion, where the command is the velocity, but for the one that comes."""
    return loop.gain * (1.0 - loop.weight) * value / loop.integral_gain - HOLD_S * value


def _asked(loop: Loop, demand: float, value: float, integral: float) -> float:
    """The command of which the loop makes a demand in the middle of the time for which it holds."""
    return (demand + loop.gain * value - loop.integral_gain * integral) / (
        loop.gain * loop.weight + HOLD_S * loop.integral_gain
    )


def thrust_of(state: DroneState) -> Vec3:
    """The direction of the drone's thrust in its level axes: forward, left, up."""
    w, x, y, z = state.attitude_arena
    up = (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
    return level_of(up, axes_of(state.yaw))


def tilts_of(thrust: Vec3) -> Level:
    """The tilts of a thrust in level axes, forward and to the left."""
    return atan2(thrust[0], thrust[2]), atan2(thrust[1], hypot(thrust[0], thrust[2]))


def acceleration_in_plan(state: DroneState, up_m_s2: float) -> Level:
    """The simulated drone's acceleration by its tilt and drag, arena axes; upwards it has the one given."""
    axes = axes_of(state.yaw)
    thrust = thrust_of(state)
    drag = _drag(level_of(state.velocity_arena_m_s, axes), thrust)
    lift = (GRAVITY_M_S2 + up_m_s2 - drag[2]) / max(thrust[2], LEAST_UPRIGHT)
    forward, left = lift * thrust[0] + drag[0], lift * thrust[1] + drag[1]
    return turned(forward, left, state.yaw)


def axes_of(heading_rad: float) -> tuple[float, float]:
    """Cosine and sine of a heading, for `level_of`."""
    return cos(heading_rad), sin(heading_rad)


def level_of(vector: Vec3, axes: tuple[float, float]) -> Vec3:
    """A vector of the arena in level axes: forward, left, up."""
    c, s = axes
    return (c * vector[0] + s * vector[1], c * vector[1] - s * vector[0], vector[2])


def _sum(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _limited(forward_rad: float, left_rad: float) -> tuple[float, float]:
    """The tilts, if the vehicle's limit allows; beyond, its integrals would not be those counted here."""
    size = hypot(forward_rad, left_rad)
    scale = MAX_TILT_RAD / size if size > MAX_TILT_RAD else 1.0
    return scale * forward_rad, scale * left_rad


def _tilt_demand(tilt_rad: float, rate_rad_s: float, acceleration_rad_s2: float) -> float:
    """The tilt to ask for so that the drone has one that changes."""
    return (
        tilt_rad
        + TILT_RATE_S * rate_rad_s
        + TILT_DRAG_S2 * rate_rad_s * abs(rate_rad_s)
        + TILT_INERTIA_S2 * acceleration_rad_s2
    )


def _forces(motion: Motion, axes: tuple[float, float], closing: tuple[Vec3, Vec3]) -> Vec3:
    """Tilts forward and to the left (rad), and the thrust's upward part less the weight, by mass (m/s^2).

    Drag acts in body axes, whose tilt depends on it: so it is computed twice.
    """
    velocity = level_of(_sum(motion.velocity_m_s, closing[0]), axes)
    forward, left, up = level_of(_sum(motion.acceleration_m_s2, closing[1]), axes)
    over = GRAVITY_M_S2 + up
    drag = _drag(velocity, (forward, left, over))
    drag = _drag(velocity, (forward - drag[0], left - drag[1], over - drag[2]))
    thrust = (forward - drag[0], left - drag[1], over - drag[2])
    return (*tilts_of(thrust), up - drag[2])


def _drag(velocity: Vec3, thrust_m_s2: Vec3) -> Vec3:
    """Acceleration by drag in level axes, at the tilt of a thrust."""
    vx, vy, vz = velocity
    nx, ny, nz = thrust_m_s2
    size = sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / size, ny / size, nz / size
    ahead = hypot(nx, nz)
    fx, fz = nz / ahead, -nx / ahead  # the drone's forward direction
    lx, ly, lz = ny * fz, nz * fx - nx * fz, -ny * fx  # to its left
    a, b, c = vx * fx + vz * fz, vx * lx + vy * ly + vz * lz, vx * nx + vy * ny + vz * nz
    fa, fb = -DRAG.level_per_m * a * abs(a), -DRAG.level_per_m * b * abs(b)
    fc = -DRAG.up_per_m * c * abs(c)
    return (fa * fx + fb * lx + fc * nx, fb * ly + fc * ny, fa * fz + fb * lz + fc * nz)


Plan = tuple[float, float]
"""Along the arena's x and y."""

DISTURBANCE_S = 1.0  # in which a disturbance is learnt
_LONGEST_S = 0.15  # between two velocities that are compared


class OwnMotion:
    """Call `update` once a tick.

    Attributes:
        acceleration_m_s2: by tilt, drag and the disturbance.
        disturbance_m_s2: what telemetry's velocities show of it beside tilt and drag, such as wind.
    """

    def __init__(self) -> None:
        self.acceleration_m_s2: Plan = (0.0, 0.0)
        self.disturbance_m_s2: Plan = (0.0, 0.0)
        self._velocity_m_s: Plan = (0.0, 0.0)
        self._measured_s: float | None = None
        self._age_s = 0.0

    def update(self, state: DroneState, up_m_s2: float) -> None:
        """Take in a state; upwards the drone accelerates as given."""
        by_tilt, velocity = acceleration_in_plan(state, up_m_s2), state.velocity_arena_m_s[:2]
        measured_s, last_s = state.time_us * 1e-6 - state.position_age_s, self._measured_s
        if last_s is not None and 0.0 < (step_s := measured_s - last_s) < _LONGEST_S and not state.landed:
            share = step_s / DISTURBANCE_S
            x, y = (
                was + share * ((v - before) / step_s - by - was)
                for was, v, before, by in zip(
                    self.disturbance_m_s2, velocity, self._velocity_m_s, by_tilt, strict=True
                )
            )
            self.disturbance_m_s2 = (x, y)
        self._velocity_m_s, self._measured_s, self._age_s = velocity, measured_s, state.position_age_s
        self.acceleration_m_s2 = (
            by_tilt[0] + self.disturbance_m_s2[0],
            by_tilt[1] + self.disturbance_m_s2[1],
        )

    def velocity_in(self, time_s: float) -> Plan:
        """The velocity a while after the last state."""
        ahead_s = self._age_s + time_s
        (vx, vy), (ax, ay) = self._velocity_m_s, self.acceleration_m_s2
        return vx + ahead_s * ax, vy + ahead_s * ay
