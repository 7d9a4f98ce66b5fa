"""The pages that JavaScript draws in the browser: a line each in `PAGES`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

from monitor.pages.shell import bare, shell, style_links, use_module
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
        title: for the browser's tab; parameters of the path can stand in it, in braces.
        root: id of the element that the module fills.
        module: file below `/static/`.
        styles: names of style sheets below `/static/`, applied after the shell's.
        data: what the module is given, as `use_module` takes it; None: nothing.
        navigation: the path that is marked in the navigation; "" means `path`.
        classes: CSS classes of the root element.
    """

    path: str
    title: str
    root: str
    module: str
    styles: tuple[str, ...]
    data: Data | None = None
    navigation: str = ""
    classes: str = ""


def _judge(_monitor: Monitor, _request: Request, visitor: Visitor) -> dict[str, object]:
    return {"judge": visitor.may_judge}


def _try(_monitor: Monitor, request: Request, visitor: Visitor) -> dict[str, object]:
    return {"judge": visitor.may_judge, "attempt": request.path_params["try_id"]}


def _pilot(_monitor: Monitor, _request: Request, visitor: Visitor) -> dict[str, object]:
    return {"mayFly": visitor.may_fly}


def _ranking(monitor: Monitor, _request: Request, _visitor: Visitor) -> dict[str, object]:
    return {"join": is_for_others(monitor.place[0])}


def _replay(monitor: Monitor, _request: Request, _visitor: Visitor) -> dict[str, object]:
    return {"hasRuns": monitor.equipment.runs is not None}


PAGES = (
    Page("/", "Live", "live", "live.js", ("monitor",)),
    Page("/chart", "Statechart", "chart", "chart.js", ("monitor",)),
    Page("/pilot", "Pilot", "pilot", "pilot.js", ("monitor", "pilot"), _pilot, classes="pilot"),
    Page("/competition", "Competition", "competition", "competition.js", ("competition",), _judge),
    Page(
        "/competition/try/{try_id:int}",
        "Try {try_id}",
        "try",
        "competition_try.js",
        ("competition",),
        _try,
        navigation="/competition",
    ),
    Page("/ranking", "Ranking", "ranking", "competition_ranking.js", ("competition",), _ranking),
    Page("/replay", "Replay", "replay", "replay.js", ("monitor", "replay"), _replay),
)


def register(monitor: Monitor) -> None:
    """Add the pages of `PAGES`, and `/stage`, which has no header and no controls."""
    for page in PAGES:
        _add(monitor, page)

    @ui.page("/stage", dark=True)
    def stage() -> None:
        with bare("Stage"):
            ui.add_head_html(style_links("monitor", "stage"))
            ui.element("div").props("id=stage")
        use_module("stage.js")


def _add(monitor: Monitor, page: Page) -> None:
    @ui.page(page.path)
    def show(request: Request) -> None:
        title = page.title.format(**request.path_params)
        with shell(monitor, request, title, page.navigation or page.path) as visitor:
            ui.add_head_html(style_links(*page.styles))
            ui.element("div").props(f"id={page.root}").classes(page.classes)
        use_module(page.module, **(page.data(monitor, request, visitor) if page.data is not None else {}))
