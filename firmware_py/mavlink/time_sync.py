"""Conversion of other systems' clocks into vehicle time, by the TIMESYNC protocol.

The vehicle sends TIMESYNC with its own time; the other system returns it with its own. From each answer
follows an offset, as if both ways had taken equally long. As in PX4 v1.17 (src/lib/timesync), offset and skew
are smoothed (https://en.wikipedia.org/wiki/Exponential_smoothing, double), and used after 500 answers; until
then a time stamp is replaced by the time of arrival.
"""

from __future__ import annotations

from math import exp

_CONVERGED = 500  # answers
_INITIAL_GAIN, _FINAL_GAIN = 0.05, 0.003
_MAX_ROUND_TRIP_US = 10_000
_MAX_DEVIATION_US = 100_000
_MAX_DEVIATIONS = 10  # in succession, before the clock is taken to have jumped


class TimeSync:
    """The clock of another system, seen over one link."""

    def __init__(self) -> None:
        self._restart()

    def _restart(self) -> None:
        self._answers = self._deviations = 0
        self._offset_us = self._skew_us = 0.0

    @property
    def converged(self) -> bool:
        """Whether the offset is used."""
        return self._answers >= _CONVERGED

    def take(self, now_us: int, remote_ns: int, sent_ns: int) -> None:
        """Take an answer.

        Args:
            now_us: vehicle time of its arrival.
            remote_ns: the other system's time.
            sent_ns: vehicle time of the request.
        """
        sent_us = sent_ns / 1000
        if not 0 <= now_us - sent_us < _MAX_ROUND_TRIP_US:
            return
        offset_us = (sent_us + now_us) / 2 - remote_ns / 1000
        if self.converged and abs(offset_us - self._offset_us) > _MAX_DEVIATION_US:
            self._deviations += 1
            if self._deviations > _MAX_DEVIATIONS:
                self._restart()
            return
        self._deviations = 0
        self._smooth(offset_us)
        self._answers += 1

    def _smooth(self, offset_us: float) -> None:
        if self._answers == 0:
            self._offset_us = offset_us
            return
        gain = _FINAL_GAIN
        if not self.converged:
            share = exp(0.5 * (1.0 - 1.0 / (1.0 - self._answers / _CONVERGED)))
            gain = share * _INITIAL_GAIN + (1.0 - share) * _FINAL_GAIN
        before_us = self._offset_us
        self._offset_us = gain * offset_us + (1.0 - gain) * (before_us + self._skew_us)
        self._skew_us = gain * (self._offset_us - before_us) + (1.0 - gain) * self._skew_us

    def vehicle_time_us(self, remote_us: int, now_us: int) -> int:
        """Vehicle time of another system's time stamp; `now_us` until the offset is known."""
        return remote_us + round(self._offset_us) if self.converged else now_us


class Clocks:
    """The clock of the system on each link."""

    def __init__(self) -> None:
        self._by_link: dict[str, TimeSync] = {}

    def on(self, link: str) -> TimeSync:
        """The clock on a link, by its name."""
        clock = self._by_link.get(link)
        if clock is None:
            clock = self._by_link[link] = TimeSync()
        return clock
