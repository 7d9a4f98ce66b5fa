"""`/chart`: the mission's diagram with its active state lit, large."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.live import STYLE
from monitor.pages.shell import shell, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/chart")
    def chart(request: Request) -> None:
        ui.add_head_html(STYLE)
        with shell(monitor, request, "Statechart", "/chart"):
            ui.element("div").props("id=chart")
            use_module("chart.js")
