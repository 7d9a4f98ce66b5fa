"""The live page and the statechart's, in a real browser, with messages of the test."""

import asyncio
import re
from dataclasses import replace
from math import inf

import cv2
import numpy as np
import pytest
import pytest_asyncio
from playwright.async_api import expect

from framerunner.flying.mission_reporter import MissionReporter
from framerunner.monitor.vehicle.mission import MissionView
from framerunner.wire.mission_tunnel import DOCUMENT_TYPE
from offboard.app import Moment
from offboard.drone import DroneState, PlaceEstimate, VelocityFluCommand
from offboard.mission import load_mission, mermaid
from offboard.navigation.view import GateEstimate, NavigationView
from scenarios.loader import load_scenario
from tests.chromium import Complaints, until
from tests.framerunner.monitor.page_server import JPEG, fake_monitor
from tests.framerunner.monitor.vehicle.test_mission_view import tunnel
from vision.types import Detections

pytestmark = pytest.mark.asyncio(loop_scope="session")
MISSION = load_mission("frame_challenge")
STATES = list(MISSION.leaves)
MARKUP = "<img src=x onerror=alert(1)><b>bold</b>"
LIT = "svg .e-state.e-active:not(.e-super)"
PATIENCE_MS = 20_000  # a browser that draws without a graphics card, on a machine that has other things to do
expect.set_options(timeout=PATIENCE_MS)
LAPTOP, PHONE = {"width": 1366, "height": 768}, {"width": 390, "height": 844}
SMALL, LARGE = {"width": 1024, "height": 768}, {"width": 1920, "height": 1080}
LIVE_LINK = {"state": "live", "age_s": 0.04, "loss_percent": 0.0, "rate_hz": 210.0}
FIGURES = {
    "try_time_s": 87.4321,
    "penalty_s": 2.25,
    "total_time_s": 89.6821,
    "limit_s": 180.0,
    "time_over": False,
    "crossed": ["red", "green"],
    "crossing_times_s": [32.4567, 56.9],
    "next_colour": "blue",
    "contacts": 1,
    "inside": True,
    "motors_on": True,
    "over": False,
    "verdict": "aborted",
    "reason": "aborted after 87.4 s (the motors were still on); crossed: red, green",
    "source": "truth",
    "final": False,
}


def world(**more):
    scenario = load_scenario("test-case-1").model_dump(mode="json")
    return {"kind": "world", "scenario": scenario, "lift_m": 0.0, "source": "truth", **more}


def chart(drone_id=1, name=MISSION.name, source="name: frame_challenge"):
    return {
        "kind": "chart",
        "id": drone_id,
        "name": name,
        "mermaid": mermaid(MISSION),
        "states": STATES,
        "source": source,
    }


def pose(drone_id=1, t=10.0, state="red.turning", **more):
    still = {
        "p": [1.0, 2.0, 1.5],
        "q": [1.0, 0.0, 0.0, 0.0],
        "v": [0.1, 0.0, 0.0],
        "r": 0.0,
        "c": [0.2, 0, 0, 0],
    }
    return {"id": drone_id, "t": t, **still, "on": True, "s": STATES.index(state), "fresh": True, **more}


def status(drone_id=1, state="red.turning", figures=FIGURES, **more):
    mission = {"name": MISSION.name, "state": state, "seconds": 1.5, "transitions": 4}
    mission |= {"paused": False, "flying": True, "finished": False, "alive": True}
    vehicle = {"name": f"drone {drone_id}", "mode": "OFFBOARD", "armed": True, "landed": False}
    vehicle |= {"battery_percent": 87.0, "voltage_v": 11.84, "link": LIVE_LINK, "pilot": "", "video": False}
    return {"id": drone_id, **vehicle, "mission": mission, "figures": figures, **more}


@pytest_asyncio.fixture(loop_scope="session")
async def fake():
    async with fake_monitor() as monitor:
        monitor.welcome = [world(), chart(), {"kind": "status", "drones": [status()]}]
        yield monitor


WITHOUT_WEBGL = """const context = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind.startsWith("webgl") ? null : context.call(this, kind, ...more);
};"""


async def visit(browser, fake, path="/", viewport=LAPTOP, *, three=None, script="", **more):
    """Open a page.

    Args:
        browser: a playwright `Browser`.
        fake: the monitor.
        path: of the page.
        viewport: its size.
        three: an event that its library for 3-D waits for.
        script: run before the page's own.
        more: for the browser's context.
    """
    context = await browser.new_context(viewport=viewport, **more)
    page = await context.new_page()
    if script:
        await page.add_init_script(script)

    async def load_three(route):
        await three.wait()
        await route.continue_()

    if three is not None:
        await page.route("**/static/chunks/scene-*.js", load_three)
    page.set_default_timeout(PATIENCE_MS)
    complaints = Complaints(page)
    await page.goto(fake.url + path)
    await fake.until_watched()
    return page, complaints


def figure(page, name):
    return page.locator(f'[data-figure="{name}"]')


async def width_of(page):
    return await page.evaluate("document.documentElement.scrollWidth")


async def gates_drawn(page):
    return int(await page.locator(".m-arena").get_attribute("data-frames") or 0)


async def test_figures_are_those_that_were_sent(chromium, fake):
    page, complaints = await visit(chromium, fake)
    for name, shown in (
        ("try_time_s", "87.4"),
        ("penalty_s", "2.3"),
        ("total_time_s", "89.7"),
        ("contacts", "1"),
    ):
        await expect(figure(page, name)).to_have_text(shown)
        assert float(await figure(page, name).get_attribute("data-value")) == FIGURES[name]
    await expect(figure(page, "crossed")).to_have_attribute("data-value", "red,green")
    await expect(page.locator('[data-colour="red"]')).to_have_attribute("data-value", "32.4567")
    await expect(page.locator('[data-colour="blue"]')).to_contain_text("next")
    await expect(figure(page, "verdict")).to_have_text("under way")
    await expect(page.locator(".m-warning")).to_be_hidden()
    await expect(page.locator(".m-strip")).to_contain_text("87 %, 11.8 V")
    await expect(figure(page, "faults")).to_be_hidden()

    faults = [{"fault": "gps off at 3 s", "active": False}, {"fault": "motor 1 <b>off</b>", "active": True}]
    await fake.say("status", drones=[status(figures=FIGURES | {"faults": faults, "failsafe": "Landing"})])
    told = "fault: gps off at 3 s (over); fault: motor 1 <b>off</b>; Landing"
    await expect(figure(page, "faults")).to_have_text(told)

    outside = FIGURES | {"inside": False, "time_over": True, "try_time_s": 181.0}
    await fake.say("status", drones=[status(figures=outside)])
    await expect(page.get_by_role("alert")).to_contain_text("outside the arena")
    await expect(page.get_by_role("alert")).to_contain_text("time over")

    clean = FIGURES | {"verdict": "clean", "reason": "clean after 102.3 s", "over": True, "final": True}
    await fake.say("status", drones=[status(figures=clean)])
    await expect(figure(page, "verdict")).to_have_text("clean")
    await expect(figure(page, "verdict")).to_have_attribute("data-value", "clean")
    await expect(page.locator(".m-source")).to_have_text("judged by the simulator's truth, final")

    for crossed, told in ((["red"], "all frames crossed, back to the base"), ([], "")):  # or an open field
        shown = FIGURES | {"crossed": crossed, "next_colour": None}
        await fake.say("status", drones=[status(figures=shown)])
        await expect(figure(page, "next_colour")).to_have_text(told)

    await fake.say("status", drones=[status(figures=None)])
    await expect(figure(page, "try_time_s")).to_have_text("–")
    await expect(figure(page, "verdict")).to_have_text("not judged")
    assert complaints == []


async def test_texts_with_markup_are_shown_as_text(chromium, fake):
    fake.welcome[1] = chart(name=MARKUP, source=f"name: {MARKUP}")
    page, complaints = await visit(chromium, fake, viewport=SMALL)
    await fake.say("text", id=1, time_s=3.0, severity=4, text=MARKUP, **{"from": "drone"})
    await fake.say("notice", id=None, level="warning", text=MARKUP)
    values = [["frame.d", 0.4412345], [MARKUP, None]]
    taken = {"time_s": 4.0, "from": MARKUP, "to": MARKUP, "when": MARKUP, "values": values, "seconds": 1.0}
    await fake.say("transitions", id=1, list=[taken])
    await fake.say("status", drones=[status(state=MARKUP, mode=MARKUP, name=MARKUP, pilot=MARKUP)])
    messages = page.locator(".m-messages li")
    await expect(messages).to_have_count(2)
    for index in (0, 1):
        await expect(messages.nth(index)).to_contain_text(f"warning{'monitor' if index == 0 else ''}{MARKUP}")
    await expect(page.locator('[data-item="mode"]')).to_have_text(MARKUP)
    await expect(page.locator('[data-name="because"]')).to_have_text(MARKUP)
    await expect(page.locator('[data-name="values"]')).to_have_text(f"frame.d = 0.4412, {MARKUP} = ∞")
    await expect(page.locator(".m-mission")).to_have_text(MARKUP)
    await page.locator("summary").click()
    await expect(page.locator(".m-written pre")).to_have_text(f"name: {MARKUP}")
    assert await page.locator("#live img[src=x], #live b:text('bold')").count() == 0
    assert complaints == []


async def test_the_highlighted_state_follows_the_mission(chromium, fake):
    page, complaints = await visit(chromium, fake, "/chart")
    lit, around = page.locator(LIT), page.locator("svg .e-super.e-active")
    panel = page.locator(".m-chart")
    await expect(lit).to_contain_text("turning")
    await expect(around).to_contain_text("red")
    await fake.say("pose", drones=[pose()])
    await fake.say("pose", drones=[pose(t=10.05, state="blue.crossing")])
    await expect(panel).to_have_attribute("data-state", "blue.crossing")
    await expect(lit).to_have_count(1)
    await expect(lit).to_contain_text("crossing")
    await expect(around).to_contain_text("blue")
    await fake.say("status", drones=[status(state="landing.stop")])
    await expect(lit).to_contain_text("stop")
    await page.get_by_role("button", name="Whole").click()
    await expect(page.get_by_role("button", name="Follow")).to_have_attribute("aria-pressed", "false")
    assert await page.locator("svg .e-closed").count() == 0
    assert complaints == []


LETTERS = """(picture) => {
  const size = (text) => parseFloat(getComputedStyle(text).fontSize) * Math.abs(text.getScreenCTM().a);
  const texts = [...document.querySelectorAll('.m-chart-picture text')];
  const sizes = texts.filter((text) => text.textContent).map(size);
  const box = document.querySelector('.m-chart-picture').getBoundingClientRect();
  const lit = document.querySelector('.e-state.e-active:not(.e-super) > rect').getBoundingClientRect();
  const isWide = lit.left >= box.left && lit.right <= box.right;
  const isInside = isWide && lit.top >= box.top && lit.bottom <= box.bottom;
  return [sizes.length, Math.min(...sizes), isInside];
}"""


@pytest.mark.parametrize("path", ["/", "/chart"])
async def test_a_large_chart_can_be_read_and_shows_the_active_state(chromium, fake, path):
    fake.welcome[1] = chart() | {"mermaid": mermaid(load_mission("explorer"))}
    fake.welcome[2] = {"kind": "status", "drones": [status(state="red.crossing")]}
    page, complaints = await visit(chromium, fake, path, viewport={"width": 1440, "height": 900})
    for state in ("red.crossing", "blue.stepping_back", "landing.return"):
        await fake.say("status", drones=[status(state=state)])
        await expect(page.locator(LIT)).to_have_attribute("data-state", state)
        count, smallest, is_inside = await page.evaluate(LETTERS)
        assert count > 5 and smallest >= 9.99 and is_inside
    await expect(page.locator("svg .e-closed")).to_have_count(3)
    await page.get_by_role("button", name="Whole").click()
    await expect(page.locator("svg .e-closed")).to_have_count(0)
    assert complaints == []


async def test_a_new_chart_begins_at_its_initial_state(chromium, fake):
    states = [f'state "x{n}" as x{n}' for n in range(40)]
    arrows = [f"x{n} --> x{n + 1}" for n in range(39)]
    before = "\n".join(["stateDiagram-v2", *states, "[*] --> x0", *arrows])
    after = before.replace("x", "y")
    fake.welcome[1] = chart() | {"mermaid": before}
    fake.welcome[2] = {"kind": "status", "drones": [status(state="x39")]}
    page, complaints = await visit(chromium, fake, "/chart")
    await expect(page.locator('.e-state[data-state="x39"]')).to_be_in_viewport(ratio=0.9)
    await fake.say("status", drones=[status() | {"mission": None}])
    await expect(page.locator(LIT)).to_have_count(0)
    await fake.say(**chart() | {"mermaid": after})
    await expect(page.locator('.e-state[data-state="y0"]')).to_be_in_viewport(ratio=0.9)
    assert complaints == []


async def test_an_invalid_diagram_is_reported_and_the_state_is_still_shown(chromium, fake):
    fake.welcome[1] = chart() | {"mermaid": "stateDiagram-v2\n    state {{ --> }\n"}
    page, _ = await visit(chromium, fake, "/chart")
    await expect(page.locator(".m-chart-words")).to_contain_text("cannot be drawn")
    await expect(page.locator(".m-chart")).to_have_attribute("data-state", "red.turning")


async def test_a_lost_monitor_is_reported_and_reconnected(chromium, fake):
    page, _ = await visit(chromium, fake)
    await expect(figure(page, "try_time_s")).to_have_text("87.4")
    await fake.stop()
    line = page.locator(".m-line")
    await expect(line).to_have_text("connection to the monitor lost, trying again")
    await expect(page.locator("#live")).to_have_class(re.compile(r"\bm-stale\b"))
    fake.welcome[2] = {"kind": "status", "drones": [status(figures=FIGURES | {"try_time_s": 12.0})]}
    await fake.start()
    await expect(line).to_contain_text("back after")
    await expect(figure(page, "try_time_s")).to_have_text("12.0")
    await expect(page.locator("#live")).not_to_have_class(re.compile(r"\bm-stale\b"))


async def test_keys_and_buttons_change_the_view_and_the_drone_is_drawn(solid_chromium, fake):
    page, complaints = await visit(solid_chromium, fake)
    arena = page.locator(".m-arena")
    await expect(arena).to_have_attribute("data-view", "orbit")
    for key, name in (("2", "follow"), ("3", "onboard"), ("1", "orbit")):
        await page.keyboard.press(key)
        await expect(arena).to_have_attribute("data-view", name)
        button = page.locator(f'.m-views [data-view="{name}"]')
        await expect(button).to_have_attribute("aria-pressed", "true")
    await until(page, "document.querySelector('.m-arena').dataset.frames > 0")
    for name in ("follow", "orbit"):
        await page.locator(f'.m-views [data-view="{name}"]').click()
        await expect(arena).to_have_attribute("data-view", name)
    before = await gates_drawn(page)
    await fake.say("pose", drones=[pose(), pose(2, p=[0.0, 0.0, 1.0])])
    await until(page, f"document.querySelector('.m-arena').dataset.frames > {before}")
    await expect(page.locator(".m-arena-legend")).to_have_text("turning")
    await expect(page.locator(".m-arena-labels span")).to_have_text(["1", "2"])
    # Motors that come on again begin a new try, and its trail has colours of its own.
    await fake.say("pose", drones=[pose(t=20.0, on=False), pose(2)])
    await fake.say("pose", drones=[pose(t=20.1, state="take_off.start"), pose(2, on=False)])
    await expect(page.locator(".m-arena-legend")).to_have_text("start")
    assert complaints == []


async def test_one_of_several_drones_is_chosen(chromium, fake):
    page, complaints = await visit(chromium, fake)
    second = status(2, state="landing.stop", figures=FIGURES | {"try_time_s": 55.5})
    await fake.say("status", drones=[status(), second])
    await page.get_by_role("button", name="drone 2").click()
    await expect(figure(page, "try_time_s")).to_have_text("55.5")
    await expect(page.locator(".m-chart")).to_have_attribute("data-state", "landing.stop")
    await fake.say("status", drones=[status()])
    await expect(figure(page, "try_time_s")).to_have_text("87.4")
    await expect(page.locator(".m-tabs")).to_be_hidden()
    assert complaints == []


async def test_a_phone_shows_everything_without_scrolling_sideways(chromium, fake):
    fake.welcome[2] = {"kind": "status", "drones": [status(video=True)]}
    page, complaints = await visit(chromium, fake, viewport=PHONE, has_touch=True, is_mobile=True)
    await fake.say("pose", drones=[pose()])
    box = [-10.0, -30.0, 40.0, 10.0, 1.234, 12.4]
    boxes = {"red": box, "green": None, "blue": [120.0, 100.0, 160.0, 150.0, None, None]}
    await fake.until_filmed()
    await fake.show(JPEG, 10.0)
    await fake.say("detections", id=1, t=10.0, width=320, height=240, boxes=boxes)
    await expect(page.locator(".m-camera")).to_have_attribute("data-boxes-time", "10")
    await expect(page.locator(LIT)).to_have_count(1)
    assert await width_of(page) == PHONE["width"]
    names = ("figures", "arena", "camera", "plots", "chart")
    tops = [(await page.locator(f".m-{name}-panel").bounding_box())["y"] for name in names]
    assert tops == sorted(tops)
    await fake.say("status", drones=[status()])
    await expect(page.locator(".m-camera")).to_have_text("no video")
    assert complaints == []


async def test_without_webgl_the_arena_is_shown_from_above(chromium, fake):
    page, complaints = await visit(chromium, fake, script=WITHOUT_WEBGL)
    await expect(page.locator(".m-arena-words")).to_contain_text("from above")
    await fake.say("pose", drones=[pose(p=[4.0, 4.0, 1.0])])
    await expect(page.locator(".m-topview .t-drone")).to_have_count(1)
    await expect(page.locator(".m-topview .t-height")).to_have_text("1.0 m")
    assert complaints == []


class Pipe:
    """In place of a companion: its documents go straight to a monitor's view of the mission."""

    def __init__(self):
        self.view = MissionView(1)
        self.told = []

    def __getattr__(self, name):
        return lambda *what: None

    def send_document(self, kind, pieces):
        for piece in pieces:
            self.told += self.view.take(tunnel(DOCUMENT_TYPE, piece), 0.0)


def reported_map():
    """The message that a navigator's view becomes on its way through the app's reporter and the monitor."""
    red = GateEstimate("red", (-2.5, 2.5, 1.0), 0.0, (0.4, 0.4, 0.1), 0.1, False, False, 2, 0)
    other = GateEstimate("constructor", (0.0, -2.5, 1.0), 1.0, (inf, inf, inf), 0.1, True, False, 1, 0)
    view = NavigationView((red, other), ((-4.0, 4.0, 1.0), (-1.0, 4.0, 1.0)), MARKUP)
    pipe = Pipe()
    reporter = MissionReporter(pipe, MISSION, "", "test-case-1")
    seen = Moment(DroneState(0, 0.0, 0.0, 1.0, 0.0), VelocityFluCommand(), Detections(), "red.turning", 0.0)
    place = PlaceEstimate((0.4, 0.1, 1.0), 0.1, (0.04, 0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.0, 0.01), 0.05)
    reporter.see(replace(seen, navigation=view, place=place))
    (message,) = (each for each in pipe.told if each["kind"] == "map")
    return message


async def test_the_navigators_map_is_drawn_from_above_and_can_be_switched_off(chromium, fake):
    scenario = world()["scenario"] | {"frames": []}
    fake.welcome = [world(scenario=scenario), chart(), {"kind": "status", "drones": [status()]}]
    page, complaints = await visit(chromium, fake, script=WITHOUT_WEBGL)
    await page.wait_for_selector(".m-topview")
    button, goal = page.get_by_role("button", name="Map"), page.locator(".m-arena-goal")
    await expect(button).to_be_hidden()
    message = reported_map()
    await fake.say(**message)
    await expect(page.locator(".m-arena")).to_have_attribute("data-mapped", "red constructor")
    await expect(goal).to_have_text(f"navigator: {MARKUP}")
    mapped, path = page.locator(".m-topview [data-mapped]"), page.locator(".m-topview .t-path")
    assert [await each.get_attribute("stroke") for each in await mapped.all()] == ["#ff0000", "#7a7a7a"]
    await expect(mapped.locator("ellipse")).to_have_count(1)
    assert len((await path.get_attribute("points")).split()) == 2
    around = page.locator(".m-topview [data-place] ellipse")  # of two standard deviations
    wide, high = [float(await around.get_attribute(name)) for name in ("rx", "ry")]
    assert high / wide == pytest.approx(0.3 / 0.2)
    await button.click()
    await expect(around).to_have_count(0)
    await expect(path).to_have_count(0)
    await expect(mapped).to_have_count(0)
    await expect(goal).to_be_hidden()
    await button.click()
    await expect(goal).to_be_visible()
    await fake.say(**message | {"goal": "", "frames": [], "path": [], "place": None})
    await expect(button).to_be_hidden()
    assert complaints == []


async def test_where_a_simulated_drone_truly_is_is_a_thin_line(chromium, fake):
    fake.welcome = [world(), chart(), {"kind": "status", "drones": [status()]}]
    page, complaints = await visit(chromium, fake, script=WITHOUT_WEBGL)
    for tick in range(4):
        truth = [0.1 * tick, 1.0, 1.0] if tick else None
        await fake.say(
            kind="pose", drones=[pose(t=10.0 + 0.05 * tick, p=[0.1 * tick, 0.5, 1.0], truth=truth)]
        )
    line = page.locator(".m-topview .t-truth")
    await expect(line).to_have_count(1)
    await until(page, "document.querySelector('.t-truth').getAttribute('points').split(' ').length === 3")
    assert complaints == []


async def test_the_navigators_map_is_drawn_in_three_dimensions(solid_chromium, fake):
    page, complaints = await visit(solid_chromium, fake)
    arena = page.locator(".m-arena")
    await until(page, "document.querySelector('.m-arena').dataset.frames > 0")

    async def path_pixels():
        picture = cv2.imdecode(np.frombuffer(await arena.screenshot(), np.uint8), cv2.IMREAD_COLOR)
        blue, green, red = np.moveaxis(picture.astype(int), 2, 0)
        return int(np.sum((red - green > 100) & (blue - green > 60)))

    assert await path_pixels() == 0
    await fake.say(**reported_map())
    await until(page, "document.querySelector('.m-arena').dataset.mapped")
    for _ in range(100):  # pictures that are drawn when the machine has time
        if await path_pixels() >= 30:
            break
    assert await path_pixels() >= 30
    assert complaints == []


BOX = [20.0, -20.0, 30.0, -30.0, 1.5, 5.0]
WATCH_MOMENTS = """() => {
  const camera = document.querySelector(".m-camera"), arena = document.querySelector(".m-arena");
  window.moments = [];
  new MutationObserver(() => {
    const { time, boxesTime } = camera.dataset;
    window.moments.push([Number(time), boxesTime, Number(arena.dataset.time)]);
  }).observe(camera, { attributes: true, attributeFilter: ["data-boxes-time"] });
}"""


async def test_camera_boxes_and_arena_are_of_one_moment(chromium, fake):
    """Detections are sent 0.2 s after their image, when the drone has moved."""
    fake.welcome[2] = {"kind": "status", "drones": [status(video=True)]}
    page, complaints = await visit(chromium, fake)
    await fake.until_filmed()
    await page.evaluate(WATCH_MOMENTS)
    for step in range(600):  # a slow browser draws a few times a second
        t = 10 + step / 20
        await fake.say("pose", drones=[pose(t=t, p=[t - 12, 0.0, 1.5])])
        if step % 2 == 0:
            await fake.show(JPEG, t)
            seen = {"red": BOX, "green": None, "blue": None}
            await fake.say("detections", id=1, t=round(t - 0.2, 3), width=320, height=240, boxes=seen)
        await asyncio.sleep(0.05)
        moments = [each for each in await page.evaluate("window.moments") if each[0] > 10.5]
        if len(moments) >= 6 and t > 13:
            break
    assert len(moments) >= 6
    assert {boxes for _, boxes, _ in moments} == {f"{image:.6g}" for image, _, _ in moments}
    # An image stands until the next one's moment, 0.1 s later; a slow browser draws a few times a second.
    assert all(-0.001 <= arena - image < 0.5 for image, _, arena in moments), moments
    assert complaints == []


async def test_a_late_viewer_sees_the_flight_so_far_at_once(chromium, fake):
    rows = [
        [10 + 0.1 * step, 0.02 * step, 1.0, 1.5, 0.3, 0.2, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1, state]
        for step in range(300)
        for state in [STATES.index("red.turning" if step < 150 else "red.crossing")]
    ]
    fake.welcome.insert(2, {"kind": "history", "id": 1, "poses": rows})
    for step in range(40):  # these come while the page still loads what draws the arena, which is large
        now = pose(t=40 + step / 20, state="red.crossing", p=[6.0 + step / 100, 1.0, 1.5])
        fake.welcome.append({"kind": "pose", "drones": [now]})
    three = asyncio.Event()
    page, complaints = await visit(chromium, fake, three=three)
    await expect(page.locator(".m-plots output").first).to_have_text("6.39")
    three.set()
    await expect(page.locator(".m-arena-legend")).to_have_text("turningcrossing")
    assert complaints == []


async def test_after_a_flight_its_result_and_last_image_stay(chromium, fake):
    fake.welcome[2] = {"kind": "status", "drones": [status(video=True)]}
    page, complaints = await visit(chromium, fake)
    await fake.until_filmed()
    await fake.say("pose", drones=[pose()])
    await fake.show(JPEG, 10.0)
    await expect(page.locator(".m-camera")).to_have_attribute("data-time", "10")
    clean = FIGURES | {"verdict": "clean", "over": True, "final": True, "motors_on": False}
    lost = LIVE_LINK | {"state": "lost", "age_s": 9.0}
    over = status(video=True, figures=clean, armed=False, link=lost, over=True)
    over["mission"] |= {"alive": False}
    await fake.say("status", drones=[over])
    await fake.say("pose", drones=[pose(fresh=False, on=False)])
    await expect(page.locator(".m-camera-note")).to_have_text("last image of the flight")
    await expect(figure(page, "verdict")).to_have_text("clean")
    await expect(page.locator('[data-item="link"]')).to_have_text("ended with the flight")
    await expect(page.locator('[data-item="mission"]')).to_contain_text("ended in red.turning")
    await asyncio.sleep(0.6)
    await expect(page.locator("#live")).not_to_have_class(re.compile(r"m-old|m-stale|m-flying"))
    assert complaints == []


async def test_an_image_that_comes_before_the_first_pose_is_shown(chromium, fake):
    page, complaints = await visit(chromium, fake)
    shown = await page.evaluate(
        """async (pose) => {
          const { Playout } = await import("/sources/lib/flight/playout.js");
          const shown = [];
          const playout = new Playout(({ image }) => { if (image) shown.push(image.t); });
          playout.choose(pose.id);
          playout.addImage({ t: pose.t, jpeg: new Blob([]) });
          playout.addPoses([pose]);
          await new Promise((resolve) => setTimeout(resolve, 1000));
          return shown;
        }""",
        pose(),
    )
    assert shown == [10.0]
    assert complaints == []


async def test_where_a_page_draws_only_twice_a_second_the_newest_pose_is_shown_at_last(chromium, fake):
    page, complaints = await visit(chromium, fake)
    shown_s = await page.evaluate(
        """async (poses) => {
          const { Playout } = await import("/sources/lib/flight/playout.js");
          const { setPeriod } = await import("/sources/lib/beat.js");
          setPeriod(500);
          let shown_s = 0;
          const playout = new Playout(({ poses }) => { shown_s = poses[0].t; });
          for (const pose of poses) playout.addPoses([pose]);
          const began = performance.now();
          while (shown_s < poses.at(-1).t && performance.now() - began < 10000) {
            playout.addPoses([poses.at(-1)]);
            await new Promise((resolve) => setTimeout(resolve, 100));
          }
          return shown_s;
        }""",
        [pose(), pose(t=20.0), pose(t=20.1)],
    )
    assert shown_s == 20.1
    assert complaints == []


async def test_a_restarted_monitor_does_not_say_that_a_flight_has_not_begun(chromium, fake):
    """The names of a mission's states are received some seconds after its state."""
    unnamed = status(state="")
    unnamed["mission"] |= {"name": ""}
    fake.welcome = [world(), {"kind": "status", "drones": [unnamed]}]
    page, _ = await visit(chromium, fake)
    await expect(page.locator('[data-item="mission"]')).to_contain_text("mission: under way")


@pytest.mark.parametrize("viewport", [{"width": 1440, "height": 900}, LARGE], ids=["1440x900", "1920x1080"])
async def test_all_of_it_fits_a_large_screen_with_the_team(chromium, fake, viewport):
    flown = {"id": 7, "drone_id": 1, "team_name": MARKUP, "scenario": "test-case-1"}
    fake.stage["running"] = [flown]
    fake.welcome[2] = {"kind": "status", "drones": [status(video=True, armed=False, figures=None)]}
    page, complaints = await visit(chromium, fake, viewport=viewport)
    await expect(page.locator(".m-team-name")).to_have_text(MARKUP)
    page_size = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    wait = f"String({page_size}) === String([innerWidth, innerHeight])"
    await until(page, wait)
    before = await page.locator(".m-camera").bounding_box()
    await fake.say("status", drones=[status(video=True)])
    await expect(page.locator("#live")).to_have_class(re.compile(r"\bm-flying\b"))
    await until(page, wait)
    during = await page.locator(".m-camera").bounding_box()
    assert during["width"] > 1.1 * before["width"]
    assert during["width"] > 0.35 * viewport["width"]
    for name in ("figures", "messages", "chart", "plots"):
        box = await page.locator(f".m-{name}-panel").bounding_box()
        assert box["y"] + box["height"] <= viewport["height"]
    assert complaints == []


async def test_a_try_that_was_interrupted_is_shown_as_the_store_has_it(chromium, fake):
    """A real drone's referee is the monitor's own; after a restart it cannot know how the try began."""
    flown = {"id": 7, "drone_id": 1, "team_name": "Adler", "scenario": "test-case-1", "penalty_s": 0.0}
    flown |= {"crossed": ["red"], "splits": {"red": 31.2}, "try_time_s": 40.5, "total_s": 40.5}
    fake.stage["interrupted"] = flown
    fake.welcome[2] = {"kind": "status", "drones": [status(figures=None)]}
    page, complaints = await visit(chromium, fake)
    await expect(figure(page, "verdict")).to_have_text("interrupted")
    await expect(figure(page, "try_time_s")).to_have_text("40.5")
    await expect(page.locator('[data-colour="red"]')).to_have_attribute("data-value", "31.2")
    await expect(page.locator(".m-team-name")).to_have_text("Adler")
    assert complaints == []
