"""The page `/competition`: teams, draw, who flies next, tries; with controls for judges."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.shell import shell, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor

STYLE = '<link rel="stylesheet" href="/static/competition.css">'


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/competition")
    def competition(request: Request) -> None:
        ui.add_head_html(STYLE)
        with shell(monitor, request, "Competition", "/competition") as visitor:
            ui.element("div").props("id=competition")
        use_module("competition.js", judge=visitor.may_judge)
