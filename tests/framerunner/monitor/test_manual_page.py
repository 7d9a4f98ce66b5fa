"""The page at /pilot in a real browser: what its inputs send, and what it refuses."""

import asyncio

import pytest
import pytest_asyncio
from playwright.async_api import expect

from framerunner.monitor import manual_control
from framerunner.monitor.access import Access, Visitor
from framerunner.monitor.manual_control import NEUTRAL
from framerunner.monitor.ports import Equipment
from framerunner.monitor.vehicle.commands import Sticks
from tests.chromium import Complaints, until
from tests.framerunner.monitor.manual_fakes import MISSION, FakeFleet
from tests.framerunner.monitor.manual_server import served

pytestmark = pytest.mark.asyncio(loop_scope="session")
PHONE = {"width": 390, "height": 844}
FAKE_GAMEPAD = """
window.pad = {
  id: "Fake pad", connected: true, mapping: "standard", axes: [0, 0, 0, 0],
  buttons: Array.from({length: 17}, () => ({pressed: false, value: 0})),
};
navigator.getGamepads = () => [window.pad, null];
"""


KEYS = {
    "ArrowUp": Sticks(0.235, 0, 0, 0),
    "ArrowDown": Sticks(-0.235, 0, 0, 0),
    "ArrowRight": Sticks(0, 0.235, 0, 0),
    "ArrowLeft": Sticks(0, -0.235, 0, 0),
    "KeyW": Sticks(0, 0, 0.37, 0),
    "KeyS": Sticks(0, 0, -0.37, 0),
    "KeyD": Sticks(0, 0, 0, 0.37),
    "KeyA": Sticks(0, 0, 0, -0.37),
}
EQUIPMENT = Equipment(
    open_link=lambda: None,
    make_referee=lambda _scenario: None,
    scenario=None,
    list_scenarios=lambda: (),
    load_scenario=lambda _name: None,
    runs=None,
)


class Pilot:
    """A window at the page, and the drones behind it."""

    def __init__(self, page, fleet):
        self.page = page
        self.fleet = fleet
        self.complaints = Complaints(page)

    async def open(self, url):
        await self.page.goto(f"{url}pilot")
        await self.page.wait_for_selector(".p-state strong:not(:empty)")
        await until(self.page, "document.querySelector('.p-orders button')")

    async def take(self):
        await self.page.get_by_role("button", name="Take sticks").click()
        await self.flying()

    async def flying(self):
        await self.page.wait_for_selector('#manual[data-look="mine"]')

    async def sends(self, condition):
        """Wait until sticks are sent that fulfil a condition."""
        count = len(self.fleet.sent)
        found = await self.until(
            lambda: [each for _, each in self.fleet.sent[count:] if each is not None and condition(each)]
        )
        return found[0]

    async def ordered(self, what):
        await self.until(lambda: what in self.fleet.orders)

    async def until(self, condition, limit_s=20.0):
        """Wait for a condition; what it returned."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + limit_s
        while not (found := condition()):
            log = await self.page.locator(".p-log").all_inner_texts()
            assert loop.time() < end_s, f"{self.fleet.orders} {self.fleet.sent[-3:]} {log}"
            await asyncio.sleep(0.01)
        return found

    async def says(self, text):
        """Wait for a message."""
        log = self.page.locator(".p-log")
        await expect(log).to_contain_text(text, timeout=20_000)


@pytest_asyncio.fixture(loop_scope="session")
async def monitor(monkeypatch, tmp_path, chromium):
    """Opens windows at a monitor with fake drones: `await monitor()`."""
    fleets = []

    def make_fleet(equipment):
        fleets.append(FakeFleet(equipment))
        del fleets[-1].status[2]
        return fleets[-1]

    monkeypatch.setattr("framerunner.monitor.server.MonitoredFleet", make_fleet)
    monkeypatch.setattr(manual_control, "SILENT_S", 20.0)  # a busy machine is not a page that fell silent
    monkeypatch.setattr(manual_control, "ABANDONED_S", 60.0)
    async with served(EQUIPMENT, tmp_path) as url:

        async def open_window(viewport=None, touch=False):
            size = viewport or {"width": 900, "height": 760}  # without the arena, which takes time to draw
            context = await chromium.new_context(viewport=size, has_touch=touch)
            await context.add_init_script(FAKE_GAMEPAD)
            pilot = Pilot(await context.new_page(), fleets[0])
            await pilot.open(url)
            return pilot

        yield open_window


async def test_each_key_moves_one_stick_to_the_top_speed_and_back(monitor):
    pilot = await monitor()
    await pilot.take()
    for key, expected in KEYS.items():
        await pilot.page.keyboard.down(key)
        first = await pilot.sends(lambda sticks: sticks != NEUTRAL)
        assert max(map(abs, (first.forward, first.right, first.up, first.yaw))) <= 0.37
        await pilot.sends(lambda sticks, expected=expected: sticks == expected)
        await pilot.page.keyboard.up(key)
        await pilot.sends(lambda sticks: sticks == NEUTRAL)
    assert pilot.complaints == []


async def test_the_slider_and_its_keys_set_the_top_speed(monitor):
    pilot = await monitor()
    await pilot.take()
    await pilot.page.keyboard.press("+")
    assert await pilot.page.get_by_label("Top speed").input_value() == "20"
    await pilot.page.get_by_label("Top speed").fill("100")
    await pilot.page.keyboard.down("ArrowRight")
    await pilot.sends(lambda sticks: sticks == Sticks(0, 1.0, 0, 0))
    assert await pilot.page.locator("output[data-axis=right]").text_content() == "1.00"
    await pilot.page.keyboard.up("ArrowRight")


async def test_a_gamepad_takes_flies_holds_and_gives_back(monitor):
    pilot = await monitor()
    await press(pilot, 0)
    await pilot.flying()
    await pilot.page.evaluate("pad.axes = [0.07, -0.07, 0.05, -1]")
    sent = await pilot.sends(lambda sticks: sticks.forward > 0)
    assert sent == Sticks(0.235, 0, 0, 0)  # small deflections are within its dead zone
    assert await pilot.page.locator(".p-input").text_content() == "gamepad Fake pad"
    await pilot.page.evaluate("pad.axes = [1, -1, 1, 0]")
    assert await pilot.sends(lambda sticks: sticks.up > 0) == Sticks(0, 0.235, 0.37, 0.37)
    await pilot.page.evaluate("pad.axes = [0, 0, 0, 0]")
    await pilot.sends(lambda sticks: sticks == NEUTRAL)
    await press(pilot, 2)
    await pilot.ordered("hold")
    await press(pilot, 1)
    await pilot.says("no mission waits")
    assert pilot.fleet.pilots[1] == ""


async def press(pilot, button):
    """Press a button of the gamepad for long enough to be seen."""
    await pilot.page.evaluate(f"pad.buttons[{button}] = {{pressed: true, value: 1}}")
    await pilot.page.wait_for_timeout(120)
    await pilot.page.evaluate(f"pad.buttons[{button}] = {{pressed: false, value: 0}}")


async def test_two_fingers_hold_two_sticks_which_spring_back(monitor):
    pilot = await monitor(PHONE, touch=True)
    await pilot.take()
    touch = await pilot.page.context.new_cdp_session(pilot.page)
    left, right = [await pilot.page.locator(selector).bounding_box() for selector in (".p-left", ".p-right")]
    points = [
        {"id": number, "x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
        for number, box in enumerate((left, right))
    ]
    await touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points})
    points[0]["y"] -= 90
    points[1]["x"] += 90
    await touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": points})
    assert await pilot.sends(lambda sticks: sticks.up > 0 and sticks.right > 0) == Sticks(0, 0.235, 0.37, 0)
    await touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": points[1:]})
    assert await pilot.sends(lambda sticks: sticks.right == 0) == Sticks(0, 0, 0.37, 0)
    await touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    await pilot.sends(lambda sticks: sticks == NEUTRAL)


@pytest.mark.parametrize("viewport", [PHONE, {"width": 844, "height": 390}, {"width": 1366, "height": 768}])
async def test_all_controls_are_visible_without_scrolling(monitor, viewport):
    pilot = await monitor(viewport)
    await pilot.take()
    await until(pilot.page, "document.scrollingElement.scrollWidth <= innerWidth")
    for selector in (".p-state", ".p-left", ".p-right", ".p-orders", ".p-middle .stop", ".p-figures"):
        box = await pilot.page.locator(selector).first.bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= viewport["height"] + 1, selector
        assert box["x"] >= 0 and box["x"] + box["width"] <= viewport["width"] + 1, selector


async def test_without_focus_the_sticks_are_centred_at_once(monitor):
    pilot = await monitor()
    await pilot.take()
    await pilot.page.keyboard.down("ArrowUp")
    await pilot.sends(lambda sticks: sticks.forward > 0.2)
    await pilot.page.evaluate("dispatchEvent(new Event('blur'))")
    await pilot.sends(lambda sticks: sticks == NEUTRAL)
    count = len(pilot.fleet.sent)
    await pilot.page.wait_for_timeout(300)
    assert {sticks for _, sticks in pilot.fleet.sent[count:]} == {NEUTRAL}  # the key counts no more


async def test_the_drone_holds_when_the_page_is_hidden(monitor):
    pilot = await monitor()
    await pilot.take()
    await pilot.page.evaluate(
        "Object.defineProperty(document, 'hidden', {get: () => true});"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )
    await pilot.ordered("hold")
    count = len(pilot.fleet.sent)
    await pilot.page.wait_for_timeout(300)
    assert {sticks for _, sticks in pilot.fleet.sent[count:]} <= {NEUTRAL}


async def test_keys_that_fly_do_not_scroll_and_press_no_button(monitor):
    pilot = await monitor({"width": 900, "height": 420})
    await pilot.take()
    await pilot.page.get_by_role("button", name="Arm", exact=True).focus()
    before = await pilot.page.evaluate("scrollY")
    for key in ("ArrowDown", "ArrowUp", "Space"):
        await pilot.page.keyboard.press(key)
    await pilot.ordered("hold")
    assert await pilot.page.evaluate("scrollY") == before
    assert "arm" not in pilot.fleet.orders


async def test_keys_do_nothing_to_a_drone_that_was_not_taken(monitor):
    pilot = await monitor()
    for key in ("ArrowUp", "KeyW", "Space", "Escape"):
        await pilot.page.keyboard.press(key)
    await pilot.page.wait_for_timeout(200)
    assert pilot.fleet.sent == [] and pilot.fleet.orders == []


async def test_escape_gives_back_to_the_mission_that_waits(monitor):
    pilot = await monitor()
    await pilot.take()
    pilot.fleet.status[1]["mission"] = MISSION
    await pilot.page.keyboard.press("Escape")
    await pilot.says("the mission frame_challenge goes on")
    pilot.fleet.status[1]["mission"] = MISSION | {"paused": False}
    await until(pilot.page, "document.querySelector('.p-who').textContent === 'Automaticmission red.turning'")


async def test_stopping_the_motors_requires_confirmation(monitor):
    pilot = await monitor()
    await pilot.page.get_by_role("button", name="Stop motors").click()
    question = pilot.page.get_by_role("dialog")
    assert await question.get_by_role("heading").text_content() == "Stop the motors of drone 1?"
    assert await pilot.page.evaluate("document.activeElement.textContent") == "Cancel"
    await pilot.page.keyboard.press("Enter")
    await question.wait_for(state="hidden")
    assert pilot.fleet.orders == []
    await pilot.page.keyboard.press("Enter")  # the focus is back on the button
    await pilot.page.keyboard.press("Tab")
    await pilot.page.keyboard.press("Enter")
    await pilot.ordered("stop_motors")
    await pilot.says("stop motors: stop_motors done")


async def test_stopping_the_motors_by_holding_the_button_for_a_second(monitor):
    pilot = await monitor()
    button = pilot.page.get_by_role("button", name="Stop motors")
    await button.hover()
    await pilot.page.mouse.down()
    await pilot.page.wait_for_timeout(400)
    assert pilot.fleet.orders == []
    await pilot.ordered("stop_motors")
    await pilot.page.mouse.up()
    assert not await pilot.page.get_by_role("dialog").is_visible()
    assert pilot.fleet.orders == ["stop_motors"]


async def test_a_second_window_sees_who_flies_and_may_not(monitor):
    first, second = await monitor(), await monitor()
    await first.take()
    await second.page.wait_for_selector('#manual[data-look="theirs"]')
    assert await second.page.locator(".p-who").text_content() == "Manualanother window flies"
    await second.page.get_by_role("button", name="Take sticks").click()
    await second.says("another window has the sticks; ask for them to be given back")
    await second.page.get_by_role("button", name="Land").click()
    await second.says("land: another window has the sticks of drone 1")
    assert first.fleet.orders == ["position"]


async def test_the_drone_holds_when_the_window_is_closed_and_the_others_are_told(monitor):
    first, second = await monitor(), await monitor()
    await first.take()
    await first.page.close()
    await first.ordered("hold")
    await second.says("the pilot's page is gone; drone 1 is told to hold")
    await second.take()


async def test_a_visitor_who_may_not_fly_is_told_to_log_in(monitor, monkeypatch):
    nobody = Visitor()
    monkeypatch.setattr(Access, "visitor", lambda _self, _connection: nobody)
    pilot = await monitor()
    words = pilot.page.locator(".p-refused")
    assert await words.text_content() == "Only judges and organisers may fly. Log in"
    for name in ("Take sticks", "Arm", "Take off", "Hold", "Land", "Disarm", "Stop motors"):
        assert await pilot.page.get_by_role("button", name=name, exact=name != "Stop motors").is_disabled()
    await pilot.page.evaluate(
        """() => new Promise((resolve) => {
          const socket = new WebSocket(`ws://${location.host}/ws/pilot`);
          socket.onopen = () => socket.send('{"kind": "do", "id": 1, "what": "land"}');
          socket.onclose = (event) => { window.closedWith = event.code; resolve(); };
        })"""
    )
    assert await pilot.page.evaluate("closedWith") == 4403
    assert pilot.fleet.orders == []


async def test_texts_of_drones_and_names_are_escaped(monitor):
    pilot = await monitor()
    evil = "<img src=x onerror=alert(1)>"
    pilot.fleet.status[1]["mission"] = MISSION | {"paused": False, "state": evil}
    pilot.fleet.refuse["arm"] = evil
    await pilot.page.get_by_role("button", name="Arm", exact=True).click()
    await pilot.says(evil)
    await until(pilot.page, f"document.querySelector('.p-who').textContent.includes({evil!r})")
    assert await pilot.page.locator("img[src=x]").count() == 0
    assert pilot.complaints == []
