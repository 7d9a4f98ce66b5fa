"""What is let in: only pages of our own, asked for by a name of our own, with bodies of a sane size."""

from __future__ import annotations

from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAX_BODY_BYTES = 1 << 20
_MERELY_READING = ("GET", "HEAD", "OPTIONS")
# NiceGUI compiles templates in the browser and begins its pages by inline scripts.
CONTENT_POLICY = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self' 'unsafe-inline' 'unsafe-eval'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "media-src 'self' blob:",
        "worker-src 'self' blob:",
        "connect-src 'self'",
        "object-src 'none'",
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


class Guard:
    """ASGI middleware before everything else.

    Args:
        app: what is guarded.
        local_only: the server listens on this machine's own address only; then other names in the Host
            header are a foreign page's trick (DNS rebinding).
    """

    def __init__(self, app: ASGIApp, *, local_only: bool) -> None:
        self._app = app
        self._local_only = local_only

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request or WebSocket pass, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        problem = self._problem(scope, headers)
        if problem is not None:
            await _refuse(scope, receive, send, 403, problem)
            return
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
            return
        body = await _read_body(headers, receive)
        if body is None:
            words = f"too large; at most {MAX_BODY_BYTES} bytes are taken"
            await _refuse(scope, receive, send, 413, words)
            return
        await self._app(scope, _replay(body, receive), _with_headers(send))

    def _problem(self, scope: Scope, headers: Headers) -> str | None:
        """Say why a request is not for us; None if it is."""
        host = headers.get("host", "")
        if len(headers.getlist("host")) != 1 or not _is_host(host):
            return "the Host header names no host"
        if self._local_only and not _is_local(host):
            return "the monitor listens on this machine only: open it as http://127.0.0.1 or http://localhost"
        origin = headers.get("origin")
        if origin is not None and not _same_place(origin, host):
            return "pages of other sites may not use the monitor"
        acts = scope["type"] == "websocket" or scope["method"] not in _MERELY_READING
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
    name = urlsplit(f"//{host}").hostname or ""
    if name == "localhost":
        return True
    try:
        return ip_address(name).is_loopback
    except ValueError:
        return False


def _same_place(origin: str, host: str) -> bool:
    """Whether an Origin header names the host that was asked; "null" does not."""
    scheme, separator, place = origin.partition("://")
    return bool(separator) and scheme in ("http", "https") and place.lower() == host.lower()


async def _read_body(headers: Headers, receive: Receive) -> list[Message] | None:
    """Read a request's whole body, however it comes; None if it is too large."""
    announced = headers.get("content-length", "0")
    if announced == "0" and "transfer-encoding" not in headers:
        return []
    if announced.isdecimal() and int(announced) > MAX_BODY_BYTES:
        return None
    messages: list[Message] = []
    size = 0
    while True:
        message = await receive()
        messages.append(message)
        if message["type"] != "http.request":
            return messages  # gone
        size += len(message.get("body", b""))
        if size > MAX_BODY_BYTES:
            return None
        if not message.get("more_body", False):
            return messages


def _replay(messages: list[Message], receive: Receive) -> Receive:
    """Return a `receive` that gives what was read before what is still to come."""
    pending = iter(messages)

    async def again() -> Message:
        for message in pending:
            return message
        return await receive()

    return again


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, words: str) -> None:
    """Answer with one line; a WebSocket that is not accepted is answered by status 403."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 4403, "reason": words})
        return
    headers = {**_HEADERS, "Connection": "close"} if status == 413 else _HEADERS
    await PlainTextResponse(f"{words}\n", status, headers)(scope, receive, send)
