"""Log-in and log-out of judges: plain HTML forms, which need no JavaScript."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Annotated

from fastapi import Form, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from monitor.access import LONGEST_NAME, SESSION_S, LoginRefusedError
from monitor.pages.shell import HEAD, header_html

if TYPE_CHECKING:
    from monitor.server import Monitor

_LONGEST_SECRET = 1000


def register(monitor: Monitor) -> None:
    """Add `/login` and `/logout`."""

    @monitor.web.get("/login")
    async def show(request: Request, token: str = "") -> Response:
        return _page(monitor, request, token=token)

    @monitor.web.post("/login")
    async def log_in(
        request: Request,
        name: Annotated[str, Form()] = "",
        secret: Annotated[str, Form(max_length=_LONGEST_SECRET)] = "",
    ) -> Response:
        address = request.client.host if request.client else ""
        try:
            session_id = await monitor.access.log_in(name, secret, address)
        except LoginRefusedError as error:
            # A name that has to be mended must not cost the link; a link that was refused is worth nothing.
            token = secret if error.status == 400 and not monitor.access.wants_password else ""
            return _page(monitor, request, token=token, name=name, problem=str(error), status=error.status)
        response = RedirectResponse("/competition", status_code=303)
        response.set_cookie(
            monitor.access.cookie,
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
        monitor.access.log_out(request)
        response = RedirectResponse("/", status_code=303)
        response.delete_cookie(
            monitor.access.cookie, path="/", httponly=True, samesite="lax", secure=_is_encrypted(request)
        )
        return response


def _is_encrypted(request: Request) -> bool:
    """Whether the browser came by TLS, of which a trusted proxy tells."""
    return request.url.scheme == "https"


def _page(
    monitor: Monitor,
    request: Request,
    *,
    token: str = "",
    name: str = "",
    problem: str = "",
    status: int = 200,
) -> Response:
    visitor = monitor.access.visitor(request)
    problem_html = f'<p class="problem" role="alert">{escape(problem)}</p>' if problem else ""
    content = f"<h1>Judges log in</h1>{problem_html}{_form(monitor, token, name)}"
    return HTMLResponse(
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Log in – framerunner</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"{HEAD}</head><body>{header_html(visitor, '/login')}"
        f'<main class="page narrow" id="main" tabindex="-1">{content}</main></body></html>',
        status_code=status,
        headers={"Cache-Control": "no-store"},
    )


def _form(monitor: Monitor, token: str, name: str) -> str:
    if monitor.access.wants_password:
        secret = (
            '<label for="secret">Password</label>'
            '<input id="secret" name="secret" type="password" autocomplete="current-password" required>'
        )
    elif token:
        secret = f'<input name="secret" type="hidden" value="{escape(token)}">'
    else:
        return (
            "<p>Judges log in by a one-time link. The newest one stands on the console of the machine "
            "that runs the monitor. Watching needs no log-in.</p>"
        )
    return (
        '<p>Watching needs no log-in.</p><form class="login" method="post" action="/login">'
        '<label for="name">Who are you?</label>'
        f'<input id="name" name="name" value="{escape(name)}" autocomplete="name" required '
        f'maxlength="{LONGEST_NAME}" aria-describedby="why">'
        '<p class="hint" id="why">Your name is kept with what you change.</p>'
        f'{secret}<button type="submit">Log in</button></form>'
    )
