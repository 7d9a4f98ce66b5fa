"""`/`: a flight as it happens. All of it is drawn in the browser, from what the live channel sends."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.shell import shell, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor

STYLE = '<link rel="stylesheet" href="/static/monitor.css">'


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/")
    def live(request: Request) -> None:
        ui.add_head_html(STYLE)
        with shell(monitor, request, "Live", "/"):
            ui.element("div").props("id=live")
            use_module("live.js")
