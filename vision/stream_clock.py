"""When an image of a stream was captured, by this machine's clock, as far as the stream's stamps tell."""

from __future__ import annotations

_DRIFT = 200e-6  # two cheap quartz oscillators differ by less
_JUMP_S = 1.0  # a stream that stood still, or was restarted, has new offsets
_SAME_CLOCK_S = 1.0


class StreamClock:
    """Converts the time stamps of a stream's images to monotonic time of this machine.

    A video device of Linux stamps images with the machine's own monotonic clock: that is the answer. The
    stamps of a network stream count from some other zero. The image with the least delay so far shows that
    zero; the others came late by what they are behind it, which is the jitter of network and decoder. Thus
    the answer is the arrival less the jitter; the least delay itself cannot be known from the stream, and is
    measured (`framerunner camera latency`).
    """

    __slots__ = ("_last_arrived_s", "_last_stamp_s", "_offset_s")

    def __init__(self) -> None:
        self._offset_s = 0.0
        self._last_stamp_s, self._last_arrived_s = 0.0, float("-inf")

    def captured_s(self, stamp_s: float, arrived_s: float) -> float:
        """The capture of an image, at its arrival at the latest.

        Args:
            stamp_s: the stream's time stamp; those of a stream without stamps are all the same.
            arrived_s: monotonic time.
        """
        passed_s = stamp_s - self._last_stamp_s
        waited_s = arrived_s - self._last_arrived_s
        self._last_stamp_s, self._last_arrived_s = stamp_s, arrived_s
        if passed_s == 0.0:
            return arrived_s
        if 0.0 <= arrived_s - stamp_s < _SAME_CLOCK_S:
            return stamp_s
        offset_s = arrived_s - stamp_s
        known_s = self._offset_s + _DRIFT * waited_s
        if passed_s < 0.0 or offset_s > known_s + _JUMP_S or passed_s > waited_s + _JUMP_S:
            known_s = offset_s
        self._offset_s = min(known_s, offset_s)
        return stamp_s + self._offset_s
