"""How late a vehicle's climb and turn follow commands, estimated in flight, and what it will do next.

Both follow commands after a dead time, with a lag of first order. Many pairs of dead time and lag are tried
at once: what each predicts for the change of a rate over a second is compared with the change that telemetry
shows. A change, because a constant difference is wind or drag, not lateness.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from offboard.response.tilt_loop import STEP_S

Array = NDArray[np.float64]

DEAD_STEPS = (1, 3, 5, 7, 9, 11, 13)
LAGS_S = (0.05, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3)
_WINDOW = 20  # steps over which a change is compared
_KEPT = max(DEAD_STEPS) + _WINDOW + 1
_MEMORY = 1.0 - STEP_S / 40.0
_MIN_ENERGY = 0.2  # sum of squared changes (m/s, rad/s) that is evidence
_BETTER = 0.7  # share of the present pair's error that another one must reach
_UNEXPLAINED = 0.08  # root mean square of the changes (m/s, rad/s) that other things than lateness make
_DISTURBANCE_S = 0.2  # time constant of the estimate of what commands do not explain
_WASHED_S = 0.4  # time constant with which a vehicle's integral takes over what a cause makes
_CAUSE_PRIOR = 0.3  # standard deviation of the rate by a unit of the cause
_CAUSE_NOISE = 0.07  # of the rate
_LEAD = 0.7  # share by which its change is expected to go on: heights wander slowly


@dataclass(frozen=True, slots=True)
class Coming:
    """What the vehicle will do by the commands that it has got, until the next one has an effect.

    Attributes:
        moved: from its present height, m, or heading, rad.
        rate: then.
        disturbance: part of the rate that commands do not explain.
    """

    moved: float
    rate: float
    disturbance: float


class RateResponse:
    """Climb or turn of the vehicle that is flown; call `update` once a step.

    Attributes:
        dead_s: before a command has an effect.
        lag_s: of first order, after that.
    """

    def __init__(self) -> None:
        self.dead_s, self.lag_s = DEAD_STEPS[0] * STEP_S, LAGS_S[0]
        self._chosen = (0, 0)
        self._kept = np.array([exp(-STEP_S / lag_s) for lag_s in LAGS_S])
        self._errors = np.zeros((len(DEAD_STEPS), len(LAGS_S)))
        self._energy = self._time_s = 0.0
        self._by_cause, self._by_cause_variance = 0.0, _CAUSE_PRIOR**2
        self.restart()

    def restart(self) -> None:
        """Forget the motion, but not what was learnt."""
        self._outputs: Array = np.zeros(len(LAGS_S))
        self._past: deque[Array] = deque(maxlen=_KEPT)
        self._changes: deque[Array] = deque(maxlen=max(DEAD_STEPS) + 1)  # of the outputs, over the window
        self._measured: deque[float] = deque(maxlen=_WINDOW + 1)
        self._disturbance = self._disturbance_rate = 0.0
        self._cause = self._slow_cause = 0.0

    def update(
        self, command: float, measured: float, *, learns: bool, chooses: bool, cause: float = 0.0
    ) -> None:
        """Add a step.

        Args:
            command: that was flown during the step.
            measured: rate at its end.
            learns: the vehicle is in the air.
            chooses: another pair may be chosen.
            cause: what disturbs the rate when it changes.
        """
        self._outputs = command + self._kept * (self._outputs - command)
        self._past.append(self._outputs)
        self._measured.append(measured)
        if len(self._past) > _WINDOW:
            self._changes.append(self._outputs - self._past[-1 - _WINDOW])
        if learns and len(self._past) == _KEPT:
            change = self._measured[-1] - self._measured[0]
            errors = np.array([self._changes[-1 - dead] for dead in DEAD_STEPS]) - change
            self._errors = _MEMORY * self._errors + STEP_S * errors * errors
            self._energy = _MEMORY * self._energy + STEP_S * change * change
            self._time_s = _MEMORY * self._time_s + STEP_S
            if chooses:
                self._choose()
        self._slow_cause += (1.0 - exp(-STEP_S / _WASHED_S)) * (cause - self._slow_cause)
        self._cause = cause
        self._observe_disturbance(measured, learns=learns)

    def _choose(self) -> None:
        """Take a pair that explains what was measured clearly better than the present one."""
        dead, lag = divmod(int(self._errors.argmin()), len(LAGS_S))
        least, present = float(self._errors[dead, lag]), float(self._errors[self._chosen])
        if self._energy > _MIN_ENERGY and least < _BETTER * (present - _UNEXPLAINED**2 * self._time_s):
            self._chosen = (dead, lag)
            self.dead_s, self.lag_s = DEAD_STEPS[dead] * STEP_S, LAGS_S[lag]

    def _observe_disturbance(self, measured: float, *, learns: bool) -> None:
        """Filter what the commands do not explain of the rate now."""
        dead, lag = self._chosen
        made = float(self._past[max(len(self._past) - 1 - DEAD_STEPS[dead], 0)][lag])
        washed = self._cause - self._slow_cause
        share, rest = 1.0 - exp(-STEP_S / _DISTURBANCE_S), measured - made - self._disturbance
        rest -= self._by_cause * washed
        if learns:  # a Kalman filter of one state
            variance = self._by_cause_variance
            gain = variance * washed / (washed * washed * variance + _CAUSE_NOISE**2)
            self._by_cause += gain * rest
            self._by_cause_variance = variance * (1.0 - gain * washed)
        change = share * rest
        self._disturbance += change
        self._disturbance_rate += share * (change / STEP_S - self._disturbance_rate)

    def predict(self, cause: float | None = None) -> Coming:
        """What the vehicle will do by the commands so far; the cause is that of then, else that of now."""
        lag = self._chosen[1]
        made = [float(outputs[lag]) for outputs in list(self._past)[-DEAD_STEPS[self._chosen[0]] :]] or [0.0]
        ahead_s = self.dead_s + self.lag_s + _DISTURBANCE_S
        by_cause = self._by_cause * ((self._cause if cause is None else cause) - self._slow_cause)
        present = self._disturbance + by_cause
        return Coming(
            sum(made) * STEP_S + self.dead_s * present,
            made[-1] + present,
            present + ahead_s * _LEAD * self._disturbance_rate,
        )
