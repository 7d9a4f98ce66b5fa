"""Makes the GUARDS documents of a flight: what the guards read, which hold, and how often each was taken."""

from __future__ import annotations

from collections import Counter
from typing import Any

from framerunner.flying.navigation_reporter import PERIOD_US
from offboard.engine import MissionEngine, TransitionTaken

MAX_GUARDS = 100
MAX_COUNTS = 1000
_TEXT_CHARACTERS = 80  # of a guard's value that is not a number
_DIGITS = 6  # of a guard's value: more would take more pieces, and so longer to arrive
_EXACT = 2**53  # larger integers lose digits in some JSON readers

Json = dict[str, Any]


class GuardReporter:
    """Decides at each tick whether there is news to report."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._reported_us: int | None = None
        self._reported: Json | None = None

    def count(self, taken: TransitionTaken) -> None:
        """Count a transition."""
        self._counts.update(taken.ids)

    def document(self, engine: MissionEngine, time_us: int) -> Json | None:
        """The document to send now; None if nothing has changed, or the last one was sent just before."""
        if self._reported_us is not None and time_us - self._reported_us < PERIOD_US:
            return None
        chart = engine.chart_now()
        content = {
            "counts": dict(self._counts.most_common(MAX_COUNTS)),
            "guards": [[each.id, each.holds] for each in chart.guards[:MAX_GUARDS]],
            "values": [[each.name, plain_value(each.value), each.unit] for each in chart.values[:MAX_GUARDS]],
        }
        if content == self._reported:
            return None
        self._reported, self._reported_us = content, time_us
        return {"time_us": time_us, **content}


def plain_value(value: object) -> object:
    """A value of a guard as JSON; a contestant's pilot may hold any type."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int) and abs(value) < _EXACT:
        return int(value)
    try:
        if not isinstance(value, str) and hasattr(value, "__float__"):
            return float(f"{float(value):.{_DIGITS}g}")
        return str(value)[:_TEXT_CHARACTERS]
    except Exception:  # any that a contestant's conversion raises
        return type(value).__name__
