"""Keeps simulated time in step with wall time: the one place where they meet."""

from __future__ import annotations

_FORGIVEN_S = 0.05  # shorter delays are caught up; longer ones become slower simulated time


class Pacer:
    """Says how far simulated time should be by now.

    Simulated time is a linear function of wall time, so it never drifts. When the machine cannot keep up,
    the line is moved: simulated time passes slower and no step is skipped.

    Args:
        speed: simulated seconds a wall second.
        now_s: monotonic wall time, seconds.
        time_us: simulated time now, microseconds.

    Attributes:
        lost_s: wall seconds by which the line was moved so far.
    """

    def __init__(self, speed: float, now_s: float, time_us: int = 0) -> None:
        if not 0.01 <= speed <= 1000:
            raise ValueError(f"speed {speed:g}: must be from 0.01 to 1000")
        self._speed = speed
        self._wall_s = now_s
        self._time_us = time_us
        self.lost_s = 0.0

    def target_us(self, now_s: float) -> int:
        """Return the simulated time that should have been reached at a wall time."""
        return self._time_us + round((now_s - self._wall_s) * self._speed * 1e6)

    def wait_s(self, now_s: float, time_us: int) -> float:
        """Return the wall time to wait until a simulated time is due; zero if it is."""
        return max(0.0, (time_us - self.target_us(now_s)) / 1e6 / self._speed)

    def give_up_lag(self, now_s: float, time_us: int) -> float:
        """Move the line if simulated time is too far behind to catch up.

        Returns:
            Wall seconds given up, 0 if it keeps up.
        """
        lag_s = (self.target_us(now_s) - time_us) / 1e6 / self._speed
        if lag_s <= _FORGIVEN_S:
            return 0.0
        self._wall_s += lag_s
        self.lost_s += lag_s
        return lag_s
