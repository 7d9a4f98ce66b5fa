"""`/replay`: recorded flights on a line of time, one or two of them. All of it is drawn in the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.shell import shell, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor

_STYLE = '<link rel="stylesheet" href="/static/monitor.css"><link rel="stylesheet" href="/static/replay.css">'


def register(monitor: Monitor) -> None:
    """Add the page; `monitor.replay_api` has what it fetches."""

    @ui.page("/replay")
    def replay(request: Request) -> None:
        ui.add_head_html(_STYLE)
        with shell(monitor, request, "Replay", "/replay"):
            ui.element("div").props("id=replay")
            use_module("replay.js", hasRuns=monitor.equipment.runs is not None)
