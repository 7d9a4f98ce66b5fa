"""Makes the messages that say what the chart of a flight does, at most twenty a second."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping

from framerunner.editing.editor_messages import Contact, Ended, Now, Taken
from framerunner.flying.cause import lost_in
from framerunner.flying.fly import FinishedFlight
from framerunner.flying.run_control import RunStanding
from framerunner.runs.track import ChartRecord
from framerunner.wire.finite_json import finite
from framerunner.wire.mission_report import TransitionTaken, rounded
from offboard.app import Moment
from offboard.drone import DroneState
from offboard.engine import MissionEngine
from scenarios.models import TrueState

PERIOD_S = 0.04  # wall time between two messages of a flight that is not paused
TRAIL_US = 100_000  # vehicle time between two places of the trail
MAX_TAKEN = 100

Point = tuple[float | None, ...]


class RunReporter:
    """Sees a flight as observer (`see`, `see_truth`) and as a control's listener (`hear`).

    Args:
        run: id of the flight.
        tell: takes the messages.
        clock: seconds that never go back.
        solids: names of gates and obstacles, to touch which is told.
    """

    def __init__(
        self,
        run: str,
        tell: Callable[[Now], None],
        clock: Callable[[], float] = time.monotonic,
        *,
        solids: Collection[str] = (),
    ) -> None:
        self._run = run
        self._tell = tell
        self._clock = clock
        self._record = ChartRecord()
        self._trail: list[Point] = []
        self._trail_us = -TRAIL_US
        self._command: Point = (0.0, 0.0, 0.0, 0.0)
        self._told_s = -PERIOD_S
        self._standing: RunStanding | None = None
        self._full = True
        self._solids = frozenset(solids)
        self._began_us: int | None = None  # motors on
        self._contacts: dict[str, int] = {}  # vehicle time of the first one with each
        self._told = (0, 0, 0, 0)  # transitions, spans, contacts and places

    def see(self, moment: Moment) -> None:
        """Take a tick."""
        self._record.see(moment)
        command = moment.command
        self._command = (
            command.forward_m_s,
            command.left_m_s,
            command.up_m_s,
            command.yaw_rate_rad_s,
        )
        state = moment.state
        if state.time_us - self._trail_us >= TRAIL_US:
            self._trail_us = state.time_us
            self._trail.append(_numbers(state.time_us / 1e6, state.x, state.y, state.z))

    def see_truth(self, truth: TrueState) -> None:
        """Note when the motors start, and the first contact with each gate and obstacle."""
        if self._began_us is None and truth.motors_on:
            self._began_us = truth.time_us
        for name in truth.contacts:
            if name in self._solids:
                self._contacts.setdefault(name, truth.time_us)

    def rename(self, ids: Mapping[str, str]) -> None:
        """Count on with a changed chart; the next message is a full one."""
        self._record.rename(ids)
        self._full = True

    def tell_all(self) -> None:
        """Make the next message a full one; may be called from another thread."""
        self._full = True

    def hear(self, engine: MissionEngine, state: DroneState, standing: RunStanding) -> None:
        """Tell what is new, unless that was done just before."""
        now_s = self._clock()
        is_due = now_s - self._told_s >= PERIOD_S
        if not (is_due or standing.paused or self._full or standing != self._standing):
            return
        self._told_s, self._standing = now_s, standing
        self._tell(self._now(engine, state, standing))

    def ended(self, flown: FinishedFlight) -> Ended:
        """The last message of a flight."""
        result = flown.result
        return Ended(
            run=self._run,
            text=result.reason,
            lost_in=lost_in(result, flown.track),
            result=result.as_json(),
            counts=dict(self._record.counts),
            spans=self._record.spans(),
        )

    def failed(self, text: str) -> Ended:
        """The last message of a flight that a fault of the program ended."""
        spans, counts = self._record.spans(), dict(self._record.counts)
        state = spans[-1].state if spans else ""
        return Ended(run=self._run, text=text, lost_in=state, result=None, counts=counts, spans=spans)

    def _now(self, engine: MissionEngine, state: DroneState, standing: RunStanding) -> Now:
        full, self._full = self._full, False
        chart, record = engine.chart_now(), self._record
        taken_told, spans_told, contacts_told, trail_told = (0, 0, 0, 0) if full else self._told
        taken, spans = record.taken[taken_told:], record.ended(spans_told)
        contacts = [Contact(name=name, time_s=time_us / 1e6) for name, time_us in self._contacts.items()]
        self._told = (len(record.taken), spans_told + len(spans), len(contacts), len(self._trail))
        changed = record.counts if full else dict.fromkeys(name for each in taken for name in each.ids)
        return Now(
            run=self._run,
            full=full,
            time_s=state.time_us / 1e6,
            began_s=None if self._began_us is None else self._began_us / 1e6,
            state=chart.state,
            active=chart.active,
            seconds_in_state=chart.seconds_in_state,
            paused=standing.paused,
            stopped_in=standing.stopped_in,
            speed=standing.speed,
            guards=chart.guards,
            values=chart.values,
            taken=tuple(map(_taken, taken[-MAX_TAKEN:])),
            counts={name: record.counts[name] for name in changed},
            spans=spans,
            contacts=tuple(contacts[contacts_told:]),
            pose=_numbers(state.x, state.y, state.z, state.yaw),
            command=_numbers(*self._command),
            trail=tuple(self._trail[trail_told:]),
        )


def _taken(taken: TransitionTaken) -> Taken:
    return Taken(
        ids=taken.ids,
        source=taken.source,
        target=taken.target,
        when=taken.when,
        values=tuple((name, rounded(value)) for name, value in taken.values),
        time_s=taken.time_us / 1e6,
        seconds=taken.seconds_in_source,
    )


def _numbers(*values: float | None) -> Point:
    return tuple(finite(list(values)))
