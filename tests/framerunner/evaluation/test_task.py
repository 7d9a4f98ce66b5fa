"""One flight of an evaluation: its row, and that its errors become rows too."""

import json
from dataclasses import replace

import pytest

from framerunner.evaluation import runner as runner_module
from framerunner.evaluation.rows import COLUMNS, EvaluationRow
from framerunner.evaluation.runner import fly_task, thinned
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.runs.track import Track
from offboard.mission import load_mission
from offboard.pilot_file import PilotFile
from tests.framerunner.evaluation.flights import made_row, short_scenario

BAIL = """
from offboard.pilot import Pilot

class Bail(BaseException):
    pass

class MyPilot(Pilot):
    def hover(self):
        {action}
"""


def task(seed=1, pilot=None):
    return FlightPlan(short_scenario(seed), load_mission("frame_challenge", pilot))


def test_a_row_has_the_result_s_fields_and_order():
    flight = task()
    result = fly_lockstep(flight).result
    row = fly_task(flight)
    assert tuple(result.as_json()) == COLUMNS
    assert json.loads(row.to_json()) == result.as_json()
    assert (row.verdict, row.completed, row.ended_in) == ("timed out", False, "take_off.set_base")
    assert row.traceback == ""


def test_a_row_of_an_older_version_can_be_read():
    told = json.loads(made_row("calm-1").to_json())
    for name in ("kept_in_box_s", "bound_s", "times_bound", "contact_times_s", "cause"):
        del told[name]
    assert EvaluationRow.model_validate_json(json.dumps(told)) == made_row("calm-1")


def test_the_row_of_a_failed_flight_has_a_thinned_track():
    flight = task()
    whole = fly_lockstep(flight).track
    track = fly_task(flight).track
    assert len(track) < len(whole) / 2
    assert (track.time_s[0], track.time_s[-1]) == (round(whole.time_s[0], 3), round(whole.time_s[-1], 3))


def test_a_row_is_read_back_from_json():
    row = made_row(seconds_in_state={"turning": 3.1999999999999997})
    assert EvaluationRow.model_validate_json(row.to_json()) == row
    for line in ("", "{}", "[]", "1", row.to_json()[:-1]):
        with pytest.raises(ValueError, match=r".*"):
            EvaluationRow.model_validate_json(line)


def test_a_fault_of_the_program_is_a_row_with_its_traceback():
    row = fly_task(replace(task(), scenario=short_scenario(1).model_copy(update={"airframe": "nonesuch"})))
    assert (row.scenario, row.verdict, row.ended) == ("calm-1", "error", "error")
    assert row.reason.startswith("AirframeError: ")
    assert row.ended_in == "AirframeError"
    assert "Traceback" in row.traceback and "fly_lockstep" in row.traceback


def test_a_contestant_s_code_may_raise_anything():
    for action in ("Bail('enough')", "SystemExit(3)", "KeyboardInterrupt"):  # the last is not the user's
        row = fly_task(task(pilot=PilotFile("bail.py", BAIL.format(action=f"raise {action}"))))
        assert row.verdict == "aborted"
        assert action.partition("(")[0] in row.reason


def test_a_number_that_is_not_finite_is_an_error_of_the_flight(monkeypatch):
    flight = task()
    monkeypatch.setattr("scenarios.referee.PENALTY_S_PER_S", float("nan"))
    row = fly_task(flight)
    assert row.verdict == "error"
    assert "penalty_s" in row.reason


def test_ctrl_c_is_raised(monkeypatch):
    flight = task()
    flown = fly_lockstep(flight)
    stopped = replace(flown, outcome=replace(flown.outcome, ended="aborted", reason="interrupted"))
    monkeypatch.setattr(runner_module, "fly_lockstep", lambda *_args, **_options: stopped)
    with pytest.raises(KeyboardInterrupt):
        fly_task(flight)


def test_thinning_keeps_both_ends_and_every_change_of_state():
    count = 100
    times = [number * 0.05 for number in range(count)]
    states = ["a"] * 33 + ["b"] * 1 + ["c"] * 66
    thin = thinned(Track(times, times, times, times, states))
    assert thin.time_s[0] == 0.0
    assert thin.time_s[-1] == 4.95
    assert len(thin) < 32
    assert list(thin.seconds_in_state()) == ["a", "b", "c"]
    assert thin.seconds_in_state() == pytest.approx(
        Track(times, times, times, times, states).seconds_in_state()
    )
    assert len(thinned(Track())) == 0
