"""From where the monitor fetches when a drone sends a URL: real datagrams, and a real server that counts."""

import asyncio
import socket
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from aiohttp import web

from framerunner.commands.monitor import equipment
from framerunner.wire.dialect import mavlink
from tests.framerunner.monitor.watching import watching
from tests.free_ports import free_port


@asynccontextmanager
async def service(address):
    """A web server of this machine; yields its port and the requested paths."""
    asked = []

    async def answer(request):
        asked.append(request.path_qs)
        return web.Response(status=302, headers={"Location": "/elsewhere"})

    app = web.Application()
    app.router.add_route("*", "/{path:.*}", answer)
    runner = web.AppRunner(app, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, address, 0).start()
    try:
        yield runner.addresses[0][1], asked
    finally:
        await runner.cleanup()


class FakeDrone:
    """A drone at an address, with a camera that sends the URL of its video."""

    def __init__(self, address, port, url):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((address, 0))
        self._peer = ("127.0.0.1", port)
        self._parts = [mavlink.MAVLink(None, srcSystem=1, srcComponent=each) for each in (1, 100)]
        self._url = url.encode()

    def speak(self):
        self._send(0, mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 3, 3))
        self._send(1, mavlink.MAVLink_heartbeat_message(30, 8, 0, 0, 3, 3))
        told = (1, 1, 0, 1, 10.0, 320, 240, 0, 0, 90, b"camera", self._url, 0)
        self._send(1, mavlink.MAVLink_video_stream_information_message(*told))

    def _send(self, part, message):
        self._socket.sendto(message.pack(self._parts[part]), self._peer)

    def close(self):
        self._socket.close()


@pytest.mark.parametrize(
    ("address", "service_address", "place", "confirmed", "paths"),
    [
        ("127.0.0.1", "127.0.0.1", "admin?delete=all", False, set()),
        ("127.0.0.1", "127.0.0.1", "admin", False, set()),
        ("127.0.0.2", "127.0.0.1", "video", False, set()),
        ("127.0.0.1", "127.0.0.1", "video", True, {"/referee.json"}),  # and the redirection is not followed
    ],
)
async def test_only_a_camera_s_own_url_is_fetched(address, service_address, place, confirmed, paths):
    async with service(service_address) as (port, asked):
        hosts = (f"{service_address}:{port}",) if confirmed else ()
        link_port = free_port()
        given = equipment(f"udpin://127.0.0.1:{link_port}", None, Path("runs"), hosts)
        async with watching(given) as watched:
            drone = FakeDrone(address, link_port, f"http://{service_address}:{port}/{place}")
            try:

                def told():
                    drone.speak()
                    return (
                        asked if confirmed else [each for each in watched.notices() if "not fetched" in each]
                    )

                await watched.until(told)
                await asyncio.sleep(0.3)
            finally:
                drone.close()
        assert (watched.fleet.video_url(1) is not None) is confirmed
        assert set(asked) == paths
