"""The frame of all pages: name, navigation, how the link is, who is logged in."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from nicegui import ui
from starlette.requests import Request

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
    """Put the frame around a page; what is made inside the `with` is its content, within `<main>`.

    Args:
        monitor: the running monitor.
        request: of the page.
        title: of the page, for the browser's tab.
        here: path of the page, which is marked in the navigation.

    Yields:
        Who is looking.
    """
    visitor = monitor.access.visitor(request)
    ui.page_title(f"{title} – framerunner")
    ui.add_head_html(HEAD)
    ui.add_body_html(header_html(visitor, here))
    main = ui.element("main").classes("page")
    main.props["id"] = "main"
    main.props["tabindex"] = "-1"  # the skip link moves the focus here
    with main:
        yield visitor


@contextmanager
def bare(title: str) -> Iterator[None]:
    """Put a page without header and navigation around what is made inside the `with`, for a projector.

    Args:
        title: of the page, for the browser's tab.
    """
    ui.page_title(f"{title} – framerunner")
    ui.add_head_html(HEAD)
    main = ui.element("main").classes("page")
    main.props["id"] = "main"
    with main:
        yield


def use_module(path: str, **data: object) -> None:
    """Have a page's own JavaScript run once the page stands.

    The module is loaded as `<script type="module">` after the page's elements were made. For NAME.js its data
    stands as JSON in the element "data-NAME"; `pageData(import.meta.url)` of `start.js` reads it.

    Args:
        path: of the module, below `/static/`.
        data: what it is to know; what `json.dumps` takes.
    """
    path = path.removeprefix("/static/")
    ui.add_body_html(
        f'<script type="application/json" id="data-{escape(PurePosixPath(path).stem)}" '
        f'data-module="/static/{escape(path)}">{json_block(data)}</script>'
    )


def json_block(data: object) -> str:
    """Write JSON that can stand in a `<script>`: nothing in it can end the element or begin a comment.

    Raises:
        ValueError: a number is not finite.
    """
    text = json.dumps(data, ensure_ascii=True, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def header_html(visitor: Visitor, here: str) -> str:
    """Return the header, which stands before anything of NiceGUI's and shows without it."""
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
