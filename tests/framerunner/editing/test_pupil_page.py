"""The tab Fly and the lessons' words, as a pupil meets them."""

from __future__ import annotations

import pytest
import pytest_asyncio
from playwright.async_api import expect

from framerunner.course.lessons import find_lesson
from tests.framerunner.editing.editor_program import editor
from tests.framerunner.editing.editor_user import EditorUser

pytestmark = pytest.mark.asyncio(loop_scope="module")
SMALL = {"width": 1024, "height": 720}
LINE = ".e-tabs .e-tab:not([hidden]) .e-run-line"
LESSON_4 = find_lesson("4")
CARELESS = LESSON_4.solution.replace(
    "- cmd.vel_x = 0.3\n    during:\n      - look_to_frame", "- cmd.vel_x = 0.3"
)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def program(tmp_path_factory):
    folder = tmp_path_factory.mktemp("missions")
    (folder / "careless.yaml").write_text(CARELESS)
    start = find_lesson("1").start
    (folder / "start.yaml").write_text(start)
    (folder / "waits.yaml").write_text(start.replace("distance_to_goal_m < 0.1", "imu.z > 3"))
    async with editor(folder / "careless.yaml", spares=False) as running:
        yield running


async def pupil(browser, program, file, lesson, locale="en-GB"):
    """A pupil at a lesson, with the tab Fly open."""
    context = await browser.new_context(viewport=SMALL, locale=locale)
    user = EditorUser(await context.new_page())
    user.page.set_default_timeout(10_000)
    await user.open(f"{program.page(file)}&lesson={lesson}")
    await user.page.locator("#e-tab-fly").click()
    await user.page.locator(".e-controls select").select_option("")
    return user


async def test_a_gate_that_is_hit_is_named_and_marked(browser, program):
    user = await pupil(browser, program, "careless.yaml", LESSON_4.name)
    await user.press("Fly", user.page.locator(".e-controls"))
    await expect(user.page.locator(".e-touched")).to_have_text(
        "The drone hit the red frame at 16 s.", timeout=30_000
    )
    await expect(user.page.locator(".t-hit")).to_have_count(1)
    await expect(user.page.locator('.t-frame[data-colour="red"]')).to_have_count(
        2
    )  # from above and its height
    # As fast as possible, the flight may have ended by itself before Stop is pressed.
    await expect(user.page.locator(".e-controls").get_by_role("button", name="Stop")).to_be_disabled()
    await expect(user.page.locator(".t-hit")).to_have_count(1)
    assert not user.complaints
    await user.page.context.close()


async def test_a_flight_that_is_stopped_says_so(browser, program):
    user = await pupil(browser, program, "careless.yaml", LESSON_4.name)
    await user.page.locator(".e-controls select").select_option("1")
    await user.press("Fly", user.page.locator(".e-controls"))
    await user.press("Stop", user.page.locator(".e-controls"))
    await expect(user.page.locator(LINE)).to_have_text("You stopped the flight.")
    assert not user.complaints
    await user.page.context.close()


async def test_a_flight_whose_time_is_up_says_so_and_where_it_was(browser, program):
    user = await pupil(browser, program, "waits.yaml", "1_take_off")
    await user.press("Fly", user.page.locator(".e-controls"))
    told = "The time was up after 60 s; the drone was still in the state rise."
    await expect(user.page.locator(LINE)).to_have_text(told, timeout=60_000)
    assert not user.complaints
    await user.page.context.close()


async def test_a_beginner_sees_the_goal_and_only_what_is_needed_without_scrolling(browser, program):
    user = await pupil(browser, program, "start.yaml", "1_take_off", locale="es-ES")
    for name in ("Volar", "Pausa", "Un paso", "Parar"):
        await expect(
            user.page.locator(".e-controls").get_by_role("button", name=name, exact=True)
        ).to_be_in_viewport()
    await expect(user.page.locator(".e-more")).to_be_hidden()
    await user.press("Volar", user.page.locator(".e-controls"))
    line = user.page.locator(LINE)
    told = "El dron aterrizó, pero no estuvo 3 s en el punto (0, 0, 1.5). Lo más cerca"
    await expect(line).to_contain_text(told, timeout=30_000)
    await expect(line).to_be_in_viewport()
    await expect(user.page.locator("circle.t-goal")).to_have_count(1)
    await user.page.goto(f"{program.page('start.yaml')}&lesson=5_the_challenge")
    await user.page.locator("#e-tab-fly").click()
    await expect(user.page.locator(".e-more")).to_be_visible()
    await user.page.context.close()


async def test_a_check_whose_connection_is_lost_says_so_and_can_be_repeated(browser, program):
    user = await pupil(browser, program, "start.yaml", "1_take_off")
    await user.page.evaluate("localStorage.setItem('framerunner-learner', 'Ada')")
    await user.page.locator("#e-tab-lesson").click()
    await user.page.route("**/api/course/check*", lambda route: route.abort())
    line = user.page.locator(".e-lesson-line")
    for said in ("no connection to the monitor", "try later"):
        await user.press("Check the lesson", user.page.locator(".e-verdict"))
        await expect(line).to_contain_text(said)
        await user.page.unroute("**/api/course/check*")
        await user.page.route(
            "**/api/course/check*", lambda route: route.fulfill(status=503, json={"detail": "try later"})
        )
    await user.page.context.close()


async def test_a_divider_is_dragged_moved_by_keys_and_remembered(browser, program):
    user = await pupil(browser, program, "start.yaml", "1_take_off")
    drawing = user.page.locator(".e-drawing")
    height = (await drawing.bounding_box())["height"]
    bar = await user.page.locator(".e-divider-tabs").bounding_box()
    middle = (bar["x"] + bar["width"] / 2, bar["y"] + bar["height"] / 2)
    await user.page.mouse.move(*middle)
    await user.page.mouse.down()
    await user.page.mouse.move(middle[0], middle[1] - 100, steps=4)
    await user.page.mouse.up()
    assert (await drawing.bounding_box())["height"] == pytest.approx(height - 100, abs=2)
    await user.page.keyboard.press("ArrowDown")
    assert (await drawing.bounding_box())["height"] == pytest.approx(height - 76, abs=2)
    await user.page.reload()
    await expect(user.page.locator(".e-saved")).not_to_be_empty()
    assert (await drawing.bounding_box())["height"] == pytest.approx(height - 76, abs=2)
    assert not user.complaints
    await user.page.context.close()
