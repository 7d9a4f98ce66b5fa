"""What the terminal shows during a flight, and the result in words."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Sequence
from math import isfinite

from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from framerunner.flying.judges import Judge
from framerunner.runs.recorder import FlightRecorder
from framerunner.terminal import ProgressLine, say
from offboard.app import MissionEnd, Moment
from offboard.safety.operator import GO_WORDS
from scenarios.result import FlightResult, RefereeSnapshot
from vision.types import Detection

_REFRESH_S = 0.2
_LINE_S = 10.0


class MomentLines:
    """Ticks of a flight where there is no terminal: a line at every change and every ten seconds."""

    def __init__(self) -> None:
        self._told = ""
        self._line_s = -_LINE_S

    def show(self, moment: Moment, crossed: Sequence[str], also: str) -> None:
        """Print a line if it is due, or if the mission's state or `also` has changed."""
        time_s, told = moment.flight_time_s, moment.mission_state + also
        if told == self._told and time_s - self._line_s < _LINE_S:
            return
        self._told, self._line_s = told, time_s
        note = pause_in_words(moment) or moment.remark
        say(
            f"{time_s:6.1f} s  {moment.mission_state:22s} {place_in_words(moment)}  "
            f"crossed: {', '.join(crossed) or 'none'}{'  ' if note else ''}{note}"
        )


class FlightDisplay:
    """A live table in a terminal; elsewhere a line at every change of state and every ten seconds.

    Shown while it is entered as a context; the recorder has the latest tick, the judge how the try stands.
    """

    def __init__(self, title: str, limit_s: float, recorder: FlightRecorder, judge: Judge) -> None:
        self._title = title
        self._limit_s = limit_s
        self._recorder = recorder
        self._judge = judge
        self._console = Console(file=sys.stderr)
        self._showing: asyncio.Task[None] | None = None

    async def __aenter__(self) -> FlightDisplay:
        """Start to show."""
        self._showing = asyncio.create_task(self._show())
        return self

    async def __aexit__(self, *_: object) -> None:
        """Remove the table."""
        if self._showing is not None:
            self._showing.cancel()
            await asyncio.gather(self._showing, return_exceptions=True)

    async def _show(self) -> None:
        if not self._console.is_terminal:
            lines = MomentLines()
            while True:
                standing, moment = await self._judge.standing(), self._recorder.latest
                if moment is not None:
                    lines.show(moment, standing.crossed if standing else (), pause_in_words(moment))
                await asyncio.sleep(_REFRESH_S)
        with Live(console=self._console, auto_refresh=False, transient=True) as live:
            while True:
                live.update(self._table(await self._judge.standing()), refresh=True)
                await asyncio.sleep(_REFRESH_S)

    def _table(self, standing: RefereeSnapshot | None) -> Table:
        moment = self._recorder.latest
        if moment is None:
            table = _empty_table(self._title)
            table.add_row("state", "connecting, waiting until the drone is ready")
            return table
        table = moment_table(self._title, moment, f"{moment.flight_time_s:.1f} s of {self._limit_s:g} s")
        if standing is not None:
            crossed = ", ".join(standing.crossed) or "none"
            table.add_row("crossed", f"{crossed}   contacts: {standing.contacts}")
        return table


def moment_table(title: str, moment: Moment, time: str) -> Table:
    """A tick of a flight as a table, with its time in words."""
    table = _empty_table(title)
    table.add_row("state", escape(moment.mission_state))
    if moment.paused:
        table.add_row("[yellow]paused[/]", escape(pause_in_words(moment).removeprefix("paused: ")))
    elif moment.remark:
        waits = moment.remark.startswith(GO_WORDS)
        table.add_row(f"[yellow]{'waiting' if waits else 'limited'}[/]", escape(moment.remark))
    table.add_row("time", time)
    table.add_row("drone", f"{place_in_words(moment)}  {escape(moment.state.mode)}")
    for colour in ("red", "green", "blue"):
        detection: Detection = getattr(moment.detections, colour)
        table.add_row(f"[{colour}]{colour}[/]", _seen(detection))
    return table


def _empty_table(title: str) -> Table:
    table = Table(title=escape(title), show_header=False, min_width=60)
    table.add_column(style="bold")
    table.add_column()
    return table


def place_in_words(moment: Moment) -> str:
    """Position and yaw of the drone."""
    state = moment.state
    return f"x {state.x:5.2f}  y {state.y:5.2f}  z {state.z:4.2f} m  yaw {state.yaw:5.2f} rad"


def pause_in_words(moment: Moment) -> str:
    """Why the mission is paused; empty if it is not."""
    if not moment.paused:
        return ""
    mode = moment.state.mode
    if moment.remark:
        return f"paused: given back ({mode}), but {moment.remark}"
    return f"paused: the pilot has the sticks ({mode})"


def _seen(detection: Detection) -> str:
    if not detection.seen:
        return "not seen"
    if not isfinite(detection.d):
        return "seen in part"
    return f"{detection.d:.2f} m away, {detection.a:.0f} degrees aside"


class LockstepProgress(ProgressLine):
    """How far a flight in lockstep is; a line every two seconds where there is no terminal."""

    def __init__(self, limit_s: float) -> None:
        super().__init__(quiet_s=1.0, line_s=2.0, refresh_s=0.25)
        self._limit_s = limit_s

    def see(self, moment: Moment) -> None:
        """Show a tick of the flight, if the last one shown is old enough."""
        if self.is_due:
            speed = moment.flight_time_s / (time.monotonic() - self.started_s)
            self.show(
                f"{moment.flight_time_s:6.1f} s of {self._limit_s:g} s  {moment.mission_state:22s} "
                f"{speed:.0f} times real time"
            )


def _faults_in_words(result: FlightResult) -> str:
    """The faults of a flight, and what came of them."""
    parts = [", ".join(result.faults)]
    if result.fault_reaction:
        parts.append(result.fault_reaction)
    if result.fault_outcome:
        parts.append(f"{result.fault_outcome} ({result.fault_expected})")
    return "; ".join(parts)


def dry_run_line(end: MissionEnd) -> str:
    """How a dry run ended, in a line for people."""
    how = f"aborted: {end.reason}" if end.ended == "aborted" else "done"
    return (
        f"dry run {how}; the mission ran for {end.flight_time_s:.1f} s in {end.ticks} ticks, last "
        f"in {end.mission_state}; nothing was armed"
    )


def result_lines(result: FlightResult) -> str:
    """A result in two lines for people, one more if it was not clean, and one if something failed."""
    error_m = result.landing_error_m
    landing = "did not land" if error_m is None else f"landed {100 * error_m:.1f} cm from the base's centre"
    verdict, reason = result.verdict, result.reason
    sentence = reason if reason.startswith(verdict) else f"{verdict}: {reason}"
    drone_class = "" if result.mission_class == "contest" else f", class {result.mission_class}"
    times = f", {result.times_bound:.2f} times the bound" if result.times_bound else ""
    kept = f", kept in its box for {result.kept_in_box_s:.1f} s" if result.kept_in_box_s else ""
    cause = f"\ncause: {result.cause}" if result.cause else ""
    faults = f"\nfaults: {_faults_in_words(result)}" if result.faults else ""
    return (
        f"{sentence}\n"
        f"try {result.try_time_s:.1f} s{times}, penalty {result.penalty_s:.1f} s, "
        f"path {result.path_length_m:.1f} m, {landing}, judged by {result.judged_by}"
        f"{drone_class}{kept}{cause}{faults}"
    )
