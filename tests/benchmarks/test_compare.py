"""From what programs print to ratios, and what is refused on the way."""

import json
from dataclasses import asdict, replace

import pytest

from benchmarks.compare import (
    CONTENDERS,
    BadResultError,
    Comparison,
    Pair,
    best,
    check_flight,
    chosen,
    goals_along,
    minima,
    read_flight,
)
from benchmarks.peers.job import Box, Flight, Goal, GoalFollower, Job
from benchmarks.report import part_rows

FLIGHT = Flight("1.0", "500/250 Hz", "OpenCV", 20.0, 2.0, 2.1, 200, 40.0)
JOB = Job("", "test-case-1", 20.0, 10.0, goals=(Goal(0.0, (0.0, 0.0, 1.0), 0.0),))


def at_cost(processor_s):
    return replace(FLIGHT, processor_s=processor_s)


def printed(**changes):
    return json.dumps(asdict(FLIGHT) | changes)


def test_a_job_comes_out_as_it_went_in():
    job = replace(JOB, boxes=(Box((1.0, 2.0, 3.0), (0.1, 0.1, 0.1), 0.5, (1.0, 0.0, 0.0)),))
    again = Job.from_json(job.to_json())
    assert again.seconds == job.seconds
    assert list(again.boxes[0].centre_m) == [1.0, 2.0, 3.0]
    assert again.goals[0].time_s == 0.0


def test_a_flight_is_read_from_the_last_line_whatever_libraries_wrote_before():
    output = 'argv[0]=\n{"not": "this"}\n' + printed(path=[[0.0, 1.0, 2.0, 3.0, 0.5]]) + "\n\n"
    assert read_flight(output) == replace(FLIGHT, path=((0.0, 1.0, 2.0, 3.0, 0.5),))


@pytest.mark.parametrize(
    ("output", "complaint"),
    [
        ("", "ended without a result"),
        ("Segmentation fault", "ended without a result"),
        ("[1, 2]", "ended without a result"),
        ('{"version": "1.0"}', "incomplete"),
        (printed(colour="red"), "unknown fields: colour"),
        (printed(processor_s=0.0), "0.0 s of processor time"),
    ],
)
def test_what_is_no_flight_is_refused(output, complaint):
    with pytest.raises(BadResultError, match=complaint):
        read_flight(output)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"images": 150}, "150 images delivered instead of 200"),
        ({"contrast": 0.0}, "shows nothing"),
        ({"miss_m": 2.5}, "ended 2.5 m from where"),
    ],
)
def test_a_flight_that_did_not_do_the_job_is_refused(change, complaint):
    check_flight(FLIGHT, JOB)
    with pytest.raises(BadResultError, match=complaint):
        check_flight(replace(FLIGHT, **change), JOB)


def test_the_ratio_is_best_against_best_and_the_spread_is_of_the_pairs():
    contender = replace(CONTENDERS[0], target=5.0)
    pairs = tuple(Pair(at_cost(ours), at_cost(peer)) for ours, peer in [(2.0, 10.0), (1.0, 9.0), (1.5, 8.0)])
    comparison = Comparison(contender, pairs)
    assert comparison.ratio == pytest.approx(8.0)
    assert comparison.spread == pytest.approx((5.0, 9.0))
    assert comparison.reached
    assert not Comparison(replace(contender, target=8.5), pairs).reached


def test_cost_counts_by_the_second_of_flight():
    long = replace(FLIGHT, simulated_s=200.0, processor_s=10.0)
    assert best([at_cost(2.0), long]) is long


def test_a_path_becomes_steps_of_two_seconds_and_the_start_comes_first():
    path = tuple((0.5 * i, float(i), 0.0, 1.0, 0.1) for i in range(11))  # 5 s
    goals = goals_along(path)
    assert [goal.time_s for goal in goals] == [0.0, 0.0, 2.0]
    assert [goal.position_m[0] for goal in goals] == [0.0, 4.0, 8.0]
    follower = GoalFollower(goals)
    assert [follower.at(time_s).position_m[0] for time_s in (0.0, 1.9, 2.0, 9.0)] == [4.0, 4.0, 8.0, 8.0]


def test_peers_are_chosen_by_name():
    assert chosen("none") == ()
    assert {each.peer for each in chosen("pyflyt")} == {"pyflyt"}
    assert chosen("all") == CONTENDERS
    assert len({each.key for each in CONTENDERS}) == len(CONTENDERS)


def test_of_several_runs_the_minimum_counts_part_by_part():
    runs = [{"name": "a", "raw_s": 2.0, "step_s": 5.0}, {"name": "a", "raw_s": 3.0, "step_s": 4.0}]
    assert minima(runs) == {"name": "a", "raw_s": 2.0, "step_s": 4.0}


def test_parts_add_up_to_the_whole_flight():
    parts = {
        "raw_s": 4e-6,
        "step_s": 20e-6,
        "render_s": 300e-6,
        "detect_s": 100e-6,
        "flight_s": 1.6,
        "simulated_s": 100.0,
        "images_per_s": 10.0,
        "vision": "boxes",
    }
    rows = {row.name: row for row in part_rows(parts, 500.0)}
    whole = rows.pop("the whole challenge, a step")
    assert whole.cost_s == pytest.approx(32e-6)
    assert whole.runs == pytest.approx(8.0)
    assert whole.real_time == pytest.approx(62.5)
    assert sum(row.share for row in rows.values() if row.share is not None) == pytest.approx(1.0)
    assert rows["physics + autopilot, a step"].reached
    slow = {row.name: row for row in part_rows(parts | {"step_s": 41e-6}, 500.0)}
    assert slow["physics + autopilot, a step"].reached is False
