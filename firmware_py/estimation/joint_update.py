"""Several measured numbers fused one after the other, with one change of the covariance at the end.

A Kalman filter may take measured numbers with independent errors one by one (Simon, "Optimal State
Estimation", 2006, section 6.1). What the one tells of the next is worked out here among the few measured
numbers, as a Cholesky factorisation of their covariance, row by row, in scalar code; only the sum of all
corrections is applied to the large covariance: numpy's calls on matrices of this size cost more than their
arithmetic.
"""

from __future__ import annotations

import numpy as np

from firmware_py.estimation.error_state import ErrorCovariance, Matrix

_Fused = tuple[int, float, float, list[float]]
"""A number that was fused: its index, 1 over the root of its variance given those before, its innovation
times that, and its row of the factor without the diagonal."""


class JointUpdate:
    """Measured numbers on their way into the covariance.

    Nothing is changed before `apply`.

    Args:
        covariance: predicted to the measurements' time.
        rows: derivatives of the measured numbers by the error state, shape (k, n).
        innovations: measured minus predicted by the nominal state, length k.
    """

    __slots__ = ("_covariance", "_gains", "_left", "_related", "_spread", "_taken", "_weights")

    def __init__(
        self, covariance: ErrorCovariance, rows: Matrix, innovations: tuple[float, ...] | list[float]
    ) -> None:
        self._covariance = covariance
        self._related: Matrix = np.dot(covariance.p, rows.T)
        self._spread: list[list[float]] = np.dot(rows, self._related).tolist()
        if covariance.has_error:
            known: list[float] = np.dot(rows, covariance.error).tolist()
            self._left = [number - part for number, part in zip(innovations, known, strict=True)]
        else:
            self._left = list(innovations)
        self._taken: list[_Fused] = []
        self._gains: list[list[float]] = []
        self._weights: list[float] = []

    def square(self, index: int, variance: float) -> float:
        """Normalised innovation squared of a number, after those that have been fused."""
        left, total, _ = self._after_others(index, variance)
        return left * left / total

    def fuse(self, index: int, variance: float) -> float:
        """Fuse a number.

        Args:
            index: of its row; each at most once.
            variance: of its measurement.

        Returns:
            Its normalised innovation squared; over the numbers of one measurement, these add up to its NIS.
        """
        left, total, row = self._after_others(index, variance)
        scale = total**-0.5
        # The gain of this number is a combination of the columns of P H'.
        gain = [0.0] * len(self._left)
        gain[index] = scale
        for share, other in zip(row, self._gains, strict=True):
            for at, part in enumerate(other):
                gain[at] -= scale * share * part
        self._taken.append((index, scale, scale * left, row))
        self._gains.append(gain)
        self._weights.append(scale * left)
        return left * left / total

    def _after_others(self, index: int, variance: float) -> tuple[float, float, list[float]]:
        """A number's innovation and its variance given those that have been fused; its row of the factor."""
        spread = self._spread[index]
        left, total = self._left[index], spread[index] + variance
        row: list[float] = []
        for other, scale, weight, other_row in self._taken:
            share = spread[other]
            for mine, its in zip(row, other_row, strict=True):
                share -= mine * its
            share *= scale
            row.append(share)
            left -= share * weight
            total -= share * share
        return left, total, row

    def apply(self) -> None:
        """Correct the covariance and its error by all that has been fused."""
        if self._gains:
            gains: Matrix = np.dot(self._related, np.array(self._gains).T)
            self._covariance.correct(gains, np.array(self._weights))
