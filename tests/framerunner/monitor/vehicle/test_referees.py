"""The referee over HTTP: its answers are checked, and its absence costs little."""

import asyncio
from contextlib import asynccontextmanager
from dataclasses import asdict, replace
from functools import partial

import pytest
from aiohttp import web

from framerunner.flying.plan import FlightPlan
from framerunner.monitor.vehicle.referees import RefereeChannel, scenario_of
from framerunner.wire.simulator_api import SimulatorApi
from scenarios.loader import load_scenario
from scenarios.result import RefereeSnapshot
from scenarios.task import Task
from tests.framerunner.monitor.simulated_link import SimulatedLink, equipment

SCENARIO = load_scenario("test-case-1")
SNAPSHOT = RefereeSnapshot(5, 1.0, 0.0, ("red",), "green", 0, True, True, False, False)


def good_answer():
    return {
        "scenario": SCENARIO.name,
        "source": "truth",
        "lift_m": 0.25,
        "time_us": 7,
        "local_frame": {"origin_arena_m": [1.0, 2.0, 3.0], "yaw_rad": 0.5},
        "snapshot": asdict(SNAPSHOT),
        "report": FlightPlan(SCENARIO).new_referee().report().as_json(),
    }


def told(scenario, **how):
    return Task.of(scenario, **how).model_dump(mode="json")


class Site:
    """A drone's web server; `answers` by path are JSON, bytes or a response's maker."""

    def __init__(self):
        self.answers = {"/referee.json": good_answer(), "/scenario.json": told(SCENARIO)}
        self.equipment = replace(equipment(SimulatedLink()), scenario=None)
        self.asked = []
        self.heard, self.said = [], []
        self.channel = None

    async def serve(self, request):
        self.asked.append(request.path)
        answer = self.answers.get(request.path)
        if answer is None:
            raise web.HTTPNotFound
        if callable(answer):
            return answer()
        return web.Response(body=answer) if isinstance(answer, bytes) else web.json_response(answer)

    async def until(self, condition):
        for _ in range(800):
            if condition():
                return
            await asyncio.sleep(0.01)
        raise AssertionError(f"did not come: {self.asked} {self.said}")


@asynccontextmanager
async def asked(site):
    app = web.Application()
    app.router.add_get("/{path:.*}", site.serve)
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    api = SimulatorApi(f"http://127.0.0.1:{runner.addresses[0][1]}")
    find = partial(scenario_of, equipment=site.equipment)
    site.channel = RefereeChannel(api, site.heard.append, lambda level, text: site.said.append(text), find)
    task = asyncio.create_task(site.channel.run())
    try:
        yield
        assert not task.done(), task.exception()
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await runner.cleanup()


@pytest.fixture
def site():
    return Site()


async def test_the_referee_is_requested_five_times_a_second_and_the_scenario_once(site):
    async with asked(site):
        await site.until(lambda: len(site.heard) >= 4)
        assert site.channel.scenario == SCENARIO
    assert site.asked.count("/scenario.json") == 1
    told = site.heard[0]
    assert told.snapshot == SNAPSHOT
    assert told.local_frame.origin_arena_m == (1.0, 2.0, 3.0)
    assert told.source == "truth"
    assert (site.channel.lift_m, site.said) == (0.25, [])


async def test_the_scenario_is_requested_again_when_its_name_changes(site):
    other = load_scenario("test-case-2")
    async with asked(site):
        await site.until(lambda: site.channel.scenario)
        site.answers = {
            "/referee.json": {**good_answer(), "scenario": other.name},
            "/scenario.json": told(other),
        }
        await site.until(lambda: site.channel.scenario == other)
    assert site.asked.count("/scenario.json") == 2


async def test_a_layout_that_is_not_known_here_is_told_for_training_only(site):
    own = SCENARIO.model_copy(update={"name": "own-arena"})
    site.answers["/referee.json"] = {**good_answer(), "scenario": own.name}
    site.answers["/scenario.json"] = told(own)
    async with asked(site):
        await site.until(lambda: site.said)
        assert site.channel.scenario is None
    assert "scenario 'own-arena' is not known here; give its file to" in site.said[0]
    site.answers["/scenario.json"] = told(own, show_layout=True)
    async with asked(site):
        await site.until(lambda: site.channel.scenario == own)
    site.answers["/scenario.json"] = told(own)
    site.equipment = replace(site.equipment, scenario=own)
    async with asked(site):
        await site.until(lambda: site.channel.scenario == own)


async def test_requests_without_an_answer_become_less_frequent(site):
    site.answers = {}
    loop, times_s = asyncio.get_running_loop(), []
    async with asked(site):
        for count in (1, 2, 3):
            await site.until(lambda count=count: len(site.asked) >= count)
            times_s.append(loop.time())
    assert times_s[2] - times_s[0] > 1.1  # 0.4 s, then 0.8 s
    assert (site.heard, site.said) == ([], [])


def big():
    return b'{"a": "' + b"x" * 1_100_000 + b'"}'


def elsewhere():
    raise web.HTTPFound("/elsewhere.json")


@pytest.mark.parametrize(
    "answer",
    [
        b"\xff\xfe",
        b"[" * 100_000,
        b"7",
        big(),
        elsewhere,
        {},
        {**good_answer(), "snapshot": {}},
        {**good_answer(), "lift_m": 1e300},
        {**good_answer(), "scenario": "x" * 1000},
        {**good_answer(), "snapshot": {**asdict(SNAPSHOT), "crossed": ["red"] * 1000}},
        b'{"scenario": "s", "lift_m": NaN}',
    ],
    ids=range(11),
)
async def test_invalid_answers_are_ignored(site, answer):
    site.answers["/referee.json"] = answer
    site.answers["/elsewhere.json"] = good_answer()
    async with asked(site):
        await site.until(lambda: site.asked.count("/referee.json") >= 2)
    assert site.heard == []
    assert "/elsewhere.json" not in site.asked
    assert len(site.said) <= 1


@pytest.mark.parametrize(
    "answer",
    [
        None,
        {**told(SCENARIO), "name": "../secret.yaml"},
        b"no",
        {**told(SCENARIO), "x": 1},
        {**told(SCENARIO), "layout_mark": "0000"},
    ],
)
async def test_an_invalid_scenario_is_reported_once_and_the_referee_still_counts(site, answer):
    site.answers["/scenario.json"] = answer
    async with asked(site):
        await site.until(lambda: len(site.heard) >= 3)
        assert site.channel.scenario is None
    assert len(site.said) == 1
    assert "/scenario.json: " in site.said[0]
    assert "\n" not in site.said[0]
    assert site.asked.count("/scenario.json") == 1
