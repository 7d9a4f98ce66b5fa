"""A flight seen in a real browser: from take-off to verdict, and with a pilot who takes the sticks."""

import asyncio
import json
import re
from contextlib import asynccontextmanager

import aiohttp
import pytest
from pymavlink import mavutil

from tests.chromium import Complaints, chromium
from tests.processes import free_instance, program

pytestmark = pytest.mark.realtime

VIEWERS = 9  # and the browser
LATE_S = 0.3
FIGURES = ("try_time_s", "penalty_s", "total_time_s", "contacts")
SCENARIO = """\
name: one-gate
base: {x_m: -1.0}
start: {x_m: -1.0}
frames:
  - {colour: red, x_m: 0.0, y_m: 0.0, z_m: 1.0}
"""
MISSION = """\
name: hop
description: Through the red frame, over it and back
initial: up
states:
  up:
    enter:
      - hover
      - goal_m = (-1, 0, 1)
    during:
      - fly_to_goal
    transitions:
      - when: distance_to_goal_m < 0.05
        to: through
  through:
    enter:
      - goal_m = (0.9, 0, 1)
    during:
      - fly_to_goal
    transitions:
      - when: distance_to_goal_m < 0.3
        to: over
  over:
    enter:
      - goal_m = (0.5, 0, 1.6)
    during:
      - fly_to_goal
    transitions:
      - when: distance_to_goal_m < 0.2
        to: home
  home:
    initial: back
    states:
      back:
        enter:
          - goal_m = (-1, 0, 1.2)
        during:
          - fly_to_goal
        transitions:
          - when: distance_to_goal_m < 0.1
            to: down
      down:
        enter:
          - goal_m = (-1, 0, 0.58)
        during:
          - fly_to_goal
        transitions:
          - when: distance_to_goal_m < 0.05
            to: stop
      stop:
        enter:
          - motors_off
        final: true
"""
LEAVES = ["up", "through", "over", "home.back", "home.down", "home.stop"]
NOTE_STATES = """() => {
    window.lit = [];
    const note = () => {
        const id = document.querySelector(".m-chart")?.dataset.state;
        if (id && id !== window.lit.at(-1)?.id) window.lit.push({ id, unix_s: Date.now() / 1000 });
    };
    new MutationObserver(note).observe(document.body, { subtree: true, attributes: true, childList: true });
}"""


@pytest.fixture
def plan(tmp_path):
    """A scenario and a mission of twenty seconds; a folder each for flight and monitor."""
    (tmp_path / "gate.yaml").write_text(SCENARIO)
    (tmp_path / "hop.yaml").write_text(MISSION)
    (tmp_path / "monitor").mkdir()
    (tmp_path / "flight").mkdir()
    return tmp_path


@pytest.fixture
def monitor(plan):
    """The monitor as people start it; the address of its pages."""
    with program(plan / "monitor", "monitor", "--port", "0", "--runs", str(plan / "runs")) as running:
        running.wait_for("judges log in", 60.0)
        yield re.search(r"monitor: (http\S+)", running.err)[1]
        assert running.process.poll() is None
        assert "Traceback" not in running.err


@asynccontextmanager
async def flying(plan):
    """`framerunner fly`; yields the running program."""
    arguments = [str(plan / "gate.yaml"), "--mission", str(plan / "hop.yaml"), "--out", str(plan / "runs")]
    with program(plan / "flight", "fly", *arguments, "--instance", str(free_instance())) as flight:
        yield flight
        code = await asyncio.to_thread(flight.process.wait, 120.0)
        assert "Traceback" not in flight.err
        assert code == 0, flight.out + flight.err


class Viewer:
    """Counts poses like a page that does not draw."""

    def __init__(self, url):
        self.poses_s = []
        self._url = url.replace("http", "ws") + "ws/live"

    async def look(self):
        loop = asyncio.get_running_loop()
        async with aiohttp.ClientSession() as session, session.ws_connect(self._url) as socket:
            async for message in socket:
                if message.data.startswith('{"kind":"pose"'):
                    self.poses_s.append(loop.time())

    def rate_hz(self, since_s, until_s):
        return sum(since_s <= came_s < until_s for came_s in self.poses_s) / (until_s - since_s)


def told_states(folder):
    """When the app told of each state, by the log's clock: unix seconds and the state's id."""
    log = mavutil.mavlink_connection(str(folder / "flight.tlog"))
    told = {}
    while (message := log.recv_match(type="STATUSTEXT")) is not None:
        if message.get_srcComponent() == 191 and message.text.startswith("mission: "):
            told.setdefault(message.text.removeprefix("mission: "), message._timestamp)
    return told


async def test_a_flight_is_seen_from_take_off_to_its_verdict_by_ten_viewers(plan, monitor):
    viewers = [Viewer(monitor) for _ in range(VIEWERS)]
    looking = [asyncio.create_task(viewer.look()) for viewer in viewers]
    async with chromium(solid=True) as browser:
        page = await browser.new_page(viewport={"width": 1366, "height": 768})
        complaints = Complaints(page)
        await page.goto(monitor)
        await page.evaluate(NOTE_STATES)
        loop = asyncio.get_running_loop()
        async with flying(plan):
            await page.wait_for_selector('[data-figure="crossed"][data-value="red"]', timeout=90_000)
            until_s = loop.time()
            rates_hz = [viewer.rate_hz(until_s - 5.0, until_s) for viewer in viewers]
            await page.wait_for_selector('[data-final="true"]', timeout=60_000)
        shown = {
            name: float(await page.get_attribute(f'[data-figure="{name}"]', "data-value")) for name in FIGURES
        }
        verdict = await page.get_attribute('[data-figure="verdict"]', "data-value")
        crossed = await page.get_attribute('[data-figure="crossed"]', "data-value")
        lit = {state["id"]: state["unix_s"] for state in await page.evaluate("window.lit")}
    for task in looking:
        task.cancel()
    await asyncio.gather(*looking, return_exceptions=True)

    (run,) = (plan / "runs").iterdir()
    result = json.loads((run / "result.json").read_text())
    assert shown == {name: result[name] for name in FIGURES}
    assert (verdict, crossed.split(",")) == (result["verdict"], result["frames_crossed"])
    assert min(rates_hz) >= 19.0, rates_hz
    assert result["real_time_factor"] >= 0.98
    told = told_states(run)
    late_s = {state: lit[state] - told[state] for state in LEAVES}
    assert max(late_s.values()) < LATE_S, late_s
    print(f"poses a second: {min(rates_hz):.1f} to {max(rates_hz):.1f}; lit after {late_s}")
    assert complaints == []

    async with aiohttp.ClientSession() as session, session.get(f"{monitor}api/competition/tries") as response:
        (judged,) = await response.json()
    assert (judged["verdict"], judged["final"]) == (result["verdict"], True)
    assert judged["result"]["total_s"] == pytest.approx(result["total_time_s"], abs=0.005)


async def test_a_pilot_takes_the_sticks_from_a_mission_and_gives_them_back(plan, monitor):
    async with chromium() as browser:
        page = await browser.new_page(viewport={"width": 1366, "height": 768})
        complaints = Complaints(page)
        await page.goto(f"{monitor}pilot")
        async with flying(plan) as flight:
            await asyncio.to_thread(flight.wait_for, "home.back", 90.0)
            await page.get_by_role("button", name="Take sticks").click()
            await page.get_by_text("you fly").wait_for(timeout=10_000)
            await page.keyboard.down("ArrowLeft")
            await asyncio.sleep(1.5)
            await page.keyboard.up("ArrowLeft")
            await page.get_by_role("button", name="Give back").click()
    (run,) = (plan / "runs").iterdir()
    result = json.loads((run / "result.json").read_text())
    assert result["verdict"] == "clean"
    assert result["path_length_m"] > 4.75  # without the detour it is 4.6 m
    assert complaints == []
