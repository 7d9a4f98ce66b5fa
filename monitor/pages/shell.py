"""The frame of all pages: name, navigation, state of the link, who is logged in."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request
from starlette.responses import HTMLResponse

if TYPE_CHECKING:
    from monitor.access import Visitor
    from monitor.server import Monitor

_PAGES = (
    ("Live", "/"),
    ("Statechart", "/chart"),
    ("Pilot", "/pilot"),
    ("Competition", "/competition"),
    ("Ranking", "/ranking"),
    ("Stage", "/stage"),
    ("Replay", "/replay"),
)
HEAD = (
    '<link rel="stylesheet" href="/static/shell.css">\n'
    '<script type="module" src="/static/shell.js"></script>\n'
    '<script type="module" src="/static/start.js"></script>\n'
)


@contextmanager
def shell(monitor: Monitor, request: Request, title: str, here: str) -> Iterator[Visitor]:
    """Put the frame around a NiceGUI page; elements made inside the `with` stand within its `<main>`.

    Args:
        monitor: the running monitor.
        request: the page's request.
        title: for the browser's tab.
        here: path that is marked in the navigation; "": no header and navigation, for a projector.

    Yields:
        The visitor who opened the page.
    """
    visitor = monitor.access.visitor(request)
    ui.page_title(f"{title} – framerunner")
    ui.add_head_html(HEAD)
    if here:
        ui.add_body_html(header_html(visitor, here))
    main = ui.element("main").classes("page")
    main.props["id"] = "main"
    main.props["tabindex"] = "-1"  # the skip link moves the focus here
    with main:
        yield visitor


def html_page(
    visitor: Visitor, here: str, title: str, content: str, *, head: str = "", classes: str, status: int = 200
) -> HTMLResponse:
    """A page with the same frame, but without NiceGUI and its own JavaScript; browsers do not store it.

    Args:
        visitor: who opened the page.
        here: path that is marked in the navigation.
        title: for the browser's tab.
        content: HTML within `<main>`; what it shows of others is escaped already.
        head: further HTML for the head, likewise.
        classes: CSS classes of `<main>`.
        status: HTTP status.
    """
    return HTMLResponse(
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(title)} – framerunner</title>"
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"{HEAD}{head}</head><body>{header_html(visitor, here)}"
        f'<main class="page {classes}" id="main" tabindex="-1">{content}</main></body></html>',
        status_code=status,
        headers={"Cache-Control": "no-store"},
    )


def style_links(*names: str) -> str:
    """HTML for the head that applies style sheets below `/static/`."""
    return "".join(f'<link rel="stylesheet" href="/static/{name}.css">' for name in names)


def use_module(path: str, **data: object) -> None:
    """Run a page's own JavaScript module after the page's elements were made.

    For NAME.js the data stands as JSON in the element "data-NAME"; `pageData(import.meta.url)` of `start.js`
    reads it.

    Args:
        path: of the module, below `/static/`.
        data: for the module; values that `json.dumps` takes.
    """
    ui.add_body_html(
        f'<script type="application/json" id="data-{escape(PurePosixPath(path).stem)}" '
        f'data-module="/static/{escape(path)}">{_json_block(data)}</script>'
    )


def _json_block(data: object) -> str:
    """JSON that can stand in a `<script>`: nothing in it can end the element or begin a comment."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def header_html(visitor: Visitor, here: str) -> str:
    """The header, which stands before NiceGUI's elements and is shown without them."""
    links = "".join(
        f'<li><a href="{path}"{" aria-current=page" if path == here else ""}>{name}</a></li>'
        for name, path in _PAGES
    )
    return (
        '<a class="skip" href="#main">Skip to the content</a>'
        '<header class="top"><span class="brand">framerunner</span>'
        f'<nav aria-label="Pages"><ul>{links}</ul></nav>'
        '<span class="link" id="link" role="status" data-state="waiting">'
        '<span class="dot" aria-hidden="true"></span><span class="words">connecting</span></span>'
        f"{_who(visitor, here)}</header>"
    )


def _who(visitor: Visitor, here: str) -> str:
    if not visitor.name:
        current = " aria-current=page" if here == "/login" else ""
        return f'<span class="who"><a href="/login"{current}>Log in</a></span>'
    return (
        f'<form class="who" method="post" action="/logout"><span>{escape(visitor.name)}</span>'
        '<button type="submit">Log out</button></form>'
    )
