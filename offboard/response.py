"""How late a vehicle answers commands: estimated in flight, and what it will do with those it has got.

A vehicle's velocity follows commands after a dead time, with a lag of first order. Many pairs of dead time
and lag are tried at once: what each predicts for the change of velocity over a second is compared with the
change that telemetry shows. A change, because a constant difference is wind or drag, not lateness. The same
filters predict the motion by the commands that are still on their way. In plan, a vehicle that answers late
may have a second lag, see `second_lag.py`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, pi, remainder

import numpy as np
from numpy.typing import NDArray

from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import DroneState, ResponsePrior, VelocityFluCommand
from offboard.second_lag import LAG_S as OWN_LAG_S
from offboard.second_lag import SecondLag
from offboard.slow_share import SlowShare

Array = NDArray[np.float64]

STEP_S = 0.05
DEAD_STEPS = (1, 3, 5, 7, 9, 11, 13)
LAGS_S = (0.05, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3)
TAKE_OFF_STEPS = 30  # after which the thrust is that of flight
_COMPARED_STEPS = 2  # between two comparisons, unless the vehicle is known to be late
_WINDOW = 20  # steps over which a change of velocity is compared
_KEPT = max(DEAD_STEPS) + _WINDOW + 1
_MEMORY_S = 40.0
_MAX_STEPS = 8  # after a longer gap everything but the estimate begins again
_EXPECTED = ((3, 2), (1, 0), (1, 0))  # indices of dead time and lag, before there is evidence
_EXPECTED_LATE = ((1, 2), (0, 1), (0, 0))  # likewise, of a PX4 with our parameters
_MIN_ENERGY = (0.3, 0.2, 0.2)  # sums of squared changes (m/s, m/s, rad/s) that are evidence
_BETTER = 0.7  # share of the present pair's error that another one must reach
_LITTLE_ENERGY = 0.03  # is enough where a vehicle is known to be late, and a pair is
_MUCH_BETTER = 0.3  # by this share
_CLEARLY_BETTER = 0.5  # likewise for axes that turn: those of vehicles that answer late seldom do
_LATE_S = (0.65, 0.36, 0.31)  # level, climb, yaw: beyond this in all a vehicle answers late
_LATE_SHARE = 0.4  # of the error of the best pair that is not late: a late one must reach it
_UNEXPLAINED = 0.06  # share of the changes that this best pair must leave unexplained
_KNOWN_STEPS = 120  # in the air, until a late vehicle's model is known well enough to be kept near gates
_SURE = 3  # choices in a row after which a vehicle is known to be late
_DISTURBANCE_S = 0.4  # time constant of the estimate of what commands do not explain
_LEADS = np.array((0.0, 0.0, 0.7))  # shares by which its change is expected to go on: heights wander slowly
_X, _Y, _FORWARD, _LEFT, _UP, _TURN = range(6)
_GROUPS = ((_X, _Y), (_FORWARD, _LEFT), (_UP,), (_TURN,))
_MEMBERS = np.array([[float(axis in group) for group in _GROUPS] for axis in range(6)])

_TIMES_S = np.array([dead * STEP_S + lag_s for dead in DEAD_STEPS for lag_s in LAGS_S])
_PROMPT = [limit_s >= _TIMES_S for limit_s in _LATE_S]  # pairs of each channel that are not late


@dataclass(frozen=True, slots=True)
class Response:
    """How a vehicle's velocity follows commands: after a dead time, with a lag of first order.

    The defaults are the simulated drone's.

    Attributes:
        turning: its velocity follows in level axes that turn with its heading, so that a turn at speed needs
            commands ahead; else in axes that do not turn.
        late: so late that the motion must be predicted; or it is not the simulated drone, whose loops can be
            inverted.
        own_lag_s: a second lag in plan, after the first, in axes that turn; 0 if there is none.
        share: of a command in plan that the velocity follows so; it follows the rest only slowly.
    """

    level_dead_s: float = 0.075
    level_tilt_s: float = 0.15
    level_lag_s: float = 0.3
    climb_dead_s: float = 0.05
    climb_lag_s: float = 0.05
    yaw_dead_s: float = 0.05
    yaw_lag_s: float = 0.05
    turning: bool = True
    late: bool = False
    own_lag_s: float = 0.0
    share: float = 1.0

    @property
    def level_s(self) -> float:
        """Dead time and lags together, in plan; longer where only a share of a command is followed soon."""
        return self.level_dead_s + self.level_tilt_s + self.level_lags_s / self.share

    @property
    def level_lags_s(self) -> float:
        """Both lags together, in plan."""
        return self.level_lag_s + self.own_lag_s


@dataclass(frozen=True, slots=True)
class Prediction:
    """What the vehicle will do by the commands that it has got, until the next one has an effect.

    Level, climb and yaw have different dead times, and so different times of prediction.

    Attributes:
        moved_m: from its present position, arena axes.
        velocity_m_s: then, arena axes.
        disturbance_m_s: part of the velocity that commands do not explain.
        turned_rad: from its present heading.
        yaw_rate_rad_s: then.
        acceleration_m_s2: then, in plan, arena axes; zero without a second lag.
        slow_m_s: part of the velocity in plan that follows commands only slowly, a lag later; arena axes.
    """

    moved_m: Vec3
    velocity_m_s: Vec3
    disturbance_m_s: Vec3
    turned_rad: float
    yaw_rate_rad_s: float
    acceleration_m_s2: tuple[float, float] = (0.0, 0.0)
    slow_m_s: tuple[float, float] = (0.0, 0.0)


class ResponseEstimate:
    """Estimates the response of the vehicle that is flown; call `update` once a tick.

    Attributes:
        response: as known now.
    """

    def __init__(self) -> None:
        self._prior = ResponsePrior.OWN  # until the first state
        self._stays_late = False  # whatever the evidence: its loops cannot be inverted
        self._chosen = list(_EXPECTED)
        self._turning = True
        shape = (len(DEAD_STEPS), len(LAGS_S), len(_GROUPS))
        self._errors = np.zeros(shape)
        self._energies = np.zeros(len(_GROUPS))
        self._late_choices = 0  # in a row
        self._late_steps = 0  # in the air, since the vehicle counts as late
        self._second = SecondLag(shape[:2], STEP_S, _WINDOW)
        self._slow = SlowShare(shape[:2], STEP_S, _WINDOW)
        self._kept = np.array([exp(-STEP_S / lag_s) for lag_s in LAGS_S])[:, None]
        self.response = Response()
        self._restart()

    def _restart(self) -> None:
        self._last_s: float | None = None
        self._yaw = 0.0
        self._outputs = np.zeros((len(LAGS_S), 6))
        self._past: deque[Array] = deque(maxlen=_KEPT)
        self._changes: deque[Array] = deque(maxlen=max(DEAD_STEPS) + 1)  # of the outputs, over the window
        self._measured: deque[Array] = deque(maxlen=_WINDOW + 1)
        self._second.restart()
        self._slow.restart()
        self._airborne_steps = self._uncompared = 0
        self._disturbance = [0.0, 0.0, 0.0]  # arena axes, m/s
        self._disturbance_rate = [0.0, 0.0, 0.0]

    def _begin_with(self, prior: ResponsePrior) -> None:
        """Expect what is known of the vehicle before there is evidence."""
        self._prior = prior
        self._stays_late = prior is not ResponsePrior.OWN
        if prior is ResponsePrior.LATE:
            self._chosen, self._turning = list(_EXPECTED_LATE), False
            self.response = self._as_response()

    def update(self, state: DroneState, sent: VelocityFluCommand | None, *, near_gate: bool = False) -> None:
        """Add a tick.

        Args:
            state: of the drone now.
            sent: the command that it has had since the last tick; None if it had none, or it is not known.
            near_gate: another model would disturb the flight now: one that is known for some time is kept.
        """
        if state.response_prior is not self._prior:
            self._begin_with(state.response_prior)
        if self._stays_late and not self.response.late:
            self.response = self._as_response()
        now_s = state.time_us * 1e-6
        if sent is None or self._last_s is None or not 0.0 <= now_s - self._last_s <= _MAX_STEPS * STEP_S:
            self._restart()
            self._last_s, self._yaw = now_s, state.yaw
            return
        steps = round((now_s - self._last_s) / STEP_S)
        if steps == 0:
            return
        turn_rate = remainder(state.yaw - self._yaw, 2 * pi) / (now_s - self._last_s)
        self._last_s += steps * STEP_S
        self._last_s += 0.2 * (now_s - self._last_s)
        commanded = np.array(_in_all_axes(sent, self._yaw))
        moves = _measured(state, turn_rate)
        measured = np.array(moves)
        self._yaw = state.yaw
        is_known = self._late_steps >= _KNOWN_STEPS
        compared = False
        for _ in range(steps):
            self._outputs = commanded + self._kept * (self._outputs - commanded)
            self._past.append(self._outputs)
            if len(self._past) > _WINDOW:
                self._changes.append(self._outputs - self._past[-1 - _WINDOW])
            self._measured.append(measured)
            if self.response.late:
                self._second.update(self._first_lags(), measured[[_X, _Y]], self._yaw)
                self._slow.update(commanded[[_X, _Y]], measured[[_X, _Y]])
                self._late_steps += 0 if state.landed else 1
            self._airborne_steps = 0 if state.landed else self._airborne_steps + 1
            if self._airborne_steps > TAKE_OFF_STEPS:
                self._uncompared += 1
                # Windows that begin a step later hardly differ; only of a late vehicle all are needed.
                if self.response.late or self._uncompared == _COMPARED_STEPS:
                    self._compare(self._uncompared * STEP_S)
                    self._uncompared = 0
                    compared = True
        if compared and not (near_gate and is_known):
            self._choose()
        self._observe_disturbance((moves[_X], moves[_Y], moves[_UP]), steps)

    def _compare(self, period_s: float) -> None:
        """Add the errors of all predictions of the change over the window; they count for a period."""
        if len(self._past) < _KEPT:
            return
        change = self._measured[-1] - self._measured[0]
        fade = 1.0 - period_s / _MEMORY_S
        self._errors *= fade
        self._energies *= fade
        errors = np.concatenate([self._changes[-1 - dead] for dead in DEAD_STEPS]) - change
        squares = ((errors * errors) @ _MEMBERS).reshape(self._errors.shape)
        self._errors += squares * period_s
        self._energies += ((change * change) @ _MEMBERS) * period_s
        if self.response.late:
            one = float(squares[(*self._chosen[0], 1 if self._turning else 0)])
            self._second.compare(change[[_X, _Y]], one)
            changes = np.array([self._changes[-1 - dead][:, [_X, _Y]] for dead in DEAD_STEPS])
            self._slow.compare(changes, change[[_X, _Y]])
        else:
            self._second.restart()
            self._slow.restart()

    def _first_lags(self) -> Array:
        """What all pairs make of the commands by now, in axes that do not turn: dead times, lags, x and y."""
        past = self._past
        return np.array([past[max(len(past) - 1 - dead, 0)][:, [_X, _Y]] for dead in DEAD_STEPS])

    def _choose(self) -> None:
        """Take pairs, and axes, that explain what was measured clearly better than the present ones."""
        before = self._choices()
        if self.response.late:
            self._second.choose()
            self._slow.choose(self._second.least_error)
        errors = self._errors.reshape(-1, len(_GROUPS))
        pairs: list[int] = errors.argmin(axis=0).tolist()
        least = [float(errors[pair, group]) for group, pair in enumerate(pairs)]
        best = [divmod(pair, len(LAGS_S)) for pair in pairs]
        energies: list[float] = self._energies.tolist()
        if energies[0] > (_LITTLE_ENERGY if self.response.late else _MIN_ENERGY[0]):
            dead, lag = best[0]
            late = DEAD_STEPS[dead] * STEP_S + LAGS_S[lag] > _LATE_S[0]
            self._turning = least[1] < (_CLEARLY_BETTER if late else 1.0) * least[0]
        for channel, group in enumerate((1 if self._turning else 0, 2, 3)):
            present = float(self._errors[(*self._chosen[channel], group)])
            little = self.response.late and least[group] < _MUCH_BETTER * present
            if energies[group] < (_LITTLE_ENERGY if little else _MIN_ENERGY[channel]):
                continue
            if least[group] < _BETTER * present:
                self._chosen[channel] = best[group]
        seems_late = self._seems_late(errors)
        self._late_choices = self._late_choices + 1 if seems_late else 0
        is_late = seems_late and (self.response.late or self._late_choices >= _SURE)
        is_late = is_late or self._stays_late
        if is_late != self.response.late or self._choices() != before:
            self.response = self._as_response() if is_late else Response()

    def _choices(self) -> tuple[object, ...]:
        """All that the response is made from."""
        return (self._turning, *self._chosen, self._second.chosen, self._slow.chosen, self._slow.share)

    def _seems_late(self, errors: Array) -> bool:
        """Whether a pair chosen is that of a late vehicle, and no pair that is not late fits nearly as well.

        A drone that is flown at its limits does not follow as a lag would: then many pairs fit about as well.
        """
        for channel, group in enumerate((1 if self._turning else 0, 2, 3)):
            dead, lag = self._chosen[channel]
            if DEAD_STEPS[dead] * STEP_S + LAGS_S[lag] <= _LATE_S[channel]:
                continue
            shorter = float(errors[_PROMPT[channel]][:, (0, 1) if channel == 0 else group].min())
            unexplained = shorter > _UNEXPLAINED * float(self._energies[group])
            if self.response.late or (unexplained and float(errors[:, group].min()) < _LATE_SHARE * shorter):
                return True
        return False

    def _as_response(self) -> Response:
        pairs = [(DEAD_STEPS[dead] * STEP_S, LAGS_S[lag]) for dead, lag in self._chosen]
        (level_dead, level_lag), (climb_dead, climb_lag), (yaw_dead, yaw_lag) = pairs
        follows = Response(
            level_dead_s=level_dead,
            level_tilt_s=0.0,
            level_lag_s=level_lag,
            climb_dead_s=climb_dead,
            climb_lag_s=climb_lag,
            yaw_dead_s=yaw_dead,
            yaw_lag_s=yaw_lag,
            turning=self._turning,
            late=True,
        )
        other = self._slow.chosen or self._second.chosen
        if other is None:
            return follows
        dead, lag = other
        follows = replace(
            follows, level_dead_s=DEAD_STEPS[dead] * STEP_S, level_lag_s=LAGS_S[lag], turning=False
        )
        if self._slow.chosen is not None:
            return replace(follows, share=self._slow.share)
        return replace(follows, own_lag_s=OWN_LAG_S)

    def _observe_disturbance(self, velocity_m_s: Vec3, steps: int) -> None:
        """Filter what the commands do not explain of the velocity now."""
        model = self._model_velocity(lambda dead: self._past[max(len(self._past) - 1 - dead, 0)])
        if self._second.chosen is not None and self._slow.chosen is None:
            model = (*self._second.velocity(self._second.chosen), model[2])
        time_s = steps * STEP_S
        share = 1.0 - exp(-time_s / _DISTURBANCE_S)
        for axis, (measured, explained) in enumerate(zip(velocity_m_s, model, strict=True)):
            before, rate = self._disturbance[axis], self._disturbance_rate[axis]
            now = before + share * (measured - explained - before)
            self._disturbance[axis] = now
            self._disturbance_rate[axis] = rate + share * ((now - before) / time_s - rate)

    def _model_velocity(self, output: Callable[[int], Array]) -> Vec3:
        """In arena axes, of the pairs chosen; `output` gives all filters' by the dead time in steps."""
        (level_dead, level_lag), (climb_dead, climb_lag), _ = self._chosen
        slow = self._slow
        if slow.chosen is not None:
            level_dead, level_lag = slow.chosen
        x, y, forward, left, _, _ = output(DEAD_STEPS[level_dead])[level_lag].tolist()
        up = float(output(DEAD_STEPS[climb_dead])[climb_lag, _UP])
        if slow.chosen is not None:
            rest_x, rest_y = slow.rest_m_s
            return (slow.share * x + rest_x, slow.share * y + rest_y, up)
        if not self._turning:
            return (x, y, up)
        return (*turned(forward, left, self._yaw), up)

    def predict(self) -> Prediction:
        """What the vehicle will do by the commands of all ticks so far."""
        past = list(self._past) or [self._outputs]
        (level_dead, level_lag), (climb_dead, climb_lag), (yaw_dead, yaw_lag) = self._chosen
        moved = np.array(self._model_velocity(lambda dead: np.sum(past[-dead:], axis=0) * STEP_S))
        velocity = np.array(self._model_velocity(lambda dead: past[-1]))
        turns = [float(row[yaw_lag, _TURN]) * STEP_S for row in past[-DEAD_STEPS[yaw_dead] :]]
        acceleration, rest, second, own_lag_s = (0.0, 0.0), (0.0, 0.0), self._second.chosen, 0.0
        if self._slow.chosen is not None:
            level_dead, level_lag = self._slow.chosen
            rest = self._slow.rest_in(LAGS_S[level_lag])
            # The sum above contains the slow part once, as if for a second.
            moved[:2] += (DEAD_STEPS[level_dead] * STEP_S - 1.0) * self._slow.rest_m_s
        elif second is not None:
            level_dead, level_lag = second
            own_lag_s = OWN_LAG_S
            commanded = np.array([row[level_lag, [_X, _Y]] for row in past[-DEAD_STEPS[level_dead] :]])
            all_turns = (turns + [turns[-1]] * len(commanded))[: len(commanded)]
            moved[:2], velocity[:2], acceleration = self._second.predict(
                second, commanded, self._yaw, all_turns
            )
        dead_s = np.array([DEAD_STEPS[d] * STEP_S for d in (level_dead, level_dead, climb_dead)])
        present, change = np.array(self._disturbance), np.array(self._disturbance_rate)
        moved += dead_s * present
        velocity += present
        lag_s = LAGS_S[level_lag] + own_lag_s
        ahead_s = dead_s + np.array((lag_s, lag_s, LAGS_S[climb_lag]))
        disturbance = present + (ahead_s + _DISTURBANCE_S) * _LEADS * change
        rate = float(past[-1][yaw_lag, _TURN])
        return Prediction(
            _vector(moved), _vector(velocity), _vector(disturbance), sum(turns), rate, acceleration, rest
        )


def _in_all_axes(command: VelocityFluCommand, yaw_rad: float) -> tuple[float, ...]:
    forward, left = command.forward_m_s, command.left_m_s
    return (*turned(forward, left, yaw_rad), forward, left, command.up_m_s, command.yaw_rate_rad_s)


def _measured(state: DroneState, turn_rate_rad_s: float) -> tuple[float, ...]:
    x, y, up = state.velocity_arena_m_s
    return (x, y, *turned(x, y, -state.yaw), up, turn_rate_rad_s)


def _vector(values: Array) -> Vec3:
    x, y, z = values.tolist()
    return (x, y, z)
