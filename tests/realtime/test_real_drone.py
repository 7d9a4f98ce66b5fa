"""A drone that is taken for a real one, flown by the program: dry run, operator's keys, a killed app."""

import asyncio
import json
import os
import pty
import signal
import threading
import time
from contextlib import contextmanager

import aiohttp
import pytest
from pymavlink import mavutil

from tests.processes import program, simulator, wait_until
from tests.realtime.conftest import Peer

pytestmark = pytest.mark.realtime

ARM, TAKEOFF, LAND, MODE = 400, 22, 21, 176
ARMED = 128


def drone(instance):
    urls = ("--drone", f"udpin://127.0.0.1:{14540 + instance}")
    return (*urls, "--camera", f"http://127.0.0.1:{8100 + instance}/video")


@contextmanager
def terminal():
    """A terminal's program side, and a function that types on it."""
    master, slave = pty.openpty()
    closed = threading.Event()

    def drain():
        while not closed.is_set():
            try:
                os.read(master, 4096)
            except OSError:
                return

    threading.Thread(target=drain, daemon=True).start()
    try:
        yield slave, lambda text: os.write(master, text.encode())
    finally:
        closed.set()
        os.close(slave)
        os.close(master)


def run_of(folder):
    (run,) = (folder / "runs").iterdir()
    return run


def test_a_dry_run_sends_setpoints_and_arms_nothing(tmp_path, instance):
    (tmp_path / "app").mkdir()
    with (
        simulator(tmp_path, instance, "--scenario", "test-case-1"),
        program(
            tmp_path / "app", "fly", "test-case-1", *drone(instance), "--dry-run", "--accept", "all"
        ) as app,
    ):
        assert app.process.wait(120.0) == 0, app.err + app.out
        assert "nothing was armed" in app.out
    run = run_of(tmp_path / "app")
    assert (run / "flight_card.html").exists() and (run / "flight_card.pdf").exists()
    log = mavutil.mavlink_connection(str(run / "flight.tlog"))
    counts = {}
    while (message := log.recv_match()) is not None:
        kind = message.get_type()
        counts[kind] = counts.get(kind, 0) + 1
        if kind in ("COMMAND_LONG", "COMMAND_INT"):
            assert message.command not in (ARM, TAKEOFF, LAND), message
        if kind == "HEARTBEAT" and message.get_srcComponent() == 1:
            assert not message.base_mode & ARMED
    assert counts["SET_POSITION_TARGET_LOCAL_NED"] > 200


def test_the_operator_arms_by_a_held_key_and_stops_by_the_space_bar(tmp_path, instance):
    (tmp_path / "app").mkdir()
    arguments = (
        "fly",
        "test-case-1",
        *drone(instance),
        "--set-parameters",
        "--mission",
        "explorer_soft_landing",
    )
    with (
        simulator(tmp_path, instance, "--scenario", "test-case-1"),
        terminal() as (slave, type_keys),
        program(tmp_path / "app", *arguments, stdin=slave) as app,
    ):
        app.wait_for("waiting for the operator's go", 60.0)
        time.sleep(1.0)
        assert "red." not in app.err
        for _ in range(40):
            type_keys("g")
            time.sleep(0.035)
        app.wait_for("red.", 60.0)
        time.sleep(1.0)
        type_keys(" ")
        assert app.process.wait(60.0) == 1, app.err + app.out
    result = json.loads((run_of(tmp_path / "app") / "result.json").read_text(encoding="utf-8"))
    assert result["ended"] == "aborted"
    assert "stopped by the operator" in result["reason"]
    assert "Traceback" not in app.err


def test_the_operators_page_arms_and_lands_without_a_terminal(tmp_path, instance):
    """A page's end of the connection, as a phone has it, at a monitor that is a program of its own."""
    (tmp_path / "app").mkdir()
    socket, link = tmp_path / "operator.sock", f"127.0.0.1:{14570 + instance}"
    arguments = ("fly", "test-case-1", *drone(instance), "--set-parameters", "--operator-socket", str(socket))
    shared = ("--mission", "explorer_soft_landing", "--monitor-link", f"udpout://{link}", "--accept", "all")
    monitor_options = ("--port", "0", "--drone", f"udpin://{link}", "--operator-socket", str(socket))
    with (
        simulator(tmp_path, instance, "--scenario", "test-case-1"),
        program(tmp_path, "monitor", *monitor_options) as monitor,
    ):
        monitor.wait_for("monitor: http", 60.0)
        url = next(line for line in monitor.err.splitlines() if line.startswith("monitor: http"))
        with program(tmp_path / "app", *arguments, *shared) as app:
            phases = asyncio.run(operate(url.removeprefix("monitor: ")))
            assert app.process.wait(60.0) == 1, app.err + app.out
    assert phases == ["checks", "waiting", "flying", "landing"]
    result = json.loads((run_of(tmp_path / "app") / "result.json").read_text(encoding="utf-8"))
    assert "stopped by the operator (somebody, on the page)" in result["reason"]


async def operate(url):
    """Hold Go when the flight asks for it, and land two seconds later; the phases of the flight."""
    phases, flown_s, flight = [], None, ""
    async with aiohttp.ClientSession() as web, web.ws_connect(f"{url}ws/operator") as page:
        async for message in page:
            told = message.json()
            if told["kind"] in ("flight", "end"):
                flight = told["flight"]
            if told["kind"] == "end":
                break
            if told["kind"] != "beat":
                continue
            if told["phase"] not in (*phases, "ended"):
                phases.append(told["phase"])
                flown_s = time.monotonic() if told["phase"] == "flying" else flown_s
            lands = flown_s is not None and time.monotonic() - flown_s > 8.0
            what = "go" if told["asks"] else "stop" if lands else "here"
            await page.send_json({"kind": what, "beat": told["beat"], "flight": flight})
    return phases


def test_without_a_terminal_nothing_is_armed(tmp_path, instance):
    (tmp_path / "app").mkdir()
    with program(tmp_path / "app", "fly", "test-case-1", *drone(instance), "--operator", "Ada") as app:
        assert app.process.wait(30.0) == 2
        assert "--yes" in app.err and "no terminal" in app.err
    assert not list((tmp_path / "app").glob("runs/*"))


def test_a_failed_check_arms_nothing(tmp_path, instance):
    (tmp_path / "app").mkdir()
    with (
        simulator(tmp_path, instance, "--scenario", "test-case-1"),
        program(tmp_path / "app", "fly", "test-case-1", *drone(instance), "--yes") as app,
    ):
        assert app.process.wait(60.0) == 2
        line = app.err.splitlines()[-1]
        assert line.startswith("error: not armed: 5 checks have failed (COM_OBL_RC_ACT, "), app.err
    assert [path.name for path in run_of(tmp_path / "app").iterdir()] != []


def test_a_killed_app_leaves_the_landing_to_the_drone(tmp_path, instance):
    (tmp_path / "app").mkdir()
    arguments = ("fly", "test-case-1", *drone(instance), "--set-parameters", "--yes")
    with (
        simulator(tmp_path, instance, "--scenario", "test-case-1"),
        program(tmp_path / "app", *arguments) as app,
    ):
        app.wait_for("red.", 60.0)
        time.sleep(2.0)
        peer = Peer(14550 + instance)
        os.kill(app.process.pid, signal.SIGKILL)

        def disarmed():
            beat = peer.wait("HEARTBEAT", lambda beat: beat.get_srcComponent() == 1)
            return not beat.base_mode & ARMED

        assert wait_until(disarmed, 40.0)
        peer.link.close()
