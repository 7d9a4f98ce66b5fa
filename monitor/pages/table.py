"""The pages that JavaScript draws in the browser: an entry each in `PAGES`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.shell import shell, style_links, use_module
from monitor.urls import is_for_others

if TYPE_CHECKING:
    from monitor.access import Visitor
    from monitor.server import Monitor

    Data = Callable[[Monitor, Request, Visitor], dict[str, object]]


@dataclass(frozen=True, slots=True)
class Page:
    """One page.

    Attributes:
        path: as FastAPI writes it.
        title: for the browser's tab; parameters of the path may stand in it, in braces.
        root: id of the element that the module fills.
        module: file below `/static/`.
        styles: names of style sheets below `/static/`, applied after the shell's.
        data: what the module gets, as `use_module` takes it.
        here: the path that is marked in the navigation; None: `path`; "": the page has no header.
        classes: CSS classes of the root element.
        dark: whether it is dark; None: as the browser is set.
    """

    path: str
    title: str
    root: str
    module: str
    styles: tuple[str, ...]
    data: Data = lambda _monitor, _request, _visitor: {}
    here: str | None = None
    classes: str = ""
    dark: bool | None = None


PAGES = (
    Page("/", "Live", "live", "live.js", ("monitor",)),
    Page("/chart", "Statechart", "chart", "chart.js", ("monitor",)),
    Page(
        "/pilot",
        "Pilot",
        "pilot",
        "pilot.js",
        ("monitor", "pilot"),
        lambda _monitor, _request, visitor: {"mayFly": visitor.may_fly},
        classes="pilot",
    ),
    Page(
        "/competition",
        "Competition",
        "competition",
        "competition.js",
        ("competition",),
        lambda _monitor, _request, visitor: {"judge": visitor.may_judge},
    ),
    Page(
        "/competition/try/{try_id:int}",
        "Try {try_id}",
        "try",
        "competition_try.js",
        ("competition",),
        lambda _, request, visitor: {"judge": visitor.may_judge, "attempt": request.path_params["try_id"]},
        here="/competition",
    ),
    Page(
        "/ranking",
        "Ranking",
        "ranking",
        "competition_ranking.js",
        ("competition",),
        lambda monitor, _request, _visitor: {"join": is_for_others(monitor.place[0])},
    ),
    Page("/stage", "Stage", "stage", "stage.js", ("monitor", "stage"), here="", dark=True),
    Page(
        "/replay",
        "Replay",
        "replay",
        "replay.js",
        ("monitor", "replay"),
        lambda monitor, _request, _visitor: {"hasRuns": monitor.equipment.runs is not None},
    ),
)


def register(monitor: Monitor) -> None:
    """Add the pages."""
    for page in PAGES:
        _add(monitor, page)


def _add(monitor: Monitor, page: Page) -> None:
    @ui.page(page.path, dark=page.dark)
    def show(request: Request) -> None:
        here = page.path if page.here is None else page.here
        with shell(monitor, request, page.title.format(**request.path_params), here) as visitor:
            ui.add_head_html(style_links(*page.styles))
            ui.element("div").props(f"id={page.root}").classes(page.classes)
        use_module(page.module, **page.data(monitor, request, visitor))
