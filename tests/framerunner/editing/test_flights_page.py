"""Flights at the editor's page: replayed on the chart, many in a table; moved boxes."""

from __future__ import annotations

import pytest
import pytest_asyncio
from playwright.async_api import expect

from framerunner.course.lessons import find_lesson
from tests.chromium import until
from tests.framerunner.editing.editor_program import editor
from tests.framerunner.editing.editor_user import EditorUser, box_of

pytestmark = pytest.mark.asyncio(loop_scope="module")
LAPTOP = {"width": 1366, "height": 768}
CLIMB, LANDING = "climb_to_the_point_above_the_base", "land_wherever_the_drone_is_just_now"
MISSION = find_lesson("1").start.replace("rise", CLIMB).replace("landing", LANDING)
GUARD = "1: distance_to_goal_m < 0.1"
AT_ONCE = f"name: at_once\ninitial: {LANDING}\nstates:\n  {LANDING}: {{enter: [hover, land], final: true}}\n"


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def program(tmp_path_factory):
    path = tmp_path_factory.mktemp("missions") / "short.yaml"
    path.write_text(MISSION)
    path.with_name("at_once.yaml").write_text(AT_ONCE)
    async with editor(path, spares=False) as running:
        yield running


@pytest_asyncio.fixture(loop_scope="module")
async def user(browser, program):
    context = await browser.new_context(viewport=LAPTOP)
    person = EditorUser(await context.new_page())
    person.page.set_default_timeout(10_000)
    await person.open(program.page("short.yaml"))
    yield person
    assert not person.complaints
    await context.close()


async def drag_slider(replay, part):
    """Move the slider of a replay to a part of its range, and wait until the page shows that time."""
    slider = replay.locator(".r-slider")
    box = await box_of(slider)
    await slider.click(position={"x": 8 + part * (box["width"] - 16), "y": box["height"] / 2})
    shown = """([slider, part]) => {
        const [begin, end] = [Number(slider.min), Number(slider.max)];
        const time = slider.closest(".r-bar").querySelector(".r-time");
        return Math.abs(Number(time.dataset.value) - begin - part * (end - begin)) < 0.5;
    }"""
    await until(slider.page, shown, arg=[await slider.element_handle(), part])


async def track_points(panel):
    """How many points the track on the map has."""
    return len((await panel.locator(".t-track").get_attribute("points")).split())


async def wide_parts(panel):
    """Classes of what is wider than the right part of a tab."""
    script = "all => [...all.querySelectorAll('*')].filter((each) => each.getBoundingClientRect().right >"
    script += " all.getBoundingClientRect().left + all.clientWidth + 1).map((each) => each.className)"
    return await panel.locator(".e-flying").evaluate(script)


async def test_a_flight_is_replayed_on_the_chart_and_the_map(user):
    fly = await user.show_tab("fly")
    await fly.locator(".e-controls select").select_option("")  # as fast as possible
    await user.press("Fly", fly)
    await expect(fly.locator(".e-run-line")).to_contain_text("landed", timeout=30_000)
    replay = await user.show_tab("replay")
    await replay.get_by_label("Flight", exact=True).select_option(index=1)
    await drag_slider(replay, 0.4)
    await expect(user.page.locator(".e-active")).to_have_attribute("data-state", CLIMB)
    await expect(user.page.locator(".e-label")).to_have_text(GUARD)
    await expect(replay.locator(".e-run-line")).to_contain_text(f"s: {CLIMB}")
    climbed = await track_points(replay)
    assert climbed > 10
    await drag_slider(replay, 1.0)
    await expect(user.page.locator(".e-active")).to_have_attribute("data-state", LANDING)
    await expect(user.page.locator(".e-label")).to_have_text(f"{GUARD} (1×)")
    await expect(replay.locator(".t-frame")).to_have_count(6)  # from above and their heights
    assert await track_points(replay) > climbed
    assert not await wide_parts(replay)


async def test_a_flight_pauses_and_goes_on_at_the_button(user):
    fly = await user.show_tab("fly")
    await user.press("Fly", fly)
    await expect(fly.locator(".e-run-line")).to_contain_text(CLIMB, timeout=30_000)
    await user.press("Pause", fly)
    await expect(fly.locator(".e-paused")).to_have_count(1)
    await user.press("Go on", fly)
    await expect(fly.locator(".e-paused")).to_have_count(0)
    await user.press("Stop", fly)


async def test_the_table_of_many_flights_is_not_wider_than_its_panel(user, program):
    await user.open(program.page("at_once.yaml"))
    fly = await user.show_tab("fly")
    await user.press("Fly 20 layouts", fly)
    await expect(fly.locator(".e-batch tr")).to_have_count(21, timeout=90_000)
    await expect(fly.locator(".e-batch")).to_contain_text(LANDING)
    assert not await wide_parts(fly)


async def test_a_box_stays_where_it_is_dropped_and_arrange_is_undone(user):
    climb, shape = user.state(CLIMB), user.state(CLIMB).locator("> rect").first
    places = []
    for _ in range(2):
        box = await box_of(shape)
        x, y = box["x"] + 12, box["y"] + 10
        await user.page.mouse.move(x, y)
        await user.page.mouse.down()
        await user.page.mouse.move(x + 40, y + 30, steps=4)
        await user.page.mouse.up()
        dropped = await box_of(shape)
        assert (dropped["x"] - box["x"], dropped["y"] - box["y"]) == pytest.approx((40, 30), abs=2)
        places.append(await climb.get_attribute("transform"))
    await user.press("Arrange")
    await expect(climb).not_to_have_attribute("transform", places[1])
    for place in reversed(places):
        await user.press("Undo")
        await expect(climb).to_have_attribute("transform", place)
