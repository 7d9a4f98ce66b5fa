"""The frame of all pages: name, navigation, state of the link, who is logged in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined
from starlette.responses import HTMLResponse

if TYPE_CHECKING:
    from framerunner.monitor.access import Visitor
    from framerunner.monitor.server import Monitor

_NAVIGATION = (
    ("Live", "/"),
    ("Statechart", "/chart"),
    ("Editor", "/edit"),
    ("Course", "/course"),
    ("Pilot", "/pilot"),
    ("Operator", "/operator"),
    ("Competition", "/competition"),
    ("Ranking", "/ranking"),
    ("Stage", "/stage"),
    ("Replay", "/replay"),
)
_TEMPLATES = Environment(
    loader=PackageLoader("framerunner.monitor.pages"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
)


def register(monitor: Monitor) -> None:
    """Add `/api/instance`, by which a page notices that the monitor was restarted."""

    @monitor.web.get("/api/instance")
    async def instance() -> dict[str, str]:
        return {"instance": monitor.instance}


def render(
    template: str,
    visitor: Visitor,
    instance: str,
    *,
    title: str,
    here: str,
    style: str = "",
    classes: str = "",
    status: int = 200,
    values: Mapping[str, object] | None = None,
) -> HTMLResponse:
    """A page, which browsers do not store.

    Args:
        template: its file in `templates/`; it extends `base.html.j2`. All values are escaped.
        visitor: who opened it.
        instance: of the monitor; a page that finds another one loads again.
        title: for the browser's tab.
        here: path that is marked in the navigation; "": no header and navigation, for a projector.
        style: name of a bundled style sheet, applied after the shell's; "": none.
        classes: CSS classes of `<main>`.
        status: HTTP status.
        values: what else the template uses.
    """
    frame = {
        "instance": instance,
        "navigation": _NAVIGATION,
        "visitor": visitor,
        "title": title,
        "here": here,
        "style": style,
        "classes": classes,
    }
    html = _TEMPLATES.get_template(template).render({**frame, **(values or {})})
    return HTMLResponse(html, status_code=status, headers={"Cache-Control": "no-store"})
