"""A drone flown from a browser: signs, the dead man, and what becomes of the sticks."""

import asyncio
import json
from contextlib import asynccontextmanager
from math import cos, remainder, sin, tau

import aiohttp
import pytest

from scenarios.loader import load_scenario
from tests.chromium import Complaints, chromium
from tests.framerunner.monitor.manual_server import served
from tests.framerunner.monitor.simulated_link import SimulatedLink, equipment

pytestmark = pytest.mark.realtime

CENTRED = {"forward": 0.0, "right": 0.0, "up": 0.0, "yaw": 0.0}


class Flight:
    """A simulated drone in real time, and a monitor that it is flown with."""

    def __init__(self, link, url):
        self.link = link
        self.url = url

    @property
    def simulation(self):
        return self.link.drones[0].simulation

    @property
    def mode(self):
        return self.simulation.autopilot.status.mode.name

    @property
    def armed(self):
        return self.simulation.autopilot.status.armed

    @property
    def state(self):
        return self.simulation.autopilot.state

    @property
    def height_m(self):
        return -self.state.position_ned_m[2]

    @property
    def still(self):
        return max(map(abs, self.state.velocity_ned_m_s)) < 0.05

    def moved(self, since):
        """Forward, to the right and clockwise (m, m, rad) since a `place`, as seen from there."""
        (x, y, yaw), (x0, y0, yaw0) = self.place(), since
        north, east = x - x0, y - y0
        turned = remainder(yaw - yaw0, tau)
        forward = cos(yaw0) * north + sin(yaw0) * east
        return forward, cos(yaw0) * east - sin(yaw0) * north, turned

    def place(self):
        return (*self.state.position_ned_m[:2], self.state.yaw_rad)

    def manual_controls(self):
        with self.link.lock:
            return sum(message.get_type() == "MANUAL_CONTROL" for message in self.link.sent)

    async def until(self, condition, limit_s=20.0):
        loop = asyncio.get_running_loop()
        end_s = loop.time() + limit_s
        while not condition():
            assert loop.time() < end_s, f"did not come: {self.mode} armed {self.armed} {self.height_m:.2f} m"
            await asyncio.sleep(0.01)


@pytest.fixture
async def flight(request, tmp_path):
    link = SimulatedLink(load_scenario("empty"), speed=getattr(request, "param", 1.0))
    async with served(equipment(link), tmp_path) as url:
        flight = Flight(link, url)
        await flight.until(lambda: flight.simulation.autopilot.status.ready)
        yield flight


class Hand:
    """A pilot's WebSocket without a page: streams sticks, gives orders."""

    def __init__(self, socket):
        self._socket = socket
        self.held = dict(CENTRED)
        self.streaming = True

    async def stream(self):
        while True:
            if self.streaming:
                await self._socket.send_json({"kind": "sticks", **self.held})
            await asyncio.sleep(0.04)

    async def order(self, what):
        await self._socket.send_json({"kind": "do", "id": 1, "what": what})
        async for message in self._socket:
            reply = json.loads(message.data)
            if reply["kind"] == "reply" and reply["what"] == what:
                return reply
        raise AssertionError("closed")


@asynccontextmanager
async def hand_at(flight):
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(flight.url.replace("http", "ws") + "ws/pilot") as socket,
    ):
        hand = Hand(socket)
        streaming = asyncio.create_task(hand.stream())
        try:
            yield hand
        finally:
            streaming.cancel()


async def take_off(flight, hand):
    """By the stick, in position mode."""
    for what in ("take", "arm"):
        reply = await hand.order(what)
        assert reply["ok"], reply
    hand.held["up"] = 0.4
    await flight.until(lambda: flight.height_m > 1.0)
    hand.held["up"] = 0.0
    await flight.until(lambda: flight.still)


@pytest.mark.alone
async def test_silence_has_the_drone_hold_in_time_and_neutral_sticks_go_on_until_it_is_disarmed(flight):
    loop = asyncio.get_running_loop()
    async with hand_at(flight) as hand:
        await take_off(flight, hand)
        hand.held["forward"] = 0.3
        start = flight.place()
        await flight.until(lambda: flight.moved(start)[0] > 0.5)
        hand.streaming = False
        silent_since_s = loop.time()
        await flight.until(lambda: flight.mode == "HOLD")
        assert loop.time() - silent_since_s < 0.8
        count = flight.manual_controls()
        await asyncio.sleep(2.0)
        assert flight.mode == "HOLD"  # no failsafe for lost sticks
        assert flight.manual_controls() > count + 30
        assert (await hand.order("land"))["ok"]
        await flight.until(lambda: not flight.armed)
    async with asyncio.timeout(10.0):
        count = -1
        while count != flight.manual_controls():  # none came for so long: they ended with the flight
            count = flight.manual_controls()
            await asyncio.sleep(0.5)


@pytest.mark.alone  # a browser that is kept waiting for half a second has the drone hold, as it must
@pytest.mark.parametrize("flight", [2.0], indirect=True, ids=["twice real time"])
async def test_keys_and_gamepad_fly_the_drone_to_where_they_point(flight):
    script = """
      window.pad = { id: "pad", connected: true, axes: [0, 0, 0, 0],
        buttons: Array.from({length: 17}, () => ({pressed: false})) };
      navigator.getGamepads = () => [window.pad];
    """
    async with chromium() as browser:
        page = await browser.new_page(viewport={"width": 900, "height": 760})
        complaints = Complaints(page)
        await page.add_init_script(script)
        await page.goto(f"{flight.url}pilot")
        await page.get_by_role("button", name="Take sticks").click()
        await page.wait_for_selector('#manual[data-look="mine"]')
        await page.get_by_role("button", name="Arm", exact=True).click()
        await flight.until(lambda: flight.armed)
        await page.keyboard.down("KeyW")
        await flight.until(lambda: flight.height_m > 1.2)
        await page.keyboard.up("KeyW")
        for key, axis, sign in (
            ("ArrowUp", 0, 1),
            ("ArrowRight", 1, 1),
            ("ArrowDown", 0, -1),
            ("ArrowLeft", 1, -1),
            ("KeyD", 2, 1),
            ("KeyA", 2, -1),
        ):
            await flown(flight, axis, sign, page.keyboard.down(key), page.keyboard.up(key))
        for axes, axis, sign in (("[0,0,0,-1]", 0, 1), ("[0,0,1,0]", 1, 1), ("[1,0,0,0]", 2, 1)):
            push, centre = page.evaluate(f"pad.axes = {axes}"), page.evaluate("pad.axes = [0,0,0,0]")
            await flown(flight, axis, sign, push, centre)
        await page.get_by_role("button", name="Land").click()
        await flight.until(lambda: not flight.armed)
        assert complaints == []


async def flown(flight, axis, sign, push, let_go):
    """Push until it has moved enough along an axis, the right way and no other; then let it stop."""
    start = flight.place()
    await push
    await flight.until(lambda: abs(flight.moved(start)[axis]) > 0.3)
    await let_go
    moved = flight.moved(start)
    assert moved[axis] * sign > 0.3
    others = [abs(value) for number, value in enumerate(moved) if number != axis]
    assert max(others) < 0.15
    await flight.until(lambda: flight.still)
