"""When an image of a network stream was captured, by this machine's clock, as far as its stamps tell."""

from __future__ import annotations

from collections import deque
from math import inf

_WINDOW_S = 5.0
_ON_TIME = 0.1  # the share of images that are taken to have come without delay
_JUMP_S = 1.0  # stamps that jump by more count from another zero
_GAP_S = 0.3  # an image that comes later than its stamp by more follows a gap
_QUEUED = 0.3  # images that come faster than their stamps by more than this share come from a queue


class _Trial:
    """Images of which it is not known yet whether they come from a queue.

    Args:
        usual_s: arrival less stamp of the images before a gap; -inf if the stream was opened or restarted.
        arrived_s: of the first image.
    """

    def __init__(self, usual_s: float, arrived_s: float) -> None:
        opened = usual_s == -inf
        self.usual_s = usual_s
        self.offsets: deque[tuple[float, float]] = deque()  # of the current period
        self._period_s = 0.1 if opened else 0.5
        self._limit_s = arrived_s + (1.0 if opened else _WINDOW_S)

    def ends(self, arrived_s: float, offset_s: float) -> bool:
        """Whether its images have come at the pace of their stamps for a period; else begin the next one."""
        began_s, first_s = self.offsets[0]
        if arrived_s - began_s < self._period_s:
            return False
        if first_s - offset_s < _QUEUED * (arrived_s - began_s) or arrived_s >= self._limit_s:
            return True
        self.offsets.clear()
        return False


class StreamClock:
    """Converts the time stamps of a stream's images to monotonic time of this machine.

    The stamps count from some unknown zero. The images of the last seconds that came earliest by their stamps
    show it; others came late by what they are behind those, which is the jitter of network and decoder. Thus
    the answer is the arrival less the jitter; the least delay itself cannot be known from the stream, and is
    measured (`framerunner camera latency`). It is a tenth of the images and not the single earliest one, so
    that one image with a wrong stamp does not move all others and each start gives the same delay.

    One image alone does not show everything. A stream that was just opened may begin with old images that
    the server kept. The first image after a gap is an old one that the network held back, or a new one of
    a sender whose stamps stood still meanwhile. The next images tell: those from a queue come faster than
    their stamps. The time is not known until they come at the pace of their stamps, from when on the zero
    is found anew, or until they are as early as those before the gap.
    """

    def __init__(self) -> None:
        self._offsets: deque[tuple[float, float]] = deque()  # arrival, and arrival less stamp
        self._last_stamp_s, self._last_arrived_s = 0.0, -inf
        self._trial: _Trial | None = None

    def captured_s(self, stamp_s: float, arrived_s: float) -> float | None:
        """The capture of an image, at its arrival at the latest; None while it is not known.

        Args:
            stamp_s: the stream's time stamp; those of a stream without stamps are all the same.
            arrived_s: monotonic time.
        """
        first = self._last_arrived_s == -inf
        passed_s, waited_s = stamp_s - self._last_stamp_s, arrived_s - self._last_arrived_s
        self._last_stamp_s, self._last_arrived_s = stamp_s, arrived_s
        offset_s, usual_s = arrived_s - stamp_s, self._usual_s()
        jumped = passed_s > waited_s + _JUMP_S and offset_s < usual_s - _JUMP_S
        if first or passed_s < 0.0 or jumped:  # the stream was opened or restarted
            self._offsets.clear()
            self._trial = _Trial(-inf, arrived_s)
        elif passed_s > 0.0 and waited_s > passed_s + _GAP_S:
            self._trial = _Trial(usual_s, arrived_s)
        elif self._trial is not None:
            self._judge(self._trial, arrived_s, offset_s)
        if self._trial is not None:
            self._trial.offsets.append((arrived_s, offset_s))
            return None
        if passed_s == 0.0:
            return arrived_s
        self._offsets.append((arrived_s, offset_s))
        while self._offsets[0][0] < arrived_s - _WINDOW_S:
            self._offsets.popleft()
        return min(arrived_s, stamp_s + self._usual_s())

    def _judge(self, trial: _Trial, arrived_s: float, offset_s: float) -> None:
        """End the trial if this image shows that the queue is empty, or that there is none."""
        if offset_s < trial.usual_s + _GAP_S / 2:
            self._trial = None
        elif trial.ends(arrived_s, offset_s):
            self._trial, self._offsets = None, trial.offsets

    def _usual_s(self) -> float:
        """Arrival less stamp of the images that came without delay; -inf if there are none."""
        earliest = sorted(offset_s for _, offset_s in self._offsets)
        return earliest[int(_ON_TIME * len(earliest))] if earliest else -inf
