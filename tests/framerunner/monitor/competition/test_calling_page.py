"""Calls, queue and penalties on the pages, on a judge's phone and before the audience."""

import pytest
import pytest_asyncio

from tests.chromium import until
from tests.framerunner.monitor.competition.harness import contest, event
from tests.framerunner.monitor.competition.test_pages import faults, open_page, text_of

pytestmark = pytest.mark.asyncio(loop_scope="session")
PHONE = (375, 812)


@pytest_asyncio.fixture(loop_scope="session")
async def running(tmp_path, monkeypatch):
    async with contest(f"sqlite:///{tmp_path}/contest.db", monkeypatch) as running:
        await running.log_in("Grace")
        for name in ("Falken", "Adler", "Spatzen"):
            await running.post("teams", {"name": name})
        yield running


async def until_text(page, selector, words):
    await until(
        page,
        "([selector, words]) => [...document.querySelectorAll(selector)]"
        ".map((each) => each.textContent).join(' ') === words",
        arg=[selector, words],
    )


async def test_the_flying_the_called_and_the_next_team_are_separate(running, chromium):
    judge = await open_page(chromium, running, "competition", judge="Ada", size=PHONE)
    audience = await open_page(chromium, running, "ranking", size=(1920, 1080))
    team = await open_page(chromium, running, "competition", size=PHONE)
    questions = []

    async def agree(dialog):
        questions.append(dialog.message)
        await dialog.accept()

    judge.on("dialog", agree)
    await judge.click("#queue-all")
    await until_text(team, ".queue .name", "Falken Adler Spatzen")
    await judge.click("[data-key='up-2']")
    await until_text(team, ".queue .name", "Adler Falken Spatzen")
    await judge.click("[data-key='skip-1']")
    await until_text(team, ".queue .name", "Adler Spatzen Falken")
    await until_text(audience, ".flight.next .name", "Adler")
    assert await team.locator("#main button").count() == 0

    await judge.click("button:text-is('Call Adler')")
    await until_text(audience, ".flight.called .name", "Adler")
    await until_text(audience, ".flight.next .name", "Spatzen")
    await judge.click("button:text-is('Call Spatzen')")  # the wrong one
    await until_text(audience, ".flight.called .name", "Spatzen")
    assert questions == ["Adler is called and has not flown. Call Spatzen in its place?"]
    await until_text(audience, ".flight.next .name", "Adler")
    await judge.click("button:text-is('Take back the call of Spatzen')")
    await until_text(team, ".queue .name", "Adler Spatzen Falken")
    await judge.click("button:text-is('Call Adler')")
    await until_text(judge, ".flight.called .name", "Adler")

    await running.post("draw", {"pool": ["case-2"], "count": 1})
    running.fleet.tell(event("began", "k", "case-1", time_s=0.0))
    for page in (judge, audience, team):
        await page.wait_for_selector(".flight .tag:text-is('not drawn: does not count')")
        await until_text(page, ".flight:not(.called, .next) .name", "Adler")
        assert await text_of(page, ".flight.next .name") == "Spatzen"
        assert await page.locator(".flight.called").count() == 0
    await judge.click("button:text-is('Take back the call of Adler')")
    await until_text(audience, ".flight:not(.called, .next) .name", "drone 1, no team")
    assert "Try 1 was flown on this call and would be nobody's" in questions[-1]
    await until_text(team, ".queue .name", "Adler Spatzen Falken")
    assert faults(judge) == faults(audience) == faults(team) == []


async def test_a_penalty_that_changes_nothing_says_so(running, chromium):
    await running.fly("k", 1, verdict="aborted", crossed=("red", "green"), time_s=50.0)
    page = await open_page(chromium, running, "competition/try/1", judge="Ada", size=PHONE)
    await page.wait_for_selector(".counts:has-text('Counts 240.00 s')")
    assert "changes nothing" not in await text_of(page, ".counts")
    await page.fill("#penalty", "30")
    words = "The penalty changes nothing: a try that is not completed counts 180 s, and 60 s for each frame"
    assert words in await text_of(page, ".counts")
    await page.evaluate("document.querySelector('form.judge').requestSubmit()")
    await page.wait_for_selector(".line:has-text('Saved.')")
    assert words in await text_of(page, ".line")
    box = await page.locator(".line").bounding_box()
    assert box["y"] >= 0 and box["y"] + box["height"] <= PHONE[1]  # where the judge looks
    viewer = await open_page(chromium, running, "competition/try/1", size=PHONE)
    await viewer.wait_for_selector("dd:has-text('30.00 s (changes nothing: not completed)')")

    await running.fly("l", 1, time_s=40.0)
    await page.goto(f"{running.url}competition/try/1")
    await page.wait_for_selector(".counts:has-text('of the team\\'s tries here try 2 counts, 40.00 s')")
    await page.goto(f"{running.url}competition/try/2")
    await page.wait_for_selector(".counts:has-text('Counts 40.00 s')")
    assert await text_of(page, ".counts") == "Counts 40.00 s: completed."
    await page.fill("#penalty", "200.01")
    assert await text_of(page, ".counts") == (
        "Counts 240.01 s: completed. "
        "The ranking stays as it is: of the team's tries here try 1 counts, 240.00 s."
    )
    assert faults(page) == []
