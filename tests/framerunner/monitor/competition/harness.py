"""A monitor with a contest and a fleet whose events the tests send."""

import asyncio
from contextlib import asynccontextmanager
from types import SimpleNamespace

import aiohttp

from framerunner.monitor import run, server
from framerunner.monitor.settings import MonitorSettings
from framerunner.monitor.vehicle.tries import TryEvent
from scenarios.models import Gate, Scenario
from scenarios.result import RefereeReport

PASSWORD = "only for these tests"
JUDGE_PASSWORD = "of the judges only"
COLOURS = ("red", "green", "blue")
MODULES = (
    "framerunner.monitor.competition.api",
    *(f"framerunner.monitor.pages.{name}" for name in ("login", "table", "join")),
)


def scenario(name, colours=COLOURS):
    frames = tuple(Gate(colour=colour, x_m=index, y_m=2, z_m=1.5) for index, colour in enumerate(colours))
    return Scenario(name=name, frames=frames)


GATES = {"case": COLOURS, "calm": COLOURS, "two": COLOURS[:2], "no": ()}


def load(name):
    kind = name.partition("-")[0]
    if kind not in GATES:
        raise ValueError(f"scenario {name} is unknown")
    return scenario(name, GATES[kind])


EQUIPMENT = SimpleNamespace(
    scenario=None,
    list_scenarios=lambda: ["broken", "case-1", "case-2", "case-3", "case-4", "no-frames", "two-1"],
    load_scenario=load,
    extensions=(),
    scenario_argument=str,
)


def report(verdict="clean", time_s=40.0, crossed=COLOURS, contacts=0, penalty_s=0.0, path_m=20.0):
    return {
        "verdict": verdict,
        "reason": f"{verdict} after {time_s} s",
        "frames_crossed": list(crossed),
        "contacts": contacts,
        "penalty_s": penalty_s,
        "try_time_s": time_s,
        "total_time_s": time_s + penalty_s,
        "path_length_m": path_m,
    }


def event(kind, key, scenario_name="case-1", drone_id=1, final=False, told=None, **values):
    """An event of the fleet; `told` are further fields of the report, valid or not."""
    given = report(**values) if kind == "ended" else report(**{"verdict": "aborted", "crossed": (), **values})
    given = RefereeReport.from_outside({**given, **(told or {})})
    return TryEvent(kind, drone_id, key, scenario_name, given, "truth", final)


class FakeFleet:
    """A fleet without drones; `tell` sends its events."""

    newest = None

    def __init__(self, equipment):
        self._hear = []
        FakeFleet.newest = self

    async def run(self):
        await asyncio.Event().wait()

    def on_try(self, hear):
        self._hear.append(hear)

    def tell(self, told):
        for hear in self._hear:
            hear(told)


class Contest:
    """A running monitor, and clients for it."""

    def __init__(self, url, fleet):
        self.url = url
        self.fleet = fleet
        self.http = aiohttp.ClientSession(url, cookie_jar=aiohttp.CookieJar(unsafe=True))

    async def get(self, path):
        async with self.http.get(f"/api/competition/{path}") as answer:
            if answer.content_type != "application/json":
                return answer.status, await answer.text()
            return answer.status, await answer.json()

    async def post(self, path, form, session=None, **options):
        options = options or {"json": form}
        async with (session or self.http).post(f"/api/competition/{path}", **options) as answer:
            text = await answer.text()
            return answer.status, (await answer.json() if text.startswith("{") else text)

    async def log_in(self, name="Ada"):
        async with self.http.post("/login", data={"name": name, "secret": PASSWORD}) as answer:
            assert answer.url.path != "/login"

    async def judge(self, name, secret=JUDGE_PASSWORD):
        """Another judge with a separate session."""
        session = aiohttp.ClientSession(self.url, cookie_jar=aiohttp.CookieJar(unsafe=True))
        async with session.post("/login", data={"name": name, "secret": secret}) as answer:
            assert answer.url.path != "/login"
        return session

    async def until(self, path, holds, seconds=10.0):
        """The answer of `path` once the condition holds."""
        async with asyncio.timeout(seconds):
            while True:
                status, answer = await self.get(path)
                if status == 200 and holds(answer):
                    return answer
                await asyncio.sleep(0.02)

    async def fly(self, key, team=None, scenario_name="case-1", **values):
        """A whole try, of a team if one is named; returns it."""
        if team is not None:
            assert (await self.post("next", {"team": team, "scenario": scenario_name}))[0] == 200
        before = len((await self.get("tries"))[1])
        self.fleet.tell(event("began", key, scenario_name, time_s=0.0))
        self.fleet.tell(event("ended", key, scenario_name, **values))
        tries = await self.until("tries", lambda all_: len(all_) > before and all_[0]["state"] == "ended")
        return tries[0]


@asynccontextmanager
async def contest(database, monkeypatch, port=0):
    """A monitor with an open database; port 0 is a free one."""
    monkeypatch.setattr("framerunner.monitor.server.MonitoredFleet", FakeFleet)
    monkeypatch.setattr(server, "MODULES", MODULES)
    said = []
    settings = MonitorSettings(
        port=port, database=database, organiser_password=PASSWORD, judge_password=JUDGE_PASSWORD
    )
    serving = asyncio.create_task(run.serve(EQUIPMENT, settings, said.append))
    try:
        async with asyncio.timeout(30):
            while not any(line.startswith("monitor: ") for line in said):
                if serving.done():
                    serving.result()
                await asyncio.sleep(0.02)
        url = next(line for line in said if line.startswith("monitor: ")).removeprefix("monitor: ")
        running = Contest(url, FakeFleet.newest)
        try:
            await running.until("state", lambda _: True)
            yield running
        finally:
            await running.http.close()
    finally:
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)
