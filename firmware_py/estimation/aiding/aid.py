"""One kind of measurement that aids the filter: its gate, its last use, its consistency."""

from __future__ import annotations

from firmware_py.estimation.error_state import Matrix
from firmware_py.estimation.navigation_filter import NavigationFilter

NEVER_US = -(10**15)


class Aid:
    """The gate of one group of measured numbers, such as the horizontal position.

    What it fuses changes the covariance and its `error`; the nominal state is corrected by the caller.

    Args:
        name: for messages.
        numbers: measured at once; the degrees of freedom of `nis`.
        gate: innovations beyond so many standard deviations are rejected.
        reset_us: measurements rejected for so long are taken for right.

    Attributes:
        fused_us: when one was fused last.
        arrived_us: when one arrived last.
        ratio: of the last one, its largest innovation over the gate; above 1 it is rejected. 0: none yet.
        nis: normalised innovation squared of the last one that was fused.
    """

    __slots__ = ("_gate", "_open", "_reset_us", "arrived_us", "fused_us", "name", "nis", "numbers", "ratio")

    def __init__(self, name: str, numbers: int, gate: float, reset_us: int) -> None:
        self.name = name
        self.numbers = numbers
        self._gate = gate
        self._reset_us = reset_us
        self._open = False
        self.fused_us = NEVER_US
        self.arrived_us = NEVER_US
        self.ratio = 0.0
        self.nis = 0.0

    def fuse_states(
        self, into: NavigationFilter, index: int, innovations: tuple[float, ...], variances: tuple[float, ...]
    ) -> bool:
        """Fuse measurements of neighbouring states.

        Args:
            into: predicted to its own time.
            index: of the first state.
            innovations: measured minus predicted, of each state.
            variances: of the measured numbers.

        Returns:
            Whether they passed the gate; if not, nothing is fused.
        """
        covariance = into.covariance
        worst = 0.0
        for at, (innovation, variance) in enumerate(zip(innovations, variances, strict=True), start=index):
            total = float(covariance.p[at, at]) + variance
            worst = max(worst, innovation * innovation / total)
        if not self._passes(worst, into.time_us):
            return False
        nis = 0.0
        for at, (innovation, variance) in enumerate(zip(innovations, variances, strict=True), start=index):
            nis += covariance.fuse_state(at, innovation, variance)
        self._fused(nis, into)
        return True

    def fuse_rows(
        self,
        into: NavigationFilter,
        rows: tuple[Matrix, ...],
        innovations: tuple[float, ...],
        variances: tuple[float, ...],
    ) -> bool:
        """Fuse measured numbers by their derivatives, each of shape (n,); see `fuse_states`."""
        covariance = into.covariance
        related = [covariance.related(row) for row in rows]
        worst = max(
            [
                innovation * innovation / (own + variance)
                for (_, own), innovation, variance in zip(related, innovations, variances, strict=True)
            ]
        )
        if not self._passes(worst, into.time_us):
            return False
        nis = covariance.fuse(rows[0], innovations[0], variances[0], related[0])
        for row, innovation, variance in zip(rows[1:], innovations[1:], variances[1:], strict=True):
            nis += covariance.fuse(row, innovation, variance)
        self._fused(nis, into)
        return True

    def is_overdue(self, now_us: int) -> bool:
        """Whether measurements come but have been rejected for so long that the estimate must be wrong."""
        return self.fused_us != NEVER_US and self.ratio > 1.0 and now_us - self.fused_us > self._reset_us

    def is_needed(self, now_us: int) -> bool:
        """Whether the estimate must be set to the next measurement: it is the first, or is overdue."""
        return self.fused_us == NEVER_US or self.is_overdue(now_us)

    def accept_any(self) -> None:
        """Let the next measurement pass the gate: the estimate has been set to it."""
        self._open = True

    def _passes(self, square: float, now_us: int) -> bool:
        self.arrived_us = now_us
        self.ratio = (square**0.5) / self._gate
        is_open, self._open = self._open, False
        return self.ratio <= 1.0 or is_open  # false for NaN too

    def _fused(self, nis: float, into: NavigationFilter) -> None:
        self.nis = nis
        self.fused_us = into.time_us
