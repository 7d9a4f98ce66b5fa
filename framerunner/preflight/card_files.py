"""Writes the flight card as a page and as a PDF."""

from __future__ import annotations

from pathlib import Path

from framerunner.preflight.card import FlightCard
from framerunner.terminal import warn

HTML_NAME, PDF_NAME = "flight_card.html", "flight_card.pdf"


def write_card(card: FlightCard, folder: Path) -> None:
    """Write the card as a page and as a PDF; what cannot be written is reported on standard error."""
    try:
        (folder / HTML_NAME).write_text(card_html(card), encoding="utf-8")
    except OSError as error:
        warn(f"cannot write '{folder / HTML_NAME}': {error.strerror or error}")
    try:
        from framerunner.preflight.card_pdf import write_pdf

        write_pdf(card, folder / PDF_NAME)
    except OSError as error:
        warn(f"cannot write '{folder / PDF_NAME}': {error.strerror or error}")


def card_html(card: FlightCard) -> str:
    """The card as a page without scripts; all texts are escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("framerunner.preflight", "templates")
    page = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return page.get_template("flight_card.html.j2").render(card=card)
