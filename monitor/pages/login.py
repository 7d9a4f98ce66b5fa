"""`/login` and `/logout` of judges: plain HTML forms, which need no JavaScript."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import Form, Request
from fastapi.responses import RedirectResponse, Response

from monitor.access import MAX_NAME_LENGTH, SESSION_S, LoginRefusedError
from monitor.pages.shell import render

if TYPE_CHECKING:
    from monitor.server import Monitor

_MAX_SECRET_LENGTH = 1000


def register(monitor: Monitor) -> None:
    """Add `/login` and `/logout`."""
    access = monitor.access

    def page(request: Request, token: str, name: str = "", problem: str = "", status: int = 200) -> Response:
        values = {"token": token, "name": name, "problem": problem}
        return _page(monitor, request, values, status)

    @monitor.web.get("/login")
    async def show(request: Request, token: str = "") -> Response:
        return page(request, token)

    @monitor.web.post("/login")
    async def log_in(
        request: Request,
        name: Annotated[str, Form()] = "",
        secret: Annotated[str, Form(max_length=_MAX_SECRET_LENGTH)] = "",
    ) -> Response:
        address = request.client.host if request.client else ""
        try:
            session_id = await access.log_in(name, secret, address)
        except LoginRefusedError as error:
            # The link is still valid after a bad name, and never after a bad secret.
            token = secret if error.status == 400 and not access.needs_password else ""
            return page(request, token, name, str(error), error.status)
        response = RedirectResponse("/competition", status_code=303)
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
    form = {"needs_password": monitor.access.needs_password, "max_name_length": MAX_NAME_LENGTH}
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
