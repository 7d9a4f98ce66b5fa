"""A monitor's pages without a monitor: files, a page's frame, and a live channel that a test writes."""

from __future__ import annotations

import asyncio
import json
import struct
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import cv2
import numpy as np
from aiohttp import WSMsgType, web

from framerunner.monitor.access import Visitor
from framerunner.monitor.pages.static_files import STATIC
from framerunner.monitor.pages.table import PAGES, render_page
from framerunner.monitor.security import CONTENT_POLICY

SOURCES = Path(__file__).parents[3] / "web" / "src"
SERVED = {page.path: page for page in PAGES if page.path in ("/", "/chart", "/stage", "/ranking")}
JPEG = cv2.imencode(".jpg", np.full((240, 320, 3), (56, 176, 226), np.uint8))[1].tobytes()
REPEAT_S = 1.0  # a page takes a monitor that says nothing for four seconds for lost


NO_CONTEST = {
    **{"running": [], "last": None, "last_against": None, "interrupted": None},
    **{"best": [], "called": None, "queue": {"number": 0, "teams": []}, "ranking": None, "complete": False},
}


class FakeMonitor:
    """Serves pages, sends messages to all viewers, and repeats the last status and poses, as a monitor does.

    Attributes:
        welcome: messages each new watcher gets first.
        stage: what the contest's page for the projector is told.
        url: where the pages are.
    """

    def __init__(self) -> None:
        self.welcome: list[dict] = []
        self.url = ""
        self.stage = dict(NO_CONTEST)
        self._somebody = asyncio.Event()
        self._filmed = asyncio.Event()
        self._ended = asyncio.Event()
        self._cameras: list[web.StreamResponse] = []
        self._contest_watchers: set[web.WebSocketResponse] = set()
        self._watchers: set[web.WebSocketResponse] = set()
        self._last: dict[str, dict] = {}
        self._repeating: asyncio.Task | None = None
        self._port = 0
        self._runner: web.AppRunner | None = None

    async def start(self):
        """Listen; a second time at the same port as before."""
        app = web.Application()
        self._ended.clear()
        for path in SERVED:
            app.router.add_get(path, self._page)
        app.router.add_get("/api/instance", self._instance)
        app.router.add_get("/ws/live", self._watch)
        app.router.add_get("/video/{id}/frames", self._frames)
        app.router.add_get("/api/competition/stage", self._stage)
        app.router.add_get("/api/competition/ranking", self._ranking)
        app.router.add_get("/ws/competition", self._contest)
        app.router.add_static("/static", STATIC)
        app.router.add_static("/sources", SOURCES)  # for tests of single modules
        self._runner = web.AppRunner(app, shutdown_timeout=0.1)
        await self._runner.setup()
        site = web.TCPSite(self._runner, "127.0.0.1", self._port, reuse_address=True)
        await site.start()
        self._port = site._server.sockets[0].getsockname()[1]
        self.url = f"http://127.0.0.1:{self._port}"
        self._repeating = asyncio.create_task(self._repeat())

    async def stop(self):
        """Stop like a killed monitor: all connections end."""
        self._repeating.cancel()
        for watcher in [*self._watchers, *self._contest_watchers]:
            await watcher.close()
        self._ended.set()
        await self._runner.cleanup()

    async def say(self, kind, **fields):
        """Send a message to all viewers; with a status, poses said before are not repeated any more."""
        message = {"kind": kind, **fields}
        if kind == "status":
            self._last.pop("pose", None)
        self._last[kind] = message
        await self._send(message)

    async def _repeat(self):
        while True:
            await asyncio.sleep(REPEAT_S)
            said = {message["kind"]: message for message in self.welcome} | self._last
            for kind in ("status", "pose"):
                if kind in said:
                    await self._send(said[kind])

    async def _send(self, message):
        for watcher in list(self._watchers):
            with suppress(ConnectionError):  # a page that is leaving
                await watcher.send_str(json.dumps(message))

    async def until_watched(self):
        """Wait for a page."""
        async with asyncio.timeout(30):
            await self._somebody.wait()

    async def _page(self, request):
        page = SERVED[request.path]
        html = render_page(page, Visitor(), "fake", page.title, {})
        headers = {"Content-Security-Policy": CONTENT_POLICY}
        return web.Response(body=html.body, content_type="text/html", charset="utf-8", headers=headers)

    async def _instance(self, request):
        return web.json_response({"instance": "fake"})

    async def _watch(self, request):
        watcher = web.WebSocketResponse()
        await watcher.prepare(request)
        if "kinds" in request.query:  # the header's own; it has a test of its own
            await watcher.receive()
            return watcher
        for message in self.welcome:
            await watcher.send_str(json.dumps(message))
        self._watchers.add(watcher)
        self._somebody.set()
        try:
            while (await watcher.receive()).type not in {
                WSMsgType.CLOSE,
                WSMsgType.CLOSING,
                WSMsgType.CLOSED,
            }:
                pass
        finally:
            self._watchers.discard(watcher)
        return watcher

    async def show(self, jpeg, time_s):
        """Send an image of the camera to all viewers."""
        time_us = -1 if time_s is None else round(time_s * 1e6)
        for camera in self._cameras:
            await camera.write(struct.pack("<qI", time_us, len(jpeg)) + jpeg)

    async def until_filmed(self):
        """Wait for a page that reads the camera."""
        async with asyncio.timeout(30):
            await self._filmed.wait()

    async def change_contest(self, **stage):
        """Change the contest."""
        self.stage |= stage
        for watcher in list(self._contest_watchers):
            await watcher.send_str(json.dumps({"kind": "changed", "version": 1, "problem": ""}))

    async def _frames(self, request):
        camera = web.StreamResponse(headers={"Content-Type": "application/octet-stream"})
        await camera.prepare(request)
        self._cameras.append(camera)
        self._filmed.set()
        try:
            await self._ended.wait()
        finally:
            self._cameras.remove(camera)
        return camera

    async def _stage(self, request):
        return web.json_response(self.stage)

    async def _ranking(self, request):
        rule = {"scenarios": 3, "limit_s": 180, "missing_frame_s": 60, "counting": "best"}
        return web.json_response({**self.stage, "rounds": [1], "rule": rule, "problem": ""})

    async def _contest(self, request):
        watcher = web.WebSocketResponse()
        await watcher.prepare(request)
        self._contest_watchers.add(watcher)
        await watcher.send_str(json.dumps({"kind": "changed", "version": 1, "problem": ""}))
        await watcher.receive()
        self._contest_watchers.discard(watcher)
        return watcher


@asynccontextmanager
async def fake_monitor():
    """A monitor that listens."""
    fake = FakeMonitor()
    await fake.start()
    try:
        yield fake
    finally:
        await fake.stop()
