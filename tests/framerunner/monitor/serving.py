"""The real web server on a free port of this process, with a fleet that a test controls."""

import asyncio
import contextlib
from dataclasses import dataclass, field

import aiohttp

from framerunner.monitor.ports import Equipment
from framerunner.monitor.run import serve
from framerunner.monitor.settings import MonitorSettings


class StubFleet:
    """One drone whose time advances by a tick with each pose."""

    def __init__(self, equipment=None):
        self.ticks = 0
        self.hearers = []
        self.video = None
        self.status = {
            "kind": "status",
            "drones": [{"id": 1, "link": {"state": "live", "age_s": float("inf")}}],
        }

    async def run(self):
        await asyncio.Event().wait()

    def welcome(self):
        return [{"kind": "world", "scenario": None, "lift_m": 0.0, "source": ""}, self.status]

    def pose_message(self):
        self.ticks += 1
        place = [0.123456789, float("nan"), float("inf")]
        return {"kind": "pose", "drones": [{"id": 1, "t": float(self.ticks), "p": place}]}

    def status_message(self):
        return self.status

    def subscribe(self, hear):
        self.hearers.append(hear)
        return lambda: self.hearers.remove(hear)

    def on_try(self, hear):
        pass

    def drone_ids(self):
        return [1]

    def video_url(self, drone_id):
        return self.video


@dataclass
class Served:
    """A monitor that runs."""

    url: str
    lines: list[str]
    fleet: StubFleet
    task: asyncio.Task = field(repr=False)

    @property
    def port(self):
        return int(self.url.rstrip("/").rpartition(":")[2])

    @property
    def invitation(self):
        """Secret of the newest one-time link."""
        return next(line for line in reversed(self.lines) if "organisers log in" in line).partition("token=")[
            2
        ]


@contextlib.asynccontextmanager
async def serving(monkeypatch, *modules, bind="127.0.0.1", port=0, password=None, **more):
    """Serve with the given modules beside the server's own, and more settings; yields a `Served`."""
    fleets = []

    def make_fleet(equipment):
        fleets.append(StubFleet(equipment))
        return fleets[-1]

    own = (
        "framerunner.monitor.live_channel",
        "framerunner.monitor.video_proxy",
        "framerunner.monitor.pages.shell",
        "framerunner.monitor.pages.login",
    )
    monkeypatch.setattr("framerunner.monitor.server.MODULES", (*own, *modules))
    monkeypatch.setattr("framerunner.monitor.server.MonitoredFleet", make_fleet)
    lines: list[str] = []
    up = asyncio.Event()

    def say(line):
        lines.append(line)
        up.set()

    settings = MonitorSettings(bind, port, "sqlite://", password, **{"judge_password": "only judges", **more})
    task = asyncio.create_task(serve(equipment(), settings, say))
    waiting = asyncio.create_task(up.wait())
    try:
        await asyncio.wait({task, waiting}, timeout=60, return_when=asyncio.FIRST_COMPLETED)
        if task.done():
            task.result()
        assert up.is_set(), "the monitor does not start"
        yield Served(lines[0].partition(" ")[2], lines, fleets[0], task)
    finally:
        waiting.cancel()
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


def equipment():
    """Equipment that must not be used."""

    def nothing(*_):
        raise AssertionError("not used here")

    return Equipment(nothing, nothing, None, list, nothing, None)


@contextlib.asynccontextmanager
async def browser():
    """A client that keeps cookies, also of IP addresses."""
    async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as session:
        yield session
