"""How late a vehicle's speed follows what it is told."""

from __future__ import annotations

from collections import deque

WINDOW = 8  # ticks over which a change is looked at
FIRST_S = 0.3  # guessed
LONGEST_S = 0.7
_WEIGHT = 8.0  # of the guess, in changes that just count


class LagEstimate:
    """Least squares for T in T dv/dt = told - v, each integrated over a window, so that no rate is needed.

    Args:
        least: a smaller change of speed over a window does not count: it may be noise.
    """

    __slots__ = ("_behind", "_changes", "_least", "_past", "_way")

    def __init__(self, least: float) -> None:
        self._least = least
        self._changes = _WEIGHT * least * least
        self._behind = FIRST_S * self._changes
        self._way = 0.0
        self._past: deque[tuple[float, float]] = deque(maxlen=WINDOW)

    def see(self, told: float, speed: float, step_s: float) -> None:
        """Take one step: what it was told since the last one, and its speed now."""
        self._way += (told - speed) * step_s
        if len(self._past) == WINDOW:
            way, before = self._past[0]
            change = speed - before
            if abs(change) > self._least:
                self._changes += change * change
                self._behind += change * (self._way - way)
        self._past.append((self._way, speed))

    def interrupt(self) -> None:
        """Keep what was learned, but look at no change across a gap."""
        self._past.clear()

    @property
    def lag_s(self) -> float:
        """As seen so far, 0 to LONGEST_S."""
        return min(max(self._behind / self._changes, 0.0), LONGEST_S)
