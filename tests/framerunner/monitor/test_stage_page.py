"""The page for the audience, in a real browser: it follows the contest by itself."""

import pytest
from playwright.async_api import expect

from tests.chromium import Complaints
from tests.framerunner.monitor.page_server import JPEG, fake_monitor
from tests.framerunner.monitor.test_live_page import (
    BOX,
    FIGURES,
    LIVE_LINK,
    MARKUP,
    PATIENCE_MS,
    chart,
    pose,
    status,
    world,
)

pytestmark = pytest.mark.asyncio(loop_scope="session")
PROJECTOR = {"width": 1920, "height": 1080}
FRAMES = ["red", "green", "blue"]
TRY = {"id": 7, "drone_id": 1, "team_name": "Adler", "scenario": "test-case-1", "frames": FRAMES}
BEST = {
    **{"id": 6, "drone_id": 1, "team_name": MARKUP, "scenario": "test-case-1", "frames": FRAMES},
    **{"crossed": FRAMES, "splits": {"red": 33.0, "green": 55.0, "blue": 80.0}, "verdict": "clean"},
    **{"try_time_s": 95.0, "penalty_s": 0.0, "total_s": 95.0, "completed": True},
}


def ranking(*teams):
    rows = [
        {
            "rank": place,
            "team": place,
            "name": name,
            "total_s": total_s,
            "contacts": 0,
            "flown": 1,
            "cells": [],
        }
        for place, (name, total_s) in enumerate(teams, 1)
    ]
    return {"round": 1, "scenarios": ["test-case-1"], "rows": rows}


CUT = """() => {
  const cut = ({ scrollWidth, clientWidth, scrollHeight, clientHeight }) =>
    scrollWidth > clientWidth || scrollHeight > clientHeight + 1;
  const box = document.querySelector('.s-list, .rows').getBoundingClientRect();
  const low = Math.min(box.bottom, innerHeight) + 1;
  const rows = [...document.querySelectorAll('[data-rank], tbody tr')].filter((row) => !row.hidden);
  const names = [...document.querySelectorAll('bdi')].filter((name) => cut(name.parentElement));
  return [
    rows.map((row) => row.querySelector('bdi').textContent),
    rows.filter((row) => row.getBoundingClientRect().bottom > low).length,
    names.map((name) => name.textContent),
  ];
}"""


@pytest.mark.parametrize(
    ("path", "size"), [("/stage", (390, 844)), ("/stage", (1440, 900)), ("/ranking", (1440, 900))]
)
async def test_all_of_twenty_teams_are_shown_whole(chromium, path, size):
    names = ["ÁÉÑ Ñandú", "W" * 60, "Équipe Châteauneuf-de-l'Écluse Ålesund Überlingen ÄÖÜ Çédill"]
    names += [f"Team Número {number}" for number in range(17)]
    told = ranking(*((name, 100.0 + place) for place, name in enumerate(names)))
    told["rows"][-1] |= {"rank": None, "flown": 0}
    page = await chromium.new_page(viewport={"width": size[0], "height": size[1]})
    async with fake_monitor() as fake:
        fake.stage |= {"ranking": told, "queue": {"number": 1, "teams": [{"team": 2, "team_name": names[1]}]}}
        await page.goto(f"{fake.url}{path}")
        seen = []
        for _ in range(3):
            await expect(page.locator("bdi:visible").first).to_be_visible()
            rows, low, cut = await page.evaluate(CUT)
            assert (low, cut) == (0, [])
            seen += [row for row in rows if row not in seen]
            await page.locator(".pages, .s-pages").dispatch_event("click")
        assert seen == names
        last = page.locator(".s-rank, td.rank").last
        await expect(last).to_have_text("–")
    await page.close()


def split(page, name):
    return page.locator(f'[data-split="{name}"]')


async def test_the_stage_goes_from_waiting_to_the_podium_by_itself(chromium):
    context = await chromium.new_context(viewport=PROJECTOR)
    page = await context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    complaints = Complaints(page)
    async with fake_monitor() as fake:
        fake.welcome = [world(), chart(), {"kind": "status", "drones": []}]
        await page.goto(f"{fake.url}/stage")
        await fake.until_watched()
        shown = page.locator("#stage")
        await expect(shown).to_have_attribute("data-phase", "waiting")
        await expect(page.locator(".s-called")).to_have_text("No try is running")

        queue = {"number": 1, "teams": [{"team": 3, "team_name": "Falken"}]}
        await fake.change_contest(queue=queue)
        await expect(page.locator(".s-called")).to_have_text("Falken")
        await expect(page.locator(".s-label")).to_have_text("Next")
        called = {"team": 2, "team_name": MARKUP, "scenario": "test-case-1", "try": None}
        await fake.change_contest(
            called=called, ranking=ranking((MARKUP, 95.0), ("Adler", 240.0)), best=[BEST]
        )
        await expect(page.locator(".s-label")).to_have_text("Called")
        await expect(page.locator(".s-before")).to_have_text("Next: Falken")
        await expect(page.locator(".s-called")).to_have_text(MARKUP)
        await expect(page.locator(".s-row-name")).to_have_text([MARKUP, "Adler"])

        await fake.change_contest(running=[TRY], called=None)
        await fake.say("status", drones=[status(video=True)])
        await expect(shown).to_have_attribute("data-phase", "flying")
        await fake.until_filmed()
        await fake.say("pose", drones=[pose()])
        await fake.show(JPEG, 10.0)
        boxes = {"red": BOX, "green": None, "blue": None}
        await fake.say("detections", id=1, t=10.0, width=320, height=240, boxes=boxes)
        await expect(page.locator(".m-camera")).to_have_attribute("data-boxes-time", "10")
        await expect(page.locator(".s-team")).to_have_text("Adler")
        await expect(page.locator(".s-clock")).to_have_text("87.4")
        await expect(split(page, "red")).to_contain_text("▲ −0.5")
        await expect(split(page, "green")).to_contain_text("▼ +1.9")
        await expect(split(page, "blue")).to_contain_text("best 80.0")
        await expect(page.locator(".s-against")).to_have_text(f"best: {MARKUP}, 95.0 s")

        ended = {**BEST, "id": 7, "team_name": "Adler", "total_s": 94.0}
        clean = {"verdict": "clean", "over": True, "final": True, "motors_on": False, "next_colour": None}
        clean |= {"crossed": FRAMES, "crossing_times_s": [32.0, 56.0, 79.0], "total_time_s": 94.0}
        over = status(video=True, figures=FIGURES | clean, armed=False, link=LIVE_LINK, over=True)
        await fake.say("status", drones=[over])
        places = ranking(("Adler", 94.0), (MARKUP, 95.0), ("Falken", 133.0))
        news = {"running": [], "last": ended, "last_against": BEST, "best": [ended], "ranking": places}
        await fake.change_contest(**news, complete=True)
        await expect(shown).to_have_attribute("data-phase", "ended")
        await expect(page.locator(".s-verdict")).to_have_text("clean · rank 1")
        await expect(split(page, "landed")).to_contain_text("▲ −1.0")  # than the best before it
        await expect(page.locator(".m-camera-note")).to_have_text("last image of the flight")
        size = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        assert await page.evaluate(size) == [1920, 1080]

        # Half a minute later the result makes way for the podium.
        await page.evaluate(
            "const now = performance.now; performance.now = () => now.call(performance) + 31000"
        )
        await expect(shown).to_have_attribute("data-phase", "podium")
        await expect(page.locator('[data-place="1"] .s-winner')).to_have_text("Adler")
        await expect(page.locator(".s-winner")).to_have_text(["Adler", MARKUP, "Falken"])
        assert await page.locator("#stage b").count() == 0
    complaints = [words for words in complaints if "ERR_CONNECTION" not in words]  # the monitor was stopped
    assert complaints == []
