"""Rates, distributions and comparisons, against numbers from other sources."""

import math

import pytest

from framerunner.evaluation.compare import compare, mcnemar, mean_difference
from framerunner.evaluation.plan import Identity
from framerunner.evaluation.statistics import spread, summarise, wilson
from framerunner.evaluation.store import FLIGHTS, EvaluationFolder
from framerunner.evaluation.terminal import comparison_lines
from scenarios.verdict import Verdict
from tests.framerunner.evaluation.flights import made_row


def test_wilson_s_interval():
    rate = wilson(8, 10)
    z = 1.959963984540054
    middle = (0.8 + z * z / 20) / (1 + z * z / 10)
    half = z / (1 + z * z / 10) * math.sqrt(0.8 * 0.2 / 10 + z * z / 400)
    assert (rate.low, rate.high) == pytest.approx((middle - half, middle + half))
    assert str(rate) == "80.0 % (49.0 to 94.3)"
    assert (wilson(0, 5).low, wilson(5, 5).high) == pytest.approx((0.0, 1.0))
    assert wilson(0, 0).share == 0.0


def test_a_spread():
    assert spread([]) is None
    assert spread([2.5]).median == spread([2.5]).p10 == 2.5
    found = spread([float(number) for number in range(101)])
    assert (found.p10, found.median, found.p90, found.mean) == pytest.approx((10.0, 50.0, 90.0, 50.0))


def test_a_summary_counts_each_flight_where_it_belongs():
    rows = [
        made_row("a"),
        made_row("b", "completed", try_time_s=100.0, outside_s=0.5),
        made_row("c", "timed out"),
        made_row("d", "timed out", mission_state="red.turning"),
        made_row("e", "timed out"),
        made_row("f", Verdict.ERROR, reason="ValueError: no", frames_crossed=(), crossing_offsets_m=()),
    ]
    summary = summarise(rows)
    assert (summary.landed.count, summary.landed.total) == (2, 6)
    counts = {verdict: rate.count for verdict, rate in summary.verdicts.items()}
    assert list(counts.items()) == [("clean", 1), ("completed", 1), ("timed out", 3), ("error", 1)]
    assert summary.try_time_s.mean == 95.0
    assert {colour: offset.count for colour, offset in summary.offset_m.items()} == {
        "red": 5,
        "green": 2,
        "blue": 2,
    }
    assert (summary.penalised.count, summary.penalised.total) == (1, 5)
    assert summary.seconds_in_state == {"turning": 10.0, "crossing": 4.0}
    causes = [
        (cause.verdict, cause.ended_in, [row.scenario for row in cause.rows]) for cause in summary.causes
    ]
    assert causes == [
        ("timed out", "green.turning", ["c", "e"]),
        ("error", "ValueError", ["f"]),
        ("timed out", "red.turning", ["d"]),
        ("completed", "landing.stop", ["b"]),
    ]


def test_a_summary_of_failures_only():
    summary = summarise([made_row("a", Verdict.ERROR, reason="X", frames_crossed=(), crossing_offsets_m=())])
    assert (summary.try_time_s, summary.landing_error_m, summary.offset_m) == (None, None, {})
    assert summary.seconds_in_state == {}


def test_mcnemar_is_the_exact_binomial_test():
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(5, 5) == pytest.approx(1.0)
    assert mcnemar(6, 0) == pytest.approx(2 * 0.5**6)
    assert mcnemar(1, 8) == mcnemar(8, 1) == pytest.approx(2 * (1 + 9) / 2**9)


def test_a_mean_difference_has_student_s_interval():
    assert mean_difference([]) is None
    assert mean_difference([2.0]).low is None
    found = mean_difference([1.0, 2.0, 3.0])
    half = 4.302652729911275 * 1.0 / math.sqrt(3)
    assert (found.mean, found.low, found.high) == pytest.approx((2.0, 2.0 - half, 2.0 + half))


def folder(path, digests, *rows):
    identity = Identity(digests, "m", "", "Pilot", "", tuple(0 for _ in digests), "0.1.0", "")
    path.mkdir()
    (path / FLIGHTS).write_text("".join(row.to_json() + "\n" for row in rows), encoding="utf-8")
    return EvaluationFolder(path, identity, {row.scenario for row in rows})


def test_pairs_are_scenarios_with_the_same_content(tmp_path):
    before = folder(
        tmp_path / "before",
        {"a": "1", "b": "2", "c": "3", "d": "4", "old": "5", "e": "6"},
        made_row("a"),
        made_row("b", "timed out"),
        made_row("c", "completed"),
        made_row("d"),
        made_row("old"),
        made_row("e", "aborted", state_sha256="1" * 64),
    )
    after = folder(
        tmp_path / "after",
        {"a": "1", "b": "2", "c": "3", "d": "other", "e": "6", "new": "7"},
        made_row("a", "timed out", state_sha256="2" * 64),
        made_row("b", try_time_s=80.0, state_sha256="3" * 64),
        made_row("c", try_time_s=85.0, state_sha256="4" * 64),
        made_row("d"),
        made_row("e", "timed out", state_sha256="1" * 64),
        made_row("new"),
    )
    found = compare(before, after)
    assert [pair.after.scenario for pair in found.pairs] == ["a", "b", "c", "e"]
    assert [pair.after.scenario for pair in found.better] == ["b", "c"]
    assert [pair.after.scenario for pair in found.worse] == ["a"]
    assert (found.identical, found.won, found.lost, found.p_value) == (1, 1, 1, 1.0)
    assert (found.landed_before.count, found.landed_after.count) == (2, 2)
    assert (found.only_after, found.only_before) == (2, 2)
    assert (found.try_time_s.count, found.try_time_s.mean) == (1, -5.0)
    lines = comparison_lines(found)
    assert "better: b (timed out, now clean), c (completed, now clean)" in lines
    assert "worse: a (clean, now timed out)" in lines
    assert "1 of 4 flights are the same to the last bit" in lines
