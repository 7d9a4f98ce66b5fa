"""The replay's page in a real browser: one clock for all, two flights side by side, links to a view."""

import contextlib
import re
from urllib.parse import urlencode

import pytest
from playwright.async_api import expect

from framerunner.monitor.ports import RunInfo
from tests.chromium import Complaints, until
from tests.framerunner.monitor.replay_runs import END_S, MARKUP, Library, a_run, info_of, serving_runs

pytestmark = pytest.mark.asyncio(loop_scope="session")
PATIENCE_MS = 30_000
expect.set_options(timeout=PATIENCE_MS)
LAPTOP, PHONE = {"width": 1366, "height": 768}, {"width": 390, "height": 844}


@contextlib.asynccontextmanager
async def opened(monkeypatch, chromium, library, path, viewport=LAPTOP):
    """A page of the replay; it must log no errors."""
    async with serving_runs(monkeypatch, library) as served:
        page = await chromium.new_page(viewport=viewport)
        page.set_default_timeout(PATIENCE_MS)
        page.complaints = Complaints(page)
        await page.goto(f"{served.url}{path}")
        await page.wait_for_selector("#replay[data-listed]")
        yield page
        assert page.complaints == []
        await page.close()


async def seek(page, t):
    """Move the slider as a finger does."""
    await page.eval_on_selector(
        ".r-slider",
        "(slider, t) => { slider.value = t; slider.dispatchEvent(new Event('input', { bubbles: true })); }",
        str(t),
    )
    await until(page, "t => Number(document.querySelector('.r-time').dataset.value) === t", arg=t)


def figure(page, name, side=0):
    return page.locator(".r-side").nth(side).locator(f"[data-figure={name}]")


async def test_the_slider_moves_all_that_is_shown(monkeypatch, chromium):
    async with opened(monkeypatch, chromium, Library(a_run()), "replay?a=first&t=5.5") as page:
        side = page.locator(".r-side")
        await expect(side).to_have_attribute("data-state", "take_off.start")
        await expect(figure(page, "try_time_s")).to_have_attribute("data-value", "5.5")
        await expect(figure(page, "crossed")).to_have_attribute("data-value", "")
        await expect(page.locator(".r-place")).to_have_text(re.compile(r"x 2\.56 +y 1\.57 +z 1\.0[56] m"))
        await seek(page, 13)
        await expect(side).to_have_attribute("data-state", "red.crossing")
        await expect(page.locator("g.e-active:not(.e-super)")).to_contain_text("crossing")
        await expect(figure(page, "crossed")).to_have_attribute("data-value", "red")
        await expect(figure(page, "next_colour")).to_have_attribute("data-value", "green")
        await expect(page.locator(".m-transitions tbody tr")).to_have_count(1)
        await expect(page.locator(".r-slider")).to_have_attribute(
            "aria-valuetext", "13.0 seconds, red.crossing"
        )
        await seek(page, 39.5)
        await expect(side).to_have_attribute("data-state", "landing.stop")
        await expect(figure(page, "verdict")).to_have_text("clean")
        await expect(figure(page, "total_time_s")).to_have_attribute("data-value", "39")
        await expect(figure(page, "contacts")).to_have_attribute("data-value", "0")
        await expect(page.locator(".m-transitions tbody tr")).to_have_count(3)
        await seek(page, 2)
        await expect(side).to_have_attribute("data-state", "take_off.start")
        await expect(figure(page, "contacts")).not_to_have_attribute("data-value", "0")
        await expect(page.locator(".m-transitions tbody tr")).to_have_count(0)


async def test_the_map_of_the_time_is_shown(monkeypatch, chromium):
    frame = {"p": [1.0, 2.0, 1.5], "yaw": 0.5, "std": [0.2, 0.1, 0.1], "yaw_std": 0.1}
    frame |= {"certain": False, "ambiguous": False, "views": 2}
    red, green = ({"colour": colour, **frame} for colour in ("red", "green"))
    maps = [
        {"t": 2.0, "goal": "explore", "frames": [red], "path": []},
        {"t": 8.0, "goal": f"cross red {MARKUP}", "frames": [red, green], "path": [[0, 0, 1], [1, 2, 1.5]]},
    ]
    async with opened(monkeypatch, chromium, Library(a_run(maps=maps)), "replay?a=first&t=1") as page:
        arena, goal = page.locator(".m-arena"), page.locator(".m-arena-goal")
        await expect(goal).to_be_hidden()
        await seek(page, 9)
        await expect(arena).to_have_attribute("data-mapped", "red green")
        await expect(goal).to_have_text(f"navigator: cross red {MARKUP}")
        await seek(page, 3)
        await expect(arena).to_have_attribute("data-mapped", "red")
        await seek(page, 0)
        await expect(goal).to_be_hidden()


async def test_the_image_of_the_time_is_shown(monkeypatch, chromium):
    shown = """async blue => {
        const image = document.querySelector('.r-camera img');
        if (!image.complete || !image.naturalWidth) return false;
        const canvas = new OffscreenCanvas(1, 1), pen = canvas.getContext('2d');
        pen.drawImage(image, 0, 0, 1, 1);
        return Math.abs(pen.getImageData(0, 0, 1, 1).data[2] - blue) < 3;
    }"""
    async with opened(monkeypatch, chromium, Library(a_run()), "replay?a=first&t=10.2") as page:
        for t, number in ((10.2, 20), (27.5, 55), (3.3, 6)):
            await seek(page, t)
            await until(page, shown, arg=4 * number)
        await seek(page, -1)
        await expect(page.locator(".m-camera-words")).to_have_text("before the first image")


async def test_it_plays_pauses_steps_and_ends_by_keyboard(monkeypatch, chromium):
    time = "Number(document.querySelector('.r-time').dataset.value)"
    async with opened(monkeypatch, chromium, Library(a_run()), "replay?a=first") as page:
        bar = page.locator(".r-bar")
        assert await page.evaluate(time) == 0.0
        await page.locator(".r-buttons select").select_option("16")
        await page.locator("#main").focus()
        await page.keyboard.press("Space")
        await expect(bar).to_have_attribute("data-playing", "true")
        await until(page, f"{time} > 8")
        await page.keyboard.press("Space")
        await expect(bar).to_have_attribute("data-playing", "false")
        stood = await page.evaluate(time)
        await page.keyboard.press(".")
        await until(page, f"t => Math.abs({time} - t - 0.1) < 0.002", arg=stood)
        await page.keyboard.press(",")
        await until(page, f"t => Math.abs({time} - t) < 0.002", arg=stood)
        await page.locator(".r-slider").focus()
        await page.keyboard.press("Home")
        await until(page, f"{time} === -1")
        await page.keyboard.press("PageUp")
        await page.keyboard.press("ArrowRight")
        await until(page, f"Math.abs({time} - 4.1) < 0.002")
        await page.keyboard.press("-")
        assert await page.locator(".r-buttons select").input_value() == "8"
        await page.keyboard.press("End")
        await until(page, f"{time} === {END_S}")
        await page.keyboard.press("Space")  # from the end it begins again
        await until(page, f"{time} < 30")
        await until(page, f"{time} === {END_S}")
        await expect(bar).to_have_attribute("data-playing", "false")


async def test_crossings_are_marks_that_jump_to_their_time(monkeypatch, chromium):
    async with opened(monkeypatch, chromium, Library(a_run()), "replay?a=first") as page:
        marks = page.locator(".r-marks button")
        await expect(marks).to_have_count(2)
        green = marks.nth(1)
        await expect(green).to_have_attribute("aria-label", "green crossed, 25.0 s")
        track = await page.locator(".r-slider").bounding_box()
        mark = await green.bounding_box()
        share = (mark["x"] + mark["width"] / 2 - track["x"]) / track["width"]
        assert abs(share - 26 / 41) < 0.02
        await green.click()
        await expect(page.locator(".r-time")).to_have_text("25.0 s")
        await expect(figure(page, "crossed")).to_have_attribute("data-value", "red,green")


async def test_two_flights_side_by_side_have_one_clock(monkeypatch, chromium):
    library = Library(a_run(), a_run("second", end_s=18.0))
    async with opened(monkeypatch, chromium, library, "replay?a=first&b=second&t=5") as page:
        sides = page.locator(".r-side")
        await expect(sides).to_have_count(2)
        left, right = [await sides.nth(number).bounding_box() for number in (0, 1)]
        assert abs(left["y"] - right["y"]) < 2
        assert left["x"] + left["width"] <= right["x"]
        await seek(page, 15)
        for number in (0, 1):
            await expect(sides.nth(number)).to_have_attribute("data-state", "red.crossing")
            await expect(figure(page, "try_time_s", number)).to_have_attribute("data-value", "15")
        await seek(page, 30)
        await expect(figure(page, "try_time_s", 0)).to_have_attribute("data-value", "30")
        await expect(figure(page, "try_time_s", 1)).to_have_attribute("data-value", "17")
        await expect(figure(page, "verdict", 1)).to_have_text("clean")
        await expect(sides.nth(1)).to_have_attribute("data-ended", "true")
        await expect(page.locator(".r-marks [data-row='1']")).to_have_count(2)


async def test_on_a_phone_two_flights_are_stacked_and_fit(monkeypatch, chromium):
    library = Library(a_run(), a_run("a-very-long-name-of-a-run-" * 4))
    path = f"replay?a=first&b={'a-very-long-name-of-a-run-' * 4}"
    async with opened(monkeypatch, chromium, library, path, PHONE) as page:
        first, second = [await page.locator(".r-side").nth(number).bounding_box() for number in (0, 1)]
        assert first["y"] + first["height"] <= second["y"]
        assert await page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        bar = await page.locator(".r-bar").bounding_box()
        assert bar["y"] + bar["height"] <= PHONE["height"] + 1  # always in reach
        play = await page.locator(".r-play").bounding_box()
        assert min(play["width"], play["height"]) >= 36


async def test_the_address_is_a_link_to_the_present_view(monkeypatch, chromium):
    async with opened(monkeypatch, chromium, Library(a_run()), "replay?a=first") as page:
        await seek(page, 21.5)
        await until(page, "location.search === '?a=first&t=21.5'")
        await page.reload()
        await expect(page.locator(".r-side")).to_have_attribute("data-state", "green.turning")
        await expect(page.locator(".r-time")).to_have_text("21.5 s")


async def test_the_list_is_searched_and_opens_one_or_two_flights(monkeypatch, chromium):
    runs = [a_run(), a_run("second")]
    bad = RunInfo("bad", "", "", "unreadable", None, "")
    library = Library(*runs, infos=[info_of(run) for run in runs] + [bad])
    async with opened(monkeypatch, chromium, library, "replay") as page:
        rows = page.locator(".r-runs tbody tr")
        await expect(rows).to_have_count(3)
        await expect(rows.nth(2)).to_contain_text("unreadable")
        await expect(rows.nth(2).locator("a")).to_have_count(0)
        await expect(rows.nth(0).locator("[data-name=total]")).to_have_text("39.0 s")
        await page.get_by_label("Search").fill("SECOND clean")
        await expect(rows).to_have_count(1)
        await expect(page.locator(".r-count")).to_have_text("1 of 3 flights")
        await page.get_by_label("Search").fill("first")
        await page.get_by_role("link", name="first").click()
        await page.wait_for_selector("#replay[data-ready][data-listed]")
        await page.locator("summary", has_text="Choose another").click()
        await page.get_by_role("link", name="beside").click()
        await page.wait_for_selector("#replay[data-ready][data-listed]")
        await expect(page.locator(".r-side h2")).to_have_text(["Afirst", "Bsecond"])


async def test_markup_in_names_and_reasons_is_text(monkeypatch, chromium):
    name = MARKUP.replace("/", "")  # it is a folder's
    run = a_run(name, states=[MARKUP] * 4)
    run["transitions"][0].update({"to": MARKUP, "when": MARKUP, "values": [[MARKUP, MARKUP]]})
    info = RunInfo(name, MARKUP, MARKUP, MARKUP, 1.0, MARKUP)
    path = f"replay?{urlencode({'a': name, 't': 39.5})}"
    async with opened(monkeypatch, chromium, Library(run, infos=[info]), path) as page:
        await page.wait_for_selector("#replay[data-ready]")
        await expect(page.locator(".r-side h2")).to_have_text(name)
        await expect(page.locator(".m-reason")).to_contain_text(MARKUP)
        await expect(page.locator(".r-runs [data-name=scenario]")).to_have_text(MARKUP)
        await expect(page.locator(".m-transitions")).to_contain_text(MARKUP)
        assert await page.locator("#main b:text('bold'), #main img[src=x]").count() == 0


async def test_a_flight_without_result_images_and_chart(monkeypatch, chromium):
    run = a_run(
        chart=None, result=None, images=[], detections=[], crossings=[], transitions=[], states=["hold"]
    )
    run["poses"] = [{**pose, "c": None, "s": 0} for pose in run["poses"]]
    async with opened(monkeypatch, chromium, Library(run), "replay?a=first&t=3") as page:
        await expect(page.locator(".r-outcome")).to_contain_text("not judged")
        await expect(page.locator(".m-camera-words")).to_have_text("this flight has no video")
        await expect(page.locator(".r-side")).to_have_attribute("data-state", "hold")
        await expect(figure(page, "verdict")).to_have_text("not judged")


async def test_a_missing_run_is_reported_and_the_other_is_shown(monkeypatch, chromium):
    async with opened(monkeypatch, chromium, Library(a_run()), "replay?a=gone&b=first") as page:
        await expect(page.locator(".m-line")).to_have_text("run 'gone': there is no such run")
        await expect(page.locator(".r-side h2")).to_have_text("first")
        # The browser itself notes a request that was answered by 404.
        assert all("404" in complaint for complaint in page.complaints)
        page.complaints.clear()


async def test_without_runs_the_page_says_how_to_get_some(monkeypatch, chromium):
    async with opened(monkeypatch, chromium, None, "replay") as page:
        await expect(page.locator(".r-none")).to_contain_text("--runs FOLDER")
    async with opened(monkeypatch, chromium, Library(), "replay") as page:
        await expect(page.locator(".r-none")).to_contain_text("framerunner fly test-case-1")
