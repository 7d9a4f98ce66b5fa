"""TUNNEL messages of an app become messages for the pages."""

from math import inf, nan

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.monitor.vehicle.mission import MissionView
from framerunner.wire.mission_tunnel import (
    DETECTIONS_TYPE,
    DOCUMENT_TYPE,
    STATE_TYPE,
    DocumentKind,
    MissionDetections,
    MissionState,
    encode_detections,
    encode_state,
    split_document,
)
from scenarios.result import FlightResult

CHART = {
    "name": "race <b>",
    "description": "",
    "scenario": "s",
    "states": ["red.seek", "red.cross"],
    "mermaid": "stateDiagram-v2",
    "source": "states: {}",
}
COMMAND = (0.5, 0.0, -0.25, 0.125)


def tunnel(kind, payload):
    padded = list(payload) + [0] * (128 - len(payload))
    return mavlink.MAVLink_tunnel_message(0, 0, kind, len(payload), padded)


def state(crc=0, index=1, *, flying=True, paused=False, command=COMMAND, time_us=9_000_000):
    told = MissionState(
        crc, index, 3, time_us, 7_500_000, flying, paused, False, command, (1.0, 2.0, 3.0, 0.5)
    )
    return tunnel(STATE_TYPE, encode_state(told))


def documents(kind, content):
    crc, pieces = split_document(kind, content)
    return crc, [tunnel(DOCUMENT_TYPE, piece) for piece in pieces]


@pytest.fixture
def view():
    view = MissionView(1)
    crc, pieces = documents(DocumentKind.MISSION, CHART)
    (chart,) = [told for piece in pieces for told in view.take(piece, 10.0)]
    assert chart == {
        "kind": "chart",
        "id": 1,
        **{key: CHART[key] for key in ("name", "mermaid", "states", "source")},
    }
    view.take(state(crc), 10.0)
    return view


def test_the_status_names_the_state_and_counts_its_seconds(view):
    assert view.as_dict(9_500_000, 10.1) == {
        "name": "race <b>",
        "state": "red.cross",
        "seconds": 2.0,
        "transitions": 3,
        "paused": False,
        "flying": True,
        "finished": False,
        "alive": True,
    }
    assert view.state_index(10.1) == 1
    assert view.command(10.1) == [0.5, 0.0, -0.25, 0.125]


def test_after_two_seconds_of_silence_the_app_is_not_alive(view):
    assert view.as_dict(20_000_000, 12.1)["alive"] is False
    assert view.as_dict(20_000_000, 12.1)["seconds"] == 1.5
    assert (view.command(12.1), view.state_index(12.1)) == (None, -1)


@pytest.mark.parametrize(
    "told",
    [state(paused=True), state(flying=False), state(command=(nan, 0, 0, 0)), state(command=(inf,) * 4)],
)
def test_there_is_no_command_while_the_app_does_not_fly(view, told):
    view.take(told, 10.0)
    assert view.command(10.1) is None


def test_a_state_of_another_mission_has_no_name(view):
    view.take(state(crc=1), 10.0)
    assert view.as_dict(0, 10.0)["state"] == ""
    view.take(state(view._document_crc, index=99), 10.0)
    assert view.as_dict(0, 10.0)["state"] == ""


def test_transitions_are_listed_newest_first(view):
    taken = [
        {
            "from": f"s{number}",
            "to": f"s{number + 1}",
            "time_us": number * 1_000_000,
            "when": "frame.d < 1",
            "values": [["frame.d", 0.44], ["frame.seen", True], ["frame.a", None]],
            "seconds": 1.5,
            "ids": [f"s{number}/2", f"s{number}/then"],
        }
        for number in range(3)
    ]
    _, pieces = documents(DocumentKind.HISTORY, {"transitions": taken})
    (told,) = [message for piece in pieces for message in view.take(piece, 10.0)]
    assert [each["time_s"] for each in told["list"]] == [2.0, 1.0, 0.0]
    assert told["list"][0] == {
        "time_s": 2.0,
        "from": "s2",
        "to": "s3",
        "when": "frame.d < 1",
        "values": [["frame.d", 0.44], ["frame.seen", True], ["frame.a", None]],
        "seconds": 1.5,
        "ids": ["s2/2", "s2/then"],
    }
    assert told["list"][0]["values"][1][1] is True
    assert [message["kind"] for message in view.standing()] == ["chart", "transitions"]


def test_detections_distinguish_not_seen_and_not_known(view):
    seen = MissionDetections(1_500_000, 320, 240, red=(10.0, -10.0, 20.0, -20.0, 1.25, inf))
    (told,) = view.take(tunnel(DETECTIONS_TYPE, encode_detections(seen)), 10.0)
    assert told == {
        "kind": "detections",
        "id": 1,
        "t": 1.5,
        "width": 320,
        "height": 240,
        "boxes": {"red": [10.0, -10.0, 20.0, -20.0, 1.25, None], "green": None, "blue": None},
    }


MAPPED = {"colour": "red", "p": [3.0, 2.0, 2.0], "yaw": 0.5, "std": [0.02, 0.01, 0.03], "yaw_std": 0.1}
MAPPED |= {"certain": True, "ambiguous": False, "views": 12, "size": [1.2, 0.5]}


def map_of(view, **content):
    """Messages that follow from a MAP document."""
    _, pieces = documents(DocumentKind.MAP, content)
    return [message for piece in pieces for message in view.take(piece, 10.0)]


def test_the_map_of_another_mission_is_forgotten(view):
    place = {"p": [1.0, 2.0, 0.5], "yaw": 0.25, "std": [0.2, 0.1, 0.05], "yaw_std": 0.03}
    known = {
        "goal": "cross red",
        "frames": [MAPPED],
        "path": [[0.0, 0.0, 1.0], [3.0, 2.0, 2.0]],
        "place": place,
    }
    (told,) = map_of(view, mission_crc=view._document_crc, time_us=9_250_000, **known)
    assert told == {"kind": "map", "id": 1, "t": 9.25, **known}
    assert view.take(state(view._document_crc), 10.0) == []
    assert view.standing()[-1] == told
    (empty,) = view.take(state(crc=1), 10.0)
    assert empty == {"kind": "map", "id": 1, "t": 0.0, "goal": "", "frames": [], "path": [], "place": None}
    assert [message["kind"] for message in view.standing()] == ["chart"]


@pytest.mark.parametrize(
    "content",
    [
        {"frames": [{**MAPPED, "p": [1e9, 0, 0]}]},
        {"frames": [{**MAPPED, "p": [0, None, 0]}]},
        {"frames": [{**MAPPED, "std": [-1, 0, 0]}]},
        {"frames": [{**MAPPED, "colour": "x" * 81}]},
        {"frames": [{**MAPPED, "size": [0, 1]}]},
        {"frames": [MAPPED] * 51},
        {"path": [[0, 0, 0]] * 101},
        {"path": [[0, 0]]},
        {"goal": {"a": 1}},
        {"time_us": -1},
    ],
)
def test_an_invalid_map_is_reported_and_the_last_one_stays(view, content):
    (told,) = map_of(view, frames=[MAPPED])
    assert map_of(view, **content) == []
    assert view.problem.startswith("map document: ")
    assert view.standing()[-1] == told


def test_a_result_is_kept_with_its_crc(view):
    crc, pieces = documents(DocumentKind.RESULT, {"verdict": "clean", "try_time_s": 40.5})
    for piece in pieces:
        assert view.take(piece, 10.0) == []
    assert view.result == (crc, FlightResult(verdict="clean", try_time_s=40.5))


@pytest.mark.parametrize(
    ("kind", "payload"),
    [
        (STATE_TYPE, b""),
        (STATE_TYPE, b"\x02" * 58),
        (DETECTIONS_TYPE, b"\x01"),
        (DOCUMENT_TYPE, b"\xff" * 128),
        (0x8F13, b"\x01\x02"),
    ],
)
def test_invalid_payloads_are_ignored(view, kind, payload):
    assert view.take(tunnel(kind, payload), 10.0) == []
    assert view.as_dict(9_500_000, 10.1)["state"] == "red.cross"


@pytest.mark.parametrize(
    "content",
    [
        {"transitions": 5},
        {"transitions": [{"from": ["x"]}]},
        {"transitions": [{"time_us": -1}]},
        {"transitions": [{"values": [["a", {"b": 1}]]}]},
    ],
)
def test_an_invalid_history_is_reported(view, content):
    _, pieces = documents(DocumentKind.HISTORY, content)
    assert [message for piece in pieces for message in view.take(piece, 10.0)] == []
    assert view.problem.startswith("history document: transitions")


def test_numbers_that_are_not_finite_are_left_out(view):
    told = {"verdict": "clean", "a": [{"b": inf}], "total_time_s": nan, "seconds_in_state": {"c": inf}}
    _, pieces = documents(DocumentKind.RESULT, told)
    for piece in pieces:
        view.take(piece, 10.0)
    assert view.result[1].as_json() == {"verdict": "clean"}


def test_a_result_without_a_verdict_is_refused(view):
    _, pieces = documents(DocumentKind.RESULT, {"try_time_s": 40.5})
    for piece in pieces:
        view.take(piece, 10.0)
    assert view.result is None
    assert view.problem == "result document: it has no verdict"


def test_what_the_guards_read_is_told_until_another_mission_is_flown(view):
    crc = view._document_crc
    content = {
        "mission_crc": crc,
        "time_us": 1_500_000,
        "counts": {"red.turning/1": 2},
        "guards": [["red.turning/1", False], ["red.turning/2", None]],
        "values": [["frame.d", 0.44, "m"], ["frame_seen", True, ""], ["memory.x", None, ""]],
    }
    _, pieces = documents(DocumentKind.GUARDS, content)
    (told,) = [message for piece in pieces for message in view.take(piece, 10.0)]
    assert told == {
        "kind": "guards",
        "id": 1,
        "time_s": 1.5,
        "counts": {"red.turning/1": 2},
        "guards": [{"id": "red.turning/1", "holds": False}, {"id": "red.turning/2", "holds": None}],
        "values": [
            {"name": "frame.d", "value": 0.44, "unit": "m"},
            {"name": "frame_seen", "value": True, "unit": ""},
            {"name": "memory.x", "value": None, "unit": ""},
        ],
    }
    assert told in view.standing()
    (empty,) = view.take(state(crc + 1), 11.0)
    assert (empty["kind"], empty["guards"], empty["counts"]) == ("guards", [], {})
    assert all(message["kind"] != "guards" for message in view.standing())
