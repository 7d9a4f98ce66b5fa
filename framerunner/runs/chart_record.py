"""What a mission's chart did in a flight: how often each transition was taken, when each state was active."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from framerunner.wire.mission_report import TransitionTaken
from offboard.app import Moment


@dataclass(frozen=True, slots=True)
class StateSpan:
    """A time in which a state was active; vehicle time, seconds."""

    state: str  # full id of the leaf
    from_s: float
    to_s: float


class ChartRecord:
    """Sees a flight tick by tick, as an observer.

    Attributes:
        counts: how often each transition was taken, by id; see `offboard.chart.spec.transition_id`.
        taken: all transitions, in order.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.taken: list[TransitionTaken] = []
        self._spans: list[StateSpan] = []
        self._state = ""
        self._since_us = 0
        self._last_us = 0

    def see(self, moment: Moment) -> None:
        """Take a tick."""
        time_us = self._last_us = moment.state.time_us
        taken = moment.transition
        if taken is None and moment.mission_state == self._state:
            return
        if taken is not None:
            self.taken.append(taken)
            self.counts.update(taken.ids)
        if self._state:
            self._spans.append(self._span(time_us))
        self._state, self._since_us = moment.mission_state, time_us

    def rename(self, ids: Mapping[str, str]) -> None:
        """After a change of the chart: keep the counts of transitions that are still there, by new ids."""
        self.counts = Counter({ids[name]: count for name, count in self.counts.items() if name in ids})

    def ended(self, since: int = 0) -> tuple[StateSpan, ...]:
        """The times of states that were left, in order, without the first `since` of them."""
        return tuple(self._spans[since:])

    def spans(self) -> tuple[StateSpan, ...]:
        """The time line of states until now, the present one last."""
        if not self._state:
            return ()
        return (*self._spans, self._span(self._last_us))

    def _span(self, to_us: int) -> StateSpan:
        return StateSpan(self._state, self._since_us / 1e6, to_us / 1e6)
