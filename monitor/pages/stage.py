"""`/stage`: flight and contest for an audience, on a projector, without controls."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from monitor.pages.shell import bare, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor

STYLE = "".join(f'<link rel="stylesheet" href="/static/{name}.css">' for name in ("monitor", "stage"))


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/stage", dark=True)
    def stage() -> None:
        ui.add_head_html(STYLE)
        with bare("Stage"):
            ui.element("div").props("id=stage")
        use_module("stage.js")
