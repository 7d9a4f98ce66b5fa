import csv
import io
from datetime import UTC, datetime

import pytest

from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import Database
from framerunner.monitor.competition.store import Store
from framerunner.monitor.competition.views import ranking_csv, tries_csv
from tests.framerunner.monitor.competition.harness import COLOURS, event

NOW = datetime(2030, 5, 17, 12, 0, tzinfo=UTC)
ADA = Entry("=Ada", NOW)


@pytest.fixture
def board():
    store = Store(Database("sqlite://"))
    for key, name in (("1", '=HYPERLINK("http://x")'), ("2", 'Comma, "quoted"'), ("3", "الصقور")):
        store.call(store.add_team(name, "", ADA), "", ADA)
        words = {"reason": "-1+1\nsecond line"}
        told = event("ended", key, time_s=30.0 + int(key), contacts=int(key), told=words)
        store.take(told, COLOURS, NOW)
    yield store.board()
    store.close()


def read(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_the_ranking_has_a_header_and_names_that_are_no_formulas(board):
    rows = read(ranking_csv(board.rankings[0]))
    assert [row["team"] for row in rows] == ['\'=HYPERLINK("http://x")', 'Comma, "quoted"', "الصقور"]
    assert rows[0]["rank"] == "1" and rows[0]["total_s"] == "751.00"
    assert rows[0]["case-1 counted_s"] == "31.00" and rows[0]["case-1 try"] == "1"
    assert rows[0]["scenario 2 state"] == "not flown" and rows[0]["scenario 2 try"] == ""


def test_the_tries_have_all_values(board):
    rows = read(tries_csv(board))
    assert [row["try"] for row in rows] == ["1", "2", "3"]
    assert rows[2]["team"] == "الصقور" and rows[2]["contacts"] == "3" and rows[2]["try_time_s"] == "33.0"
    assert rows[0]["crossed"] == "red green blue" and rows[0]["judged"] == "true"
    assert rows[0]["started"] == NOW.isoformat() and rows[0]["reason"] == "'-1+1second line"


def test_each_try_says_whether_it_counts_and_why_not():
    store = Store(Database("sqlite://"))
    cases = ("a", "b", "c")
    store.draw(dict.fromkeys(cases, COLOURS), cases, ADA)
    team = store.add_team("Falken", "", ADA)

    def fly(key, scenario, called=True, **values):
        store.call(team if called else None, "", ADA)
        store.take(event("began", key, scenario), COLOURS, NOW)
        if values:
            store.take(event("ended", key, scenario, **values), COLOURS, NOW)

    fly("1", "a", time_s=50.0)
    fly("2", "a", time_s=40.0)
    fly("3", "x", time_s=30.0)
    fly("4", "b", called=False, time_s=30.0)
    fly("5", "c")
    store.interrupt()
    fly("6", "c")
    rows = read(tries_csv(store.everything()))
    assert [(row["counts"], row["why_not"]) for row in rows] == [
        ("false", "try 2 is better"),
        ("true", ""),
        ("false", "not drawn"),
        ("false", "no team"),
        ("false", "interrupted: to be judged"),
        ("false", "is being flown"),
    ]
    store.close()
