"""The operator of a flight: a go before arming, and a stop that lands or, pressed again, stops the motors."""

from __future__ import annotations

from collections.abc import Callable

GO_WORDS = "waiting for the operator's go"
STOPPED = "stopped by the operator"


class Operator:
    """What an operator has demanded so far. Used on one event loop; no clock.

    A key, a page or a test calls `give_go` and `press_stop`; the flight reads them and is told of each stop.

    Args:
        needs_go: the flight waits for a go before it arms; not in a dry run.
        hint: how to give the go and to stop, for people.

    Attributes:
        needs_go: see above.
        has_go: the go was given, or none is needed.
        stops: how often stop was pressed: once lands, twice stops the motors.
    """

    def __init__(self, *, needs_go: bool = True, hint: str = "") -> None:
        self.needs_go = needs_go
        self.has_go = not needs_go
        self.hint = hint
        self.stops = 0
        self._on_stop: Callable[[], object] | None = None

    @property
    def kills(self) -> bool:
        """Whether the motors must stop at once, wherever the drone is."""
        return self.stops > 1

    def ask_for_go(self) -> None:
        """Forget a go that was given before: nobody had been told that the drone is ready."""
        self.has_go = not self.needs_go

    def give_go(self) -> None:
        """Let the flight arm; ignored after a stop."""
        if not self.stops:
            self.has_go = True

    def press_stop(self) -> None:
        """End the flight: land, or stop the motors if it was pressed before."""
        self.stops += 1
        if self._on_stop is not None:
            self._on_stop()

    def on_stop(self, call: Callable[[], object] | None) -> None:
        """Call this at each stop from now on; None: nothing."""
        self._on_stop = call
