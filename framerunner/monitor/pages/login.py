"""`/login` and `/logout`: plain HTML forms, which need no JavaScript."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

from fastapi import Form, Request
from fastapi.responses import RedirectResponse, Response

from framerunner.monitor.access import MAX_NAME_LENGTH, SESSION_S, LoginRefusedError, Role
from framerunner.monitor.addresses import client_address
from framerunner.monitor.pages.shell import render

if TYPE_CHECKING:
    from framerunner.monitor.server import Monitor

_MAX_SECRET_LENGTH = 1000
_PATH = re.compile(r"/([A-Za-z0-9_.?=&%-][A-Za-z0-9_./?=&%-]*)?")  # of this monitor


def register(monitor: Monitor) -> None:
    """Add `/login` and `/logout`."""
    access = monitor.access

    def page(request: Request, values: dict[str, str], status: int = 200) -> Response:
        empty = {"token": "", "name": "", "problem": "", "next": ""}
        return _page(monitor, request, {**empty, **values}, status)

    @monitor.web.get("/login")
    async def show(request: Request, token: str = "", next: str = "") -> Response:  # noqa: A002 - in the address
        return page(request, {"token": token, "next": next})

    @monitor.web.post("/login")
    async def log_in(
        request: Request,
        name: Annotated[str, Form()] = "",
        secret: Annotated[str, Form(max_length=_MAX_SECRET_LENGTH)] = "",
        next: Annotated[str, Form(max_length=_MAX_SECRET_LENGTH)] = "",  # noqa: A002 - of the form
    ) -> Response:
        try:
            session_id, visitor = await access.log_in(name, secret, client_address(request.scope))
        except LoginRefusedError as error:
            token = secret if access.is_link(secret) else ""  # not after a bad name
            values = {"token": token, "name": name, "problem": str(error), "next": next}
            return page(request, values, error.status)
        first = "/course" if visitor.role is Role.PUPIL else "/competition"
        response = RedirectResponse(next if _PATH.fullmatch(next) else first, status_code=303)
        response.set_cookie(
            access.cookie,
            session_id,
            max_age=round(SESSION_S),
            path="/",
            httponly=True,
            samesite="lax",
            secure=_is_encrypted(request),
        )
        return response

    @monitor.web.post("/logout")
    async def log_out(request: Request) -> Response:
        access.log_out(request)
        response = RedirectResponse("/", status_code=303)
        response.delete_cookie(
            access.cookie, path="/", httponly=True, samesite="lax", secure=_is_encrypted(request)
        )
        return response


def _is_encrypted(request: Request) -> bool:
    """Whether the request came by TLS, as a trusted proxy reports."""
    return request.url.scheme == "https"


def _page(monitor: Monitor, request: Request, values: dict[str, str], status: int) -> Response:
    form = {
        "needs_password": monitor.access.needs_password,
        "max_name_length": MAX_NAME_LENGTH,
        "has_class": monitor.settings.class_code is not None,
    }
    return render(
        "login.html.j2",
        monitor.access.visitor(request),
        monitor.instance,
        title="Log in",
        here="/login",
        classes="narrow",
        status=status,
        values={**form, **values},
    )
