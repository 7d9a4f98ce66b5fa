"""The page at /operator in a real browser, with a real monitor and a flight's end of the connection."""

import asyncio
import re
import socket
from contextlib import asynccontextmanager, suppress

import aiohttp
import pytest
import pytest_asyncio
from playwright.async_api import expect

from framerunner.errors import SettingError
from framerunner.monitor.operator_channel import REFUSED
from framerunner.monitor.run import serve
from framerunner.monitor.settings import MonitorError, MonitorSettings
from framerunner.preflight.card import FlightCard, table
from framerunner.preflight.operator_link import OperatorLink
from offboard.safety.operator import Operator
from tests.chromium import Complaints
from tests.framerunner.monitor.serving import StubFleet
from tests.framerunner.monitor.test_manual_page import EQUIPMENT
from tests.waiting import until

pytestmark = pytest.mark.asyncio(loop_scope="session")
PHONE = {"width": 390, "height": 844}
SILENCE = """() => {
  const { send } = WebSocket.prototype;
  window.mend = () => { WebSocket.prototype.send = send; };
  WebSocket.prototype.send = () => {};
}"""
CARD = FlightCard(
    "Flight card: test-case-1",
    (
        table("Flight", (("drone", "PX4, quadrotor, system 1"), ("on abort", "lands where it is"))),
        table(
            "Checks: name, result, value, allowed, what to do",
            (
                ("autopilot", "pass", "PX4, quadrotor", "", ""),
                ("battery", "FAIL", "31 %, 14.9 V", "40 % or more", "charge it"),
                ("fence", "note", "no global position", "4 corners", "put up a net"),
            ),
        ),
    ),
)


@asynccontextmanager
async def monitor(folder, **changed):
    """A monitor with a socket for flights; yields its URL and its task."""
    started = asyncio.get_running_loop().create_future()

    def say(line):
        if line.startswith("monitor: ") and not started.done():
            started.set_result(line.removeprefix("monitor: "))

    database, path = f"sqlite:///{folder / 'monitor.db'}", folder / "operator.sock"
    settings = MonitorSettings(port=0, database=database, operator_socket=path, **changed)
    task = asyncio.create_task(serve(EQUIPMENT, settings, say))
    try:
        await asyncio.wait({task, started}, return_when=asyncio.FIRST_COMPLETED, timeout=30.0)
        yield (started.result() if started.done() else task.result()), task
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


@pytest.fixture(autouse=True)
def stub_fleet(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.server.MonitoredFleet", lambda _equipment: fleet())


def fleet():
    stub = StubFleet()
    drone = {"id": 1, "link": {"state": "live", "age_s": 0.1}, "battery_percent": 83.0}
    stub.status["drones"] = [{**drone, "mode": "Hold", "armed": False}]
    return stub


def link_to(folder, operator, terminal=True):
    return OperatorLink(folder / "operator.sock", operator, "test-case-1, flight", terminal=terminal)


class Window:
    def __init__(self, page):
        self.page = page
        self.complaints = Complaints(page)
        self.go = page.get_by_role("button", name=re.compile("^Go"))
        self.land = page.locator(".o-land")
        self.motors = page.get_by_role("button", name=re.compile("^Stop motors"))
        self.link = page.locator(".o-link")
        self.state = page.locator(".o-state")
        self.head = page.locator(".o-state strong")


@pytest_asyncio.fixture(loop_scope="session")
async def open_window(chromium):
    contexts = []

    async def open_at(url, viewport=PHONE):
        context = await chromium.new_context(viewport=viewport, has_touch=True)
        contexts.append(context)
        window = Window(await context.new_page())
        await window.page.goto(f"{url}operator")
        return window

    yield open_at
    for context in contexts:
        await context.close()


async def press(window, button, seconds):
    """Hold a finger, which is a pointer, on a button."""
    box = await button.bounding_box()
    await window.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    await window.page.mouse.down()
    await asyncio.sleep(seconds)
    await window.page.mouse.up()


async def test_checks_go_landing_and_motors_on_a_phone(tmp_path, open_window):
    operator = Operator()
    async with monitor(tmp_path) as (url, _), link_to(tmp_path, operator) as link:
        window = await open_window(url)
        await expect(window.head).to_have_text("Checks")
        await expect(window.go).to_be_disabled()
        link.show_card(CARD, ())
        await expect(window.page.locator(".o-checks li").first).to_contain_text("battery: 31 %, 14.9 V")
        await expect(window.page.locator(".o-figures")).to_contain_text("83 %")
        await expect(window.link).to_have_text(re.compile(r"connected to the flight, delay \d+ ms"))
        operator.ask_for_go()
        operator.phase = "waiting"
        await expect(window.go).to_be_enabled()
        await expect(window.motors).to_be_disabled()
        for button in (window.go, window.land, window.motors):  # visible without scrolling
            box = await button.bounding_box()
            assert box["y"] + box["height"] < PHONE["height"]
        assert await window.page.evaluate("document.documentElement.scrollWidth <= innerWidth")

        await press(window, window.go, 0.5)
        await asyncio.sleep(0.3)
        assert not operator.has_go
        box = await window.go.bounding_box()
        await window.page.mouse.move(box["x"] + 20, box["y"] + 20)
        await window.page.mouse.down()
        await until(lambda: operator.has_go)
        await window.page.mouse.up()

        operator.phase = "flying"
        await expect(window.head).to_have_text("In flight")
        await expect(window.go).to_be_disabled()
        await press(window, window.land, 0.0)
        await until(lambda: operator.stops == 1)
        operator.phase = "landing"
        await expect(window.land).to_have_text(re.compile("^Land again"))
        landings = operator.landings
        await press(window, window.land, 0.0)
        await until(lambda: operator.landings > landings)
        await expect(window.motors).to_be_enabled()
        await press(window, window.motors, 0.0)
        await until(lambda: operator.kills)
        operator.phase = "stopping motors"
        await expect(window.motors).to_have_text(re.compile("^Stop motors again"))
        motor_stops = operator.motor_stops
        await press(window, window.motors, 0.0)
        await until(lambda: operator.motor_stops > motor_stops)
        operator.phase = "motors stopped"
        await expect(window.motors).to_be_disabled()
        await expect(window.land).to_be_disabled()
        assert window.complaints == []


async def test_the_page_has_the_keys_of_the_terminal(tmp_path, open_window):
    operator = Operator()
    async with monitor(tmp_path) as (url, _), link_to(tmp_path, operator):
        window = await open_window(url, {"width": 1200, "height": 800})
        operator.ask_for_go()
        await expect(window.go).to_be_enabled()
        await window.page.keyboard.down("g")
        await until(lambda: operator.has_go)
        await window.page.keyboard.up("g")
        await window.page.keyboard.press("k")  # means nothing before a stop
        await window.page.keyboard.press(" ")
        await window.page.keyboard.press(" ")
        await until(lambda: operator.stops == 1)
        await expect(window.motors).to_be_enabled()
        assert operator.stops == 1
        await window.page.keyboard.press("k")
        await until(lambda: operator.kills)


async def test_a_monitor_that_ends_while_go_is_held_gives_no_go(tmp_path, open_window):
    operator = Operator()
    async with monitor(tmp_path) as (url, task), link_to(tmp_path, operator):
        window = await open_window(url)
        operator.ask_for_go()
        await expect(window.go).to_be_enabled()
        box = await window.go.bounding_box()
        await window.page.mouse.move(box["x"] + 20, box["y"] + 20)
        await window.page.mouse.down()
        await asyncio.sleep(0.4)
        task.cancel()
        await expect(window.link).to_contain_text("Not connected to the monitor. Use the remote control.")
        await expect(window.go).to_be_disabled()
        await asyncio.sleep(1.5)
        assert not operator.has_go


async def test_an_app_that_does_not_answer_and_one_that_is_gone_are_told(tmp_path, open_window):
    operator = Operator()
    async with monitor(tmp_path) as (url, _):
        link = link_to(tmp_path, operator)
        async with link:
            window = await open_window(url)
            await expect(window.link).to_contain_text("connected to the flight")
            link._tasks[1].cancel()  # as if its event loop stood still
            await expect(window.link).to_contain_text(re.compile("has not answered for . s. Use the remote"))
            link._writer.close()
            await expect(window.state).to_contain_text("its connection is lost: use the remote")
            link._tasks[0].cancel()


async def test_a_stop_that_is_pressed_without_a_connection_is_sent_when_it_is_back(tmp_path, open_window):
    operator = Operator()
    async with monitor(tmp_path) as (url, _):
        link = link_to(tmp_path, operator)
        async with link:
            window = await open_window(url)
            operator.phase = "flying"
            await expect(window.head).to_have_text("In flight")
            await window.page.evaluate(SILENCE)
            link._tasks[1].cancel()
            await expect(window.link).to_contain_text("has not answered")
            await press(window, window.land, 0.0)
            await expect(window.land).to_contain_text("being sent")
            assert operator.stops == 0
            await window.page.evaluate("window.mend()")
            link._tasks[1] = asyncio.create_task(link._beat_forever())
            await until(lambda: operator.stops == 1)


async def test_a_stop_is_sent_until_the_flight_has_it(tmp_path, open_window):
    """The app's connection is lost with the stop in it; the page sends it again to the same flight only."""
    operator = Operator()
    async with monitor(tmp_path) as (url, _):
        link = link_to(tmp_path, operator)
        async with link:
            window = await open_window(url)
            await expect(window.head).to_have_text("Checks")
            link._take = lambda line: None  # what the page sends is lost
            await press(window, window.land, 0.0)
            await expect(window.land).to_contain_text("being sent")
            link._writer.close()
            await expect(window.state).to_contain_text("its connection is lost: use the remote")
            await expect(window.land).to_be_enabled()
            del link._take
            await until(lambda: operator.stops == 1)  # it has connected again
            await expect(window.land).to_have_text(re.compile("^Land again"))
        operator = Operator()
        async with link_to(tmp_path, operator):
            await expect(window.head).to_have_text("Checks")
            await asyncio.sleep(0.5)
            assert operator.stops == 0


async def test_what_ended_a_flight_stays_on_the_page(tmp_path, open_window):
    async with monitor(tmp_path) as (url, _):
        window = await open_window(url)
        await expect(window.head).to_have_text("No flight")
        with suppress(SettingError):
            async with link_to(tmp_path, Operator()) as link:
                await expect(window.head).to_have_text("Checks")
                link.show_card(CARD, ("battery",))
                await expect(window.state).to_contain_text("failed: battery")
                raise SettingError("not armed: a check has failed (battery)")
        await expect(window.state).to_contain_text("not armed: a check has failed (battery)")


async def test_that_a_second_flight_was_refused_is_told_on_the_page(tmp_path, open_window):
    async with monitor(tmp_path) as (url, _), link_to(tmp_path, Operator()):
        window = await open_window(url)
        await expect(window.head).to_have_text("Checks")
        with pytest.raises(SettingError):
            await link_to(tmp_path, Operator()).__aenter__()
        await expect(window.page.locator(".o-answer")).to_have_text(REFUSED)
        await expect(window.head).to_have_text("Checks")


async def test_a_viewer_operates_nothing_and_one_who_logged_in_does(tmp_path, open_window):
    settings = {"trusted_proxies": ("127.0.0.1",), "organiser_password": "long enough"}
    operator = Operator(needs_go=False)
    async with (
        monitor(tmp_path, **settings) as (url, _),
        link_to(tmp_path, operator),
        aiohttp.ClientSession() as web,
    ):
        window = await open_window(url)
        await expect(window.link).to_contain_text("only judges and organisers may operate a flight")
        await expect(window.land).to_be_disabled()
        async with web.ws_connect(f"{url}ws/operator") as socket:
            message = await socket.receive()
            assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, 4403)
        await window.page.goto(f"{url}login")
        await window.page.fill("[name=name]", "Ada")
        await window.page.fill("[type=password]", "long enough")
        await window.page.keyboard.press("Enter")
        await window.page.wait_for_url(re.compile(r"/$|/competition"))
        await window.page.goto(f"{url}operator")
        await press(window, window.land, 0.0)
        await until(lambda: operator.stops == 1)
        assert operator.stopped_by == "Ada, on the page"


async def test_the_socket_is_this_users_alone_and_a_second_flight_is_refused(tmp_path):
    async with monitor(tmp_path), link_to(tmp_path, Operator()):
        path = tmp_path / "operator.sock"
        assert path.stat().st_mode & 0o077 == 0
        reader, writer = await asyncio.open_unix_connection(str(path))
        assert await reader.read() == b""
        writer.close()
        with pytest.raises(SettingError, match="the monitor there has another flight already"):
            async with link_to(tmp_path, Operator()):
                pass
    assert not path.exists()
    with pytest.raises(SettingError, match="no monitor listens there"):
        async with link_to(tmp_path, Operator()):
            pass


@pytest.mark.parametrize("line", [b"[1]", b'{"kind": "answer", "page": [1]}', b"[" * 100_000, b"\xff"])
async def test_what_no_flight_sends_leaves_the_monitor_ready(tmp_path, line, caplog):
    async with monitor(tmp_path):
        reader, writer = await asyncio.open_unix_connection(str(tmp_path / "operator.sock"))
        writer.write(line + b"\n")
        writer.write_eof()
        assert await reader.read() == b""
        writer.close()
        async with link_to(tmp_path, Operator()):
            pass
    assert not [each for each in caplog.records if each.exc_info]


async def test_the_socket_of_a_monitor_that_runs_is_left_alone_and_one_that_was_killed_replaced(tmp_path):
    path = tmp_path / "operator.sock"
    async with monitor(tmp_path), link_to(tmp_path, Operator()) as link:
        with pytest.raises(MonitorError, match="another monitor listens there"):
            async with monitor(tmp_path) as (_, second):
                await asyncio.wait({second})
        assert path.is_socket()
        assert link._writer is not None
    with socket.socket(socket.AF_UNIX) as killed:
        killed.bind(str(path))
        killed.listen()
    async with monitor(tmp_path), link_to(tmp_path, Operator()):
        assert path.stat().st_mode & 0o077 == 0


async def test_a_socket_that_cannot_be_opened_is_told_before_any_url(tmp_path):
    database, path = f"sqlite:///{tmp_path / 'monitor.db'}", tmp_path / "missing" / "operator.sock"
    settings, lines = MonitorSettings(port=0, database=database, operator_socket=path), []
    with pytest.raises(MonitorError, match=r"--operator-socket .*: cannot be opened \(No such file"):
        await serve(EQUIPMENT, settings, lines.append)
    assert lines == []


@pytest.mark.parametrize("text", ["", "{}", '{"kind": "arm"}', '{"kind": "go", "beat": 1e99}', "x" * 600])
async def test_what_no_page_sends_ends_the_connection(tmp_path, text):
    operator = Operator()
    async with (
        monitor(tmp_path) as (url, _),
        link_to(tmp_path, operator),
        aiohttp.ClientSession() as web,
        web.ws_connect(f"{url}ws/operator") as page,
    ):
        await page.send_str(text)
        async for _ in page:
            pass
        assert page.close_code == 4400
    assert operator.stops == 0
