"""`/join`: addresses that a phone in the same network opens, as text and as QR codes."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from fastapi import Request
from fastapi.responses import Response

from monitor.pages.shell import html_page, style_links
from monitor.urls import is_for_others, svg_code, urls_for_visitor

if TYPE_CHECKING:
    from monitor.server import Monitor

_MAX_OTHERS = 3
_LOCAL_ONLY = (
    "<p>This monitor can be opened on this machine only. To let phones in, stop it and start it with "
    "<code>--bind 0.0.0.0</code>.</p>"
)
_NO_NETWORK = "<p>This machine is in no network. Connect it to one, then load this page again.</p>"


def register(monitor: Monitor) -> None:
    """Add the page, and its first code as an image at `/join.svg`."""
    for_others = is_for_others(monitor.place[0])

    def urls(request: Request) -> list[str]:
        return urls_for_visitor(*monitor.place, str(request.url)) if for_others else []

    @monitor.web.get("/join")
    async def join(request: Request) -> Response:
        found = urls(request)
        codes = _codes(found) if found else _NO_NETWORK if for_others else _LOCAL_ONLY
        content = f"<h1>Open it on a phone</h1>{codes}"
        visitor, head = monitor.access.visitor(request), style_links("competition")
        return html_page(visitor, "/join", "On a phone", content, head=head, classes="join")

    @monitor.web.get("/join.svg")
    async def code(request: Request) -> Response:
        found = urls(request)
        if not found:
            return Response(status_code=404)
        headers = {"Cache-Control": "no-store"}
        image = svg_code(found[0]).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
        return Response(image, media_type="image/svg+xml", headers=headers)


def _codes(urls: list[str]) -> str:
    first, *others = urls[: 1 + _MAX_OTHERS]
    more = ""
    if others:  # closed: a phone that sees two codes reads either
        shown = (f"<details><summary>{escape(url)}</summary>{_code(url)}</details>" for url in others)
        more = f"<h2>If that does not open, try</h2>{''.join(shown)}"
    return (
        "<p>Point the camera of a phone at the code, or type the address. The phone must be in the same "
        f"network as this machine.</p>{_code(first)}{more}"
    )


def _code(url: str) -> str:
    return (
        f'<figure>{svg_code(url)}<figcaption><a href="{escape(url)}">{escape(url)}</a></figcaption></figure>'
    )
