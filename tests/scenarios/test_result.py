"""The result of a flight: what is written, what is read, and that its schema is the one in docs."""

import json
from math import inf, nan
from pathlib import Path

import jsonschema
import pytest
from pydantic import ValidationError

from scenarios.result import (
    MAX_RESULT_BYTES,
    FlightResult,
    RefereeReport,
    ResultError,
    Timing,
    json_schema,
)

SCHEMA = Path(__file__).parents[2] / "docs" / "result.schema.json"
LOCKSTEP = {
    "scenario": "calm-1",
    "mission": "frame_challenge",
    "seed": 3,
    "mission_class": "open",
    "verdict": "completed",
    "reason": "completed after 90.5 s in landing.stop; crossed: red, green, blue",
    "frames_crossed": ["red", "green", "blue"],
    "crossing_times_s": [20.5, 40.25, 60.125],
    "crossing_offsets_m": [0.01, 0.02, 0.03],
    "crossing_sides": ["front", "back", "front"],
    "goal_times_s": [],
    "contacts": 1,
    "contact_frames": ["red"],
    "contact_times_s": [35.5],
    "outside_s": 0.0,
    "try_time_s": 90.5,
    "penalty_s": 0.0,
    "total_time_s": 90.5,
    "landed_on_base": True,
    "landing_error_m": 0.02,
    "path_length_m": 30.25,
    "ignored_states": 0,
    "longest_gap_s": 0.004,
    "cause": "touched red at 35.5 s",
    "mission_state": "landing.stop",
    "ended": "finished",
    "seconds_in_state": {"turning": 10.5, "crossing": 3.1999999999999997},
    "kept_in_box_s": 0.0,
    "bound_s": 12.5,
    "times_bound": 7.24,
    "judged_by": "truth",
    "response": "",
    "autopilot": "",
    "faults": ["gps off at 12 s"],
    "fault_reaction": "after 5.96 s: Failsafe activated: position lost, descending",
    "fault_expected": "lands, after 6 s: Failsafe activated: position lost, descending",
    "fault_outcome": "as expected",
    "state_sha256": "0" * 64,
    "version": "0.1.0",
    "wall_time_s": 1.5,
    "real_time_factor": 60.0,
    "started": "2026-01-02T03:04:05+00:00",
}
TIMING = {
    "kept_up": True,
    "vehicle_time_waits": True,
    "speed": 1.0,
    "ticks": 1993,
    "late_ticks": 0,
    "late_share": 0.0,
    "late_images": 0,
    "late_setpoints": 0,
    "oldest_image_s": 0.125,
    "words": "",
}
SPECIAL = ("seed", "state_sha256", "landing_error_m")
REAL_TIME = {name: value for name, value in LOCKSTEP.items() if name not in SPECIAL}
REAL_TIME |= {"seed": None, "landing_error_m": None, "lift_m": 0.51, "timing": TIMING}


def test_the_schema_in_docs_is_that_of_the_type():
    assert SCHEMA.read_text(encoding="utf-8") == json_schema(), "write it again with `make result-schema`"


def test_every_field_of_the_schema_is_described():
    schema = json.loads(json_schema())
    parts = [schema, schema["$defs"]["Timing"]]
    assert all("description" in field for part in parts for field in part["properties"].values())
    assert schema["properties"]["try_time_s"]["unit"] == "s"


@pytest.mark.parametrize("told", [LOCKSTEP, REAL_TIME])
def test_a_result_is_written_as_it_was_read(told):
    jsonschema.validate(told, json.loads(json_schema()))
    result = FlightResult.parse(json.dumps(told))
    assert result.as_json() == told
    order = [name for name in FlightResult.model_fields if name in told]
    assert result.text() == json.dumps({name: told[name] for name in order}, indent=2) + "\n"


def test_a_result_of_an_older_version_is_read():
    later = ("kept_in_box_s", "bound_s", "times_bound")
    old = {name: value for name, value in LOCKSTEP.items() if name not in later}
    result = FlightResult.parse(json.dumps({**old, "forgotten": 1}))
    assert (result.kept_in_box_s, result.bound_s, result.times_bound) == (0.0, None, None)
    assert result.as_json() == old


def test_fields_added_later_are_written_in_order():
    wall = {"wall_time_s": 1.5, "real_time_factor": None, "started": "2026"}
    result = FlightResult(verdict="clean", timing=Timing(**TIMING)).model_copy(update=wall)
    assert list(result.as_json().items()) == [("verdict", "clean"), ("timing", TIMING), *wall.items()]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "Invalid JSON"),
        ("[]", "Input should be an object"),
        ("[" * 100_000, "Invalid JSON"),
        ("{}", "verdict: Field required"),
        ('{"verdict": "fine"}', "verdict: Input should be 'clean'"),
        ('{"verdict": "clean", "try_time_s": NaN}', "try_time_s: Input should be"),
        (" " * (MAX_RESULT_BYTES + 1), "larger than 1000000 bytes"),
    ],
)
def test_a_damaged_result_is_refused_in_one_line(text, words):
    with pytest.raises(ResultError) as refusal:
        FlightResult.parse(text)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_numbers_are_finite(value):
    with pytest.raises(ValidationError):
        FlightResult(verdict="clean", landing_error_m=value)


@pytest.mark.parametrize("value", [nan, inf, -1, "12", True, [], 10**400, {"a": nan}])
def test_invalid_values_are_left_out_of_a_received_report(value):
    told = RefereeReport.from_outside({"verdict": "clean", "contacts": value, "penalty_s": 1.5, "x": value})
    assert told.as_json() == {"verdict": "clean", "penalty_s": 1.5}


@pytest.mark.parametrize(
    "content", [None, [], "clean", {}, {"verdict": "fine"}, {"verdict": 3, "contacts": 1}]
)
def test_what_has_no_verdict_is_no_report(content):
    assert RefereeReport.from_outside(content) is None


def test_a_text_is_cut_and_has_no_half_characters():
    """An error in a contestant's code may have any text, and the result must be written all the same."""
    report = RefereeReport(verdict="aborted", reason="\ud800" + "x" * 10_000)
    assert report.reason == "?" + "x" * 1999


def test_times_by_colour():
    report = RefereeReport.from_outside(LOCKSTEP)
    assert report.times_s == {"red": 20.5, "green": 40.25, "blue": 60.125}
    assert RefereeReport.from_outside({**LOCKSTEP, "crossing_times_s": [1.0]}).times_s == {}
