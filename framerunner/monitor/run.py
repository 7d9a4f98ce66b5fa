"""Runs the monitor: its listening socket, its server and its jobs, until cancelled."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from framerunner.monitor import FIRST_VIEWER
from framerunner.monitor.settings import BACKLOG, MonitorError, MonitorSettings
from framerunner.monitor.urls import is_for_others, terminal_code, url_of, urls_for_people

if TYPE_CHECKING:
    import uvicorn
    from starlette.types import ASGIApp

    from framerunner.monitor.ports import Equipment
    from framerunner.monitor.server import Job


_MAX_UNSENT_BYTES = 1 << 16  # that the kernel buffers for a slow viewer


async def serve(equipment: Equipment, settings: MonitorSettings, say: Callable[[str], None]) -> None:
    """Serve the monitor until cancelled.

    Args:
        equipment: the link to the drones and what else the monitor needs.
        settings: where it listens and stores.
        say: takes lines for people: URLs, and links to log in.

    Raises:
        MonitorError: a setting cannot be used, or the port is taken.
    """
    settings.check()
    # First, so that a taken port is reported at once.
    with listen(settings.bind, settings.port) as listener:
        # Importing the libraries takes more than a second, so other tasks of this loop run meanwhile.
        await asyncio.to_thread(_import_server)
        from framerunner.monitor.server import assemble, make_server

        certificate = None
        if settings.certificate is not None:
            from framerunner.monitor.tls import load_certificate

            certificate = load_certificate(settings.certificate, settings.key)
        host, port = listener.getsockname()[:2]
        reachable = urls_for_people(host, port, settings.scheme)
        urls = reachable or [url_of("127.0.0.1", port, settings.scheme)]
        if certificate is not None and is_for_others(host):
            urls = certificate.urls(urls, port)
        qr_codes = settings.qr_codes and bool(reachable) and is_for_others(host)

        def invite(role: str, secret: str) -> None:
            link = f"{urls[0]}login?token={secret}"
            say(f"{role}s log in at {link}")
            if qr_codes:
                say(f"one {role}'s phone reads it here; the next one gets another\n{terminal_code(link)}")

        def started() -> None:
            for url in urls:
                say(f"monitor: {url}")
            if not reachable:
                say("this machine is in no network: phones cannot open it yet")
            if certificate is not None:
                for remark in certificate.remarks(urls):
                    say(f"warning: {remark}")
            elif is_for_others(host):
                say("without --certificate, log-ins and sticks are sent as plain text")
            if qr_codes:
                say(f"viewers' phones read it here, or at {urls[0]}join\n{terminal_code(urls[0])}")
            monitor.access.invite()

        monitor = assemble(equipment, settings, (host, port), invite)
        monitor.on_viewer = cache(lambda: say(FIRST_VIEWER))
        tls = None if certificate is None else certificate.context
        server = make_server(monitor.web, settings, started, tls)
        await _run(server, listener, [monitor.fleet.run, *monitor.jobs])


async def serve_web(
    web: ASGIApp, settings: MonitorSettings, listener: socket.socket, started: Callable[[], None]
) -> None:
    """Serve a web application that is not the monitor's until cancelled; `started`: it listens."""
    from framerunner.monitor.server import make_server

    await _run(make_server(web, settings, started), listener, [])


def listen(bind: str, port: int) -> socket.socket:
    """Open the listening socket; `MonitorError` if the port is taken or the address is of another machine."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            bind, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
    except OSError as error:
        raise MonitorError(
            f"monitor: --bind {bind}: {(error.strerror or str(error)).lower()}; "
            "give an address of this machine, such as 127.0.0.1 or 0.0.0.0"
        ) from error
    try:
        # So a killed monitor's port is free at once.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "TCP_NOTSENT_LOWAT"):
            listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _MAX_UNSENT_BYTES)
        listener.bind(address)
        listener.listen(BACKLOG)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        reason = (error.strerror or str(error)).lower()
        raise MonitorError(
            f"monitor: cannot listen on {bind} port {port}: {reason}; choose another with --port"
        ) from error
    return listener


def _import_server() -> None:
    from framerunner.monitor.server import MODULES

    for name in MODULES:
        import_module(name)


async def _run(server: uvicorn.Server, listener: socket.socket, jobs: list[Job]) -> None:
    """Run server and jobs until cancelled or one of them ends."""
    serving = asyncio.create_task(server.serve([listener]))
    running = [asyncio.create_task(job()) for job in jobs]
    try:
        done, _ = await asyncio.wait([serving, *running], return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        server.should_exit = True
        for task in running:
            task.cancel()
        await asyncio.gather(serving, *running, return_exceptions=True)
