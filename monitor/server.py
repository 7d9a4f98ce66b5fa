"""The monitor's web application: request checks, files, the routes of `MODULES`, and NiceGUI."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import socket
from collections.abc import Callable, Coroutine, Iterator
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Any, cast

import nicegui
import uvicorn
from fastapi import FastAPI
from nicegui import Client, core, ui
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Scope
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from monitor.access import Access, SessionFile, session_path
from monitor.connections import Connections, Gate
from monitor.fleet import Fleet
from monitor.ports import Equipment
from monitor.security import Guard
from monitor.settings import BACKLOG, MonitorSettings

Job = Callable[[], Coroutine[Any, Any, None]]

# Each has `register(monitor)`.
MODULES = (
    "monitor.live_channel",
    "monitor.video_proxy",
    "monitor.pilot_channel",
    "monitor.replay_api",
    "monitor.extensions",
    "monitor.competition.api",
    "monitor.competition.stage",
    "monitor.pages.login",
    "monitor.pages.table",
    "monitor.pages.join",
)

_STATIC = Path(__file__).parent / "static"
_ELEMENTS = Path(nicegui.__file__).parent / "elements"
_LIBRARIES = {"three": "scene", "echart": "echart", "mermaid": "mermaid"}
_HASHED = re.compile(r"-[\w-]{8}\.js$")  # the bundler names a file by its content
_RECONNECT_S = 10.0
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
        jobs: run from start to end of the monitor; `register` may append to them.
    """

    settings: MonitorSettings
    equipment: Equipment
    fleet: Fleet
    access: Access
    place: tuple[str, int]
    web: FastAPI
    jobs: list[Job] = field(default_factory=list)

    def at_end(self, close: Callable[[], None]) -> None:
        """Call a function when the monitor ends."""

        async def wait() -> None:
            try:
                await asyncio.Event().wait()
            finally:
                close()

        self.jobs.append(wait)


class _Files(StaticFiles):
    """Files that a browser revalidates each time, except a library's that are named by their content."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        is_hashed = self.directory != _STATIC and _HASHED.search(path) is not None
        response.headers["Cache-Control"] = "public, max-age=31536000, immutable" if is_hashed else "no-cache"
        return response


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
    equipment: Equipment, settings: MonitorSettings, place: tuple[str, int], invite: Callable[[str], None]
) -> Monitor:
    """Make the monitor, to listen on `place`; `invite` is called with the secret of each one-time link."""
    local_only = ip_address(place[0]).is_loopback and not settings.trusted_proxies
    cookie = f"framerunner-judge-{place[1]}"  # browsers share cookies between ports
    # A port that the system chose is another one after a restart.
    path = session_path(settings.database) if settings.port != 0 else None
    access = Access(
        settings.password,
        all_may_fly=local_only,
        cookie=cookie,
        hear_invitation=invite,
        kept=SessionFile(path, cookie) if path is not None else None,
    )
    web = FastAPI(title="framerunner", docs_url=None, redoc_url=None, openapi_url=None)
    web.add_middleware(Guard, local_only=local_only, limits=settings.limits)
    monitor = Monitor(settings, equipment, Fleet(equipment), access, place, web)
    _add_static_files(web)
    for name in MODULES:
        import_module(name).register(monitor)
    _add_nicegui(web)
    return monitor


def make_server(web: ASGIApp, settings: MonitorSettings, started: Callable[[], None]) -> uvicorn.Server:
    """The server of a web application; `started` is called when it listens."""
    proxies = [ip_network(each) for each in settings.trusted_proxies]

    def is_proxy(address: str) -> bool:
        return any(ip_address(address) in each for each in proxies)

    connections = Connections(settings.limits, is_proxy)
    if proxies:
        web = cast(ASGIApp, ProxyHeadersMiddleware(cast(Any, web), [str(each) for each in proxies]))
    config = uvicorn.Config(
        cast(Any, connections.watch(web)),
        http=cast(Any, partial(Gate, connections)),
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


def _add_static_files(web: FastAPI) -> None:
    """Serve the monitor's own files and the libraries that come with NiceGUI."""
    web.mount("/static", _Files(directory=_STATIC))
    for name, element in _LIBRARIES.items():
        web.mount(f"/lib/{name}", _Files(directory=_ELEMENTS / element / "dist"))


def _add_nicegui(web: FastAPI) -> None:
    """Mount NiceGUI's pages after all other routes. Its application is global, so it is reset first."""
    core.app.middleware_stack = None
    core.app.user_middleware.clear()
    core.app._shutdown_handlers.clear()
    Client.instances.clear()  # of pages that were opened before; browsers load them again
    logging.getLogger("nicegui").setLevel(logging.ERROR)  # it warns of every address that does not exist
    ui.run_with(
        web,
        title="framerunner",
        dark=None,
        language="en-US",
        reconnect_timeout=_RECONNECT_S,
        gzip_middleware_factory=None,  # takes more time than it saves in a local network
        show_welcome_message=False,
    )
