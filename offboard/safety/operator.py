"""The operator of a flight: a go before arming, and a stop that lands or, the second time, stops the motors.

Keys of a terminal and buttons of a page demand through the same `Controls`; they differ in who calls it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

GO_WORDS = "waiting for the operator's go"
STOPPED = "stopped by the operator"
HOLD_S = 1.0
"""For which a control must be held to give the go."""

Phase = Literal["checks", "waiting", "flying", "landing", "holding", "motors stopped", "ended"]
"""What the flight does, for the operator."""


class Operator:
    """What an operator has demanded so far. Used on one event loop; no clock.

    A key, a page or a test calls `give_go` and `press_stop`; the flight reads them and is told of each stop.

    Args:
        needs_go: the flight waits for a go before it arms; not in a dry run.
        hint: how to give the go and to stop, for people.

    Attributes:
        needs_go: see above.
        has_go: the go was given, or none is needed.
        asks: the flight waits for the go now.
        stops: how often stop was pressed: once lands, twice stops the motors.
        stopped_by: who pressed first, for people; empty: nobody, or it is not known.
        phase: what the flight does; set by the flight.
    """

    def __init__(self, *, needs_go: bool = True, hint: str = "") -> None:
        self.needs_go = needs_go
        self.has_go = not needs_go
        self.asks = False
        self.hint = hint
        self.stops = 0
        self.stopped_by = ""
        self.phase: Phase = "checks"
        self._on_stop: Callable[[], object] | None = None

    @property
    def kills(self) -> bool:
        """Whether the motors must stop at once, wherever the drone is."""
        return self.stops > 1

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

    def press_stop(self, by: str = "") -> None:
        """End the flight: land, or stop the motors if it was pressed before."""
        if not self.stops:
            self.stopped_by = by
        self.stops += 1
        self.asks = False
        if self._on_stop is not None:
            self._on_stop()

    def on_stop(self, call: Callable[[], object] | None) -> None:
        """Call this at each stop from now on; None: nothing."""
        self._on_stop = call


class Controls:
    """Three controls in one place: go, which is held; stop; and another one that then stops the motors.

    No control means more when it comes again, so nothing is pressed twice by mistake.

    Args:
        operator: is given the go and the stops.
        max_gap_s: between two reports that go is held; a longer one counts as let go.
        place: where they are, for people; empty: in the terminal.
    """

    def __init__(self, operator: Operator, max_gap_s: float, place: str = "") -> None:
        self._operator = operator
        self._max_gap_s = max_gap_s
        self._place = place
        self._began_s: float | None = None
        self._latest_s = 0.0

    def hold_go(self, now_s: float) -> None:
        """Go is held, reported at a time in seconds; what was held before it was asked for does not count."""
        if not self._operator.asks:
            self._began_s = None
            return
        if self._began_s is None or now_s - self._latest_s > self._max_gap_s:
            self._began_s = now_s
        self._latest_s = now_s
        if now_s - self._began_s >= HOLD_S:
            self._operator.give_go()

    def let_go(self) -> None:
        """Go is not held any more."""
        self._began_s = None

    def stop(self) -> None:
        """Land; pressed again, by whomever, it is the same stop."""
        self.let_go()
        if self._operator.stops == 0:
            self._operator.press_stop(self._place)

    def stop_motors(self) -> None:
        """Stop the motors; it means nothing before a stop."""
        self.let_go()
        if self._operator.stops == 1:
            self._operator.press_stop(self._place)
