"""Deadlines and limits of connections, below HTTP: uvicorn has none for a request that is not finished.

Each connection has a `ConnectionLimiter` between the socket and uvicorn's protocol. It closes connections
whose request is not received or whose client does not read the answer, and refuses those that are too many.
"""

from __future__ import annotations

import asyncio
import resource
from collections.abc import Callable
from typing import Any, cast

from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.config import Config
from uvicorn.protocols.http.auto import AutoHTTPProtocol
from uvicorn.server import ServerState

from framerunner.monitor.addresses import Places
from framerunner.monitor.settings import ConnectionLimits

_UNSENT_BYTES = 1 << 16  # that wait for a slow client until the sender waits, too
_OTHER_FILES = 200  # file descriptors reserved for links, databases, recordings and libraries

Peer = tuple[str, int]


class Connections:
    """All connections of a server.

    Args:
        limits: their number and deadlines.
        is_proxy: whether an address is that of a trusted proxy; its connections are not counted.
    """

    def __init__(self, limits: ConnectionLimits, is_proxy: Callable[[str], bool]) -> None:
        self.limits = limits
        self._is_proxy = is_proxy
        open_files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        total = limits.total
        if open_files != resource.RLIM_INFINITY:
            total = min(total, max(open_files - _OTHER_FILES, open_files // 2))
        self._places = Places(total, min(limits.per_address, total))
        self._gates: dict[Peer, ConnectionLimiter] = {}

    def enter(self, peer: Peer, gate: ConnectionLimiter) -> str:
        """Add a connection. Returns "" or, if it is refused, one line with the reason."""
        problem = "" if self._is_proxy(peer[0]) else self._places.take(peer[0])
        if not problem:
            self._gates[peer] = gate
        return problem

    def leave(self, peer: Peer) -> None:
        """Remove a connection; ignored if it was refused."""
        if self._gates.pop(peer, None) is not None and not self._is_proxy(peer[0]):
            self._places.give_back(peer[0])

    def watch(self, app: ASGIApp) -> ASGIApp:
        """The application, with its requests reported to their gates; must be the outermost layer."""

        async def watched(scope: Scope, receive: Receive, send: Send) -> None:
            peer = scope.get("client")
            gate = self._gates.get((peer[0], peer[1])) if peer else None
            if gate is None:
                await app(scope, receive, send)
                return
            gate.request_begins()
            try:
                await app(scope, receive, send)
            finally:
                gate.request_ends()

        return watched


class ConnectionLimiter(asyncio.Protocol):
    """Passes data between a connection and the server's protocol; the other arguments are uvicorn's."""

    def __init__(
        self,
        connections: Connections,
        *,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        self._connections = connections
        self._limits = connections.limits
        self._loop = _loop or asyncio.get_running_loop()
        make: Any = AutoHTTPProtocol
        self._inner: asyncio.Protocol = make(config, server_state, app_state, _loop)
        self._transport: asyncio.Transport | None = None
        self._peer: Peer | None = None  # None: refused
        self._requests = 0
        self._head_bytes = 0
        self._timers: dict[str, asyncio.TimerHandle] = {}  # by what has a deadline

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Accept or refuse the connection."""
        self._transport = cast(asyncio.Transport, transport)
        self._transport.set_write_buffer_limits(_UNSENT_BYTES)  # over TLS it would be 512 kB
        peername = transport.get_extra_info("peername")
        if not peername:  # closed already
            self._transport.abort()
            return
        peer = (str(peername[0]), int(peername[1]))
        problem = self._connections.enter(peer, self)
        if problem:
            self._refuse("503 Service Unavailable", problem)
            return
        self._peer = peer
        self._wait_for_head(self._limits.head_s)
        self._inner.connection_made(cast(asyncio.BaseTransport, _Watched(self._transport, self)))

    def data_received(self, data: bytes) -> None:
        """Pass data on, unless the head of the request is too long."""
        if self._peer is None or self._transport is None or self._transport.is_closing():
            return
        if not self._requests:
            if self._head_bytes > self._limits.head_bytes:
                text = f"the head of a request may have {self._limits.head_bytes} bytes"
                self._refuse("431 Request Header Fields Too Large", text)
                return
            if not self._head_bytes:
                self._wait_for_head(self._limits.head_s)
            self._head_bytes += len(data)
        self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        """Pass on that the client will send nothing more."""
        return self._inner.eof_received() if self._peer is not None else None

    def pause_writing(self) -> None:
        """Set a deadline, because the client does not read."""
        self._start_timer("reading", self._limits.stalled_s, self._abort)
        if self._peer is not None:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Remove the deadline: the client reads again."""
        self._stop_timer("reading")
        if self._peer is not None:
            self._inner.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Remove the connection."""
        for name in list(self._timers):
            self._stop_timer(name)
        if self._peer is not None:
            self._connections.leave(self._peer)
            self._inner.connection_lost(exc)

    def request_begins(self) -> None:
        """Count a request whose head is complete."""
        self._requests += 1
        self._head_bytes = 0
        self._stop_timer("head")

    def request_ends(self) -> None:
        """Count a request or WebSocket as answered, and set a deadline for the next.

        The first bytes of the next one may have been received before this, so a deadline is always needed.
        """
        self._requests -= 1
        if not self._requests and "end" not in self._timers:
            self._wait_for_head(self._limits.keep_alive_s)

    def hand_over(self, protocol: asyncio.Protocol) -> None:
        """Use another protocol from now on, as the server does for a WebSocket."""
        self._inner = protocol

    def closing(self) -> None:
        """Set a deadline for sending the rest: the connection is being closed."""
        if "end" not in self._timers:
            self._start_timer("end", self._limits.close_s, self._abort)

    def _wait_for_head(self, seconds: float) -> None:
        self._start_timer("head", seconds, self._head_is_late)

    def _start_timer(self, name: str, seconds: float, late: Callable[[], None]) -> None:
        self._stop_timer(name)
        self._timers[name] = self._loop.call_later(seconds, late)

    def _stop_timer(self, name: str) -> None:
        timer = self._timers.pop(name, None)
        if timer is not None:
            timer.cancel()

    def _head_is_late(self) -> None:
        if self._head_bytes:
            self._refuse("408 Request Timeout", f"no whole request within {self._limits.head_s:g} s")
        else:
            self._abort()

    def _refuse(self, status: str, text: str) -> None:
        assert self._transport is not None
        body = f"{text}\n".encode()
        head = (
            f"HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {len(body)}\r\n"
            "Connection: close\r\n\r\n"
        )
        self._transport.write(head.encode() + body)
        self._transport.close()
        self.closing()

    def _abort(self) -> None:
        if self._transport is not None:
            self._transport.abort()


class _Watched:
    """The transport that the server's protocol gets: reports a new protocol and closing to the gate."""

    def __init__(self, transport: asyncio.Transport, gate: ConnectionLimiter) -> None:
        self._transport = transport
        self._gate = gate

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - any attribute of a transport
        return getattr(self._transport, name)

    def set_protocol(self, protocol: asyncio.Protocol) -> None:
        self._gate.hand_over(protocol)

    def close(self) -> None:
        self._transport.close()
        self._gate.closing()
