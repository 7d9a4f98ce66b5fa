"""The cause of a flight that was not clean: what happened, when, where, and what the navigator knew."""

from dataclasses import replace

import pytest

from framerunner.flying.cause import CauseWatch, Flown
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.runs.track import Track
from offboard.app import MissionEnd, Moment
from offboard.drone import DroneState, VelocityFluCommand
from offboard.mission import load_mission
from offboard.navigation.view import GateEstimate, NavigationView
from scenarios.loader import load_scenario
from scenarios.result import RefereeReport
from tests.framerunner.evaluation.flights import short_scenario
from vision.types import Detections

LAYOUT = load_scenario("test-case-1")  # red at (3, 2, 2) with yaw 3
RED = GateEstimate("red", (3.03, 2.0, 2.04), 3.1 - 3.14159, (0.1, 0.1, 0.1), 0.1, False, True, 9, 0)
TRACK = Track(
    [0.0, 10.0, 20.0, 30.0],
    [-3.0, 3.0, 5.5, 0.0],
    [-3.0, 2.0, 0.0, 0.0],
    [0.5, 2.0, 2.0, 1.0],
    ["take_off", "red.crossing", "red.crossing", "green.search"],
)
TRACK_COLUMNS = (TRACK.time_s, TRACK.x, TRACK.y, TRACK.z)
BEGAN_US = 1_000_000


def words(report, ended="finished", reason="", views=(), **paths):
    watch = CauseWatch()
    for time_s, view in views:
        state = DroneState(BEGAN_US + round(time_s * 1e6), 0.0, 0.0, 0.0, 0.0)
        watch.see(Moment(state, VelocityFluCommand(), Detections(), "", 1.0, navigation=view))
    end = MissionEnd(ended, reason, "green.search", 30.0, 600)
    return watch.words(Flown(LAYOUT, RefereeReport(**report), end, replace(TRACK, **paths), BEGAN_US))


def touched(*names, **values):
    times_s = tuple(10.0 + number for number in range(len(names)))
    facts = {"contacts": len(names), "contact_frames": names, "contact_times_s": times_s}
    return {"verdict": "completed", **facts, **values}


@pytest.mark.parametrize(
    ("report", "ended", "views", "expected"),
    [
        ({"verdict": "clean"}, "finished", (), ""),
        (touched("pole"), "finished", (), "touched pole at 10.0 s in red.crossing at (3.00, 2.00, 2.00)"),
        (
            touched("red", "wall", "wall"),
            "finished",
            [(5.0, NavigationView((RED,))), (15.0, NavigationView())],
            "touched red at 10.0 s in red.crossing at (3.00, 2.00, 2.00), which the map had 5.0 cm and "
            "5.7° off, then 2 more contacts",
        ),
        (
            touched("red"),
            "finished",
            [(5.0, NavigationView())],
            "touched red at 10.0 s in red.crossing at (3.00, 2.00, 2.00), which was not on the map",
        ),
        (
            {"verdict": "completed", "outside_s": 1.5},
            "finished",
            (),
            "outside the arena for 1.50 s, first at 20.0 s in red.crossing at (5.50, 0.00, 2.00)",
        ),
        (
            {"verdict": "wrong order", "frames_crossed": ("red", "blue"), "crossing_times_s": (9.0, 20.0)},
            "finished",
            (),
            "crossed blue before green at 20.0 s in red.crossing at (5.50, 0.00, 2.00)",
        ),
        (
            {"verdict": "timed out", "frames_crossed": ("red",), "crossing_times_s": (9.0,)},
            "timed out",
            [(5.0, NavigationView((RED,)))],
            "in green.search for the last 0 s; green was never on the map",
        ),
        (
            {"verdict": "timed out"},
            "timed out",
            [
                (5.0, NavigationView((RED,), trouble="red: lost from the map")),
                (6.0, NavigationView((RED,))),
                (7.0, NavigationView((RED,), trouble="red: no path: obstacles block the way")),
            ],
            "in green.search for the last 0 s; last trouble of the navigator: red: no path: obstacles block "
            "the way (2 times in trouble)",
        ),
        ({"verdict": "aborted"}, "aborted", (), "the camera is lost"),
        ({"verdict": "clean"}, "aborted", (), "the mission was broken off: the camera is lost"),
        (
            {"verdict": "crashed", "try_time_s": 20.0},
            "aborted",
            (),
            "crashed at 20.0 s in red.crossing at (5.50, 0.00, 2.00)",
        ),
    ],
)
def test_the_cause_is_one_line(report, ended, views, expected):
    assert words(report, ended, "the camera is lost" if ended == "aborted" else "", views) == expected


def test_a_place_that_was_off_is_the_cause_rather_than_the_map():
    """The drone believes to be at (3, 2, 2), and is 40 cm beside that; so is all that it has seen."""
    true_path = [(t, x, y - 0.4, z) for t, x, y, z in zip(*TRACK_COLUMNS, strict=True)]
    seen = replace(RED, position_m=(3.0, 2.43, 2.0))
    drifted = words(touched("red"), views=[(5.0, NavigationView((seen,)))], true_path=true_path)
    assert drifted == (
        "touched red at 10.0 s in red.crossing at (3.00, 1.60, 2.00), the place being off by 40 cm, and from "
        "there the map had red 3.0 cm and 5.7° off"
    )
    crashed = words({"verdict": "crashed", "try_time_s": 20.0}, true_path=true_path)
    assert crashed.endswith("at (5.50, -0.40, 2.00), the place being off by 40 cm")


def test_certain_gates_that_are_none_are_counted():
    def count(*gates, layout=LAYOUT, **paths):
        watch = CauseWatch()
        for number, gate in enumerate(gates):
            state = DroneState(BEGAN_US + number * 1_000_000, 0.0, 0.0, 0.0, 0.0)
            view = NavigationView((gate,))
            watch.see(Moment(state, VelocityFluCommand(), Detections(), "", 1.0, navigation=view))
        end, report = MissionEnd("finished", "", "green.search", 30.0, 600), RefereeReport(verdict="clean")
        return watch.false_gates(Flown(layout, report, end, replace(TRACK, **paths), BEGAN_US))

    true, other = replace(RED, certain=True), replace(RED, certain=True, position_m=(3.0, 0.0, 2.0))
    assert count() is None
    assert count(true, replace(other, certain=False)) == 0
    assert count(true, other, replace(other, position_m=(3.0, 0.3, 2.0))) == 1  # the same one, moved
    assert count(other, replace(true, colour="blue")) == 2
    crowded = load_scenario("crowded-17")
    decoy = crowded.decoys[0]
    assert count(replace(true, colour=decoy.colour, position_m=decoy.position_arena_m), layout=crowded) == 0
    off_m = 1.5  # the drone takes itself to be farther to the right, and so the gate
    moved = [(time_s, x, y - off_m, z) for time_s, x, y, z in zip(*TRACK_COLUMNS, strict=True)]
    seen = replace(true, position_m=(3.0, 2.0 - off_m, 2.0))
    assert count(seen) == 1
    assert count(seen, true_path=list(zip(*TRACK_COLUMNS, strict=True)), estimated_path=moved) == 0


def test_an_estimated_place_counts_before_the_reported_one():
    true_path = [(t, x, y - 0.4, z) for t, x, y, z in zip(*TRACK_COLUMNS, strict=True)]
    estimated = [(t, x, y + 0.02, z) for t, x, y, z in true_path]
    seen = replace(RED, position_m=(3.0, 2.03, 2.0))
    told = words(
        touched("red"), views=[(5.0, NavigationView((seen,)))], true_path=true_path, estimated_path=estimated
    )
    assert told.endswith("at (3.00, 1.60, 2.00), which the map had 3.0 cm and 5.7° off")


def test_a_result_says_why_it_was_not_clean():
    flown = fly_lockstep(FlightPlan(short_scenario(1, 3.0), load_mission("explorer")))
    assert flown.result.cause.startswith("in ")
    assert "was never on the map" in flown.result.cause or "for the last" in flown.result.cause


def test_an_operators_stop_is_a_cause_of_a_crash():
    stop = "stopped by the operator; the operator stopped the motors"
    assert words({"verdict": "crashed", "try_time_s": 20.0}, "aborted", stop, ()).endswith(f"; {stop}")
