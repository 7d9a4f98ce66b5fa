"""Who is called, who flies and who is next, as stored."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import Database
from framerunner.monitor.competition.store import Store
from framerunner.monitor.competition.validation import RefusedError
from scenarios.result import FlightResult
from tests.framerunner.monitor.competition.harness import COLOURS, event

NOW = datetime(2030, 5, 17, 12, 0, tzinfo=UTC)
ADA = Entry("Ada", NOW)
BOB = Entry("Bob", NOW + timedelta(minutes=1))


@pytest.fixture
def teams(store):
    """Three teams, which are in the queue."""
    ids = [store.add_team(name, "", ADA) for name in ("Falken", "Adler", "Spatzen")]
    store.set_queue(0, ids, ADA)
    return ids


def queue_of(store):
    return [each.team for each in store.board().queue.teams]


def set_queue(store, teams):
    store.set_queue(store.board().queue.number, teams, ADA)


def begin(store, key="k", name="case-1"):
    return store.take(event("began", key, name, time_s=0.0), COLOURS, NOW)


def end(store, key="k", name="case-1", **values):
    return store.take(event("ended", key, name, **values), COLOURS, NOW)


def take_back(store):
    store.take_back(store.board().last_call.id, BOB)


def test_the_order_of_the_queue_is_kept_and_named(store, teams):
    first, second, third = teams
    set_queue(store, [third, first, second])
    queue = store.board().queue
    assert [each.team_name for each in queue.teams] == ["Spatzen", "Falken", "Adler"]
    set_queue(store, [third, first, second])
    assert store.board().queue == queue  # the same order is no change


def test_a_request_for_an_older_queue_is_refused(store, teams):
    seen = store.board().queue.number
    store.set_queue(seen, teams[::-1], ADA)
    with pytest.raises(RefusedError, match="changed meanwhile") as refusal:
        store.set_queue(seen, teams[:1], BOB)
    assert refusal.value.status == 409 and queue_of(store) == teams[::-1]


def test_a_queue_names_teams_that_take_part_and_each_once(store, teams):
    store.change_team(teams[0], None, None, True, ADA)
    for queue, words in (
        ([teams[1], teams[1]], "twice"),
        ([teams[0]], "withdrawn"),
        ([99], "team 99 does not exist"),
    ):
        with pytest.raises(RefusedError, match=words):
            set_queue(store, queue)
    assert queue_of(store) == teams[1:]  # who withdraws leaves it


def test_the_next_team_is_not_the_flying_one(store, teams):
    first, second, third = teams
    store.call(first, "", ADA)
    board = store.board()
    assert (board.called.team, board.called.attempt) == (first, None)
    assert queue_of(store) == [second, third]
    number = begin(store)
    board = store.board()
    assert (board.tries[0].team, board.called.attempt) == (first, number)
    store.call(second, "", ADA)  # to make ready while the first flies
    board = store.board()
    assert (board.called.team, board.called.attempt) == (second, None)
    assert queue_of(store) == [third]
    end(store)
    assert store.board().called.team == second  # the first's try used the first's call
    begin(store, "l")
    end(store, "l")
    assert [each.team for each in store.board().tries] == [second, first]
    assert store.board().called is None


def test_a_second_call_of_the_flying_team_is_for_its_next_try(store, teams):
    store.call(teams[0], "", ADA)
    begin(store)
    store.call(teams[0], "", ADA)
    end(store)
    assert store.board().called.team == teams[0]
    begin(store, "l")
    end(store, "l")
    assert [each.team for each in store.board().tries] == [teams[0]] * 2 and store.board().called is None


def test_a_wrong_call_is_taken_back_and_costs_nothing(store, teams):
    store.call(teams[1], "case-1", ADA)
    take_back(store)
    board = store.board()
    assert board.called is None and board.last_call is None
    assert queue_of(store) == teams  # where it stood
    begin(store)
    assert store.board().tries[0].team is None


def test_a_wrong_call_is_taken_back_while_the_drone_flies_and_after(store, teams):
    first, second, _ = teams
    for key, is_over in (("k", False), ("l", True)):
        store.call(second, "", ADA)
        number = begin(store, key)
        if is_over:
            end(store, key)
            assert store.board().called is None
        assert store.board().last_call.tries == (number,)
        take_back(store)
        assert store.board().tries[0].team is None
        assert queue_of(store) == teams
        (entry,) = store.detail(number).history
        assert (entry.kind, entry.team_name, entry.who) == ("team", "", "Bob")
        store.assign(number, 1, first, BOB)
        end(store, key)
        assert store.board().tries[0].team == first
    rows = {row.team: row.flown for row in store.board().rankings[0].rows}
    assert rows[second] == 0  # no try was used


def test_a_try_assigned_to_another_team_stays_with_it(store, teams):
    first, second, _ = teams
    store.call(second, "", ADA)
    number = begin(store)
    store.assign(number, 0, first, ADA)
    assert store.board().last_call.tries == ()
    take_back(store)
    assert store.board().tries[0].team == first and queue_of(store) == teams


def test_a_call_is_taken_back_once_and_by_a_judge_who_saw_it(store, teams):
    store.call(teams[0], "", ADA)
    seen = store.board().last_call.id
    store.call(teams[1], "", ADA)
    for call in (seen, 99):
        with pytest.raises(RefusedError, match="taken back meanwhile") as refusal:
            store.take_back(call, BOB)
        assert refusal.value.status == 409
    take_back(store)
    with pytest.raises(RefusedError, match="taken back meanwhile"):
        store.take_back(seen, BOB)


def test_a_called_team_that_has_not_flown_returns_to_the_queue_when_another_is_called(store, teams):
    first, second, third = teams
    store.call(first, "", ADA)
    store.call(third, "", ADA)
    assert queue_of(store) == [first, second]
    store.call(third, "case-2", ADA)  # the same team again, for another scenario
    take_back(store)
    assert queue_of(store) == teams
    store.call(first, "", ADA)
    store.call(None, "", ADA)
    assert queue_of(store) == teams and store.board().called is None


def test_a_team_that_withdraws_is_not_called_any_more(store, teams):
    store.call(teams[0], "", ADA)
    store.change_team(teams[0], None, None, True, ADA)
    board = store.board()
    assert board.called is None and board.last_call is None and queue_of(store) == teams[1:]
    store.call(teams[1], "", ADA)
    begin(store)
    store.change_team(teams[1], None, None, True, ADA)
    assert store.board().tries[0].team == teams[1]  # it flies
    take_back(store)
    assert queue_of(store) == teams[2:]


def test_queue_and_call_are_there_after_reopening(database_url):
    store = Store(Database(database_url))
    ids = [store.add_team(name, "", ADA) for name in ("Falken", "Adler", "Spatzen")]
    store.set_queue(0, ids, ADA)
    store.call(ids[2], "", ADA)
    begin(store)
    before = store.board()
    store.close()
    again = Store(Database(database_url))
    assert again.board() == before
    again.interrupt()
    take_back(again)
    assert queue_of(again) == ids and again.board().tries[0].team is None
    again.close()


def test_a_try_says_whether_a_ranking_has_it_and_which_other_would_count(store, teams):
    def told(number):
        detail = store.detail(number)
        (listed,) = (each for each in store.board().tries if each.id == number)
        assert listed == detail.attempt
        return listed.barrier, detail.rival and detail.rival.attempt

    def fly(key, name="case-1", **values):
        store.call(teams[0], "", ADA)
        return end(store, key, name, **values)

    assert told(end(store, "a")) == ("no team", None)
    one = fly("b", time_s=40.0)
    assert told(one) == ("", None)
    other = fly("c", time_s=50.0, contacts=2)
    assert told(one) == ("", other) and told(other) == ("", one)
    rival = store.detail(one).rival
    assert (rival.counted_s, rival.contacts) == (50.0, 2)
    assert [told(fly(name, name))[0] for name in ("case-2", "case-3", "case-4", "")] == [
        "", "", "not drawn", "no scenario",
    ]  # fmt: skip
    assert store.board().rankings[0].scenarios == ("case-1", "case-2", "case-3")
    store.draw({"case-2": COLOURS}, ["case-2"], ADA)
    late = fly("d")
    assert told(late) == ("not drawn", None) and told(one) == ("", other)
    store.change_team(teams[0], None, None, True, ADA)
    assert told(one) == ("withdrawn", other)


def test_a_try_of_the_class_open_is_in_no_ranking_and_no_other_try_s_rival(store, teams):
    store.call(teams[0], "", ADA)
    slow = end(store, "a", time_s=40.0)
    fast = event("ended", "b", time_s=20.0, final=True)
    result = FlightResult(**dict(fast.report), mission_class="open")
    store.call(teams[0], "", ADA)
    fast_id = store.take(replace(fast, report=result), COLOURS, NOW)
    assert store.detail(fast_id).attempt.barrier == "open class"
    assert store.detail(slow).rival is None
    (row,) = (row for row in store.board().rankings[0].rows if row.team == teams[0])
    assert row.cells[0].attempt == slow and row.cells[0].tries == 1
