import asyncio
import contextlib

import pytest

from tests.chromium import until
from tests.framerunner.monitor.sample_page import EVIL
from tests.framerunner.monitor.serving import serving

pytestmark = pytest.mark.asyncio(loop_scope="session")
DATA = "JSON.parse(document.getElementById('page-data').textContent)"
KEEP_PAGE = """document.addEventListener("monitor-restarted", (event) => {
  window.wasAsked = true;
  event.preventDefault();
})"""
SAMPLE = "tests.framerunner.monitor.sample_page"
LINK_IS = "words => document.querySelector('#link .words').textContent === words"
PHONE = {"width": 390, "height": 800}


@contextlib.asynccontextmanager
async def phone(chromium):
    """A page that records its requests and errors."""
    page = await chromium.new_page(viewport=PHONE)
    page.complaints, page.hosts = [], set()
    page.on("console", lambda m: page.complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.hosts.add(request.url.split("/")[2]))
    try:
        yield page
    finally:
        await page.close()


async def test_the_frame_on_a_phone_offline_and_by_keyboard(monkeypatch, chromium):
    async with serving(monkeypatch, SAMPLE) as served, phone(chromium) as page:
        await page.goto(served.url)
        assert await page.evaluate(DATA) == {"text": EVIL, "judge": False}
        assert await page.evaluate("window.broken") is None
        assert await page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        assert await page.evaluate("document.documentElement.scrollHeight") == PHONE["height"]
        await page.keyboard.press("Tab")
        assert await page.evaluate("document.activeElement.textContent") == "Skip to the content"
        await page.keyboard.press("Enter")
        assert await page.evaluate("document.activeElement.id") == "main"
        assert page.hosts == {f"127.0.0.1:{served.port}"}
        assert page.complaints == []


async def test_the_navigation_shows_the_current_page_where_not_all_have_room(monkeypatch, chromium):
    async with serving(monkeypatch, "framerunner.monitor.pages.table") as served, phone(chromium) as page:
        for width in (PHONE["width"], 950):
            await page.set_viewport_size({"width": width, "height": 800})
            await page.goto(served.url)
            row, here = [
                await page.locator(each).first.bounding_box()
                for each in (".top nav", ".top nav [aria-current]")
            ]
            assert row["x"] <= here["x"] and here["x"] + here["width"] <= row["x"] + row["width"]


async def test_a_page_comes_back_by_itself_when_the_server_does(monkeypatch, chromium):
    async with phone(chromium) as page:
        async with serving(monkeypatch, SAMPLE) as served:
            port = served.port
            await page.goto(served.url)
            await until(page, LINK_IS, arg="live")
            await page.evaluate("window.isOld = true")
        await until(page, LINK_IS, arg="reconnecting")
        async with serving(monkeypatch, SAMPLE, port=port):
            await until(page, "window.isOld === undefined", timeout_s=30.0)
            await until(page, LINK_IS, arg="live")


async def test_a_page_with_unsaved_work_stays_when_the_server_was_restarted(monkeypatch, chromium):
    async with phone(chromium) as page:
        async with serving(monkeypatch, SAMPLE) as served:
            port = served.port
            await page.goto(served.url)
            await until(page, LINK_IS, arg="live")
            await page.evaluate(KEEP_PAGE)
        async with serving(monkeypatch, SAMPLE, port=port):
            await until(page, "window.wasAsked === true")
            await until(page, LINK_IS, arg="live")
            assert await page.evaluate("window.wasAsked")


async def test_the_first_page_is_small(monkeypatch, chromium):
    """It loads all that it uses, also the library for diagrams, before a drone is there."""
    async with serving(monkeypatch, "framerunner.monitor.pages.table") as served, phone(chromium) as page:
        received = []
        network = await page.context.new_cdp_session(page)
        await network.send("Network.enable")
        network.on("Network.loadingFinished", lambda event: received.append(event["encodedDataLength"]))
        await page.goto(served.url, wait_until="networkidle")
        assert 50_000 < sum(received) < 1_500_000


async def test_a_lost_drone_is_shown_in_words(monkeypatch, chromium):
    async with serving(monkeypatch, SAMPLE) as served, phone(chromium) as page:
        await page.goto(served.url)
        await until(page, LINK_IS, arg="live")
        served.fleet.status = {"kind": "status", "drones": [{"id": 1, "link": {"state": "lost"}}]}
        await until(page, LINK_IS, arg="link lost")
        over = {"id": 1, "over": True, "link": {"state": "lost"}}
        served.fleet.status = {"kind": "status", "drones": [over]}
        await until(page, LINK_IS, arg="flight over")
        served.fleet.status = {"kind": "status", "drones": []}
        await until(page, LINK_IS, arg="no drone")


async def test_a_judge_opens_a_link_says_who_and_is_logged_in(monkeypatch, chromium):
    async with serving(monkeypatch, SAMPLE) as served, phone(chromium) as page:
        await page.goto(f"{served.url}login?token={served.invitation}")
        await page.fill("#name", "Ada <b>Lovelace</b>")
        async with page.expect_response(lambda response: response.url.endswith("/login")) as answer:
            await page.click("main button")
        assert (await answer.value).status == 303
        await asyncio.wait_for(page.goto(served.url), 20)
        assert "Ada <b>Lovelace</b>" in await page.inner_text("header")
        assert (await page.evaluate(DATA))["judge"]
        await page.click("text=Log out")
        await page.wait_for_selector("text=Log in")
        assert not (await page.evaluate(DATA))["judge"]
