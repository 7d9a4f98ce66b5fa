"""Runs a session in real time, with a line once a second and a report at its end."""

from __future__ import annotations

import time
from collections.abc import Callable

from rich.console import Console
from rich.live import Live
from rich.text import Text

from framerunner.doctor.page import findings_table
from framerunner.mocap.facts import Facts, SendSettings
from framerunner.mocap.judgement import is_fused, judge, line
from framerunner.mocap.session import MocapSession
from framerunner.mocap.sources import PoseSource
from framerunner.wire.transports.vehicle_link import VehicleLink
from offboard.safety.check import Check, failures

_WAIT_S = 0.002
_LINE_S = 1.0
_PLAIN_LINE_S = 5.0  # where no line can be replaced


def run_session(
    link: VehicleLink, source: PoseSource, settings: SendSettings, seconds: float | None, console: Console
) -> bool:
    """Send poses until the source ends, the time is over or Ctrl-C; then print the report.

    Args:
        link: to the vehicle.
        source: of the poses.
        settings: how they are sent.
        seconds: the time; None: without end.
        console: for lines and report.

    Returns:
        Whether nothing is wrong.
    """
    began_s = time.monotonic()

    def clock() -> float:
        return time.monotonic() - began_s

    # Time stamps go on when this program is started again: a vehicle would take a jump for late poses.
    session = MocapSession(
        link, source, settings, lambda words: console.print(words, highlight=False), zero_s=began_s
    )
    live = Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None
    facts: Facts | None = None
    try:
        if live is not None:
            live.start()
        facts = _run(session, clock, seconds, _shower(console, live))
    except KeyboardInterrupt:
        facts = session.facts(clock())
        raise
    finally:
        if live is not None:
            live.stop()
        if facts is not None:
            _report(console, session, link.url, facts)
    return session.vehicle.system_id is not None and not failures(judge(facts))


def _run(
    session: MocapSession, clock: Callable[[], float], seconds: float | None, show: Callable[[str], None]
) -> Facts:
    line_s = _LINE_S
    facts = session.facts(0.0)
    while True:
        now_s = clock()
        if (seconds is not None and now_s >= seconds) or session.source.ended:
            # At the end of a source its rate falls: the last facts of the flow count.
            return facts if session.source.ended else session.facts(now_s)
        session.step(now_s, _WAIT_S, clock)
        if now_s >= line_s:
            line_s = now_s + _LINE_S
            facts = session.facts(now_s)
            session.note_use(is_fused(facts), facts.comparison, _LINE_S)
            show(line(facts) if session.vehicle.system_id is not None else "waiting for a vehicle")


def _shower(console: Console, live: Live | None) -> Callable[[str], None]:
    """Shows a line in the place of the one before; where that is not possible, one now and then."""
    if live is not None:
        return lambda words: live.update(Text(words), refresh=True)
    shown_s = -_PLAIN_LINE_S

    def show(words: str) -> None:
        nonlocal shown_s
        if time.monotonic() - shown_s >= _PLAIN_LINE_S:
            shown_s = time.monotonic()
            console.print(words, highlight=False, soft_wrap=True)

    return show


def _report(console: Console, session: MocapSession, url: str, facts: Facts) -> None:
    if session.vehicle.system_id is None:
        console.print(
            f"no vehicle was heard on {url}; is it running and sending to this address?",
            highlight=False,
            soft_wrap=True,
        )
        return
    findings: list[Check] = judge(facts)
    if session.source.failure:
        console.print(session.source.failure, highlight=False, soft_wrap=True)
    vehicle = session.vehicle
    words = (
        f"Vehicle {vehicle.system_id} ({vehicle.autopilot_name}) on {url}, poses from {session.source.label}"
    )
    console.print(words)
    console.print(findings_table(findings))
