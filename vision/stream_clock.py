"""When an image of a network stream was captured, by this machine's clock, as far as its stamps tell."""

from __future__ import annotations

from collections import deque

_WINDOW_S = 5.0
_ON_TIME = 0.1  # the share of images that are taken to have come without delay
_JUMP_S = 1.0  # stamps that jump by more count from another zero


class StreamClock:
    """Converts the time stamps of a stream's images to monotonic time of this machine.

    The stamps count from some unknown zero. The images of the last seconds that came earliest by their stamps
    show it; others came late by what they are behind those, which is the jitter of network and decoder. Thus
    the answer is the arrival less the jitter; the least delay itself cannot be known from the stream, and is
    measured (`framerunner camera latency`). It is a tenth of the images and not the single earliest one, so
    that one image with a wrong stamp does not move all others and each start gives the same delay.
    """

    __slots__ = ("_last_arrived_s", "_last_stamp_s", "_offsets")

    def __init__(self) -> None:
        self._offsets: deque[tuple[float, float]] = deque()  # arrival, and arrival less stamp
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
        if passed_s < 0.0 or passed_s > waited_s + _JUMP_S:
            self._offsets.clear()  # the stream was restarted
        self._offsets.append((arrived_s, arrived_s - stamp_s))
        while self._offsets[0][0] < arrived_s - _WINDOW_S:
            self._offsets.popleft()
        earliest = sorted(offset_s for _, offset_s in self._offsets)
        return min(arrived_s, stamp_s + earliest[int(_ON_TIME * len(earliest))])
