"""What is stored of a contest, in SQLite and, where a server is given, in PostgreSQL."""

from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from math import inf, nan

import pytest

from framerunner.monitor.competition import tables
from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import Database
from framerunner.monitor.competition.rules import Correction, Rule
from framerunner.monitor.competition.store import MAX_JUDGEMENTS, MAX_TEAMS, Store
from framerunner.monitor.competition.validation import RefusedError
from framerunner.monitor.competition.views import RuleView
from tests.framerunner.monitor.competition.harness import COLOURS, event

NOW = datetime(2030, 5, 17, 12, 0, tzinfo=UTC)
ADA = Entry("Ada", NOW)
BOB = Entry("Bob", NOW + timedelta(minutes=1))


def fly(store, key, name="case-1", **values):
    store.take(event("began", key, name, time_s=0.0), COLOURS, NOW)
    return store.take(event("ended", key, name, **values), COLOURS, NOW + timedelta(seconds=50))


def row_of(store, team, number=0):
    return next(row for row in store.board().rankings[number].rows if row.team == team)


def test_a_try_of_the_team_that_was_called_is_judged_by_itself(store):
    team = store.add_team("Falken", "Ann, Bo", ADA)
    store.call(team, "case-1", ADA)
    number = store.take(event("began", "k", time_s=0.0), COLOURS, NOW)
    (running,) = store.board().tries
    assert (running.id, running.state, running.team, running.judged) == (number, "running", team, False)
    store.take(event("running", "k", time_s=12.5, crossed=("red",)), COLOURS, NOW)
    assert store.board().tries[0].result.try_time_s == 12.5
    store.take(event("ended", "k", time_s=41.23, penalty_s=2.0), COLOURS, NOW + timedelta(seconds=42))
    board = store.board()
    (ended,) = board.tries
    assert (ended.state, ended.judged, ended.team_name, ended.attempt) == ("ended", True, "Falken", 1)
    assert (ended.started, ended.ended) == (NOW, NOW + timedelta(seconds=42))
    assert (ended.result.total_s, ended.result.counted_s) == (43.23, 43.23)
    assert board.rankings[0].rows[0].total_s == 43.23 + 2 * 360
    assert board.called is None  # used up


def test_a_call_for_another_scenario_is_left_alone(store):
    team = store.add_team("Falken", "", ADA)
    store.call(team, "case-2", ADA)
    fly(store, "k", "case-1")
    board = store.board()
    assert board.tries[0].team is None
    assert board.called is not None and board.called.team == team


def test_a_call_is_for_one_drone_and_stays_after_a_try_that_did_not_move(store):
    team = store.add_team("Falken", "", ADA)
    store.call(team, "", ADA)
    store.take(event("began", "first", time_s=0.0), COLOURS, NOW)
    store.take(event("began", "second", drone_id=2, time_s=0.0), COLOURS, NOW)
    assert [each.team for each in store.board().tries] == [None, team]
    store.take(event("ended", "first", verdict="aborted", crossed=(), path_m=0.0), COLOURS, NOW)
    assert store.board().called is not None
    store.take(event("ended", "second"), COLOURS, NOW)
    assert store.board().called is not None  # it had no team
    fly(store, "third")
    assert store.board().called is None


def test_the_final_result_replaces_the_first_and_late_events_are_ignored(store):
    fly(store, "k", time_s=40.0)
    store.take(event("ended", "k", time_s=40.02, final=True), COLOURS, NOW)
    store.take(event("ended", "k", time_s=55.0), COLOURS, NOW)
    store.take(event("running", "k", time_s=13.0), COLOURS, NOW)
    (each,) = store.board().tries
    assert (each.state, each.final, each.result.try_time_s) == ("ended", True, 40.02)


def test_a_correction_stays_valid_after_a_final_result(store):
    number = fly(store, "k", time_s=40.0)
    store.correct(number, 0, Correction(contacts=2), "touched red", ADA)
    store.take(event("ended", "k", time_s=40.5, contacts=0, final=True), COLOURS, NOW)
    (each,) = store.board().tries
    assert (each.result.contacts, each.result.try_time_s) == (2, 40.5)
    assert (each.referee.contacts, each.corrected_by, each.judgements) == (0, "Ada", 1)


def test_every_change_is_kept_with_who_and_when(store):
    team = store.add_team("Falken", "", ADA)
    number = fly(store, "k")
    store.assign(number, 0, team, ADA)
    store.correct(number, 1, Correction(crossed=("red",), completed=False), "<b>bold</b>\nsecond line", BOB)
    store.correct(number, 2, Correction(), "", ADA)
    history = store.detail(number).history
    assert [(entry.number, entry.kind, entry.who, entry.at) for entry in history] == [
        (3, "correction", "Ada", ADA.at),
        (2, "correction", "Bob", BOB.at),
        (1, "team", "Ada", ADA.at),
    ]
    assert history[1].crossed == ("red",) and history[1].remarks == "<b>bold</b>\nsecond line"
    assert history[2].team_name == "Falken"
    assert store.board().tries[0].result.completed  # the last says: as the referee says


def test_the_first_of_two_judges_wins(store):
    number = fly(store, "k")
    store.correct(number, 0, Correction(contacts=1), "", ADA)
    for change in (
        lambda: store.correct(number, 0, Correction(contacts=5), "", BOB),
        lambda: store.assign(number, 0, None, BOB),
    ):
        with pytest.raises(RefusedError, match="another judge") as refusal:
            change()
        assert refusal.value.status == 409
    assert store.board().tries[0].result.contacts == 1


def test_two_servers_cannot_write_the_same_judgement(database_url):
    one, other = Store(Database(database_url)), Store(Database(database_url))
    number = fly(one, "k")
    one.correct(number, 0, Correction(contacts=1), "", ADA)
    with pytest.raises(RefusedError, match="another judge"):
        other.correct(number, 0, Correction(contacts=2), "", BOB)
    one.add_team("Falken", "", ADA)
    with pytest.raises(RefusedError, match="taken"):
        other.add_team("FALKEN", "", BOB)
    one.close()
    other.close()


@pytest.mark.parametrize(
    ("correction", "words"),
    [
        (Correction(crossed=("mauve",)), "crossed .*mauve.* red, green, blue"),
        (Correction(crossed=("red",), completed=True), "completed true contradicts .* green, blue"),
    ],
)
def test_contradictions_are_refused(store, correction, words):
    number = fly(store, "k")
    with pytest.raises(RefusedError, match=words):
        store.correct(number, 0, correction, "", ADA)
    assert store.detail(number).history == ()


def test_a_try_can_be_completed_by_a_judge_who_saw_it(store):
    number = fly(store, "k", verdict="aborted", crossed=("red", "green"), time_s=50.0)
    assert store.board().tries[0].result.counted_s == 240.0
    store.correct(number, 0, Correction(crossed=COLOURS, completed=True, penalty_s=1.5), "", ADA)
    assert store.board().tries[0].result.counted_s == 51.5


def test_team_names_are_unique_ignoring_case_and_teams_are_limited(store, monkeypatch):
    first = store.add_team("Falken", "", ADA)
    for name in ("falken", "FALKEN ", "Fal\u200bken"):
        with pytest.raises(RefusedError, match="taken"):
            store.add_team(name, "", ADA)
    second = store.add_team("Adler", "", ADA)
    with pytest.raises(RefusedError, match="taken"):
        store.change_team(second, "FALKEN", None, None, ADA)
    store.change_team(first, "FALKEN", None, None, ADA)  # its own
    assert MAX_TEAMS == 500
    monkeypatch.setattr("framerunner.monitor.competition.store.MAX_TEAMS", 3)
    store.add_team("Third", "", ADA)
    with pytest.raises(RefusedError, match="3 teams is the limit"):
        store.add_team("One more", "", ADA)
    assert len(store.board().teams) == 3


def test_a_team_that_is_withdrawn_is_not_ranked_and_not_called(store):
    team = store.add_team("Falken", "", ADA)
    store.change_team(team, None, None, True, ADA)
    board = store.board()
    assert board.rankings[0].rows == () and board.teams[0].withdrawn
    with pytest.raises(RefusedError, match="withdrawn"):
        store.call(team, "", ADA)
    store.change_team(team, None, "Ann", False, ADA)
    assert row_of(store, team).name == "Falken"


def test_a_round_is_drawn_again_until_a_try_is_flown_in_it(store):
    team = store.add_team("Falken", "", ADA)
    three = dict.fromkeys(("case-1", "case-2", "case-3"), COLOURS)
    assert store.board().round == 0
    assert store.draw(three, [*three, "case-4"], ADA) == 1
    assert store.draw({"case-4": COLOURS[:2], **three}, [*three, "case-4"], BOB) == 1
    store.call(team, "", ADA)
    fly(store, "k", "case-2")
    assert store.draw(three, list(three), ADA) == 2
    board = store.board()
    assert (board.round, [ranking.round for ranking in board.rankings]) == (2, [2, 1])
    assert [cell.counted_s for cell in row_of(store, team, 0).cells] == [360.0] * 3
    assert [cell.scenario for cell in row_of(store, team, 1).cells] == ["case-4", "case-1", "case-2"]
    assert [cell.counted_s for cell in row_of(store, team, 1).cells] == [300.0, 360.0, 40.0]
    assert board.draws[1].who == "Bob" and board.draws[1].pool == ("case-1", "case-2", "case-3", "case-4")
    assert board.draws[0].commands[0] == "framerunner fly case-1"


def test_without_a_draw_what_is_flown_makes_the_round(store):
    team = store.add_team("Falken", "", ADA)
    for number, name in enumerate(("case-2", "case-1", "case-2", "case-3", "case-4")):
        store.call(team, "", ADA)
        fly(store, str(number), name)
    assert store.board().rankings[0].scenarios == ("case-2", "case-1", "case-3")


def test_the_rule_is_kept_and_changes_the_ranking(store):
    team = store.add_team("Falken", "", ADA)
    assert store.board().rule == RuleView(**asdict(Rule()), who="", at=None)
    rule = Rule(100.0, 10.0, 2, "last")
    store.set_rule(rule, BOB)
    assert store.board().rule == RuleView(**asdict(rule), who="Bob", at=BOB.at)
    assert row_of(store, team).total_s == 2 * 130.0


def test_a_try_that_ran_when_the_monitor_stopped_is_to_be_judged_by_hand(store):
    team = store.add_team("Falken", "", ADA)
    store.call(team, "", ADA)
    number = store.take(event("began", "k", time_s=0.0), COLOURS, NOW)
    store.take(event("running", "k", time_s=17.0, crossed=("red",)), COLOURS, NOW)
    assert store.interrupt() == 1
    (each,) = store.board().tries
    assert (each.state, each.judged, row_of(store, team).flown) == ("interrupted", False, 0)
    store.correct(number, 0, Correction(), "fell down", ADA)
    (each,) = store.board().tries
    assert each.judged and row_of(store, team).cells[0].counted_s == 300.0
    assert store.interrupt() == 0


def test_an_interrupted_try_continues_with_the_next_event(store):
    store.take(event("began", "k", time_s=0.0), COLOURS, NOW)
    store.interrupt()
    store.take(event("running", "k", time_s=17.0), COLOURS, NOW)
    assert store.board().tries[0].state == "running"
    store.take(event("ended", "k"), COLOURS, NOW)
    assert store.board().tries[0].judged


def test_everything_is_there_after_reopening(database_url):
    store = Store(Database(database_url))
    team = store.add_team("الصقور 🚁", "", ADA)
    store.call(team, "", ADA)
    number = fly(store, "k")
    store.correct(number, 0, Correction(contacts=3), "ö\nü", ADA)
    store.set_rule(Rule(limit_s=90.0), ADA)
    before = store.board()
    store.close()
    again = Store(Database(database_url))
    assert again.board() == before
    assert again.detail(number).history[0].remarks == "ö\nü"
    again.close()


@pytest.mark.parametrize(
    "value", [nan, inf, "\x00\ud800", {"a": {"b": nan}}, 10**400, b"x", None, "x" * 200_000]
)
def test_any_report_of_a_referee_is_stored(store, value):
    told = event("ended", "k", told={"reason": value, "try_time_s": value, "contacts": value})
    store.take(told, COLOURS, NOW)
    (each,) = store.board().tries
    assert each.state == "ended" and 0 <= each.result.try_time_s <= 36000
    each.model_dump_json()


def test_what_does_not_exist_is_named(store):
    for work in (
        lambda: store.detail(7),
        lambda: store.correct(7, 0, Correction(), "", ADA),
        lambda: store.assign(7, 0, None, ADA),
        lambda: store.call(7, "", ADA),
        lambda: store.change_team(7, "A", None, None, ADA),
    ):
        with pytest.raises(RefusedError, match=r"(try|team) 7 does not exist") as refusal:
            work()
        assert refusal.value.status == 404
    number = fly(store, "k")
    with pytest.raises(RefusedError, match="team 9 does not exist"):
        store.assign(number, 0, 9, ADA)


def test_a_try_cannot_be_changed_more_than_200_times(store):
    number = fly(store, "k")
    with store._database.transaction() as session:
        for count in range(MAX_JUDGEMENTS):
            session.add(
                tables.Judgement(
                    try_id=number, number=count + 1, kind="team", team_id=None, who="x", at=NOW, remarks=""
                )
            )
    with pytest.raises(RefusedError, match="200 is the limit"):
        store.correct(number, MAX_JUDGEMENTS, Correction(), "", ADA)
