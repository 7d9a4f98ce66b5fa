"""`/join`: addresses that a phone in the same network opens, as text and as QR codes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import Request
from fastapi.responses import Response

from framerunner.monitor.pages.shell import render
from framerunner.monitor.urls import is_for_others, svg_code, urls_of

if TYPE_CHECKING:
    from framerunner.monitor.server import Monitor

_MAX_OTHERS = 3


def register(monitor: Monitor) -> None:
    """Add the page, and its first code as an image at `/join.svg`."""

    @monitor.web.get("/join")
    async def join(request: Request) -> Response:
        shown = urls_of(monitor, request)[: 1 + _MAX_OTHERS]
        codes = [{"url": url, "svg": svg_code(url)} for url in shown]
        return render(
            "join.html.j2",
            monitor.access.visitor(request),
            monitor.instance,
            title="On a phone",
            here="/join",
            style="join",
            classes="join",
            values={"codes": codes, "for_others": is_for_others(monitor.place[0])},
        )

    @monitor.web.get("/join.svg")
    async def code(request: Request) -> Response:
        found = urls_of(monitor, request)
        if not found:
            return Response(status_code=404)
        headers = {"Cache-Control": "no-store"}
        image = svg_code(found[0]).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
        return Response(image, media_type="image/svg+xml", headers=headers)
