"""The pace of simulated time: where it meets wall time, and what is said when the machine is too slow."""

from __future__ import annotations

import time
from collections.abc import Callable

BURST_TICKS = 5  # at most 0.02 s of simulated time before links and video are served
_MAX_CAUGHT_UP_S = 0.05  # shorter delays are caught up; longer ones slow simulated time down
_NOTICE_PERIOD_S = 5.0


class Pacer:
    """The simulated time that should have been reached: the only place where it meets wall time.

    It is a linear function of wall time, so it never drifts. When the machine cannot keep up, the line is
    moved: simulated time passes more slowly and no step is skipped.

    Args:
        speed: simulated seconds a wall second.
        now_s: monotonic wall time, seconds.
        time_us: simulated time now, microseconds.

    Attributes:
        speed: as given.
    """

    def __init__(self, speed: float, now_s: float, time_us: int = 0) -> None:
        if not 0.01 <= speed <= 1000:
            raise ValueError(f"speed {speed:g}: must be from 0.01 to 1000")
        self.speed = speed
        self._wall_s = now_s
        self._time_us = time_us

    def target_us(self, now_s: float) -> int:
        """The simulated time that should have been reached at a wall time."""
        return self._time_us + round((now_s - self._wall_s) * self.speed * 1e6)

    def wait_s(self, now_s: float, time_us: int) -> float:
        """Wall seconds until a simulated time is due; zero if it is."""
        return max(0.0, (time_us - self.target_us(now_s)) / 1e6 / self.speed)

    def give_up_lag(self, now_s: float, time_us: int) -> float:
        """Move the line if simulated time is too far behind to catch up; return the wall seconds given up."""
        lag_s = (self.target_us(now_s) - time_us) / 1e6 / self.speed
        if lag_s <= _MAX_CAUGHT_UP_S:
            return 0.0
        self._wall_s += lag_s
        return lag_s


class LagNotices:
    """Reports that the machine cannot keep up, at most once a period."""

    def __init__(self, notice: Callable[[str], None], speed: float) -> None:
        self._notice = notice
        self._speed = speed
        self._since_s = time.monotonic()
        self._lost_s = 0.0

    def lag(self, lost_s: float, now_s: float) -> None:
        """Count wall seconds given up, and report them once a period."""
        self._lost_s += lost_s
        span_s = now_s - self._since_s
        if span_s < _NOTICE_PERIOD_S:
            return
        if self._lost_s > 0.0:
            reached = self._speed * (1.0 - self._lost_s / span_s)
            self._notice(
                f"the machine cannot keep up: simulated time ran at {reached:.2f} of real time "
                f"(wanted {self._speed:g}) for the last {span_s:.0f} s; nothing was skipped"
            )
        self._since_s, self._lost_s = now_s, 0.0
