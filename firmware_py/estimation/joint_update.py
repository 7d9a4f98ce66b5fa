"""Several measured numbers fused one after the other, with one change of the covariance at the end.

A Kalman filter may take measured numbers with independent errors one by one (Simon, "Optimal State
Estimation", 2006, section 6.1). What the one tells of the next is worked out here among the few measured
numbers, as an L D L' factorisation of their covariance, in scalar code; only the sum of all corrections is
applied to the large covariance: numpy's calls on matrices of this size cost more than their arithmetic.
"""

from __future__ import annotations

import numpy as np

from firmware_py.estimation.error_state import ErrorCovariance, Matrix


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
        self._taken: list[tuple[list[float], float, list[float]]] = []
        self._gains: list[list[float]] = []
        self._weights: list[float] = []

    def square(self, index: int, variance: float) -> float:
        """Normalised innovation squared of a number, after those that have been fused."""
        left = self._left[index]
        return left * left / (self._spread[index][index] + variance)

    def fuse(self, index: int, variance: float) -> float:
        """Fuse a number.

        Args:
            index: of its row; each at most once.
            variance: of its measurement.

        Returns:
            Its normalised innovation squared; over the numbers of one measurement, these add up to its NIS.
        """
        spread, left = self._spread, self._left
        row = spread[index]
        total = row[index] + variance
        innovation = left[index]
        # The gain of this number is a combination of the columns of P H'.
        combination = [0.0] * len(left)
        combination[index] = 1.0
        for before, total_before, row_before in self._taken:
            factor = row_before[index] / total_before
            for at, part in enumerate(before):
                combination[at] -= factor * part
        row = row.copy()
        self._taken.append((combination, total, row))
        for at, other in enumerate(spread):
            factor = other[index] / total
            left[at] -= factor * innovation
            for column, part in enumerate(row):
                other[column] -= factor * part
        scale = total**-0.5
        self._gains.append([scale * part for part in combination])
        self._weights.append(scale * innovation)
        return innovation * innovation / total

    def apply(self) -> None:
        """Correct the covariance and its error by all that has been fused."""
        if self._gains:
            gains: Matrix = np.dot(self._related, np.array(self._gains).T)
            self._covariance.correct(gains, np.array(self._weights))
