"""The contest's pages in a real browser."""

import asyncio

import pytest
import pytest_asyncio

from tests.chromium import Complaints, until
from tests.framerunner.monitor.competition.harness import PASSWORD, contest, event

pytestmark = pytest.mark.asyncio(loop_scope="session")
EVIL = ('<img src=x onerror="window.hurt=1">', "<script>window.hurt=1</script>", "{{7*7}}\u200f&amp;<b>")
SIZES = ((375, 812), (1366, 768), (1920, 1080))

# Notes when something came to hold, by the page's own clock, and what was animated since.
WATCH = """(holds) => {
  window.changedAt = null;
  window.moved = [];
  const animate = Element.prototype.animate;
  Element.prototype.animate = function (...how) {
    window.moved.push(this.tagName);
    return animate.apply(this, how);
  };
  new MutationObserver(() => {
    if (window.changedAt === null && holds()) window.changedAt = Date.now();
  }).observe(document.body, { childList: true, subtree: true, characterData: true });
}"""
MARKUP = "document.querySelectorAll('#main img, #main script, #main b').length"
POST = """async () => {
  const headers = { "Content-Type": "application/json" };
  const path = "/api/competition/tries/1/judgement";
  return (await fetch(path, { method: "POST", headers, body: '{"seen": 0}' })).status;
}"""
CONTROLS = "#main button, #main select, #main input:not([type=checkbox])"
SMALL = """() => [...document.querySelectorAll(CONTROLS)]
  .filter((each) => each.checkVisibility() && each.getBoundingClientRect().height < 43)
  .map((each) => each.outerHTML)""".replace("CONTROLS", repr(CONTROLS))


@pytest_asyncio.fixture(loop_scope="session")
async def running(tmp_path, monkeypatch):
    async with contest(f"sqlite:///{tmp_path}/contest.db", monkeypatch) as running:
        await running.log_in("Grace")
        yield running


async def open_page(browser, running, path, *, judge="", size=(1366, 768)):
    context = await browser.new_context(viewport={"width": size[0], "height": size[1]})
    page = await context.new_page()
    if judge:
        await page.goto(f"{running.url}login")
        await page.fill("#name", judge)
        await page.fill("#secret", PASSWORD)
        await page.click("form.login button")
    page.complaints = Complaints(page)
    await page.goto(running.url + path)
    return page


def faults(page):
    """Errors of a page, without those about the live channel, which this monitor does not have."""
    return [each for each in page.complaints if "/ws/live" not in each]


async def text_of(page, selector):
    return " ".join((await page.locator(selector).inner_text()).split())


async def test_a_judge_corrects_and_the_ranking_in_another_window_follows_within_a_second(running, chromium):
    first = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    second = (await running.post("teams", {"name": "Adler"}))[1]["team"]
    await running.fly("a", first, time_s=40.0)
    await running.fly("b", second, time_s=45.0)
    ranking = await open_page(chromium, running, "ranking", size=(1920, 1080))
    await until(ranking, "document.querySelectorAll('.ranking tbody tr').length === 2")
    names = "[...document.querySelectorAll('.ranking .name')].map((name) => name.textContent).join()"
    assert await ranking.evaluate(names) == "Falken,Adler"
    assert "760.00" in await text_of(ranking, f"[data-team='{first}']")

    judge = await open_page(chromium, running, "competition", judge="Ada", size=(390, 844))
    await judge.click("[data-key='try-1']")
    await judge.fill("#penalty", "30")
    await judge.click("button[aria-label='more: Contacts with frames']")
    await judge.click("button[aria-label='more: Contacts with frames']")
    await judge.fill("#remarks", "<i>left bar</i>")
    assert await text_of(judge, ".counts") == "Counts 70.00 s: completed."
    await ranking.evaluate(f"({WATCH})(() => {names} === 'Adler,Falken')")
    saved_ms = await judge.evaluate(
        "() => { document.querySelector('form.judge').requestSubmit(); return Date.now(); }"
    )
    await until(ranking, "window.changedAt !== null")
    assert await ranking.evaluate("window.changedAt") - saved_ms < 1000
    assert "790.00" in await text_of(ranking, f"[data-team='{first}']")
    assert await ranking.evaluate("window.moved") == ["TR", "TR"]  # they glide to their places

    await judge.wait_for_selector(".history .by")
    history = await text_of(judge, ".history")
    assert "Ada at" in history and "contacts: 2; penalty: 30.00 s" in history and "<i>left bar</i>" in history
    kept = (await running.get("tries/1"))[1]["history"]
    assert [(entry["who"], entry["contacts"], entry["penalty_s"], entry["try_time_s"]) for entry in kept] == [
        ("Ada", 2, 30.0, None)
    ]
    assert faults(ranking) == faults(judge) == []


async def test_names_are_text_on_every_page(running, chromium):
    for number, name in enumerate(EVIL):
        status, answer = await running.post("teams", {"name": name, "members": name})
        assert status == 200
        await running.fly(str(number), answer["team"])
        await running.post(f"tries/{number + 1}/judgement", {"seen": 0, "remarks": name})
    running.fleet.tell(event("began", "bad", "case-<img src=x onerror=window.hurt=1>", time_s=1.0))
    await running.until("tries", lambda tries: len(tries) == 4)
    page = await open_page(chromium, running, "ranking", judge="Ada <b>")
    shown = (
        ("ranking", ".ranking .name", EVIL),
        ("competition", ".teams .name", EVIL),
        ("competition/try/1", "dl bdi", EVIL[:1]),
        ("competition/try/4", "dl", ()),
    )
    for path, selector, names in shown:
        await page.goto(running.url + path)
        await page.wait_for_selector(selector)
        text = await page.inner_text("#main")
        for name in names:
            assert name in text
        assert await page.evaluate("window.hurt") is None
        assert await page.evaluate(MARKUP) == 0
    assert faults(page) == []


async def test_a_viewer_sees_no_controls_and_is_refused(running, chromium):
    team = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    await running.fly("k", team)
    page = await open_page(chromium, running, "competition")
    await page.wait_for_selector(".teams .name")
    assert await page.locator("#main form, #main button, #main input").count() == 0
    await page.click("[data-key='try-1']")
    await page.wait_for_selector("dl")
    assert await page.locator("#main form, #main button, #main input").count() == 0
    assert "Counts 40.00 s" in await text_of(page, "dl")
    assert await page.evaluate(POST) == 403
    assert (await running.get("tries/1"))[1]["history"] == []


async def test_a_whole_contest_by_hand(running, chromium):
    page = await open_page(chromium, running, "competition", judge="Ada")
    await page.wait_for_selector("#team-name")
    await page.fill("#team-name", "Falken")
    await page.fill("#team-members", "Ann, Bo")
    await page.press("#team-members", "Enter")
    await page.wait_for_selector(".teams .members")
    await page.fill("#team-name", "FALKEN")
    await page.press("#team-name", "Enter")
    await until(page, "document.querySelector('.line').textContent.includes('taken')")

    await page.click("summary:has-text('Draw scenarios')")
    await page.fill("#draw-other", "calm-17")
    await page.press("#draw-other", "Enter")
    await page.fill("#draw-count", "5")
    await page.click("button:has-text('Draw')")
    await until(page, "document.querySelectorAll('.drawn li').length === 5")
    drawn = await page.evaluate(
        "[...document.querySelectorAll('.drawn strong')].map((each) => each.textContent)"
    )
    assert sorted(drawn) == ["calm-17", "case-1", "case-2", "case-3", "case-4"]
    assert f"framerunner fly {drawn[0]}" in await page.inner_text(".drawn")

    await page.select_option("#next-team", label="Falken")
    await page.select_option("#next-scenario", drawn[0])
    await page.click("button:text-is('Call Falken')")
    await page.wait_for_selector(".flight.called")
    running.fleet.tell(event("began", "k", drawn[0], time_s=0.0))
    running.fleet.tell(event("running", "k", drawn[0], time_s=12.0, crossed=("red",)))
    await until(page, "document.querySelector('.flight .clock')?.textContent === '12.0'")
    running.fleet.tell(event("ended", "k", drawn[0], time_s=44.44))
    await until(page, "document.querySelector('.tries .number')?.textContent === '44.44'")
    assert "No team is called" in await page.inner_text(".now")

    await page.click("summary:has-text('Change the rule')")
    await page.select_option("#rule-counting", "last")
    await page.click("button:has-text('Set')")
    await until(page, "document.body.innerText.includes('the last counts')")
    assert (await running.get("ranking"))[1]["rule"]["who"] == "Ada"
    assert [each for each in faults(page) if "422" not in each] == []


async def test_an_answer_that_a_message_overtook_shows_no_older_time(running, chromium):
    page = await open_page(chromium, running, "competition")
    await page.wait_for_selector(".teams")
    asked, answered = asyncio.Event(), asyncio.Event()

    async def answer_late(route):
        response = await route.fetch()
        asked.set()
        await answered.wait()
        await route.fulfill(response=response)

    await page.route("**/api/competition/state", answer_late)
    running.fleet.tell(event("began", "k", time_s=0.0))
    await asyncio.wait_for(asked.wait(), 30.0)
    running.fleet.tell(event("running", "k", time_s=12.0))
    await until(page, "document.querySelector('.flight .clock')?.textContent === '12.0'")
    answered.set()
    await page.wait_for_selector(".tries tr[data-state='running']")
    assert await page.inner_text(".flight .clock") == "12.0"


async def test_a_form_that_another_judge_saved_meanwhile_is_refused(running, chromium):
    await running.fly("k")
    page = await open_page(chromium, running, "competition/try/1", judge="Ada", size=(390, 844))
    await page.wait_for_selector(".counts:has-text('Counts')")
    await page.fill("#penalty", "9")
    await running.post("tries/1/judgement", {"seen": 0, "contacts": 4})
    await page.wait_for_selector(".line:has-text('Another judge')")
    assert await page.input_value("#penalty") == "9"  # what was filled in stays
    await page.evaluate("document.querySelector('form.judge').requestSubmit()")
    await page.wait_for_selector(".line:has-text('Another judge')")
    await page.click("button:has-text('Show the new state')")
    await until(page, "document.getElementById('contacts').value === '4'")
    await page.fill("#penalty", "9")
    await page.evaluate("document.querySelector('form.judge').requestSubmit()")
    await page.wait_for_selector(".line:has-text('Saved')")
    kept = (await running.get("tries/1"))[1]
    assert kept["try"]["result"]["contacts"] == 4 and kept["try"]["result"]["penalty_s"] == 9.0
    assert [entry["who"] for entry in kept["history"]] == ["Ada", "Grace"]


async def test_a_try_that_does_not_exist_gives_a_message(running, chromium):
    page = await open_page(chromium, running, "competition/try/99", judge="Ada")
    await page.wait_for_selector(".line:has-text('try 99 does not exist')")
    assert await page.locator("#main form:visible").count() == 0
    async with running.http.get("/competition/try/abc") as answer:
        assert answer.status == 404


async def test_crossings_and_completion_by_hand(running, chromium):
    team = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    await running.fly("k", verdict="aborted", crossed=("red", "green"), time_s=50.0)
    page = await open_page(chromium, running, "competition/try/1", judge="Ada", size=(390, 844))
    await page.wait_for_selector(".counts:has-text('Counts 240.00 s')")
    await page.check("input[value='completed']")
    assert "blue is missing" in await text_of(page, ".counts")
    await page.check("input[value='blue']")
    assert (
        await text_of(page, ".counts")
        == "Counts 50.00 s: completed. It counts for nobody until a team is set."
    )
    await page.press("input[value='blue']", "Enter")
    await page.wait_for_selector(".line:has-text('Saved')")
    await page.select_option("#try-team", str(team))
    await page.click("button:has-text('Set')")
    await until(page, "document.querySelectorAll('.history .by').length === 2")
    ranking = (await running.get("ranking"))[1]["ranking"]["rows"][0]
    assert ranking["cells"][0]["counted_s"] == 50.0
    page.on("dialog", lambda dialog: dialog.accept())
    await page.click("button:has-text('As the referee says')")
    await until(page, "document.querySelectorAll('.history .by').length === 3")
    assert (await running.get("tries/1"))[1]["try"]["result"]["counted_s"] == 240.0


async def test_the_clock_of_a_try_runs_until_its_result_stands_there(running, chromium):
    team = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    await running.post("next", {"team": team})
    page = await open_page(chromium, running, "ranking")
    await page.wait_for_selector(".flight.called:has-text('Falken')")
    running.fleet.tell(event("began", "k", time_s=3.0))
    await page.wait_for_selector("[data-team][data-flying]")
    await until(page, "Number(document.querySelector('.clock').textContent) > 3.5")
    running.fleet.tell(event("ended", "k", time_s=60.0))
    await until(page, "document.querySelector('.ranking .time').textContent === '60.00'")
    assert await page.locator(".clock").count() == 0


async def test_pages_show_a_lost_connection_and_reconnect(tmp_path, monkeypatch, chromium):
    database = f"sqlite:///{tmp_path}/contest.db"
    async with contest(database, monkeypatch) as first:
        await first.log_in()
        await first.post("teams", {"name": "Falken"})
        first.fleet.tell(event("began", "k", time_s=1.0))
        page = await open_page(chromium, first, "ranking")
        await page.wait_for_selector(".ranking .name:has-text('Falken')")
        port = int(first.url.rstrip("/").rpartition(":")[2])
    await page.wait_for_selector(".line:has-text('connection to the monitor lost')")
    async with contest(database, monkeypatch, port) as again:
        await again.log_in()
        assert (await again.get("tries"))[1][0]["state"] == "interrupted"
        await page.wait_for_selector(".line", state="hidden")
        await again.post("teams", {"name": "Adler"})
        await page.wait_for_selector(".ranking .name:has-text('Adler')")


async def test_pages_fit_every_window(running, chromium):
    for number, name in enumerate(("W" * 60, "Falken", "الصقور")):
        team = (await running.post("teams", {"name": name, "members": "x" * 300}))[1]["team"]
        await running.fly(str(number), team)
    worst = {"seen": 0, "remarks": "y" * 1000, "contacts": 1000, "penalty_s": 36000}
    assert (await running.post("tries/1/judgement", worst))[0] == 200
    await running.post("queue", {"seen": 0, "teams": [1, 2, 3]})
    await running.post("next", {"team": 2})
    shown = {"competition": ".teams .name", "competition/try/1": ".history .by", "ranking": ".ranking .rank"}
    for path, selector in shown.items():
        page = await open_page(chromium, running, path, judge="Ada")
        await page.wait_for_selector(selector, state="attached")
        for width, height in SIZES:
            await page.set_viewport_size({"width": width, "height": height})
            assert await page.evaluate("document.documentElement.scrollWidth") <= width, (path, width)
            assert await page.evaluate(SMALL) == [], (path, width)
        await page.context.close()


async def test_the_form_is_filled_in_by_keyboard_alone(running, chromium):
    await running.fly("k")
    page = await open_page(chromium, running, "competition/try/1", judge="Ada")
    await page.wait_for_selector(".counts:has-text('Counts')")
    await page.focus("input[value='red']")
    await page.keyboard.press("Space")
    for _ in range(40):
        if await page.evaluate("document.activeElement.id") == "contacts":
            break
        await page.keyboard.press("Tab")
    await page.keyboard.press("ArrowUp")
    for _ in range(40):
        if await page.evaluate("document.activeElement.textContent") == "Save":
            break
        await page.keyboard.press("Tab")
    outline = await page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline == "solid"
    await page.keyboard.press("Enter")
    await page.wait_for_selector(".line:has-text('Saved')")
    result = (await running.get("tries/1"))[1]["try"]["result"]
    assert result["crossed"] == ["green", "blue"] and result["contacts"] == 1 and not result["completed"]
