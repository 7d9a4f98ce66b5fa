"""TLS: the monitor's certificate, and the way of a connection through it to the server.

Both TLS and plain HTTP are understood at the same port, so that who comes by http:// is sent to https://.
"""

from __future__ import annotations

import asyncio
import contextlib
import ssl
import time
from asyncio.sslproto import SSLProtocol
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlsplit

from starlette.datastructures import URL, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from framerunner.monitor.addresses import Places
from framerunner.monitor.connections import ConnectionLimiter, Connections
from framerunner.monitor.settings import ConnectionLimits, MonitorError
from framerunner.monitor.urls import url_of
from framerunner.wire.transports.urls import is_loopback

HTTPS_PORT = 443
_HANDSHAKE = 0x16  # first byte of a TLS connection: the content type of its first record (RFC 8446, 5.1)
_MAX_FILE_BYTES = 1 << 20
_SOON_S = 14 * 86400.0
_HSTS_S = 30 * 86400
_IGNORE_DATES = 0x200000  # OpenSSL's X509_V_FLAG_NO_CHECK_TIME, to which Python gives no name


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate that can be used, with its key.

    Attributes:
        context: serves with it.
        hosts: the addresses and names that it is for, addresses first; names with * are left out.
        remark: one line for people if browsers will refuse it now or soon; "" if not.
    """

    context: ssl.SSLContext
    hosts: tuple[str, ...]
    remark: str

    def urls(self, urls: Sequence[str], port: int) -> list[str]:
        """The monitor's URLs, those without a warning in the browser first.

        Args:
            urls: of this machine's addresses.
            port: TCP port, for URLs of the names that the certificate is for.
        """
        named = [host for host in self.hosts if not _is_address(host) and not is_loopback(host)]
        names = [url_of(host, port, "https") for host in named]
        known = [url for url in urls if self._is_for(url)]
        return [*known, *names, *(url for url in urls if url not in known)]

    def remarks(self, urls: Sequence[str]) -> list[str]:
        """What people should know, a line each: dates, and URLs at which browsers will warn."""
        strange = [urlsplit(url).hostname or "" for url in urls if not self._is_for(url)]
        wanted = ", ".join(self.hosts) or "no address and no name"
        lines = [self.remark] if self.remark else []
        if strange:
            lines.append(f"browsers will warn at {', '.join(strange)}: the certificate is for {wanted}")
        return lines

    def _is_for(self, url: str) -> bool:
        return (urlsplit(url).hostname or "") in self.hosts


def load_certificate(path: Path, key: Path | None, now_s: Callable[[], float] = time.time) -> Certificate:
    """Load a certificate and its private key, and try both in a handshake.

    Args:
        path: PEM file: the certificate, then those of its issuers if there are any.
        key: PEM file of its private key; None: it is in the same file.
        now_s: Unix time.

    Raises:
        MonitorError: a file cannot be used, they do not belong together, or the certificate has expired.
    """
    _check_holds(path, "--certificate", "CERTIFICATE-----", "a certificate")
    key_option, key_path = ("--certificate", path) if key is None else ("--key", key)
    _check_holds(key_path, key_option, "PRIVATE KEY-----", "a private key")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.set_alpn_protocols(["http/1.1"])

    def refuse_password() -> str:
        raise MonitorError(
            f"monitor: {key_option} {key_path}: the private key is encrypted; remove its passphrase "
            "(openssl pkey -in OLD -out NEW) and let only the monitor's user read the file"
        )

    try:
        context.load_cert_chain(path, key_path, refuse_password)
        found = _try(context, path)
    except ssl.SSLCertVerificationError as error:
        raise MonitorError(f"monitor: --certificate {path}: {error.verify_message}; make another") from None
    except ssl.SSLError as error:
        raise MonitorError(f"monitor: {_words(error, path, key_option, key_path)}") from None
    starts_s, ends_s = (ssl.cert_time_to_seconds(str(found[each])) for each in ("notBefore", "notAfter"))
    if ends_s <= now_s():
        raise MonitorError(f"monitor: --certificate {path}: has expired on {found['notAfter']}; make another")
    remark = ""
    if starts_s > now_s():
        remark = f"{path} is valid only from {found['notBefore']}; is the clock of this machine right?"
    elif ends_s - now_s() < _SOON_S:
        remark = f"{path} expires on {found['notAfter']}; make another"
    alternatives = cast(tuple[tuple[str, str], ...], found.get("subjectAltName", ()))
    addresses = [value.lower() for kind, value in alternatives if kind == "IP Address"]
    names = [value.lower() for kind, value in alternatives if kind == "DNS" and "*" not in value]
    return Certificate(context, (*addresses, *names), remark)


def _is_address(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


def _check_holds(path: Path, option: str, mark: str, what: str) -> None:
    """Raise `MonitorError` if a file cannot be read, or has no PEM block of a kind."""
    try:
        with path.open("rb") as file:
            text = file.read(_MAX_FILE_BYTES)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise MonitorError(f"monitor: {option} {path}: {reason}") from error
    if mark.encode() not in text:
        raise MonitorError(f"monitor: {option} {path}: holds no {what.removeprefix('a ')} in PEM format")


def _words(error: ssl.SSLError, path: Path, key_option: str, key_path: Path) -> str:
    if error.reason == "KEY_VALUES_MISMATCH":
        return f"{key_option} {key_path}: is not the key of the certificate {path}"
    reason = (error.reason or "it is damaged").replace("_", " ").lower()
    return f"--certificate {path} with the key in {key_path}: cannot be used ({reason}); make another"


def _try(server_context: ssl.SSLContext, path: Path) -> dict[str, Any]:
    """A handshake in memory with a client that trusts only this certificate.

    Returns:
        What the client sees of it, as `ssl.SSLSocket.getpeercert`; its dates are not checked.

    Raises:
        ssl.SSLError: the certificate cannot be that of a server.
    """
    client_context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client_context.check_hostname = False
    client_context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN | ssl.VerifyFlags(_IGNORE_DATES)
    client_context.load_verify_locations(path)
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = client_context.wrap_bio(to_client, to_server)
    server = server_context.wrap_bio(to_server, to_client, server_side=True)
    while True:
        with contextlib.suppress(ssl.SSLWantReadError):
            client.do_handshake()
            return cast(dict[str, Any], client.getpeercert())
        with contextlib.suppress(ssl.SSLWantReadError):
            server.do_handshake()


class TlsProtocol(asyncio.Protocol):
    """Takes a connection until its first byte tells TLS from plain HTTP, then hands it to a limiter.

    Connections whose handshake is not complete have a limit and a deadline of their own, as the gate does not
    see them yet.

    Args:
        context: of the certificate.
        connections: those of the server.
        knocking: places of connections whose handshake is not complete.
        for_gate: arguments of `ConnectionLimiter`; they are uvicorn's.
    """

    def __init__(
        self,
        context: ssl.SSLContext,
        connections: Connections,
        knocking: Places,
        **for_gate: Any,  # noqa: ANN401 - passed on
    ) -> None:
        self._context = context
        self._limits: ConnectionLimits = connections.limits
        self._knocking = knocking
        self._make_gate = partial(ConnectionLimiter, connections, **for_gate)
        self._loop = asyncio.get_running_loop()
        self._transport: asyncio.Transport | None = None
        self._address: str | None = None  # None: has no place
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Wait for the first byte, or refuse the connection."""
        self._transport = cast(asyncio.Transport, transport)
        peername = transport.get_extra_info("peername")
        if not peername or self._knocking.take(str(peername[0])):  # nothing can be said before the handshake
            self._transport.abort()
            return
        self._address = str(peername[0])
        self._deadline = self._loop.call_later(self._limits.head_s, self._transport.abort)

    def data_received(self, data: bytes) -> None:
        """Give the connection away."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        gate = self._make_gate()
        if data[0] != _HANDSHAKE:
            self._leave()
            transport.set_protocol(gate)
            gate.connection_made(transport)
            gate.data_received(data)
            return
        decided = self._loop.create_future()
        decided.add_done_callback(self._handshake_ended)
        decryption = SSLProtocol(
            self._loop,
            gate,
            self._context,
            decided,
            server_side=True,
            ssl_handshake_timeout=round(self._limits.head_s),
            ssl_shutdown_timeout=round(self._limits.close_s),
        )
        transport.set_protocol(decryption)
        decryption.connection_made(transport)
        # The loop writes what it receives into this buffer; these bytes it has received already.
        decryption.get_buffer(len(data))[: len(data)] = data
        decryption.buffer_updated(len(data))

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place back."""
        self._leave()

    def _handshake_ended(self, decided: asyncio.Future[None]) -> None:
        if not decided.cancelled():
            decided.exception()  # a client that refuses the certificate is no fault to be reported
        self._leave()

    def _leave(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        if self._address is not None:
            self._knocking.give_back(self._address)
        self._address = self._deadline = None


class OnlyTls:
    """ASGI middleware of a monitor with a certificate: pages that are asked for by http:// are redirected.

    Args:
        app: the application.
        port: TCP port that the monitor listens on.
    """

    def __init__(self, app: ASGIApp, *, port: int) -> None:
        self._app = app
        # Browsers apply it to all ports of a host, on which other programs may serve plain HTTP.
        self._policy = f"max-age={_HSTS_S}" if port == HTTPS_PORT else ""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request or WebSocket on, redirect or refuse it."""
        if scope["type"] == "http" and scope["scheme"] != "https":
            url = URL(scope=scope).replace(scheme="https")
            if scope["method"] in ("GET", "HEAD"):
                await RedirectResponse(url, 307)(scope, receive, send)
            else:
                text = f"the monitor takes this only over TLS: open {url.replace(path='/', query='')}\n"
                await PlainTextResponse(text, 403, {"Connection": "close"})(scope, receive, send)
        elif scope["type"] == "websocket" and scope["scheme"] != "wss":
            await receive()
            await send({"type": "websocket.close", "code": 4403, "reason": "use wss://"})
        else:
            await self._app(scope, receive, self._with_policy(send) if self._policy else send)

    def _with_policy(self, send: Send) -> Send:
        async def send_with_policy(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["Strict-Transport-Security"] = self._policy
            await send(message)

        return send_with_policy
