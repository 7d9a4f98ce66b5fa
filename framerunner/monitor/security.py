"""Which requests are accepted: from the monitor's own pages, to its own host names, with limited bodies."""

from __future__ import annotations

import asyncio
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from framerunner.monitor.addresses import Places, client_address
from framerunner.monitor.settings import ConnectionLimits
from framerunner.wire.transports.urls import is_loopback

_FORWARDED = ("x-forwarded-for", "x-real-ip", "forwarded")
_SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
CONTENT_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' blob:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)
_HEADERS = {
    "Content-Security-Policy": CONTENT_POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class SecurityMiddleware:
    """ASGI middleware before all other.

    Args:
        app: the application.
        local_only: only programs of this machine reach the server, and no proxy forwards requests of others;
            then another name in the Host header is an attack by a foreign page (DNS rebinding).
        limits: of bodies, and of simultaneous requests from one address.
    """

    def __init__(self, app: ASGIApp, *, local_only: bool, limits: ConnectionLimits) -> None:
        self._app = app
        self._local_only = local_only
        self._limits = limits
        self._places = Places(limits.total, limits.per_address)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request or WebSocket on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        problem = self._problem(scope, headers)
        if problem is not None:
            await _refuse(scope, receive, send, 403, problem)
            return
        address = client_address(scope)
        problem = self._places.take(address)
        if problem:
            await _refuse(scope, receive, send, 429, problem)
            return
        try:
            if scope["type"] == "websocket":
                await self._app(scope, receive, send)
            elif problem := self._body_problem(scope, headers):
                await _refuse(scope, receive, send, 413, problem)
            else:
                await self._app(scope, _Body(receive, self._limits), _with_headers(send))
        finally:
            self._places.give_back(address)

    def _body_problem(self, scope: Scope, headers: Headers) -> str:
        """Why a body is refused by the head of its request; "" if it is not."""
        announced = headers.get("content-length", "0")
        if announced == "0" and "transfer-encoding" not in headers:
            return ""
        if scope["method"] in _SAFE_METHODS:
            return f"{scope['method']} takes no body"
        if not announced.isdecimal() or len(announced) > 18 or int(announced) > self._limits.body_bytes:
            return _too_large(self._limits)
        return ""

    def _problem(self, scope: Scope, headers: Headers) -> str | None:
        """Why a request is refused; None if it is not."""
        host = headers.get("host", "")
        if len(headers.getlist("host")) != 1 or not _is_host(host):
            return "the Host header names no host"
        if self._local_only and not _is_local(host):
            return "the monitor listens on this machine only: open it as 127.0.0.1 or localhost"
        if self._local_only and any(name in headers for name in _FORWARDED):
            return "a proxy passed this on: start the monitor with --trusted-proxy and the proxy's address"
        origin = headers.get("origin")
        if origin is not None and not _same_host(origin, host):
            return "pages of other sites may not use the monitor"
        acts = scope["type"] == "websocket" or scope["method"] not in _SAFE_METHODS
        if acts and headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
            return "pages of other sites may not use the monitor"
        return None


def _is_host(host: str) -> bool:
    try:
        parts = urlsplit(f"//{host}")
        return bool(parts.hostname) and parts.netloc == host and "@" not in host and parts.port != 0
    except ValueError:
        return False


def _is_local(host: str) -> bool:
    return is_loopback(urlsplit(f"//{host}").hostname or "")


def _same_host(origin: str, host: str) -> bool:
    """Whether an Origin header names the host of the request; "null" does not."""
    scheme, _, authority = origin.partition("://")
    return scheme in ("http", "https") and authority.lower() == host.lower()


class _Body:
    """A request's `receive` with limits of length and time of the body.

    Raises:
        HTTPException: 413 or 408, where the application reads the body.
    """

    def __init__(self, receive: Receive, limits: ConnectionLimits) -> None:
        self._receive = receive
        self._limits = limits
        self._size = 0
        self._due_s: float | None = None
        self._complete = False

    async def __call__(self) -> Message:
        if self._complete:
            return await self._receive()  # waits for the client to disconnect
        loop = asyncio.get_running_loop()
        if self._due_s is None:
            self._due_s = loop.time() + self._limits.body_s
        try:
            async with asyncio.timeout_at(self._due_s):
                message = await self._receive()
        except TimeoutError:
            text = f"no whole body within {self._limits.body_s:g} s"
            raise HTTPException(408, text, {"Connection": "close"}) from None
        self._size += len(message.get("body", b""))
        if self._size > self._limits.body_bytes:
            raise HTTPException(413, _too_large(self._limits), {"Connection": "close"})
        self._complete = not message.get("more_body", False)
        return message


def _too_large(limits: ConnectionLimits) -> str:
    return f"the body is too large; at most {limits.body_bytes} bytes are taken"


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, text: str) -> None:
    """Answer with one line; for a WebSocket the server answers with status 403."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 4403, "reason": text})
        return
    # The body, if there is one, is not read; so nothing more can be read from this connection.
    headers = {**_HEADERS, "Connection": "close"}
    await PlainTextResponse(f"{text}\n", status, headers)(scope, receive, send)
