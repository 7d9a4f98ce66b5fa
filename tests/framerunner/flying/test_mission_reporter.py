"""What is reported of a mission while it is flown."""

from __future__ import annotations

import logging
from dataclasses import asdict, replace
from math import inf, nan

import numpy as np
import pytest

from framerunner.flying.mission_reporter import HISTORY, MAX_HISTORY_PIECES, MissionReporter
from framerunner.flying.navigation_reporter import MAX_GATES, MAX_POINTS, map_document
from framerunner.wire.mission_report import TransitionTaken, plain_value
from framerunner.wire.mission_tunnel import DocumentAssembler, DocumentKind, split_document
from offboard.app import Moment, fly_mission
from offboard.drone import DroneState, VelocityFluCommand
from offboard.engine import MissionEngine
from offboard.mission import load_mission, mermaid
from offboard.navigation.view import GateEstimate, NavigationView
from offboard.pilot import Imu
from scenarios.result import FlightResult
from tests.offboard.fakes import START_1, TEST_CASE_1, GeometricPerception, KinematicDrone
from vision.types import CameraFrame, Detection, Detections

MISSION = load_mission("frame_challenge")
LEAVES = list(MISSION.leaves)
START = (-3.0, -3.0, 0.53, 1.0)


class Listener:
    """Replaces the companion; keeps what it is to send."""

    def __init__(self):
        self.states, self.detections, self.texts, self.documents, self.farewells = [], [], [], [], []
        self.sending = ()

    def send_state(self, state):
        self.states.append(state)

    def send_detections(self, detections):
        self.detections.append(detections)

    def send_text(self, text):
        self.texts.append(text)

    def send_document(self, kind, pieces):
        assembler = DocumentAssembler()
        (document,) = [document for piece in pieces if (document := assembler.take(piece))]
        assert document.kind == kind
        self.documents.append(document)

    async def send_finally(self, kind):
        self.farewells.append(kind)

    def is_sending(self, kind):
        return kind in self.sending

    def contents(self, kind):
        return [document.content for document in self.documents if document.kind == kind]


def make_reporter(source="name: frame_challenge\n"):
    listener = Listener()
    return listener, MissionReporter(listener, MISSION, source, "test-case-1", START)


def moment(tick, mission_state="red.turning", **changes):
    flying = changes.pop("flying", True)
    state = DroneState(50_000 * tick, 1.0, 2.0, 3.0, 0.5, armed=flying, offboard=flying)
    return replace(
        Moment(state, VelocityFluCommand(0.1, 0.2, 0.3, 0.4), Detections(), mission_state, 0.0), **changes
    )


def taken(number, source="red.turning", target="red.frame_visible", values=()):
    values = tuple((name, plain_value(value)) for name, value in values)  # as the engine does
    return TransitionTaken(
        source, target, "frame.d < 1", values, 50_000 * number, 0.05 * number, (f"{source}/1",)
    )


def test_the_mission_is_sent_before_it_begins():
    listener, _ = make_reporter("name: x # ü\n")
    (document,) = listener.documents
    assert document.content == {
        "name": "frame_challenge",
        "description": MISSION.description,
        "scenario": "test-case-1",
        "states": LEAVES,
        "mermaid": mermaid(MISSION),
        "source": "name: x # ü\n",
    }
    (state,) = listener.states
    assert (state.mission_crc, state.state_index, state.flying) == (document.crc, -1, False)
    assert state.pose_arena == START


def test_a_mission_that_is_too_large_is_sent_without_its_text(caplog):
    noise = np.random.default_rng(1).integers(33, 0x2000, 60_000)
    listener, _ = make_reporter("".join(map(chr, noise)))
    (content,) = listener.contents(DocumentKind.MISSION)
    assert (content["source"], content["mermaid"], content["states"]) == ("", mermaid(MISSION), LEAVES)
    assert "pieces; the limit is 255" in caplog.text


def test_the_state_is_sent_every_second_tick_and_at_once_when_it_changes():
    listener, reporter = make_reporter()
    listener.states.clear()
    for tick in range(4):
        reporter.see(moment(tick))
    assert [state.time_us for state in listener.states] == [0, 100_000]
    reporter.see(moment(4, paused=True))
    reporter.see(moment(5, flying=False))
    reporter.see(moment(6, "red.frame_visible", transition=taken(6)))
    reporter.see(moment(7, "landing.stop", transition=taken(7, "red.frame_visible", "landing.stop")))
    reporter.see(moment(8, "landing.stop"))
    reporter.see(moment(9, "landing.stop"))
    assert [state.time_us // 50_000 for state in listener.states] == [0, 2, 4, 5, 6, 7, 9]
    assert [state.flying for state in listener.states[:5]] == [True, True, False, False, True]
    assert [state.paused for state in listener.states[:4]] == [False, False, True, False]
    last = listener.states[-1]
    assert (last.state_index, last.transitions, last.finished) == (LEAVES.index("landing.stop"), 2, True)
    assert (last.entered_us, listener.states[0].finished) == (350_000, False)
    assert (last.command, last.pose_arena) == ((0.1, 0.2, 0.3, 0.4), (1.0, 2.0, 3.0, 0.5))


def test_each_new_state_is_one_status_text():
    listener, reporter = make_reporter()
    for tick, state in enumerate(("red.turning", "red.turning", "red.crossing", "red.turning")):
        reporter.see(moment(tick, state))
    assert listener.texts == ["mission: red.turning", "mission: red.crossing", "mission: red.turning"]


def test_a_state_that_leads_to_itself_is_entered_again():
    listener, reporter = make_reporter()
    reporter.see(moment(1))
    reporter.see(moment(2, transition=taken(2, target="red.turning")))
    assert [(state.entered_us, state.transitions) for state in listener.states[1:]] == [
        (50_000, 0),
        (100_000, 1),
    ]
    assert len(listener.texts) == 1


def test_the_history_keeps_the_last_ten_with_the_values_of_their_guards():
    listener, reporter = make_reporter()

    class Odd:
        def __str__(self):
            raise ValueError("no words")

    values = (
        ("frame.d", 0.44),
        ("frame.a", inf),
        ("frame_seen", True),
        ("memory.count", np.float64(2.5)),
        ("memory.name", "x" * 200),
        ("memory.large", 10**5000),
        ("memory.odd", Odd()),
        ("memory.none", None),
    )
    for number in range(12):
        reporter.see(moment(number, transition=taken(number, values=values)))
    histories = listener.contents(DocumentKind.HISTORY)
    assert [len(history["transitions"]) for history in histories] == [*range(1, HISTORY), *[HISTORY] * 3]
    sent = histories[-1]["transitions"]
    assert [transition["time_us"] // 50_000 for transition in sent] == list(range(2, 12))
    assert sent[-1] == {
        "from": "red.turning",
        "to": "red.frame_visible",
        "time_us": 550_000,
        "when": "frame.d < 1",
        "values": [
            ["frame.d", 0.44],
            ["frame.a", None],
            ["frame_seen", True],
            ["memory.count", 2.5],
            ["memory.name", "x" * 80],
            ["memory.large", "int"],
            ["memory.odd", "Odd"],
            ["memory.none", None],
        ],
        "seconds": pytest.approx(0.55),
        "ids": ["red.turning/1"],
    }


def test_each_image_s_detections_are_sent_once_with_the_image_s_size():
    listener, reporter = make_reporter()
    first = Detections(red=Detection(10.0, -10.0, 20.0, -20.0, 1.5, 30.0), time_us=7)
    reporter.see(moment(0, detections=first))
    assert listener.detections == []  # the image's size was not known yet
    reporter.see_frame(CameraFrame(np.zeros((240, 320, 3), np.uint8), 7, 0.0))
    second = replace(first, time_us=None)
    for tick, seen in enumerate((first, first, second, second)):
        reporter.see(moment(tick, detections=seen))
    assert [(sent.time_us, sent.width_px, sent.height_px) for sent in listener.detections] == [
        (7, 320, 240),
        (None, 320, 240),
    ]
    assert listener.detections[0].red == (10.0, -10.0, 20.0, -20.0, 1.5, 30.0)
    assert listener.detections[0].blue == (-inf, inf, -inf, inf, inf, inf)
    reporter.see(moment(5, "landing.stop", detections=Detections()))
    assert len(listener.detections) == 2


def estimate(colour="red", position_m=(3.0, 2.0, 2.0), std_m=(0.02, 0.01, 0.03), yaw_rad=0.5):
    return GateEstimate(colour, position_m, yaw_rad, std_m, 0.1, False, True, 12, 0)


def test_the_navigator_s_map_is_sent_twice_a_second_when_it_has_changed():
    listener, reporter = make_reporter()
    first = NavigationView((estimate(),), ((0.0, 0.0, 1.0), (3.0, 2.0, 2.0)), "cross red")
    second = replace(first, goal="explore")
    for tick in range(40):
        reporter.see(moment(tick, navigation=None if tick < 5 else first if tick < 18 else second))
    sent = listener.contents(DocumentKind.MAP)
    assert [(each["time_us"] // 50_000, each["goal"]) for each in sent] == [(5, "cross red"), (18, "explore")]
    (mission,) = (each for each in listener.documents if each.kind == DocumentKind.MISSION)
    assert sent[0] == {
        "mission_crc": mission.crc,
        "time_us": 250_000,
        "goal": "cross red",
        "frames": [
            {
                **{"colour": "red", "p": [3.0, 2.0, 2.0], "yaw": 0.5, "std": [0.02, 0.01, 0.03]},
                **{"yaw_std": 0.1, "certain": True, "ambiguous": False, "views": 12, "size": [0.42, 0.22]},
            }
        ],
        "path": [[0.0, 0.0, 1.0], [3.0, 2.0, 2.0]],
        "place": None,
    }
    listener.sending = (DocumentKind.MAP,)
    reporter.see(moment(39, navigation=first))
    assert len(listener.contents(DocumentKind.MAP)) == 2
    listener.sending = ()
    for tick in range(40, 80):  # a map that changes at every tick
        reporter.see(moment(tick, navigation=replace(first, gates=(estimate(position_m=(tick, 0.0, 1.0)),))))
    assert [each["time_us"] // 50_000 for each in listener.contents(DocumentKind.MAP)[2:]] == [40, 50, 60, 70]


def test_a_large_map_is_thinned_and_unknown_numbers_are_null():
    listener, reporter = make_reporter()
    random = np.random.default_rng(1)
    places = [tuple(place) for place in random.normal(0.0, 3.0, (100, 3))]
    path = tuple((0.1 * number, 0.0, 1.0) for number in range(100))
    gates = (estimate(position_m=(nan, 0.0, 0.0)), *(estimate(position_m=place) for place in places))
    unknown = estimate(std_m=(inf, 0.1, 0.1))
    reporter.see(moment(0, navigation=NavigationView((unknown, *gates), path, "x" * 200)))
    (sent,) = listener.contents(DocumentKind.MAP)
    assert (len(sent["goal"]), sent["frames"][0]["std"]) == (80, None)
    assert len(sent["frames"]) == MAX_GATES
    assert sent["frames"][1]["p"] == pytest.approx(places[0], abs=0.001)
    assert len(sent["path"]) == MAX_POINTS
    assert (sent["path"][0], sent["path"][-1]) == ([0.0, 0.0, 1.0], [9.9, 0.0, 1.0])
    steps = np.diff([point[0] for point in sent["path"]])
    assert (steps.min(), steps.max()) == (pytest.approx(0.3), pytest.approx(0.4))


def test_a_usual_map_takes_a_few_pieces():
    random = np.random.default_rng(2)
    gates = tuple(
        estimate(colour, tuple(random.normal(0.0, 3.0, 3)), tuple(random.uniform(0.01, 1.0, 3)), 0.1 * number)
        for number, colour in enumerate(("red", "green", "blue", "yellow", "white"))
    )
    path = tuple(tuple(point) for point in np.cumsum(random.normal(0.0, 0.2, (MAX_POINTS, 3)), axis=0))
    view = NavigationView(gates, path, "look at green")
    _, pieces = split_document(DocumentKind.MAP, asdict(map_document(view)))
    assert len(pieces) <= 6  # 1.5 kB a second at most


async def test_the_result_is_sent_and_nothing_else_follows_until_it_is_sent():
    listener, reporter = make_reporter()
    result = {"seed": None, "verdict": "clean", "crossing_times_s": [1.5, 2.5], "total_time_s": 88.9}
    await reporter.send_result(FlightResult(**result))
    assert listener.contents(DocumentKind.RESULT) == [result]
    assert listener.farewells == [DocumentKind.RESULT]


async def test_a_result_that_cannot_be_sent_is_logged(caplog):
    listener, reporter = make_reporter()
    await reporter.send_result(FlightResult(verdict="clean", contact_frames=("x" * 200,) * 9000))
    assert listener.farewells == []
    assert "not reported: result document: 1827" in caplog.text


def test_a_fault_in_reporting_does_not_reach_the_flight(caplog):
    listener, reporter = make_reporter()
    listener.send_text = lambda text: 1 / 0
    sent = len(listener.states)
    with caplog.at_level(logging.WARNING):
        for tick in range(5):
            reporter.see(moment(tick))
    assert len(listener.states) == sent + 1
    assert [record.message.partition(":")[0] for record in caplog.records] == [
        "the mission is no longer reported"
    ]


async def test_a_whole_flight_is_reported_in_order():
    listener, reporter = make_reporter()
    drone = KinematicDrone(*START_1[:2], START_1[2])
    seen = []

    def observe(moment):
        seen.append((moment.state.time_us, moment.mission_state))
        reporter.see(moment)

    perception = GeometricPerception(drone, TEST_CASE_1)
    outcome = await fly_mission(drone, perception, MISSION, observer=observe)
    assert outcome.ended == "finished"
    changes = [now for now, before in zip(seen, [(0, ""), *seen], strict=False) if now[1] != before[1]]
    assert listener.texts == [f"mission: {state}" for _, state in changes]
    entered = {(state.entered_us, state.state_index) for state in listener.states[1:]}
    assert entered == {(time_us, LEAVES.index(state)) for time_us, state in changes}
    histories = listener.contents(DocumentKind.HISTORY)
    assert [history["transitions"][-1]["to"] for history in histories] == [state for _, state in changes[1:]]
    closing = next(last for h in histories if (last := h["transitions"][-1])["to"] == "red.frame_close")
    assert closing["values"][0][0] == "frame.d" and 0.3 < closing["values"][0][1] < 0.45
    gaps = np.diff([state.time_us for state in listener.states[1:]])
    assert gaps.max() <= 100_000
    assert listener.states[-1].finished and not listener.states[-1].flying
    assert len(seen) / 2 <= len(listener.states) <= len(seen) / 2 + 2 * len(changes) + 10


def test_a_history_of_long_guards_has_fewer_transitions_so_that_the_newest_arrives_at_once():
    listener, reporter = make_reporter()
    noise = np.random.default_rng(1).integers(33, 127, (12, 80))
    for number, letters in enumerate(noise):
        values = (("memory.text", "".join(map(chr, letters))),)
        reporter.see(moment(number, transition=taken(number, values=values)))
    last = listener.contents(DocumentKind.HISTORY)[-1]
    assert last["transitions"][-1]["time_us"] == 550_000
    assert 1 < len(last["transitions"]) < HISTORY
    assert len(split_document(DocumentKind.HISTORY, last)[1]) <= MAX_HISTORY_PIECES


async def test_what_the_guards_read_is_reported_twice_a_second_with_the_counts():
    listener, reporter = make_reporter()
    engine = MissionEngine(MISSION)
    imu, time_us = Imu(-3.0, -3.0, 0.53, 1.0), 0
    for tick in range(30):
        time_us = 50_000 * tick
        engine.tick(replace(imu, z=0.5 + 0.001 * tick), Detections(), time_us)
        reporter.see(moment(tick, engine.state, transition=engine.transition))
        await reporter.look(engine, DroneState(time_us, 0.0, 0.0, 0.0, 0.0))
    told = listener.contents(DocumentKind.GUARDS)
    assert [each["time_us"] for each in told] == [0, 500_000, 1_000_000]
    last = told[-1]
    assert last["counts"] == {"take_off.start/1": 1}
    assert last["guards"] == [["take_off.set_base/1", False]]
    assert last["values"] == [["distance_to_goal_m", 0.48, "m"]]
    listener.sending = (DocumentKind.GUARDS,)
    await reporter.look(engine, DroneState(9_000_000, 0.0, 0.0, 0.0, 0.0))
    assert len(listener.contents(DocumentKind.GUARDS)) == 3
