"""What the terminal shows of a lockstep flight that takes longer than a moment."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.status import Status

from offboard.app import Moment

_QUIET_S = 1.0
_REFRESH_S = 0.25
_LINE_S = 2.0


class LockstepProgress:
    """A status line in a terminal, elsewhere a line every two seconds; nothing in the first second.

    Args:
        limit_s: of the try.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._console = Console(stderr=True)
        self._status: Status | None = None
        self._started_s = time.monotonic()
        self._next_s = self._started_s + _QUIET_S

    def __enter__(self) -> LockstepProgress:
        """Begin to count the first second."""
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Take the status line away."""
        if self._status is not None:
            self._status.stop()

    def see(self, moment: Moment) -> None:
        """Take a tick of the flight."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        speed = moment.flight_time_s / (now_s - self._started_s)
        text = (
            f"{moment.flight_time_s:6.1f} s of {self._limit_s:g} s  {moment.mission_state:22s} "
            f"{speed:.0f} times real time"
        )
        if not self._console.is_terminal:
            self._next_s = now_s + _LINE_S
            self._console.print(text, markup=False, highlight=False)
            return
        self._next_s = now_s + _REFRESH_S
        if self._status is None:
            self._status = self._console.status(text)
            self._status.start()
        self._status.update(text)
