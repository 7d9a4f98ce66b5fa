"""How a vehicle tilts for commanded velocities: identified in flight from commands, velocities and tilts.

A multicopter accelerates by tilting, and its attitude tells the tilt. Whatever its velocity control is, the
tilt p (rad) along each level axis follows a demand that is linear in what is known:

    p + T w + D w |w| + J a = B r - K v + I (integral of r - v) + H v |v| / g + C (centripetal) + trim

with the body's rate w about that axis and its change a, the command r after a dead time, maybe with a first
lag before the loop, and the velocity v: a proportional part with set-point weighting and an integral part
(Astrom & Hagglund, "Advanced PID Control", 2006, section 3.4), compensation of drag and of level axes that
turn, and the lags and the drag of tilting. Commands hold over a step, so all are means over one: a tilt is
the mean of two states, and a rate their difference. The coefficients are the states of a Kalman filter, one
for each of many candidates of dead time and first lag; their likelihoods choose one (multiple-model
estimation: Bar-Shalom, Li & Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001,
section 11.6), and those that are far worse are dropped.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from math import atan2, copysign, cos, exp, floor, hypot, sin, sqrt
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
MAX_ERROR_RAD = 0.3  # likewise of what a tilt lacks to a demand
QUARTER_S = 0.25 * STEP_S
DEAD_QUARTERS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48)
"""Quarter steps from a command to the demand that it makes."""
LAGGED_DEAD_QUARTERS = (4, 8, 12, 16, 20, 24, 32, 40, 48)
INNER_QUARTERS = (1, 3, 5)  # likewise from a velocity
LAGS_S = (0.2, 0.4, 0.6, 0.9)
_LONGEST_INNER = 8
_LONGEST = max(DEAD_QUARTERS) // 4 + 2  # steps
_COEFFICIENTS = 8
_STATES = 10  # coefficients, and the trims of both axes
# Of multicopters of any size, as in `TiltLoop`: they accelerate by 2 to 6 1/s of the velocity's error.
_PRIOR = np.array((0.05, 0.08, 0.004, 0.3, 0.4, 0.3, 0.5, 0.6, 0.0, 0.0))
_PRIOR_STD = np.array((0.06, 0.1, 0.003, 0.15, 0.15, 0.35, 0.8, 0.4, 0.05, 0.05))
_WANDER = np.array((0.001, 0.003, 0.0001, 0.003, 0.003, 0.003, 0.01, 0.005, 0.003, 0.003)) ** 2 * STEP_S
# By the root of a second, of the tilt against a disturbance: vehicles may tilt against gusts by themselves.
_WANDER_OF_DISTURBANCE = 0.5 / GRAVITY_M_S2
_LAGGED_COST = 8.0  # of a first lag, in log likelihood
_DEAD_COST = 0.125  # likewise of each quarter step beside the usual dead time
_USUAL_DEAD = 3
_USUAL_INNER = 3
_NOISE_RAD = 0.006
_NOISE_OF_RATE_S = 0.012
_NOISE_OF_CHANGE_S2 = 0.003
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
_GAINS = (3, 4)  # B and K
_KNOWN_STEPS = 10
_KNOWN_SHARE = 0.3  # of a gain that is known, its standard deviation


@dataclass(frozen=True, slots=True)
class TiltLoop:
    """See the module.

    Attributes:
        rate_s: T.
        rate_drag_s2: D.
        rate_lag_s2: J.
        command: B, rad s/m.
        velocity: K, likewise.
        integral: I, rad/m.
        drag: H, 1/m.
        turn: C.
        dead_s: from a command to the demand that it makes.
        inner_s: likewise from a velocity.
        lag_s: of commands, before the loop; 0 if there is none.
        turning: whether that lag is in axes that turn with the heading.
    """

    rate_s: float
    rate_drag_s2: float
    rate_lag_s2: float
    command: float
    velocity: float
    integral: float
    drag: float
    turn: float
    dead_s: float
    inner_s: float
    lag_s: float
    turning: bool

    def demands(
        self, command_m_s: Plan, velocity_m_s: Plan, integrals_m: Plan, turn_rad_s: float
    ) -> tuple[float, float]:
        """The demands forward and to the left, rad."""
        forward, left = (
            self.command * command - self.velocity * v + self.integral * integral + self.drag_tilt(v)
            for command, v, integral in zip(command_m_s, velocity_m_s, integrals_m, strict=True)
        )
        turn = self.turn * turn_rad_s / GRAVITY_M_S2
        return forward - turn * velocity_m_s[1], left + turn * velocity_m_s[0]

    def drag_tilt(self, velocity_m_s: float) -> float:
        """The part of a demand that compensates drag, rad."""
        return self.drag * velocity_m_s * abs(velocity_m_s) / GRAVITY_M_S2

    def followed(
        self, tilts_rad: Plan, rates_rad_s: Plan, demands_rad: Plan, turn_rad_s: float, step_s: float
    ) -> tuple[Plan, Plan]:
        """The tilts and rates a while later, by demands: the roots of the module's equation for the rates."""
        rates, held_s = [], self.rate_lag_s2 / step_s
        for tilt, rate, demand in zip(tilts_rad, rates_rad_s, demands_rad, strict=True):
            off, lag_s = demand - tilt + held_s * rate, step_s + self.rate_s + held_s
            size = off / lag_s
            if self.rate_drag_s2 > 1e-6:
                root = sqrt(lag_s * lag_s + 4.0 * self.rate_drag_s2 * abs(off))
                size = copysign((root - lag_s) / (2.0 * self.rate_drag_s2), off)
            rates.append(size)
        forward, left = tilts_rad
        ahead = (
            forward + step_s * (rates[0] + turn_rad_s * cos(forward) * sin(left)) / cos(left),
            left + step_s * (rates[1] - turn_rad_s * sin(forward)),
        )
        return ahead, (rates[0], rates[1])

    def lead(self, rate_rad_s: float, change_rad_s2: float) -> float:
        """By how much a demand must be ahead of the tilt when the body turns about its axis."""
        drag = self.rate_drag_s2 * rate_rad_s * abs(rate_rad_s)
        return self.rate_s * rate_rad_s + drag + self.rate_lag_s2 * change_rad_s2


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


@dataclass(frozen=True, slots=True)
class _StepMeans:
    """What is known of the motion over a step, by means.

    Attributes:
        rows: what the coefficients are multiplied with, for both axes, shape (2, candidates, states); J's is
            known a step later.
        tilts_rad: forward and to the left.
        rates_rad_s: of the body.
    """

    rows: Array
    tilts_rad: Plan
    rates_rad_s: Plan


class _Candidate(NamedTuple):
    dead: int  # quarter steps
    inner: int  # likewise
    lag: int | None  # index of the first lag
    turning: bool

    @property
    def source(self) -> int:
        """Which of the filtered commands acts: the command, those in level axes, those in the arena's."""
        return 0 if self.lag is None else 1 + self.lag + (0 if self.turning else len(LAGS_S))


def _candidates() -> list[_Candidate]:
    plain = [
        _Candidate(dead, inner, None, True)
        for dead in DEAD_QUARTERS
        for inner in sorted({*INNER_QUARTERS, dead})
        if inner == _USUAL_INNER or inner <= dead <= _LONGEST_INNER
    ]
    lagged = [
        _Candidate(dead, _USUAL_INNER, lag, turning)
        for lag in range(len(LAGS_S))
        for dead in LAGGED_DEAD_QUARTERS
        for turning in (True, False)
    ]
    return plain + lagged


def _between(quarters: list[int]) -> tuple[Array, Array]:
    """For times ago, the step from the end of a list, and the share of the one before it, as a column."""
    steps, rest = np.divmod(np.array(quarters), 4)
    return -1 - steps, 0.25 * rest[:, None]


class TiltLoopEstimate:
    """Estimates the loop of the vehicle that is flown; call `update` once a tick.

    Attributes:
        updates: from how many steps it has learnt.
        known: the gains have been identified; it stays so.
        turn_rad_s: rate of the heading over the last step.
    """

    def __init__(self) -> None:
        self.updates = 0
        self.known = False
        self.turn_rad_s = 0.0
        self._all = _candidates()
        self._chosen = self._all.index(_Candidate(_USUAL_DEAD, _USUAL_INNER, None, True))
        count = len(self._all)
        self._x = np.tile(_PRIOR, (count, 1))
        self._p = np.tile(np.diag(_PRIOR_STD**2), (count, 1, 1))
        self._scores = np.array(
            [
                -_DEAD_COST * abs(each.dead - _USUAL_DEAD) - (0.0 if each.lag is None else _LAGGED_COST)
                for each in self._all
            ]
        )
        self._kept = np.array([exp(-STEP_S / lag_s) for lag_s in LAGS_S])[:, None]
        self._index()
        self.restart()

    def _index(self) -> None:
        """Make what depends on which candidates there are."""
        self._dead = _between([each.dead for each in self._all])
        self._inner = _between([each.inner for each in self._all])
        self._source = np.array([each.source for each in self._all])
        self._has_lags = any(each.lag is not None for each in self._all)
        self._in_arena = np.array([not each.turning for each in self._all])
        self._loop: TiltLoop | None = None

    def restart(self) -> None:
        """Forget the motion, but not the loop: its integrals may be any."""
        self._lagged = np.zeros((2 * len(LAGS_S), 2))
        self._commands: deque[Array] = deque(maxlen=_LONGEST)
        self._velocities: deque[Plan] = deque(maxlen=_LONGEST_INNER // 4 + 3)
        self._turns: deque[float] = deque(maxlen=_LONGEST_INNER // 4 + 2)
        self._tilts: deque[Plan] = deque(maxlen=2)
        self._steps: tuple[_StepMeans, ...] = ()
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
            rate, rate_drag, rate_lag, command, velocity, integral, drag, turn, _, _ = self._x[
                self._chosen
            ].tolist()
            self._loop = TiltLoop(
                rate_s=max(rate, 0.0),
                rate_drag_s2=max(rate_drag, 0.0),
                rate_lag_s2=max(rate_lag, 0.0),
                command=max(command, _LEAST_COMMAND),
                velocity=velocity,
                integral=max(integral, 0.0),
                drag=drag,
                turn=turn,
                dead_s=each.dead * QUARTER_S,
                inner_s=each.inner * QUARTER_S,
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
        """The integrals, by the last state."""
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

    def acting_m_s(self, from_s: float, to_s: float, yaw_rad: float) -> Plan:
        """The mean command that acts on the loop between two times from the last state on.

        The last command is taken to hold on. Level axes at a heading.
        """
        each, commands = self._all[self._chosen], self._commands
        if not commands:
            return 0.0, 0.0
        x = y = 0.0
        begin = from_s - each.dead * QUARTER_S
        end = to_s - each.dead * QUARTER_S
        at = begin
        while at < end - 1e-9:
            ago = min(max(-floor(at / STEP_S + 1e-9), 1), len(commands))
            until = end if ago == 1 else min(end, (1 - ago) * STEP_S)
            until = until if until > at else end  # before all commands
            cx, cy = commands[-ago][each.source]
            x, y, at = x + (until - at) * float(cx), y + (until - at) * float(cy), until
        x, y = x / (end - begin), y / (end - begin)
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
        disturbed_square: float = 0.0,
    ) -> None:
        """Add a step.

        Args:
            state: of the drone now.
            velocity_level_m_s: now, forward and to the left.
            sent: the command that it has had since the last step.
            turn_rad_s: rate of the heading since then.
            learns: the motion is in the air, and a step long.
            chooses: another candidate may be chosen.
            disturbed_square: mean square of what has disturbed the motion in plan, m^2/s^4.
        """
        self._velocities.append(velocity_level_m_s)
        self._turns.append(turn_rad_s)
        self._tilts.append(tilts_of(state))
        self.turn_rad_s = turn_rad_s
        yaw_rad = state.yaw - turn_rad_s * STEP_S
        self._filter(sent, yaw_rad)
        if len(self._commands) < _LONGEST:
            return
        (f0, l0), (f1, l1) = self._tilts
        tilts = (0.5 * (f0 + f1), 0.5 * (l0 + l1))
        rates = body_rates(tilts, ((f1 - f0) / STEP_S, (l1 - l0) / STEP_S), turn_rad_s)
        step = _StepMeans(self._rows(rates, yaw_rad + 0.5 * turn_rad_s * STEP_S), tilts, rates)
        before, self._steps = self._steps, (*self._steps[-1:], step)
        if len(before) < 2:
            return
        middle = before[1]
        for axis in (0, 1):
            middle.rows[axis, :, 2] = (before[0].rates_rad_s[axis] - rates[axis]) / (2.0 * STEP_S)
        if self._is_limited(middle):
            self._p[:, _TRIMS, _TRIMS] += _HELD_RAD**2  # integrals may be held at limits
            return
        if not learns:
            return
        self._learn(middle, disturbed_square)
        self._loop = None
        self.updates += 1
        if chooses and self.updates % _CHOOSE_STEPS == 0:
            self._choose()
        self.known = self.known or self._is_known()

    def _is_known(self) -> bool:
        """Whether the gains of commands and velocities are known well enough."""
        if self.updates < _KNOWN_STEPS:
            return False
        x, p = self._x[self._chosen], self._p[self._chosen]
        gains = [(float(x[i]), sqrt(float(p[i, i]))) for i in _GAINS]
        return x[_GAINS[0]] > _LEAST_COMMAND and all(std < _KNOWN_SHARE * gain for gain, std in gains)

    @property
    def rates_rad_s(self) -> Plan:
        """Those of the body over the last step."""
        return self._steps[-1].rates_rad_s if self._steps else (0.0, 0.0)

    def _is_limited(self, step: _StepMeans) -> bool:
        """Whether a vehicle's limits may have acted: then its tilts show less of the loop."""
        loop, x = self.loop, self._x[self._chosen]
        asked, made = [], []
        for row, tilt, rate in zip(step.rows, step.tilts_rad, step.rates_rad_s, strict=True):
            lead = loop.lead(rate, -float(row[self._chosen, 2]))
            asked.append(float(row[self._chosen] @ x) + lead)
            made.append(tilt + lead)
        return (
            max(hypot(*asked), hypot(*made)) > MAX_TILT_RAD
            or max(map(abs, step.rates_rad_s)) > MAX_RATE_RAD_S
            or max(abs(demand - tilt) for demand, tilt in zip(asked, step.tilts_rad, strict=True))
            > MAX_ERROR_RAD
        )

    def _filter(self, sent: VelocityFluCommand, yaw_rad: float) -> None:
        """Let the first lags follow a command given at a heading; their means over the step act."""
        level = (sent.forward_m_s, sent.left_m_s)
        if not self._has_lags:
            self._commands.append(np.array((level,)))
            return
        given = np.empty((2, 1, 2))
        given[0], given[1] = level, turned(*level, yaw_rad)
        before = self._lagged
        now = given + self._kept * (before.reshape(2, -1, 2) - given)
        self._lagged = now.reshape(-1, 2)
        self._commands.append(np.concatenate((given[0], 0.5 * (before + self._lagged))))

    def _rows(self, rates: Plan, yaw_rad: float) -> Array:
        """What the coefficients are multiplied with over the last step: (2, candidates, states)."""
        commands = np.array(self._commands)
        last, share = self._dead
        acting = (1.0 - share) * commands[last, self._source] + share * commands[last - 1, self._source]
        if self._has_lags:
            c, s = cos(yaw_rad), sin(yaw_rad)
            acting = np.where(self._in_arena[:, None], acting @ np.array(((c, -s), (s, c))), acting)
        past = np.array(self._velocities)
        means = 0.5 * (past[1:] + past[:-1])
        last, share = self._inner
        velocity = (1.0 - share) * means[last] + share * means[last - 1]
        turns = np.array(self._turns)
        turn = ((1.0 - share[:, 0]) * turns[last] + share[:, 0] * turns[last - 1]) / GRAVITY_M_S2
        off = STEP_S * (acting - velocity)
        rows = np.zeros((2, len(self._all), _STATES))
        rows[:, :, :2] = [[(-rate, -rate * abs(rate))] for rate in rates]
        rows[:, :, 3] = acting.T
        rows[:, :, 4] = -velocity.T
        rows[:, :, 5] = (self._integrals + 0.5 * off).T
        rows[:, :, 6] = (velocity * np.abs(velocity)).T / GRAVITY_M_S2
        rows[0, :, 7], rows[1, :, 7] = -turn * velocity[:, 1], turn * velocity[:, 0]
        rows[0, :, _COEFFICIENTS] = rows[1, :, _COEFFICIENTS + 1] = 1.0
        self._integrals += off
        return rows

    def _learn(self, step: _StepMeans, disturbed_square: float) -> None:
        """Update all filters, and the candidates' log likelihoods."""
        x, p = self._x, self._p
        diagonal = p.reshape(len(p), -1)[:, :: _STATES + 1]
        diagonal += _WANDER
        diagonal[:, _COEFFICIENTS:] += np.square(_WANDER_OF_REST * np.array(self._rest_rad))
        diagonal[:, _COEFFICIENTS:] += _WANDER_OF_DISTURBANCE**2 * STEP_S * disturbed_square
        self._scores *= _MEMORY
        for axis, (row, tilt, rate) in enumerate(
            zip(step.rows, step.tilts_rad, step.rates_rad_s, strict=True)
        ):
            change = float(abs(row[0, 2]))
            noise = (_NOISE_RAD + _NOISE_OF_RATE_S * abs(rate) + _NOISE_OF_CHANGE_S2 * change) ** 2
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
            if all(each.lag is None for each in self._all):
                self._commands = deque((each[:1] for each in self._commands), maxlen=_LONGEST)
            self._steps = tuple(replace(step, rows=step.rows[:, stay]) for step in self._steps)
        self._index()
