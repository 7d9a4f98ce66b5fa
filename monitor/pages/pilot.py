"""The page of the manual pilot, at `/pilot`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.shell import shell, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor

_STYLE = "".join(f'<link rel="stylesheet" href="/static/{name}.css">' for name in ("monitor", "pilot"))


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/pilot")
    def pilot(request: Request) -> None:
        with shell(monitor, request, "Pilot", "/pilot") as visitor:
            ui.add_head_html(_STYLE)
            root = ui.element("div").classes("pilot")
            root.props["id"] = "pilot"
        use_module("pilot.js", mayFly=visitor.may_fly)
