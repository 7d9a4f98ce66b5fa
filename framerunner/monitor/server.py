"""The monitor's web application: request checks, files, and the routes of `MODULES`."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Callable, Coroutine, Iterator
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from ipaddress import ip_address, ip_network
from secrets import token_urlsafe
from typing import Any, cast

import uvicorn
from fastapi import FastAPI
from starlette.types import ASGIApp
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from framerunner.monitor.access import Access, Role, Secrets, SessionFile, session_path
from framerunner.monitor.addresses import Places
from framerunner.monitor.connections import ConnectionLimiter, Connections
from framerunner.monitor.fleet import MonitoredFleet
from framerunner.monitor.pages.static_files import StaticBundles
from framerunner.monitor.ports import Equipment
from framerunner.monitor.security import SecurityMiddleware
from framerunner.monitor.settings import BACKLOG, MonitorSettings
from framerunner.monitor.tls import OnlyTls, TlsProtocol
from framerunner.monitor.visitors.peers import is_own_connection
from framerunner.monitor.visitors.pupils import PupilBook

Job = Callable[[], Coroutine[Any, Any, None]]

# Each has `register(monitor)`.
MODULES = (
    "framerunner.monitor.live_channel",
    "framerunner.monitor.video_proxy",
    "framerunner.monitor.manual_channel",
    "framerunner.monitor.operator_channel",
    "framerunner.monitor.replay_api",
    "framerunner.monitor.competition.api",
    "framerunner.monitor.competition.stage",
    "framerunner.monitor.pages.shell",
    "framerunner.monitor.pages.login",
    "framerunner.monitor.pages.table",
    "framerunner.monitor.pages.join",
)

_END_S = 1
_MAX_MESSAGE_BYTES = 1 << 18  # of a WebSocket: a mission being edited; other pages send some hundred bytes


@dataclass
class Monitor:
    """What each module's `register` gets.

    Attributes:
        settings: as started.
        equipment: what the monitor was given.
        fleet: the drones.
        access: log-ins and permissions.
        place: IP address and TCP port that it listens on.
        web: for HTTP routes and WebSockets.
        instance: differs from one start of the monitor to the next.
        jobs: run from start to end of the monitor; `register` may append to them.
        on_viewer: called when a page begins to show the drones.
    """

    settings: MonitorSettings
    equipment: Equipment
    fleet: MonitoredFleet
    access: Access
    place: tuple[str, int]
    web: FastAPI
    instance: str = field(default_factory=lambda: token_urlsafe(9))
    jobs: list[Job] = field(default_factory=list)
    on_viewer: Callable[[], None] = lambda: None

    def at_end(self, close: Callable[[], None]) -> None:
        """Call a function when the monitor ends."""

        async def wait() -> None:
            try:
                await asyncio.Event().wait()
            finally:
                close()

        self.jobs.append(wait)


class _Server(uvicorn.Server):
    """Leaves signals to the command line, and calls `started` when it listens."""

    def __init__(self, config: uvicorn.Config, started: Callable[[], None]) -> None:
        super().__init__(config)
        self._call_started = started

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._call_started()


def assemble(
    equipment: Equipment,
    settings: MonitorSettings,
    place: tuple[str, int],
    invite: Callable[[Role, str], None],
) -> Monitor:
    """Make the monitor, to listen on `place`; `invite` is told role and secret of each one-time link."""
    local_only = ip_address(place[0]).is_loopback and not settings.trusted_proxies
    cookie = f"framerunner-login-{place[1]}"  # browsers share cookies between ports
    # A port that the system chose is another one after a restart.
    path = session_path(settings.database) if settings.port != 0 else None
    pupils = None if settings.class_file is None else PupilBook(settings.class_file, settings.class_code)
    access = Access(
        Secrets(settings.organiser_password, settings.judge_password, settings.class_code),
        pupils=pupils,
        is_user=is_own_connection if local_only else lambda _: False,
        cookie=cookie,
        hear_invitation=invite,
        kept=SessionFile(path, cookie) if path is not None else None,
    )
    web = FastAPI(title="framerunner", docs_url=None, redoc_url=None, openapi_url=None)
    if settings.certificate is not None:
        web.add_middleware(OnlyTls, port=place[1])
    web.add_middleware(SecurityMiddleware, local_only=local_only, limits=settings.limits)
    monitor = Monitor(settings, equipment, MonitoredFleet(equipment), access, place, web)
    web.mount("/static", StaticBundles())
    for name in MODULES:
        import_module(name).register(monitor)
    for extension in equipment.extensions:  # each checks what a visitor may do
        web.include_router(extension.router(access.visitor))
        monitor.jobs.append(extension.run)
    return monitor


def make_server(
    web: ASGIApp, settings: MonitorSettings, started: Callable[[], None], tls: ssl.SSLContext | None = None
) -> uvicorn.Server:
    """The server of a web application, with TLS if that is given; `started` is called when it listens."""
    proxies = [ip_network(each) for each in settings.trusted_proxies]

    def is_proxy(address: str) -> bool:
        return any(ip_address(address) in each for each in proxies)

    connections = Connections(settings.limits, is_proxy)
    if proxies:
        web = cast(ASGIApp, ProxyHeadersMiddleware(cast(Any, web), [str(each) for each in proxies]))
    gate: Callable[..., asyncio.Protocol] = partial(ConnectionLimiter, connections)
    if tls is not None:
        knocking = Places(settings.limits.total, settings.limits.per_address)
        gate = partial(TlsProtocol, tls, connections, knocking)
    config = uvicorn.Config(
        cast(Any, connections.watch(web)),
        http=cast(Any, gate),
        log_config=None,
        log_level="critical",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        backlog=BACKLOG,  # asyncio accepts so many before it can refuse one
        timeout_keep_alive=settings.limits.keep_alive_s,
        timeout_graceful_shutdown=_END_S,
        ws_max_size=_MAX_MESSAGE_BYTES,
        ws_per_message_deflate=False,  # it would compress the same pose for each viewer again
    )
    return _Server(config, started)
