"""How a vehicle tilts for commanded velocities: identified in flight from commands, velocities and tilts.

A multicopter accelerates by tilting, and its attitude tells the tilt. Whatever its velocity control is, the
tilt p (rad) along each level axis follows a demand that is linear in what is known:

    p + T w + D w |w| = B r - K v + I (integral of r - v) + H v |v| / g + C (centripetal) + trim

with the body's rate w about that axis, the command r after a dead time, maybe with a first lag before the
loop, and the velocity v: a proportional part with set-point weighting and an integral part (Astrom &
Hagglund, "Advanced PID Control", 2006, section 3.4), compensation of drag and of level axes that turn, and
the lag and the drag of tilting. The rate is a central difference of tilts, so a state counts one step after
it. The coefficients are the states of a Kalman filter, one for each of many candidates of dead time and first
lag; their likelihoods choose one (multiple-model estimation: Bar-Shalom, Li & Kirubarajan, "Estimation with
Applications to Tracking and Navigation", 2001, section 11.6), and those that are far worse are dropped.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import atan2, copysign, cos, exp, hypot, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from framerunner.geometry.vectors import turned
from offboard.drone import DroneState, VelocityFluCommand

Array = NDArray[np.float64]
Plan = tuple[float, float]
"""Forward and to the left in level axes, or along the arena's x and y."""

GRAVITY_M_S2 = 9.80665
STEP_S = 0.05
HALF_S = 0.5 * STEP_S
MAX_TILT_RAD = 0.48  # of a demand; beyond, a vehicle's limit may act
MAX_RATE_RAD_S = 0.9  # likewise of the body
DEAD_HALVES = (2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 15, 17, 19, 22, 26)
"""From a command to the demand that it makes."""
LAGGED_DEAD_HALVES = (3, 5, 7, 9, 11, 13, 17, 21, 25)
INNER_HALVES = (1, 2, 4)  # likewise from a velocity
LAGS_S = (0.2, 0.4, 0.6, 0.9)
_LONGEST = max(DEAD_HALVES) // 2 + 1  # steps
_COEFFICIENTS = 7
_STATES = 9  # coefficients, and the trims of both axes
# Of multicopters of any size, as in `TiltLoop`: they accelerate by 2 to 6 1/s of the velocity's error.
_PRIOR = np.array((0.0, 0.08, 0.3, 0.4, 0.3, 0.5, 0.5, 0.0, 0.0))
_PRIOR_STD = np.array((0.04, 0.1, 0.15, 0.15, 0.35, 0.8, 0.3, 0.05, 0.05))
_WANDER = np.array((0.001, 0.003, 0.003, 0.003, 0.003, 0.01, 0.005, 0.003, 0.003)) ** 2 * STEP_S
_LAGGED_COST = 8.0  # of a first lag, in log likelihood
_DEAD_COST = 0.25  # likewise of each half step beside the usual dead time
_USUAL_DEAD = 3
_USUAL_INNER = 2
_NOISE_RAD = 0.012
_NOISE_OF_RATE_S = 0.012
_MEMORY = 1.0 - STEP_S / 20.0  # of log likelihoods
_BETTER = 6.0  # by which a log likelihood must be better than the chosen one
_HOPELESS = 25.0  # by which it is so much worse that the candidate is dropped
_CHOOSE_STEPS = 5
_TRIMS = (_COEFFICIENTS, _COEFFICIENTS + 1)
_HELD_RAD = 0.01  # by which trims may change in a step at a limit
_WANDER_OF_REST = 0.1  # share of what is unexplained by which a trim may change in a step
_REST_S = 0.4  # time constant of what the model leaves unexplained, which is taken to go on
_OUTLIER = 3.0  # standard deviations; a tilt that is farther off counts less
_LEAST_COMMAND = 0.1


@dataclass(frozen=True, slots=True)
class TiltLoop:
    """See the module.

    Attributes:
        rate_s: T.
        rate_drag_s2: D.
        command: B, rad s/m.
        velocity: K, likewise.
        integral: I, rad/m.
        drag: H, 1/m.
        turn: C.
        dead_halves: half steps from the begin of a command's time to the demand that it makes.
        inner_halves: likewise from a velocity.
        lag_s: of commands, before the loop; 0 if there is none.
        turning: whether that lag is in axes that turn with the heading.
    """

    rate_s: float
    rate_drag_s2: float
    command: float
    velocity: float
    integral: float
    drag: float
    turn: float
    dead_halves: int
    inner_halves: int
    lag_s: float
    turning: bool

    def demand(
        self, axis: int, command_m_s: float, velocity_m_s: Plan, integral_m: float, turn_rad_s: float
    ) -> float:
        """The demand of an axis, 0 for forward (rad); the integral is that half a step before."""
        v = velocity_m_s[axis]
        centripetal = (turn_rad_s if axis else -turn_rad_s) * velocity_m_s[1 - axis]
        return (
            self.command * command_m_s
            - self.velocity * v
            + self.integral * (integral_m + HALF_S * (command_m_s - v))
            + (self.drag * v * abs(v) + self.turn * centripetal) / GRAVITY_M_S2
        )

    def followed(self, tilts_rad: Plan, demands_rad: Plan, turn_rad_s: float) -> Plan:
        """The tilts half a step later, by demands: the roots of the module's equation for the rates."""
        rates = []
        for tilt, demand in zip(tilts_rad, demands_rad, strict=True):
            off, lag_s = demand - tilt, HALF_S + self.rate_s
            size = off / lag_s
            if self.rate_drag_s2 > 1e-6:
                root = sqrt(lag_s * lag_s + 4.0 * self.rate_drag_s2 * abs(off))
                size = copysign((root - lag_s) / (2.0 * self.rate_drag_s2), off)
            rates.append(size)
        forward, left = tilts_rad
        return (
            forward + HALF_S * (rates[0] + turn_rad_s * cos(forward) * sin(left)) / cos(left),
            left + HALF_S * (rates[1] - turn_rad_s * sin(forward)),
        )

    def lead(self, rate_rad_s: float) -> float:
        """By how much a demand must be ahead of the tilt when the body turns about its axis."""
        return self.rate_s * rate_rad_s + self.rate_drag_s2 * rate_rad_s * abs(rate_rad_s)


def tilts_of(state: DroneState) -> Plan:
    """The tilts, forward and to the left (rad)."""
    w, x, y, z = state.attitude_arena
    up = 1.0 - 2.0 * (x * x + y * y)
    forward, left = turned(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), -state.yaw)
    return atan2(forward, up), atan2(left, hypot(forward, up))


def body_rates(tilts_rad: Plan, changes_rad_s: Plan, turn_rad_s: float) -> Plan:
    """Of a vehicle about its own axes, for tilts that change while its heading turns."""
    forward, left = tilts_rad
    return (
        changes_rad_s[0] * cos(left) - turn_rad_s * cos(forward) * sin(left),
        changes_rad_s[1] + turn_rad_s * sin(forward),
    )


class _Candidate(NamedTuple):
    dead_halves: int
    inner_halves: int
    lag: int | None  # index of the first lag
    turning: bool

    @property
    def source(self) -> int:
        """Which of the filtered commands acts: the command, those in level axes, those in the arena's."""
        return 0 if self.lag is None else 1 + self.lag + (0 if self.turning else len(LAGS_S))


def _candidates() -> list[_Candidate]:
    plain = [
        _Candidate(dead, inner, None, True)
        for dead in DEAD_HALVES
        for inner in (*INNER_HALVES, dead)
        if inner == _USUAL_INNER or (inner <= dead <= max(INNER_HALVES) + 1)
    ]
    lagged = [
        _Candidate(dead, _USUAL_INNER, lag, turning)
        for lag in range(len(LAGS_S))
        for dead in LAGGED_DEAD_HALVES
        for turning in (True, False)
    ]
    return plain + lagged


class TiltLoopEstimate:
    """Estimates the loop of the vehicle that is flown; call `update` once a tick.

    Attributes:
        updates: from how many steps it has learnt.
        turn_rad_s: rate of the heading over the last step.
    """

    def __init__(self) -> None:
        self.updates = 0
        self.turn_rad_s = 0.0
        self._all = _candidates()
        self._chosen = self._all.index(_Candidate(_USUAL_DEAD, _USUAL_INNER, None, True))
        count = len(self._all)
        self._x = np.tile(_PRIOR, (count, 1))
        self._p = np.tile(np.diag(_PRIOR_STD**2), (count, 1, 1))
        self._scores = np.array(
            [
                -_DEAD_COST * abs(each.dead_halves - _USUAL_DEAD)
                - (0.0 if each.lag is None else _LAGGED_COST)
                for each in self._all
            ]
        )
        self._kept = np.array([exp(-STEP_S / lag_s) for lag_s in LAGS_S])[:, None]
        self._index()
        self.restart()

    def _index(self) -> None:
        """Make what depends on which candidates there are."""
        dead = np.array([each.dead_halves for each in self._all])
        inner = np.array([each.inner_halves for each in self._all])
        self._dead = np.stack((dead // 2, (dead + 1) // 2)) + 1  # steps before the last one
        self._inner = np.stack((inner // 2, (inner + 1) // 2)) + 2
        self._source = np.array([each.source for each in self._all])
        self._in_arena = np.array([not each.turning for each in self._all])
        self._loop: TiltLoop | None = None

    def restart(self) -> None:
        """Forget the motion, but not the loop: its integrals may be any."""
        self._lagged = np.zeros((2 * len(LAGS_S), 2))
        self._commands: deque[Array] = deque(maxlen=_LONGEST + 1)
        self._velocities: deque[Plan] = deque(maxlen=max(INNER_HALVES) // 2 + 3)
        self._tilts: deque[Plan] = deque(maxlen=3)
        self._turns: deque[float] = deque(maxlen=2)
        self._rest_rad = [0.0, 0.0]
        self._integrals = np.zeros((len(self._all), 2))
        self._x[:, _COEFFICIENTS:] = 0.0
        self._p[:, _COEFFICIENTS:, :] = self._p[:, :, _COEFFICIENTS:] = 0.0
        for axis in range(_COEFFICIENTS, _STATES):
            self._p[:, axis, axis] = _PRIOR_STD[axis] ** 2

    @property
    def loop(self) -> TiltLoop:
        """As known now."""
        if self._loop is None:
            each = self._all[self._chosen]
            rate, rate_drag, command, velocity, integral, drag, turn, _, _ = self._x[self._chosen].tolist()
            self._loop = TiltLoop(
                rate_s=max(rate, 0.0),
                rate_drag_s2=max(rate_drag, 0.0),
                command=max(command, _LEAST_COMMAND),
                velocity=velocity,
                integral=max(integral, 0.0),
                drag=drag,
                turn=turn,
                dead_halves=each.dead_halves,
                inner_halves=each.inner_halves,
                lag_s=0.0 if each.lag is None else LAGS_S[each.lag],
                turning=each.turning,
            )
        return self._loop

    @property
    def trims_rad(self) -> Plan:
        """The parts of the demands that the model does not explain."""
        forward, left = self._x[self._chosen, _COEFFICIENTS:].tolist()
        return forward + self._rest_rad[0], left + self._rest_rad[1]

    @property
    def integrals_m(self) -> Plan:
        """The integrals, by half a step before the last state."""
        forward, left = self._integrals[self._chosen].tolist()
        return forward, left

    @property
    def velocities_m_s(self) -> list[Plan]:
        """The latest ones, level axes, one a step; the last is that of now."""
        return list(self._velocities)

    @property
    def lagged_m_s(self) -> Plan:
        """What the first lag has made of the commands by now, in its axes."""
        x, y = self._lagged[self._all[self._chosen].source - 1].tolist()
        return x, y

    def coming_m_s(self, steps: int, yaw_rad: float) -> Plan:
        """A command that was sent some steps ago, as it acts on the loop; level axes at a heading."""
        each = self._all[self._chosen]
        if not self._commands:
            return 0.0, 0.0
        x, y = self._commands[max(len(self._commands) - steps, 0)][each.source].tolist()
        return (x, y) if each.turning else turned(x, y, -yaw_rad)

    def update(
        self,
        state: DroneState,
        velocity_level_m_s: Plan,
        sent: VelocityFluCommand,
        turn_rad_s: float,
        *,
        learns: bool,
        chooses: bool,
    ) -> None:
        """Add a step.

        Args:
            state: of the drone now.
            velocity_level_m_s: now, forward and to the left.
            sent: the command that it has had since the last step.
            turn_rad_s: rate of the heading since then.
            learns: the motion is in the air, and a step long.
            chooses: another candidate may be chosen.
        """
        self._velocities.append(velocity_level_m_s)
        self._tilts.append(tilts_of(state))
        self._turns.append(turn_rad_s)
        self.turn_rad_s = turn_rad_s
        yaw_rad = state.yaw - turn_rad_s * STEP_S
        self._filter(sent, yaw_rad)
        if len(self._commands) <= _LONGEST:
            return
        before, tilts, after = self._tilts
        changes = ((after[0] - before[0]) / (2.0 * STEP_S), (after[1] - before[1]) / (2.0 * STEP_S))
        turn_rad_s = 0.5 * sum(self._turns)
        rates = body_rates(tilts, changes, turn_rad_s)
        rows = self._rows(rates, yaw_rad, turn_rad_s)
        loop = self.loop
        demand_rad = hypot(tilts[0] + loop.lead(rates[0]), tilts[1] + loop.lead(rates[1]))
        if demand_rad > MAX_TILT_RAD or max(map(abs, rates)) > MAX_RATE_RAD_S:
            self._p[:, _TRIMS, _TRIMS] += _HELD_RAD**2  # integrals may be held at limits
            return
        if not learns:
            return
        self._learn(rows, tilts, rates)
        self._loop = None
        self.updates += 1
        if chooses and self.updates % _CHOOSE_STEPS == 0:
            self._choose()

    def _filter(self, sent: VelocityFluCommand, yaw_rad: float) -> None:
        """Let the first lags follow a command given at a heading; their means over the step act."""
        level = (sent.forward_m_s, sent.left_m_s)
        given = np.empty((2, 1, 2))
        given[0], given[1] = level, turned(*level, yaw_rad)
        before = self._lagged
        now = given + self._kept * (before.reshape(2, -1, 2) - given)
        self._lagged = now.reshape(-1, 2)
        self._commands.append(np.concatenate((given[0], 0.5 * (before + self._lagged))))

    def _rows(self, rates: Plan, yaw_rad: float, turn_rad_s: float) -> Array:
        """What the coefficients are multiplied with at the step before, for both axes: (2, candidates, 9)."""
        commands = np.array(self._commands)
        acting = 0.5 * commands[len(commands) - self._dead, self._source].sum(axis=0)
        c, s = cos(yaw_rad), sin(yaw_rad)
        acting = np.where(self._in_arena[:, None], acting @ np.array(((c, -s), (s, c))), acting)
        past = np.array(self._velocities)
        velocity = 0.5 * past[len(past) - self._inner].sum(axis=0)
        off = STEP_S * (acting - velocity)
        rows = np.zeros((2, len(self._all), _STATES))
        turn = turn_rad_s / GRAVITY_M_S2
        for axis, sign in ((0, -turn), (1, turn)):
            row, v = rows[axis], velocity[:, axis]
            row[:, 0] = -rates[axis]
            row[:, 1] = -rates[axis] * abs(rates[axis])
            row[:, 2] = acting[:, axis]
            row[:, 3] = -v
            row[:, 4] = self._integrals[:, axis] + 0.5 * off[:, axis]
            row[:, 5] = v * np.abs(v) / GRAVITY_M_S2
            row[:, 6] = sign * velocity[:, 1 - axis]
            row[:, _COEFFICIENTS + axis] = 1.0
        self._integrals += off
        return rows

    def _learn(self, rows: Array, tilts: Plan, rates: Plan) -> None:
        """Update all filters, and the candidates' log likelihoods."""
        x, p = self._x, self._p
        p[:, range(_STATES), range(_STATES)] += _WANDER
        p[:, _TRIMS, _TRIMS] += np.square(_WANDER_OF_REST * np.array(self._rest_rad))
        self._scores *= _MEMORY
        for axis, (row, tilt, rate) in enumerate(zip(rows, tilts, rates, strict=True)):
            noise = (_NOISE_RAD + _NOISE_OF_RATE_S * abs(rate)) ** 2
            spread = np.einsum("cij,cj->ci", p, row)
            variance = np.einsum("ci,ci->c", row, spread) + noise
            error = tilt - np.einsum("ci,ci->c", row, x)
            self._rest_rad[axis] += STEP_S / _REST_S * (float(error[self._chosen]) - self._rest_rad[axis])
            off = np.abs(error) / np.sqrt(variance)
            inside = np.minimum(off, _OUTLIER)
            # Huber's loss, for contacts and limits.
            self._scores -= inside * (off - 0.5 * inside) + 0.5 * np.log(variance / noise)
            gain = spread / variance[:, None]
            x += gain * (error * np.minimum(1.0, _OUTLIER / np.maximum(off, _OUTLIER)))[:, None]
            p -= gain[:, :, None] * spread[:, None, :]

    def _choose(self) -> None:
        """Take a candidate that is clearly better, and drop hopeless ones."""
        best = int(self._scores.argmax())
        if self._scores[best] > self._scores[self._chosen] + _BETTER:
            self._chosen = best
        stay = self._scores > self._scores.max() - _HOPELESS
        stay[self._chosen] = True
        if not stay.all():
            numbers = np.flatnonzero(stay)
            self._chosen = int(np.searchsorted(numbers, self._chosen))
            self._all = [self._all[number] for number in numbers]
            self._x, self._p, self._scores = self._x[stay], self._p[stay], self._scores[stay]
            self._integrals = self._integrals[stay]
        self._index()
