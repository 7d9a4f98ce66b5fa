"""One kind of measurement that aids the filter: its gate, its last use, its consistency."""

from __future__ import annotations

from math import inf, isfinite

from firmware_py.estimation.error_state import Matrix
from firmware_py.estimation.joint_update import JointUpdate
from firmware_py.estimation.navigation_filter import NavigationFilter

NEVER_US = -(10**15)
_RESETS_FORGOTTEN_US = 10_000_000
_NOISE_SHARE = 0.1  # of a new sample in the mean square of the noise
_SECOND_DIFFERENCE = 1.0 / 6.0  # of white noise: its mean square is six variances
_MUCH_NOISE = 9.0  # times the variance that was reported: then the measured one counts
_PAUSE_US = 500_000  # innovations before and after are not compared


class Aid:
    """The gate of one group of measured numbers, such as the horizontal position.

    What it fuses changes the covariance and its `error`; the nominal state is corrected by the caller.

    Args:
        name: for messages.
        numbers: measured at once; the degrees of freedom of `nis`.
        gate: innovations beyond so many standard deviations are rejected.
        reset_us: measurements rejected for so long are taken for right.
        max_resets: so often; one that has to be reset to again within 10 s after that is not believed until
            its measurements fit. None: always.

    Attributes:
        fused_us: when one was fused last.
        arrived_us: when one arrived last.
        ratio: of the last one, its largest innovation over the gate; above 1 it is rejected. 0: none yet.
        nis: normalised innovation squared of the last one that was fused.
    """

    def __init__(
        self, name: str, numbers: int, gate: float, reset_us: int, max_resets: int | None = None
    ) -> None:
        self.name = name
        self.numbers = numbers
        self._gate = gate
        self._reset_us = reset_us
        self._max_resets = max_resets
        self._resets = 0
        self._last_reset_us = NEVER_US
        self._last: tuple[float, ...] = ()
        self._before: tuple[float, ...] = ()
        self._last_us = NEVER_US
        self._noise = 0.0
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
        squares = [
            innovation * innovation / (float(covariance.p[at, at]) + variance)
            for at, (innovation, variance) in enumerate(zip(innovations, variances, strict=True), start=index)
        ]
        if not self._passes(squares, into.time_us):
            return False
        nis = 0.0
        for at, (innovation, variance) in enumerate(zip(innovations, variances, strict=True), start=index):
            nis += covariance.fuse_state(at, innovation, variance)
        self._fused(nis, into)
        return True

    def fuse_rows(
        self,
        into: NavigationFilter,
        rows: Matrix,
        innovations: tuple[float, ...] | list[float],
        variances: tuple[float, ...],
    ) -> bool:
        """Fuse measured numbers by their derivatives, shape (k, n); see `fuse_states`."""
        update = JointUpdate(into.covariance, rows, innovations)
        passed = self.fuse_part(into, update, 0, variances)
        update.apply()
        return passed

    def fuse_part(
        self, into: NavigationFilter, update: JointUpdate, first: int, variances: tuple[float, ...]
    ) -> bool:
        """Fuse numbers of an update from an index on; see `fuse_states`."""
        squares = [update.square(at, variance) for at, variance in enumerate(variances, start=first)]
        if not self._passes(squares, into.time_us):
            return False
        nis = 0.0
        for at, variance in enumerate(variances, start=first):
            nis += update.fuse(at, variance)
        self._fused(nis, into)
        return True

    def variance(self, innovations: tuple[float, ...], reported: float, now_us: int) -> float:
        """The variance of a measurement's white noise: as reported, or as measured if that is far more.

        Measured by second differences of innovations, to which an error of the estimate hardly adds.

        Args:
            innovations: measured minus predicted.
            reported: variance of a measured number.
            now_us: the filter's time.
        """
        if now_us - self._last_us > _PAUSE_US:
            self._before = ()
        elif self._before:
            square = 0.0
            for new, last, before in zip(innovations, self._last, self._before, strict=True):
                square += (new - 2.0 * last + before) ** 2
            square *= _SECOND_DIFFERENCE / len(innovations)
            self._noise += _NOISE_SHARE * (square - self._noise)
            self._before = self._last
        else:
            self._before = self._last
        self._last, self._last_us = innovations, now_us
        return self._noise if self._noise > _MUCH_NOISE * reported else reported

    def is_overdue(self, now_us: int) -> bool:
        """Whether measurements come but have been rejected for so long that the estimate must be wrong."""
        if self.fused_us == NEVER_US or self.ratio <= 1.0 or now_us - self.fused_us <= self._reset_us:
            return False
        if now_us - self._last_reset_us > _RESETS_FORGOTTEN_US:
            self._resets = 0
        return self._max_resets is None or self._resets < self._max_resets

    def is_needed(self, now_us: int) -> bool:
        """Whether the estimate must be set to the next measurement: it is the first, or is overdue."""
        return self.fused_us == NEVER_US or self.is_overdue(now_us)

    def accept_any(self) -> None:
        """Let the next measurement pass the gate: the estimate has been set to it."""
        self._open = True
        self._last_us = NEVER_US  # innovations before and after are not compared

    def _passes(self, squares: list[float], now_us: int) -> bool:
        self.arrived_us = now_us
        worst = max(squares) if isfinite(sum(squares)) else inf
        self.ratio = worst**0.5 / self._gate
        is_open, self._open = self._open, False
        if is_open and self.fused_us != NEVER_US:
            self._resets += 1
            self._last_reset_us = now_us
        return self.ratio <= 1.0 or is_open

    def _fused(self, nis: float, into: NavigationFilter) -> None:
        self.nis = nis
        self.fused_us = into.time_us
