"""The editor's addresses for flights, as a page uses them: over WebSocket, with real worker processes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import time
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from framerunner.course.lessons import find_lesson
from framerunner.editing.service import EditingSettings
from framerunner.editing.waiting_queue import WaitingQueue
from framerunner.editing.web import EditingRouter
from framerunner.editing.workers import WorkerPool
from framerunner.evaluation.runner import fly_task
from framerunner.flying.plan import FlightPlan
from framerunner.monitor.access import Role
from offboard.mission import MISSIONS, load_mission
from scenarios.loader import load_scenario
from tests.framerunner.editing.page_socket import flights_socket

PAPER = (MISSIONS / "frame_challenge.yaml").read_text(encoding="utf-8")
RED_ONLY = (
    PAPER[: PAPER.index("  green:\n")].replace("then: green", "then: landing")
    + PAPER[PAPER.index("  landing:") :]
)
HOVER = """
name: hover
initial: up
states:
  up:
    enter:
      - hover
      - cmd.vel_z = 0.5
    transitions:
      - when: imu.z > 1
        to: wait
  wait:
    enter:
      - hover
    transitions:
      - when: seconds_in_state > 5
        to: down
  down:
    enter:
      - land
    final: true
"""
BROKEN = """
name: broken
initial: up
states:
  up:
    during:
      - cmd.vel_z = 1 / (imu.z - imu.z)
    transitions:
      - when: imu.z > 1
        to: down
  down: {final: true}
"""
FOREVER = """
import time
from offboard.pilot import Pilot
class Slow(Pilot):
    @property
    def answer(self) -> float:
        print("this is no message")
        while True:
            pass
"""


class Page:
    """The browser's end of a WebSocket."""

    def __init__(self, socket):
        self._socket = socket
        self._tag = 0
        self.seen = []

    def ask(self, do, **fields):
        self._tag += 1
        self._socket.send_text(json.dumps({"kind": do, "tag": self._tag, **fields}))
        return self._tag

    def until(self, *kinds, holds=lambda message: True):
        """The next message of these kinds for which something holds."""
        while True:
            message = json.loads(self._socket.receive_text())
            self.seen.append(message)
            if message["kind"] in kinds and holds(message):
                return message

    def answer(self, do, **fields):
        tag = self.ask(do, **fields)
        kinds = ("done", "refused", "changed", "started", "batch_started")
        return self.until(*kinds, holds=lambda message: message["tag"] == tag)


@pytest.fixture(autouse=True)
def no_spare_workers(monkeypatch):
    """No process is made ready for a next flight: to start one takes as long as most flights here."""
    monkeypatch.setattr("framerunner.editing.service._SPARE_S", 1e6)


@contextlib.contextmanager
def page(*, role=Role.ORGANISER, **settings):
    """A page that is connected to a server."""
    router = EditingRouter(EditingSettings(**{"jobs": 2, **settings}))
    with flights_socket(router, role) as socket:
        yield Page(socket)


def workers():
    """Processes of workers that exist."""
    found = []
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0") if folder.name.isdigit() else ()
            stat = (folder / "stat").read_text().rpartition(")")[2].split() if words else ["Z"]
            if b"framerunner.editing.worker" in words and stat[0] != "Z" and int(stat[1]) == os.getpid():
                found.append(int(folder.name))
    return found


def started_by(pid):
    """Processes that a worker has started."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(path.read_text().rpartition(")")[2].split()[1]) == pid:
                found.append(path)
    return found


def test_a_flight_is_told_from_start_to_end_and_is_that_of_lockstep():
    plan = FlightPlan(load_scenario("test-case-1"), load_mission("frame_challenge"), 0)
    with page() as browser:
        started = browser.answer("start", text=PAPER, speed=None)
        assert (started["kind"], started["layout"]["name"]) == ("started", "test-case-1")
        ended = browser.until("ended")
    assert ended["result"]["state_sha256"] == fly_task(plan).state_sha256
    assert (ended["lost_in"], ended["result"]["verdict"]) == ("", "clean")
    told = [message for message in browser.seen if message["kind"] == "now"]
    assert told[0]["full"] and not any(message["full"] for message in told[1:])
    taken = [each for message in told for each in message["taken"]]
    assert taken[0]["ids"] == ["take_off.start/1"]
    assert ["red.going_up/1", "red/then"] in [each["ids"] for each in taken]
    spans = [span for message in told for span in message["spans"]]
    assert [span["state"] for span in ended["spans"]][: len(spans)] == [span["state"] for span in spans]
    assert ended["spans"][-1]["state"] == "landing.stop"
    assert ended["counts"]["red/then"] == 1
    assert len([point for message in told for point in message["trail"]]) > 300


def test_a_contact_is_told_when_it_happens():
    lesson = find_lesson("4")
    careless = lesson.solution.replace(
        "- cmd.vel_x = 0.3\n    during:\n      - look_to_frame", "- cmd.vel_x = 0.3"
    )
    assert careless != lesson.solution
    with page() as browser:
        browser.answer("start", text=careless, scenario=lesson.name, speed=None)
        touched = browser.until("now", holds=lambda message: message["contacts"])
        (contact,) = touched["contacts"]
        assert contact["name"] == "red"
        assert contact["time_s"] <= touched["time_s"] and touched["state"] == "crossing"
        browser.ask("stop", run=touched["run"])
        result = browser.until("ended")["result"]
    since_s = contact["time_s"] - touched["began_s"]
    assert result["contact_times_s"][0] == pytest.approx(since_s, abs=0.001)


def test_a_flight_stops_at_a_state_is_watched_stepped_changed_and_goes_on():
    with page() as browser:
        run = browser.answer("start", text=HOVER, speed=None, break_on=["wait"])["run"]
        stopped = browser.until("now", holds=lambda message: message["paused"])
        assert (stopped["state"], stopped["active"], stopped["stopped_in"]) == ("wait", ["wait"], "wait")
        assert stopped["guards"] == [
            {"id": "wait/1", "to": "down", "when": "seconds_in_state > 5", "holds": False}
        ]
        assert [(value["name"], value["unit"]) for value in stopped["values"]] == [("seconds_in_state", "s")]
        browser.ask("watch", run=run)  # as another page does: it is told all so far
        full = browser.until("now", holds=lambda message: message["full"])
        assert (full["counts"], [span["state"] for span in full["spans"]]) == ({"up/1": 1}, ["up"])
        assert browser.answer("step", run=run, ticks=4)["kind"] == "done"
        stepped = browser.until("now", holds=lambda message: message["paused"])
        assert stepped["time_s"] - stopped["time_s"] == pytest.approx(0.2, abs=0.005)
        refused = browser.answer("change", run=run, text=HOVER.replace("wait", "stay"))
        assert refused["text"].startswith("the active state 'wait' is not in the changed chart")
        refused = browser.answer("change", run=run, text=HOVER.replace("seconds_in_state", "secs"))
        assert "unknown name 'secs'" in refused["text"]
        changed = browser.answer("change", run=run, text=HOVER.replace("> 5", "> 1"))
        assert changed["ids"] == {"up/1": "up/1", "wait/1": "wait/1"}
        shown = browser.until("now")
        assert shown["full"] and shown["counts"] == {"up/1": 1}
        assert shown["guards"][0]["when"] == "seconds_in_state > 1"
        assert shown["seconds_in_state"] == stepped["seconds_in_state"]
        assert browser.answer("break_on", run=run, states=["nowhere"])["kind"] == "refused"
        browser.ask("go_on", run=run)
        ended = browser.until("ended")
        assert ended["result"]["ended"] == "finished"
        assert ended["counts"] == {"up/1": 1, "wait/1": 1}
        wait = next(span for span in ended["spans"] if span["state"] == "wait")
        assert wait["to_s"] - wait["from_s"] == pytest.approx(1.0, abs=0.11)
        assert browser.answer("pause", run=run)["text"] == "the flight is over"
        browser.ask("watch", run=run)
        assert browser.until("ended")["run"] == run


def test_a_flight_that_is_stopped_ends_and_one_that_nobody_watches_too():
    with page(unwatched_s=0.1) as browser:
        run = browser.answer("start", text=HOVER, speed=0.1)["run"]
        browser.until("now")
        browser.ask("stop", run=run)
        assert "interrupted" in browser.until("ended")["text"]
        browser.answer("start", text=HOVER, paused=True)
        browser.until("now", holds=lambda message: message["paused"])
        assert workers()
        with contextlib.suppress(WebSocketDisconnect):
            browser._socket.close()
        deadline = time.monotonic() + 20
        while workers():
            assert time.monotonic() < deadline
            time.sleep(0.05)


def test_a_batch_is_told_flight_by_flight_failures_first():
    lessons = [find_lesson(number) for number in "413"]  # of which the mission does one; 1 has nothing red
    crossed, lost, landed = names = [lesson.scenario.name for lesson in lessons]
    with page(jobs=1) as browser:
        asked = [lesson.name for lesson in lessons]
        assert browser.answer("start_batch", text=RED_ONLY, scenarios=asked)["count"] == 3
        ended = browser.until("batch_ended")
        told = [each for each in browser.seen if each["kind"] == "flight"]
    assert [each["scenario"] for each in told] == names
    assert (ended["flown"], ended["completed"], ended["text"]) == (3, 1, "")
    assert ended["order"] == [landed, lost, crossed]
    flights = {each["scenario"]: each for each in told}
    ranked = [flights[name] for name in ended["order"]]
    assert [each["rank"] for each in ranked] == sorted(each["rank"] for each in ranked)
    assert [each["completed"] for each in ranked] == [False, False, True]
    assert flights[crossed]["counts"]["red/then"] == 1
    flight = flights[lost]
    assert (flight["lost_in"], flight["verdict"]) == ("red.turning", "timed out")
    track = flight["track"]
    assert len(track["time_s"]) == len(track["x"]) == len(track["state"]) > 100
    assert track["states"][track["state"][-1]] == "red.turning"
    assert (flight["layout"]["name"], flight["result"]["verdict"]) == (lost, flight["verdict"])


def test_a_broken_mission_ends_in_words():
    with page(jobs=1) as browser:
        started = browser.answer("start_batch", text=BROKEN, level="calm", count=4, first_seed=2)
        assert started["count"] == 4
        ended = browser.until("batch_ended")
        assert (ended["flown"], ended["completed"]) == (4, 0)
        flights = [each for each in browser.seen if each["kind"] == "flight"]
        assert [each["scenario"] for each in flights] == [f"calm-{seed}" for seed in range(2, 6)]
        assert {each["lost_in"] for each in flights} == {"up"}
        assert all("mission 'broken', state 'up': ZeroDivisionError" in each["cause"] for each in flights)
        refused = browser.answer("start_batch", text=BROKEN + "  other: {}\n")
        assert refused["text"].startswith("mission.yaml:12:3: state 'other'")
        text = HOVER.replace("name: hover", "name: hover\nextends: /etc/passwd")
        refused = browser.answer("start", text=text)
        assert "here a mission extends one of the package" in refused["text"]


def test_a_batch_is_cancelled_with_all_its_processes_and_keeps_its_results():
    with page() as browser:
        batch = browser.answer("start_batch", text=HOVER, level="calm", count=100)["batch"]
        browser.until("flight")
        flying = [pid for pid in workers() if started_by(pid)]
        assert len(flying) == 1
        assert browser.answer("start_batch", text=HOVER)["text"].startswith("your flights are not over yet")
        browser.ask("cancel", batch=batch)
        ended = browser.until("batch_ended")
        flown = [each["scenario"] for each in browser.seen if each["kind"] == "flight"]
        assert (ended["text"], ended["count"]) == ("cancelled", 100)
        assert sorted(ended["order"]) == sorted(flown)
        assert not set(flying) & set(workers())
        browser.ask("watch", run=batch)
        assert browser.until("batch_ended") == ended


@pytest.mark.parametrize("kind", ["start", "start_batch"])
def test_a_mission_that_computes_without_end_is_ended(tmp_path, kind):
    pilot = tmp_path / "slow.py"
    pilot.write_text(FOREVER, encoding="utf-8")
    text = HOVER.replace("imu.z > 1", "answer > 1")
    with page(pilot=str(pilot), processor_s=1.0) as browser:
        if kind == "start":
            browser.answer(kind, text=text, speed=None)
            text = browser.until("ended")["text"]
        else:
            browser.answer(kind, text=text, scenarios=["test-case-1"])
            browser.until("batch_ended")
            text = next(each["cause"] for each in browser.seen if each["kind"] == "flight")
    assert "state 'up'" in text
    assert "more than 1 s of processor time" in text


def test_a_worker_that_dies_is_told():
    with page() as browser:
        browser.answer("start", text=HOVER, paused=True)
        browser.until("now", holds=lambda message: message["paused"])
        for pid in workers():
            os.kill(pid, signal.SIGKILL)
        assert "the flight ended its process" in browser.until("ended")["text"]


def test_flights_under_control_wait_for_their_turn_and_can_leave_the_line():
    with page(max_runs=1) as browser:
        first = browser.answer("start", text=HOVER, paused=True)["run"]
        second = browser.ask("start", text=HOVER, paused=True)
        assert browser.until("waiting")["place"] == 1
        third = browser.ask("start", text=HOVER, paused=True)
        waiting = browser.until("waiting", holds=lambda message: message["tag"] == third)
        assert (waiting["place"], waiting["seconds"]) == (2, None)
        refused = browser.answer("pause", run=waiting["run"])
        assert refused["text"].startswith("the flight waits for its turn")
        browser.ask("stop", run=waiting["run"])
        refused = browser.until("refused", holds=lambda message: message["tag"] == third)
        assert refused["text"] == "cancelled"
        browser.ask("stop", run=first)
        browser.until("started", holds=lambda message: message["tag"] == second)
        for _ in range(3):
            browser.ask("start", text=HOVER, paused=True)
        assert browser.answer("start", text=HOVER)["text"].startswith("no more than 4 of a page")


def test_a_pupil_starts_no_flight_in_the_simulator():
    with page(role=Role.PUPIL) as browser:
        for request in ({"text": HOVER, "scenario": "test-case-1"}, {}):
            refused = browser.answer("start_live" if request else "stop_live", **request)
            assert refused["text"].startswith("only organisers may start a flight in the simulator")


def test_a_line_expects_turns_by_the_durations_of_those_before():
    now_s = 0.0
    line = WaitingQueue(2, 10.0, lambda: now_s)
    for each in "abcde":
        line.enter(each)
    assert list(line.begin()) == ["a", "b"]
    now_s = 4.0
    assert list(line.waiting()) == [("c", 1, 6), ("d", 2, 6), ("e", 3, 16)]
    now_s = 5.0
    line.leave("a")  # sooner than expected
    line.leave("d")
    assert list(line.begin()) == ["c"]
    assert list(line.waiting()) == [("e", 1, 4)]


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("[", "Invalid JSON"),
        ('{"kind": "fly"}', "kind"),
        ('{"kind": "start", "text": "x", "scenario": "../../etc/passwd", "tag": 7}', "scenario"),
        ('{"kind": "start", "text": "x", "pilot": "mine.py"}', "pilot"),
        ('{"kind": "start", "text": "x", "speed": 0}', "speed"),
        ('{"kind": "step", "run": "nothing", "ticks": 2}', "'nothing': there is no such flight"),
        ('{"kind": "start_batch", "text": "x", "count": 100000}', "count"),
    ],
)
def test_a_message_that_cannot_be_understood_is_refused_in_one_line(message, words):
    with page() as browser:
        browser._socket.send_text(message)
        refused = browser.until("refused")
    assert words in refused["text"]
    assert "\n" not in refused["text"]
    assert refused["tag"] == (7 if '"tag": 7' in message else 0)


def test_those_who_may_not_act_are_refused():
    with pytest.raises(WebSocketDisconnect) as refusal, page(role=Role.JUDGE) as browser:
        browser.until("done")
    assert refusal.value.code == 4403


def test_the_choices_are_listed():
    web = FastAPI()
    web.include_router(EditingRouter().router(lambda _: True))
    choices = TestClient(web).get("/api/editing/choices").json()
    assert "test-case-1" in choices["scenarios"]
    assert "calm" in choices["levels"]
    assert "1_take_off" in choices["lessons"]


def test_a_batch_that_is_over_is_not_cancelled_with_the_next_one_of_its_worker():
    batch = {"text": HOVER, "level": None, "scenarios": ["test-case-1"]}
    with page() as browser:
        first = browser.answer("start_batch", **batch)["batch"]
        assert browser.until("batch_ended")["text"] == ""
        assert browser.answer("start_batch", **batch)["kind"] == "batch_started"
        assert browser.answer("cancel", batch=first)["kind"] == "done"
        ended = browser.until("batch_ended")
        assert (ended["text"], ended["flown"]) == ("", 1)


async def test_a_worker_that_is_being_started_when_nobody_needs_it_is_ended():
    before, tasks = workers(), []
    pool = WorkerPool(1, lambda work: tasks.append(asyncio.create_task(work)))
    pool.prepare()
    await asyncio.sleep(0)
    pool.end_spare()
    await asyncio.gather(*tasks)
    assert workers() == before
