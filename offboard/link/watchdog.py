"""Two guards against a hung app, whose native MAVLink thread would go on sending the last setpoint.

1. A thread: if the event loop has not run for half a second, it sends a velocity of zero, and the flight
   continues when the loop runs again; after three seconds it ends the setpoints and requests hold.
2. A process of its own (`ProcessGuard`): a hang that holds the GIL stops that thread, too; then this process
   is ended, and without setpoints the vehicle's own offboard-loss failsafe acts.

A process that is stopped as a whole sends nothing. When it goes on after three seconds or more, the first
guard ends the setpoints and requests nothing: the vehicle may be somebody else's by then.

Both run only while the drone is being commanded. A task shows that the loop runs.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from offboard.link.process_guard import ProcessGuard

BEAT_S = 0.1
KNOWN_S = 1.5
"""After the process stood still; a heartbeat, one a second, has shown the vehicle's mode by then."""


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
        stop_commanding: called once, after `limits.hang_s`, on the watchdog's thread; when `stood_still` is
            set perhaps on the event loop, which it must not block then.
        guard: the second guard.

    Attributes:
        tripped_after_s: how long the loop had hung when commanding was ended; 0 if it was not.
        stood_still: then the whole process had stood still, so what is known of the vehicle is old.
    """

    def __init__(
        self,
        stand_still: Callable[[], None],
        stop_commanding: Callable[[], None],
        guard: ProcessGuard,
        limits: HangLimits = LIMITS,
    ) -> None:
        self.limits = limits
        self.tripped_after_s = 0.0
        self.stood_still = False
        self._stand_still = stand_still
        self._stop_commanding = stop_commanding
        self._guard = guard
        self._beat_s = 0.0
        self._looked_s = 0.0  # when the thread ran last
        self._still_s = -KNOWN_S  # when it ran again after it had stood still
        self._stop = threading.Event()
        self._arming = threading.Lock()  # of the second guard, which must not be armed after the end
        self._thread: threading.Thread | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Watch from now on. Call on the event loop."""
        if self._thread is not None:
            return
        self._stop.clear()
        self._beat_s = self._looked_s = time.monotonic()
        self._expect_beats()
        self._task = asyncio.create_task(self._keep_beating(), name="watchdog beat")
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop watching."""
        with self._arming:
            self._stop.set()
            self._guard.expect(0.0)
        if self._task is not None:
            self._task.cancel()
            self._task = None
        self._thread = None

    async def _keep_beating(self) -> None:
        while not self.tripped_after_s:
            hung_s = time.monotonic() - self._beat_s
            if hung_s > self.limits.hang_s:  # the thread has not run either
                self._trip(hung_s)
                return
            self._beat_s = time.monotonic()
            await asyncio.sleep(BEAT_S)

    def _expect_beats(self) -> None:
        with self._arming:
            if not self._stop.is_set():
                self._guard.expect(self.limits.locked_s)

    def _watch(self) -> None:
        stopped_at_beat_s = 0.0
        while not self._stop.wait(BEAT_S):
            self._expect_beats()
            now_s = time.monotonic()
            if now_s - self._looked_s > self.limits.stand_s:
                self._still_s = now_s
            self._looked_s, hung_s = now_s, now_s - self._beat_s
            if hung_s > self.limits.stand_s and stopped_at_beat_s != self._beat_s:
                stopped_at_beat_s = self._beat_s
                self._stand_still()
            if hung_s > self.limits.hang_s:
                self._trip(hung_s)
                return

    def _trip(self, hung_s: float) -> None:
        """End commanding, once: on the thread or, where that stood still as well, on the event loop."""
        with self._arming:
            if self._stop.is_set() or self.tripped_after_s:
                return
            now_s = time.monotonic()
            thread_stood = now_s - self._looked_s > self.limits.stand_s
            self.stood_still = thread_stood or now_s - self._still_s < KNOWN_S
            self.tripped_after_s = hung_s
            self._guard.expect(0.0)  # the GIL is free
        self._stop_commanding()
