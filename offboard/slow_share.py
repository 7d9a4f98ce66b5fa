"""A vehicle whose velocity follows a share of each command soon, and the rest only slowly.

A velocity loop with a proportional and an integral part, such as PX4's, makes such a vehicle where there is
drag: the proportional part balances drag at a share of the commanded velocity, and only the integral makes up
the rest. After a leg the integral is still there, and pushes the vehicle on. With gains P and I and drag d,
all by mass, the share is about P / (P + d), and the rest follows with a time constant of about (P + d) / I.
For PX4's default gains (1.8 and 0.4) and a drag of 0.3 to 1 1/s the share is 0.86 to 0.64, the time 5 to 7 s.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLOW_S = 6.0  # time constant of the rest
_MIN_SHARE = 0.5
_SHARE_STEP = 0.05  # of shares that are told apart
_MAX_SHARE = 0.9  # with more, nothing but one lag is needed
_BETTER_THAN_OTHERS = 0.9  # share of the other models' error that a pair must reach
_WORSE_THAN_OTHERS = 1.2  # likewise, with which it is left
_BETTER = 0.7  # share of the present pair's error that another one must reach
_MEMORY_S = 40.0
_MIN_ENERGY = 0.2  # sum of squared changes (m/s) that is evidence


class SlowShare:
    """Tries many pairs of a dead time and a lag of the soon share; call `update` at every step.

    Velocities are in plan, arena axes.

    Args:
        shape: numbers of dead times and of lags.
        step_s: of time.
        window: steps over which a change of velocity is compared.

    Attributes:
        chosen: indices of the pair that explains the motion clearly better than other models; None: none.
        share: that follows soon; 1 if no pair is chosen.
    """

    def __init__(self, shape: tuple[int, int], step_s: float, window: int) -> None:
        self.chosen: tuple[int, int] | None = None
        self.share = 1.0
        self._commanded: Array = np.zeros(2)
        self._slow: Array = np.zeros(2)  # what commands have become slowly
        self._step_s = step_s
        self._fade = 1.0 - step_s / _MEMORY_S
        # Sums of products of changes beside the slow ones: of the lags, of both, and measured.
        self._made = np.zeros(shape)
        self._both = np.zeros(shape)
        self._measured = 0.0
        self._energy = 0.0
        self._past: deque[Array] = deque(maxlen=window + 1)

    def restart(self) -> None:
        """Forget all motion, but not what was learnt."""
        self._past.clear()

    def update(self, commanded: Array, measured: Array) -> None:
        """Follow the commands slowly.

        Args:
            commanded: shape (2,).
            measured: velocity, shape (2,), to begin with.
        """
        if not self._past:
            self._slow = measured
        self._slow = self._slow + (self._step_s / SLOW_S) * (commanded - self._slow)
        self._commanded = commanded
        self._past.append(self._slow)

    @property
    def rest_m_s(self) -> Array:
        """The part of the velocity that has come slowly by now, shape (2,)."""
        return (1.0 - self.share) * self._slow

    def rest_in(self, time_s: float) -> tuple[float, float]:
        """That part after a time, if the last command holds."""
        x, y = (
            (1.0 - self.share) * (self._slow + (time_s / SLOW_S) * (self._commanded - self._slow))
        ).tolist()
        return x, y

    def compare(self, changes: Array, change: Array) -> None:
        """Compare the changes over the window with the measured one.

        Args:
            changes: of what the lags make of the commands, shape (dead times, lags, 2).
            change: of the measured velocity, shape (2,).
        """
        past = self._past
        if len(past) != past.maxlen:
            return
        slow = past[-1] - past[0]
        made, measured = changes - slow, change - slow
        fade = self._fade
        self._made = fade * self._made + (made * made).sum(axis=2)
        self._both = fade * self._both + made @ measured
        self._measured = fade * self._measured + float(measured @ measured)
        self._energy = fade * self._energy + float(change @ change) * self._step_s

    def choose(self, error_of_two_lags: float) -> None:
        """Take a pair and a share, or none, that explain what was measured clearly better.

        Args:
            error_of_two_lags: squared, of the best pair of two lags, with this class's memory.
        """
        if self._energy <= _MIN_ENERGY:
            return
        made, both = self._made, self._both
        shares = np.clip(both / np.maximum(made, 1e-9), _MIN_SHARE, 1.0)
        errors = self._measured + shares * (shares * made - 2.0 * both)
        others = min(error_of_two_lags, float((self._measured + made - 2.0 * both).min()))
        best = divmod(int(errors.argmin()), errors.shape[1])
        least = float(errors[best])
        chosen = self.chosen
        if chosen is None or errors[chosen] > _WORSE_THAN_OTHERS * others:
            chosen = best if least < _BETTER_THAN_OTHERS * others else None
        elif least < _BETTER * errors[chosen]:
            chosen = best
        if chosen is not None and shares[chosen] > _MAX_SHARE:
            chosen = None
        share = 1.0 if chosen is None else float(shares[chosen])
        if chosen != self.chosen or abs(share - self.share) > _SHARE_STEP:
            self.chosen, self.share = chosen, share
