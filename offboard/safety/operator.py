"""The operator of a flight: a go before arming, and a stop that lands or, the second time, stops the motors.

Keys of a terminal and buttons of a page demand through the same `Controls`; they differ in who calls it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Literal

GO_WORDS = "waiting for the operator's go"
STOPPED = "stopped by the operator"
HOLD_S = 1.0
"""For which a control must be held to give the go."""

Phase = Literal[
    "checks", "waiting", "flying", "landing", "holding", "stopping motors", "motors stopped", "ended"
]
"""What the flight does, for the operator."""


class Operator:
    """What an operator has demanded so far. Used on one event loop; no clock.

    A key, a page or a test calls `give_go`, `demand_landing` and `demand_motors_off`; the flight reads them
    and is told of each demand.

    Args:
        needs_go: the flight waits for a go before it arms; not in a dry run.
        hint: how to give the go and to stop, for people.

    Attributes:
        needs_go: see above.
        has_go: the go was given, or none is needed.
        asks: the flight waits for the go now.
        landings: how often a landing was demanded.
        motor_stops: how often a stop of the motors was demanded.
        stopped_by: who pressed first, for people; empty: nobody, or it is not known.
        phase: what the flight does; set by the flight.
    """

    def __init__(self, *, needs_go: bool = True, hint: str = "") -> None:
        self.needs_go = needs_go
        self.has_go = not needs_go
        self.asks = False
        self.hint = hint
        self.landings = self.motor_stops = 0
        self.stopped_by = ""
        self.phase: Phase = "checks"
        self._on_stop: Callable[[], object] | None = None

    @property
    def stops(self) -> int:
        """0: nothing was demanded; 1: a landing; 2: a stop of the motors."""
        return (self.landings > 0) + (self.motor_stops > 0)

    @property
    def kills(self) -> bool:
        """Whether the motors must stop at once, wherever the drone is."""
        return self.motor_stops > 0

    @property
    def stop_words(self) -> str:
        """Who has stopped the flight."""
        return f"{STOPPED} ({self.stopped_by})" if self.stopped_by else STOPPED

    def ask_for_go(self) -> None:
        """Forget a go that was given before: nobody had been told that the drone is ready."""
        self.has_go, self.asks = not self.needs_go, self.needs_go

    def give_go(self) -> None:
        """Let the flight arm; ignored after a stop."""
        if not self.stops:
            self.has_go, self.asks = True, False

    def demand_landing(self, by: str = "") -> None:
        """End the flight by a landing; once more: request it again."""
        if not self.stops:
            self.stopped_by = by
        self.landings += 1
        self._stop()

    def demand_motors_off(self) -> None:
        """Stop the motors; once more: request it again. It means nothing before a landing was demanded."""
        if self.landings:
            self.motor_stops += 1
            self._stop()

    def on_stop(self, call: Callable[[], object] | None) -> None:
        """Call this at each demand from now on; None: nothing."""
        self._on_stop = call

    def on_first_stop(self, call: Callable[[], object]) -> None:
        """Likewise, but not at demands after the first one."""
        self._on_stop = lambda: call() if self.landings + self.motor_stops == 1 else None

    def _stop(self) -> None:
        self.asks = False
        if self._on_stop is not None:
            self._on_stop()


class Controls:
    """Three controls in one place: go, which is held; stop; and another one that then stops the motors.

    No control means more when it comes again, so nothing is pressed twice by mistake; what it demands is
    requested again.

    Args:
        operator: is given the go and the stops.
        max_gap_s: between two reports that go is held; a longer one counts as let go.
        place: where they are, for people; empty: in the terminal.
        min_reports: within the last `HOLD_S`, without which it does not count as held.
    """

    def __init__(self, operator: Operator, max_gap_s: float, place: str = "", min_reports: int = 1) -> None:
        self._operator = operator
        self._max_gap_s = max_gap_s
        self._place = place
        self._min_reports = min_reports
        self._began_s: float | None = None
        self._reports_s: deque[float] = deque(maxlen=min_reports)

    def hold_go(self, now_s: float) -> None:
        """Go is held, reported at a time in seconds; what was held before it was asked for does not count."""
        if not self._operator.asks:
            self.let_go()
            return
        if self._began_s is None or now_s - self._reports_s[-1] > self._max_gap_s:
            self.let_go()
            self._began_s = now_s
        self._reports_s.append(now_s)
        is_held = len(self._reports_s) == self._min_reports and now_s - self._reports_s[0] <= HOLD_S
        if is_held and now_s - self._began_s >= HOLD_S:
            self._operator.give_go()

    def let_go(self) -> None:
        """Go is not held any more."""
        self._began_s = None
        self._reports_s.clear()

    def stop(self) -> None:
        """Land; pressed again, by whomever, it is the same stop."""
        self.let_go()
        self._operator.demand_landing(self._place)

    def stop_motors(self) -> None:
        """Stop the motors; it means nothing before a stop."""
        self.let_go()
        self._operator.demand_motors_off()
