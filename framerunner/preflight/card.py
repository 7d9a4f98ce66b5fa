"""The flight card: one page with all that matters of a flight, written before the drone is armed."""

from __future__ import annotations

import getpass
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from framerunner.preflight.run import PreflightReport
from framerunner.terminal import warn
from framerunner.wire.operator_messages import CardSection, Row
from offboard.safety.check import Outcome

if TYPE_CHECKING:
    from framerunner.flying.plan import FlightPlan
    from framerunner.preflight.run import PreflightSettings
    from offboard.safety.rules import SafetyRules

PROCEDURE = (
    "Stop: press SPACE in the terminal, or Land on the operator's page. The drone lands where it is.",
    "Stop the motors at once: then press K, or Stop motors on the page. The drone falls.",
    "The app does not answer: move the mode switch to position mode and land, or use the kill switch.",
    "The app ends or the link is lost: the drone's failsafes above land it.",
    "A fence, a failsafe or the app's box acts: let the drone land; find the cause before the next start.",
)
"""What the operator does when something goes wrong."""
HTML_NAME, PDF_NAME = "flight_card.html", "flight_card.pdf"


@dataclass(frozen=True, slots=True)
class FlightCard:
    """The card's contents, for people."""

    title: str
    sections: tuple[CardSection, ...]


def make_card(
    plan: FlightPlan,
    settings: PreflightSettings,
    report: PreflightReport,
    *,
    safety: SafetyRules,
    operator: str,
    kind: str,
    now: datetime,
) -> FlightCard:
    """Put the card together.

    Args:
        plan: with a mission.
        settings: of the checks.
        report: of the checks.
        safety: what the drone does when the flight is aborted.
        operator: who flies.
        kind: of the flight, such as "dry run".
        now: with a time zone.
    """
    fence = report.fence
    corners = ", ".join(f"({x:.1f}, {y:.1f})" for x, y in fence.corners_arena_m)
    flight = (
        ("date", now.strftime("%Y-%m-%d %H:%M %Z").strip()),
        ("operator", operator or getpass.getuser()),
        ("kind", kind),
        ("drone", report.vehicle),
        ("link", settings.drone_url),
        ("camera", settings.camera_url or "none"),
        ("scenario", plan.scenario.name),
        ("mission", f"{plan.chart.name}, class {plan.chart.mission_class}"),
        ("time limit", f"{plan.limit_s:g} s from motors on"),
        ("on abort", "lands where it is" if safety.abort == "land" else _hold_words(safety.hold_s)),
    )
    limits = (
        ("caps", "none" if plan.caps is None else plan.caps.words),
        ("fence, arena axes", f"x, y in m: {corners}"),
        ("fence, height and radius", f"{fence.height_m:g} m above the start, {fence.radius_m:g} m around it"),
    )
    overridden = tuple((each.name, each.value) for each in report.checks if each.outcome is Outcome.ACCEPTED)
    changes = tuple((each.name, f"{each.before:g}", f"{each.after:g}") for each in report.changes)
    if report.kept is not None:
        changes += (("old values", str(report.kept), ""),)
    return FlightCard(
        f"Flight card: {plan.scenario.name}",
        (
            table("Flight", flight),
            table("Caps and fence", limits),
            table("Failed checks that the operator accepts", overridden or (("none", ""),)),
            table("Parameters changed: name, before, now", changes or (("none", "", ""),)),
            table("Abort procedure", tuple((str(n), step) for n, step in enumerate(PROCEDURE, 1))),
            table("Checks: name, result, value, allowed, what to do", _check_rows(report)),
        ),
    )


def table(title: str, rows: tuple[tuple[str, ...], ...]) -> CardSection:
    """A table; the first column names what the others tell."""
    return CardSection(title=title, rows=tuple(Row(cells=cells) for cells in rows))


def _hold_words(hold_s: float) -> str:
    return f"holds for {hold_s:g} s, then lands; at low battery and when the link is lost it lands at once"


def _check_rows(report: PreflightReport) -> tuple[tuple[str, ...], ...]:
    return tuple(
        (check.name, check.outcome.value, check.value, check.limit, check.advice) for check in report.checks
    )


def write_card(card: FlightCard, folder: Path) -> None:
    """Write the card as a page and as a PDF; what cannot be written is reported on standard error."""
    try:
        (folder / HTML_NAME).write_text(card_html(card), encoding="utf-8")
    except OSError as error:
        warn(f"cannot write '{folder / HTML_NAME}': {error.strerror or error}")
    try:
        from framerunner.preflight.card_pdf import write_pdf

        write_pdf(card.title, card.sections, folder / PDF_NAME)
    except OSError as error:
        warn(f"cannot write '{folder / PDF_NAME}': {error.strerror or error}")


def card_html(card: FlightCard) -> str:
    """The card as a page without scripts; all texts are escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("framerunner.preflight", "templates")
    page = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return page.get_template("flight_card.html.j2").render(card=card)
