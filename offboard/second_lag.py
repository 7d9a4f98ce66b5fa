"""A vehicle whose commands become late in axes that do not turn, and which follows what comes of them itself.

A delay before a vehicle's own velocity control, which works in axes that turn with the heading, makes such a
vehicle. One lag in either axes predicts it half as well.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import cos, exp, sin

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_Vec2 = tuple[float, float]
LAG_S = 0.4  # of the vehicle's own control: the simulated drone's
_BETTER = 0.7  # share of the present error that another model must reach
_MEMORY_S = 40.0
_MIN_ENERGY = 0.3  # sum of squared changes (m/s) that is evidence
_LITTLE_ENERGY = 0.03  # likewise where the error becomes
_MUCH_BETTER = 0.3  # less than this share


class SecondLag:
    """Tries many pairs of a dead time and a first lag; call `update` at every step.

    Args:
        shape: numbers of dead times and of lags.
        step_s: of time.
        window: steps over which a change of velocity is compared.

    Attributes:
        chosen: indices of the pair that explains the motion clearly better than one lag; None if none does.
    """

    def __init__(self, shape: tuple[int, int], step_s: float, window: int) -> None:
        self.chosen: tuple[int, int] | None = None
        self._step_s = step_s
        self._share = 1.0 - exp(-step_s / LAG_S)
        self._errors = np.zeros(shape)
        self._error_of_one_lag = 0.0
        self._energy = 0.0
        self._velocities: Array = np.zeros((*shape, 2))  # in axes that turn
        self._past: deque[Array] = deque(maxlen=window + 1)

    @property
    def least_error(self) -> float:
        """Squared, of the pair that is best; with that of one lag it fades."""
        return float(self._errors.min())

    def restart(self) -> None:
        """Forget all motion, but not what was learnt."""
        self._past.clear()

    def update(self, commanded: Array, measured: Array, yaw_rad: float) -> None:
        """Follow what the first lags make of the commands.

        Args:
            commanded: shape (dead times, lags, 2), arena axes.
            measured: velocity, arena axes, to begin with.
            yaw_rad: heading.
        """
        c, s = cos(yaw_rad), sin(yaw_rad)
        to_arena = np.array(((c, s), (-s, c)))
        if not self._past:
            self._velocities[:] = measured @ to_arena.T
        self._velocities += self._share * (commanded @ to_arena.T - self._velocities)
        self._past.append(self._velocities @ to_arena)

    def velocity(self, pair: tuple[int, int]) -> tuple[float, float]:
        """What the model of a pair says that the velocity is, arena axes."""
        x, y = self._past[-1][pair].tolist() if self._past else (0.0, 0.0)
        return x, y

    def predict(
        self, pair: tuple[int, int], commanded: Array, yaw_rad: float, turns_rad: Sequence[float]
    ) -> tuple[_Vec2, _Vec2, _Vec2]:
        """The motion by the commands that are on their way, by the model of a pair.

        Args:
            pair: indices of dead time and first lag.
            commanded: what the first lag makes of them, a row for each step, arena axes.
            yaw_rad: heading.
            turns_rad: by which the heading changes in each step.

        Returns:
            The way, and the velocity and acceleration at its end, arena axes.
        """
        forward, left = self._velocities[pair].tolist()
        x_m = y_m = x_m_s = y_m_s = ahead = aside = turn = 0.0
        for (x, y), turn in zip(commanded.tolist(), turns_rad, strict=True):
            yaw_rad += turn
            c, s = cos(yaw_rad), sin(yaw_rad)
            ahead, aside = c * x + s * y - forward, c * y - s * x - left
            forward, left = forward + self._share * ahead, left + self._share * aside
            x_m_s, y_m_s = c * forward - s * left, s * forward + c * left
            x_m, y_m = x_m + self._step_s * x_m_s, y_m + self._step_s * y_m_s
        c, s = cos(yaw_rad), sin(yaw_rad)
        change = (1.0 - self._share) / LAG_S
        ahead, aside, turn = change * ahead, change * aside, turn / self._step_s
        ax, ay = c * ahead - s * aside - turn * y_m_s, s * ahead + c * aside + turn * x_m_s
        return (x_m, y_m), (x_m_s, y_m_s), (ax, ay)

    def compare(self, change: Array, error_of_one_lag: float) -> None:
        """Compare the change over the window with the measured one.

        Args:
            change: of the measured velocity, arena axes.
            error_of_one_lag: squared, of the pair of one lag that is best.
        """
        past = self._past
        if len(past) != past.maxlen:
            return
        fade = 1.0 - self._step_s / _MEMORY_S
        squares = ((past[-1] - past[0] - change) ** 2).sum(axis=2)
        self._errors = fade * self._errors + squares
        self._error_of_one_lag = fade * self._error_of_one_lag + error_of_one_lag
        self._energy = fade * self._energy + float(change @ change) * self._step_s

    def choose(self) -> None:
        """Take a pair, or none, that explains what was measured clearly better than the present one."""
        dead, lag = divmod(int(self._errors.argmin()), self._errors.shape[1])
        least = float(self._errors[dead, lag])
        present = self._error_of_one_lag if self.chosen is None else float(self._errors[self.chosen])
        enough = _LITTLE_ENERGY if least < _MUCH_BETTER * present else _MIN_ENERGY
        if self._energy > enough and least < _BETTER * present:
            self.chosen = (dead, lag)
        elif self.chosen is not None and self._error_of_one_lag < _BETTER * present:
            self.chosen = None
