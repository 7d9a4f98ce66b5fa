import random
from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.monitor.competition.rules import (
    Attempt,
    Correction,
    Rule,
    TryScore,
    choose,
    correct,
    counted_cs,
    crossed_in_order,
    rank,
    read_report,
)
from scenarios.result import RefereeReport

COLOURS = ("red", "green", "blue")
CASES = [("a", COLOURS), ("b", COLOURS), ("c", COLOURS)]
CLEAN = TryScore(COLOURS, COLOURS, 0, 0.0, 40.0, completed=True)

seconds = st.floats(0, 180).map(lambda value: round(value, 3))
subsets = st.sets(st.sampled_from(COLOURS)).map(lambda some: tuple(c for c in COLOURS if c in some))


@st.composite
def results(draw):
    crossed = draw(subsets)
    completed = crossed == COLOURS and draw(st.booleans())
    return TryScore(COLOURS, crossed, draw(st.integers(0, 9)), draw(seconds), draw(seconds), completed)


@st.composite
def rounds(draw):
    teams = {number: f"Team {number}" for number in range(draw(st.integers(1, 6)))}
    flown = draw(st.lists(st.tuples(st.integers(0, 5), st.sampled_from("abcx"), results()), max_size=20))
    attempts = [Attempt(team, name, order, result) for order, (team, name, result) in enumerate(flown)]
    return teams, attempts


def totals(teams, attempts):
    return {row.team: row.total_s for row in rank(teams, CASES, attempts, Rule())}


def test_a_total_is_the_sum_of_three():
    attempts = [
        Attempt(1, "a", 1, CLEAN),
        Attempt(1, "b", 2, replace(CLEAN, try_time_s=50.25, penalty_s=2.5)),
        Attempt(1, "c", 3, replace(CLEAN, crossed=("red",), completed=False, try_time_s=20.0)),
    ]
    (row,) = rank({1: "One"}, CASES, attempts, Rule())
    assert [cell.counted_s for cell in row.cells] == [40.0, 52.75, 180.0 + 120.0]
    assert row.total_s == 392.75


def test_what_was_not_flown_counts_as_if_all_gates_were_missing():
    assert totals({1: "One"}, []) == {1: 3 * 360.0}
    two = [("a", COLOURS[:2]), ("b", COLOURS)]
    (row,) = rank({1: "One"}, two, [], Rule())
    assert [cell.counted_s for cell in row.cells] == [300.0, 360.0, 360.0]  # the third is still to be drawn


def test_ties_share_a_rank_and_are_ordered_by_contacts_then_name():
    attempts = [Attempt(team, "a", team, replace(CLEAN, contacts=team == 1)) for team in (1, 2, 3)]
    rows = rank({1: "Alpha", 2: "zulu", 3: "Beta", 4: "Last"}, CASES, attempts, Rule())
    assert [(row.rank, row.name) for row in rows] == [(1, "Beta"), (1, "zulu"), (1, "Alpha"), (None, "Last")]


def test_times_that_look_the_same_are_a_tie():
    attempts = [Attempt(1, "a", 1, CLEAN), Attempt(2, "a", 2, replace(CLEAN, try_time_s=40.001))]
    assert [row.rank for row in rank({1: "One", 2: "Two"}, CASES, attempts, Rule())] == [1, 1]


def test_of_several_the_best_or_the_last_counts():
    attempts = [Attempt(1, "a", 1, CLEAN), Attempt(1, "a", 2, replace(CLEAN, try_time_s=60.0))]
    assert choose(attempts, Rule()).id == 1
    assert choose(attempts, Rule(counting="last")).id == 2
    assert choose([], Rule()) is None
    touched = [Attempt(1, "a", order, replace(CLEAN, contacts=3 - order)) for order in (1, 2)]
    assert choose(touched, Rule()).id == 2  # it counts the same and touched less


def test_the_rule_can_be_set():
    lost = replace(CLEAN, crossed=(), completed=False)
    assert counted_cs(lost, Rule(limit_s=100.0, missing_frame_s=10.0)) == 13000
    assert len(rank({1: "One"}, CASES, [], Rule(scenarios=2))[0].cells) == 2


@pytest.mark.parametrize(
    ("crossed", "counted"),
    [
        (["red", "green", "blue"], COLOURS),
        (["red", "blue", "green"], ("red", "green")),
        (["blue", "red"], ("red",)),
        (["red", "red", "mauve"], ("red",)),
        ([], ()),
    ],
)
def test_a_gate_crossed_too_early_is_missing(crossed, counted):
    assert crossed_in_order(crossed, COLOURS) == counted


@pytest.mark.parametrize("value", [nan, inf, -1, "12", None, True, [], 10**400])
@pytest.mark.parametrize("told", [{}, {"verdict": "clean"}])
def test_invalid_values_in_a_report_count_as_not_completed(value, told):
    report = dict.fromkeys(("contacts", "penalty_s", "try_time_s", "verdict", "frames_crossed"), value)
    result = read_report(RefereeReport.from_outside({**report, **told}), COLOURS)
    assert not result.completed
    assert 0 <= result.try_time_s <= 36000 and 0 <= result.penalty_s <= 36000 and 0 <= result.contacts <= 1000
    assert counted_cs(result, Rule()) == 36000


def test_a_verdict_without_its_gates_is_not_completed():
    report = RefereeReport(verdict="clean", frames_crossed=("red",))
    assert not read_report(report, COLOURS).completed
    assert read_report(report, ("red",)).completed


def test_a_correction_replaces_the_referees_values():
    corrected = correct(CLEAN, Correction(contacts=2, penalty_s=5.0))
    assert corrected == replace(CLEAN, contacts=2, penalty_s=5.0)
    assert correct(CLEAN, None) == correct(CLEAN, Correction()) == CLEAN
    assert not correct(CLEAN, Correction(crossed=("red",))).completed
    assert not correct(CLEAN, Correction(crossed=("red",), completed=True)).completed


@given(rounds(), st.randoms(use_true_random=False))
def test_the_order_of_tries_and_teams_changes_nothing(given_round, shuffler):
    teams, attempts = given_round
    mixed = list(attempts)
    shuffler.shuffle(mixed)
    entries = list(teams.items())
    shuffler.shuffle(entries)
    for rule in (Rule(), Rule(counting="last")):
        assert rank(teams, CASES, attempts, rule) == rank(dict(entries), CASES, mixed, rule)


@given(rounds())
def test_the_order_of_scenarios_changes_no_total(given_round):
    teams, attempts = given_round
    backwards = rank(teams, CASES[::-1], attempts, Rule())
    assert {row.team: row.total_s for row in backwards} == totals(teams, attempts)


@given(rounds())
def test_ranks_say_how_many_are_better(given_round):
    teams, attempts = given_round
    rows = rank(teams, CASES, attempts, Rule())
    assert sorted(row.team for row in rows) == sorted(teams)
    ranked = [row for row in rows if row.flown]
    assert list(rows[: len(ranked)]) == ranked
    for row in rows:
        better = sum(other.total_s < row.total_s for other in ranked)
        assert row.rank == (1 + better if row.flown else None)
        assert round(row.total_s * 100) == sum(round(cell.counted_s * 100) for cell in row.cells)


@given(rounds(), st.sampled_from("abc"), results())
def test_one_more_try_never_harms_where_the_best_counts(given_round, name, result):
    teams, attempts = given_round
    before = totals(teams, attempts)
    after = totals(teams, [*attempts, Attempt(0, name, len(attempts), result)])
    assert after[0] <= before[0]
    assert {team: after[team] for team in after if team} == {team: before[team] for team in before if team}


@given(results(), seconds, seconds)
def test_more_time_or_penalty_never_counts_less(result, time_s, penalty_s):
    more = replace(result, try_time_s=result.try_time_s + time_s, penalty_s=result.penalty_s + penalty_s)
    assert counted_cs(more, Rule()) >= counted_cs(result, Rule())


@given(results(), st.sampled_from(COLOURS))
def test_one_gate_fewer_never_counts_less(result, colour):
    fewer = tuple(each for each in result.crossed if each != colour)
    less = replace(result, crossed=fewer, completed=result.completed and fewer == result.crossed)
    if result.try_time_s + result.penalty_s <= 180:
        assert counted_cs(less, Rule()) >= counted_cs(result, Rule())


@given(seconds, seconds)
def test_completed_within_the_limit_is_never_worse_than_not_completed(time_s, penalty_s):
    completed = replace(CLEAN, try_time_s=time_s, penalty_s=min(penalty_s, 180 - time_s))
    assert counted_cs(completed, Rule()) <= counted_cs(replace(completed, completed=False), Rule())


@given(results(), results())
def test_a_full_correction_replaces_all_values_of_the_referee(referee, judged):
    everything = Correction(
        judged.crossed, judged.contacts, judged.penalty_s, judged.try_time_s, judged.completed
    )
    assert correct(referee, everything) == judged
    assert correct(correct(referee, everything), everything) == judged


def test_five_hundred_teams_are_ranked_quickly_and_correctly():
    chance = random.Random(1)
    attempts = [
        Attempt(team, name, team, replace(CLEAN, try_time_s=chance.uniform(20, 170)))
        for team in range(500)
        for name in "abc"
    ]
    rows = rank({team: str(team) for team in range(500)}, CASES, attempts, Rule())
    assert [row.total_s for row in rows] == sorted(row.total_s for row in rows)
