"""The pages that scripts fill in the browser: an entry each in `PAGES`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import HTMLResponse

from framerunner.monitor.access import Role
from framerunner.monitor.pages.shell import render
from framerunner.monitor.urls import urls_of

if TYPE_CHECKING:
    from framerunner.monitor.access import Visitor
    from framerunner.monitor.server import Monitor

    Data = Callable[[Monitor, Request, Visitor], dict[str, object]]


@dataclass(frozen=True, slots=True)
class Page:
    """One page.

    Attributes:
        path: as FastAPI writes it.
        title: for the browser's tab; parameters of the path may stand in it, in braces.
        entry: folder of `web/src/` whose script and style sheet it has; also the id of the element that the
            script fills.
        data: what `pageData()` of `lib/page_data.js` returns to the script; values that JSON has.
        here: the path that is marked in the navigation; None: `path`; "": the page has no header.
        root_classes: CSS classes of the element.
        template: its file in `templates/`; one of its own extends `script.html.j2`.
    """

    path: str
    title: str
    entry: str
    data: Data = lambda _monitor, _request, _visitor: {}
    here: str | None = None
    root_classes: str = ""
    template: str = "script.html.j2"


PAGES = (
    Page("/", "Live", "live"),
    Page("/chart", "Statechart", "chart"),
    Page(
        "/course",
        "Course",
        "course",
        lambda monitor, _request, visitor: {
            "mayAct": visitor.may_learn,
            "mayTeach": visitor.may_teach,
            "pupil": visitor.name if visitor.role is Role.PUPIL else "",
            "word": monitor.access.code_word(visitor),
        },
    ),
    Page(
        "/edit",
        "Editor",
        "edit",
        lambda _monitor, _request, visitor: {
            "mayEdit": visitor.may_learn,
            "mayTeach": visitor.may_teach,
            "pupil": visitor.name if visitor.role is Role.PUPIL else "",
        },
    ),
    Page(
        "/pilot",
        "Pilot",
        "manual",
        lambda _monitor, _request, visitor: {"mayFly": visitor.may_fly},
        root_classes="manual",
    ),
    Page(
        "/operator",
        "Operator",
        "operator",
        lambda _monitor, _request, visitor: {"mayFly": visitor.may_fly},
        root_classes="operator",
    ),
    Page(
        "/competition",
        "Competition",
        "competition",
        lambda _monitor, _request, visitor: {"judge": visitor.may_organise, "mayCorrect": visitor.may_judge},
    ),
    Page(
        "/competition/try/{try_id:int}",
        "Try {try_id}",
        "try",
        lambda _, request, visitor: {"judge": visitor.may_judge, "attempt": request.path_params["try_id"]},
        here="/competition",
    ),
    Page(
        "/ranking",
        "Ranking",
        "ranking",
        lambda monitor, request, _visitor: {"join": bool(urls_of(monitor, request))},
    ),
    Page("/stage", "Stage", "stage", here=""),
    Page(
        "/replay",
        "Replay",
        "replay",
        lambda monitor, _request, _visitor: {"hasRuns": monitor.equipment.runs is not None},
    ),
)


def register(monitor: Monitor) -> None:
    """Add the pages."""
    for page in PAGES:
        add_page(monitor, page)


def add_page(monitor: Monitor, page: Page) -> None:
    """Add one page to the monitor's web application."""

    @monitor.web.get(page.path)
    async def show(request: Request) -> HTMLResponse:
        visitor = monitor.access.visitor(request)
        title = page.title.format(**request.path_params)
        return render_page(page, visitor, monitor.instance, title, page.data(monitor, request, visitor))


def render_page(
    page: Page, visitor: Visitor, instance: str, title: str, data: dict[str, object]
) -> HTMLResponse:
    """The page's HTML, which its script fills."""
    return render(
        page.template,
        visitor,
        instance,
        title=title,
        here=page.path if page.here is None else page.here,
        style=page.entry,
        values={"entry": page.entry, "root": page.entry, "root_classes": page.root_classes, "data": data},
    )
