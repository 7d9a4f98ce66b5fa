"""Two guards against a hung app, whose native MAVLink thread would go on sending the last setpoint.

1. A thread: if the event loop has not run for half a second, it sends a velocity of zero, and the flight
   continues when the loop runs again; after three seconds it ends the setpoints and requests hold.
2. A timer that needs no interpreter (`faulthandler`): a hang that holds the GIL stops that thread, too; then
   the process is ended, and without setpoints the vehicle's own offboard-loss failsafe acts.

Both run only while the drone is being commanded. A task shows that the loop runs.
"""

from __future__ import annotations

import asyncio
import contextlib
import faulthandler
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TextIO

BEAT_S = 0.1


@dataclass(frozen=True, slots=True)
class HangLimits:
    """Wall seconds for which the event loop may hang."""

    stand_s: float = 0.5  # then the vehicle hovers until the loop runs again
    hang_s: float = 3.0  # then commanding ends
    locked_s: float = 2.0  # then, with the interpreter's lock held, the process ends


LIMITS = HangLimits()
PATIENT_LIMITS = HangLimits(10.0, 20.0, 60.0)
"""For a vehicle whose time waits for the app: it does not move meanwhile."""


class Watchdog:
    """Watches the event loop on which it is started.

    Args:
        stand_still: called on the watchdog's thread, once a hang, after `limits.stand_s`.
        stop_commanding: called on the watchdog's thread, once, after `limits.hang_s`.
        report: a real file for the second guard's stack trace; by default standard error.

    Attributes:
        tripped_after_s: how long the loop had hung when commanding was ended; 0 if it was not.
    """

    def __init__(
        self,
        stand_still: Callable[[], None],
        stop_commanding: Callable[[], None],
        report: TextIO | None = None,
        limits: HangLimits = LIMITS,
    ) -> None:
        self.limits = limits
        self.tripped_after_s = 0.0
        self._stand_still = stand_still
        self._stop_commanding = stop_commanding
        self._report = report
        self._beat_s = 0.0
        self._stop = threading.Event()
        self._arming = threading.Lock()  # of the second guard, which must not be armed after the end
        self._thread: threading.Thread | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Watch from now on. Call on the event loop."""
        if self._thread is not None:
            return
        self._stop.clear()
        self._beat()
        self._guard_lock()
        self._task = asyncio.create_task(self._keep_beating(), name="watchdog beat")
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop watching."""
        with self._arming:
            self._stop.set()
        if self._task is not None:
            self._task.cancel()
            self._task = None
        if self._thread is not None:
            faulthandler.cancel_dump_traceback_later()
            self._thread = None

    async def _keep_beating(self) -> None:
        while not self.tripped_after_s:
            self._beat()
            await asyncio.sleep(BEAT_S)

    def _beat(self) -> None:
        self._beat_s = time.monotonic()

    def _guard_lock(self) -> None:
        """Let the process end unless this is called again in time, which needs the interpreter's lock."""
        with self._arming, contextlib.suppress(OSError, ValueError, RuntimeError):
            if not self._stop.is_set():
                file = sys.stderr if self._report is None else self._report  # not real: guard 1 only
                faulthandler.dump_traceback_later(self.limits.locked_s, exit=True, file=file)

    def _watch(self) -> None:
        stopped_at_beat_s = 0.0
        while not self._stop.wait(BEAT_S):
            self._guard_lock()
            hung_s = time.monotonic() - self._beat_s
            if hung_s > self.limits.stand_s and stopped_at_beat_s != self._beat_s:
                stopped_at_beat_s = self._beat_s
                self._stand_still()
            if hung_s > self.limits.hang_s:
                self.tripped_after_s = hung_s
                faulthandler.cancel_dump_traceback_later()  # this thread runs, so the GIL is free
                self._stop_commanding()
                return
