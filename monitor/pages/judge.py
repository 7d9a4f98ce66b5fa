"""The page `/competition/try/{id}`: a judge's form for one try, made for a phone; all others read it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.competition import STYLE
from monitor.pages.shell import shell, use_module

if TYPE_CHECKING:
    from monitor.server import Monitor


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/competition/try/{try_id:int}")
    def judge(request: Request, try_id: int) -> None:
        ui.add_head_html(STYLE)
        with shell(monitor, request, f"Try {try_id}", "/competition") as visitor:
            ui.element("div").props("id=try")
        use_module("competition_try.js", judge=visitor.may_judge, attempt=try_id)
