"""The operators' pages: which of them are connected, how late they are, and what they demand. No clock.

The flight sends numbered beats to each page, and each message of a page names the latest beat that it has
received. So the age of a message is known by the flight's own clock, however long it was on its way.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from framerunner.wire.operator_messages import PageMessage, PageState
from offboard.safety.operator import Controls, Operator

BEAT_S = 0.2
GO_GAP_S = 0.4
"""Between two messages of a page whose button is held, which come ten times a second."""
GO_AGE_S = 0.6
"""Of the latest beat that a page has received when it demands the go."""
MOTORS_AGE_S = 1.5
"""Likewise when it demands that the motors stop: the situation may have changed. A landing is never late."""
ALIVE_S = 1.0
LOST_S = 5.0
"""Without any page, in a flight without a terminal; then it lands."""
LOST = "no operator's page was connected"
_BEATS_KEPT = 50


@dataclass(slots=True)
class _Page:
    name: str
    controls: Controls
    heard_s: float
    delay_s: float | None = None
    echoed: int = -1


class OperatorPages:
    """The pages of one flight.

    Args:
        operator: of the flight.
        flight: names it; messages about another one are ignored.
        alone: there is no terminal; a flight that no page watches lands.
    """

    def __init__(self, operator: Operator, flight: str, *, alone: bool) -> None:
        self._operator = operator
        self._flight = flight
        self._alone = alone
        self._pages: dict[int, _Page] = {}
        self._beats: deque[tuple[int, float]] = deque(maxlen=_BEATS_KEPT)  # number, and when it was sent
        self._watched_s: float | None = None  # when a page was heard last in flight

    def beat(self, now_s: float) -> int:
        """The number of a beat that is sent now."""
        number = self._beats[-1][0] + 1 if self._beats else 0
        self._beats.append((number, now_s))
        return number

    def take(self, message: PageMessage, now_s: float) -> str:
        """Take a page's message; returns why it was not done, empty if it was."""
        if message.what == "gone":
            self._pages.pop(message.page, None)
            return ""
        page = self._pages.get(message.page)
        if page is None:
            place = f"{message.name or 'somebody'}, on the page"
            page = self._pages[message.page] = _Page(
                message.name, Controls(self._operator, GO_GAP_S, place), now_s
            )
        page.heard_s = now_s
        age_s = self._age_s(message.beat, now_s)
        if age_s is not None and message.what == "here" and message.beat > page.echoed:
            page.echoed, page.delay_s = message.beat, age_s
        if message.flight != self._flight:
            return "" if message.what == "here" else "this flight is over"
        return self._demand(page, message.what, age_s, now_s)

    def lose_all(self) -> None:
        """The connection to the monitor is lost, and with it all pages."""
        self._pages.clear()

    def check(self, now_s: float) -> None:
        """Land a flight without a terminal that no page has watched for `LOST_S`; to be called often."""
        operator = self._operator
        if any(now_s - page.heard_s <= ALIVE_S for page in self._pages.values()):
            self._watched_s = now_s
        if not self._alone or operator.phase not in ("flying", "holding") or operator.stops:
            return
        if self._watched_s is None:
            self._watched_s = now_s
        if now_s - self._watched_s > LOST_S:
            operator.demand_landing(LOST)

    def states(self, now_s: float) -> tuple[PageState, ...]:
        """All pages, for the pages."""
        return tuple(
            PageState(
                page=number,
                name=page.name,
                alive=now_s - page.heard_s <= ALIVE_S,
                delay_ms=None if page.delay_s is None else round(1000 * page.delay_s),
            )
            for number, page in self._pages.items()
        )

    def _demand(self, page: _Page, what: str, age_s: float | None, now_s: float) -> str:
        controls = page.controls
        if what == "stop":
            controls.stop()
        elif what == "let_go":
            controls.let_go()
        elif what == "go":
            if age_s is None or age_s > GO_AGE_S:
                controls.let_go()
                return "the connection is too slow for a go"
            controls.hold_go(now_s)
        elif what == "stop_motors":
            if age_s is None or age_s > MOTORS_AGE_S:
                return "it came too late; press it again"
            if self._operator.stops == 0:
                return "land first"
            controls.stop_motors()
        return ""

    def _age_s(self, beat: int, now_s: float) -> float | None:
        """How long ago a beat was sent; None if it is too old to be known."""
        return next((now_s - sent_s for number, sent_s in reversed(self._beats) if number == beat), None)
