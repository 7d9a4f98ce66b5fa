"""The page `/ranking`, for a projector: it follows the contest by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.competition import STYLE
from monitor.pages.shell import shell, use_module
from monitor.urls import is_for_others

if TYPE_CHECKING:
    from monitor.server import Monitor


def register(monitor: Monitor) -> None:
    """Add the page."""

    @ui.page("/ranking")
    def ranking(request: Request) -> None:
        ui.add_head_html(STYLE)
        with shell(monitor, request, "Ranking", "/ranking"):
            ui.element("div").props("id=ranking")
        use_module("competition_ranking.js", join=is_for_others(monitor.place[0]))
