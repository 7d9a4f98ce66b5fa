from itertools import pairwise
from math import cos, sin

import pytest

from monitor.vehicle import history
from monitor.vehicle.history import History


def pose(t, x=0.0, on=True, state=3, yaw=0.5):
    q = [cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)]
    return {
        "t": t,
        "p": [x, 1.0, 2.0],
        "q": q,
        "v": [0.1, 0.2, 0.3],
        "r": 0.4,
        "c": None,
        "on": on,
        "s": state,
    }


def test_a_sample_has_all_that_the_plots_show():
    kept = History()
    kept.add(pose(5.0, x=-1.5))
    kept.add(pose(5.0, x=9.0))  # nothing new came
    kept.add({**pose(5.1), "c": [1.0, 2.0, 3.0, 4.0]})
    none = [None] * 4
    assert kept.rows() == [
        [5.0, -1.5, 1.0, 2.0, 0.5, 0.1, 0.2, 0.3, 0.4, *none, 1, 3],
        [5.1, 0.0, 1.0, 2.0, 0.5, 0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 3.0, 4.0, 1, 3],
    ]


def test_a_flight_begins_with_the_motors():
    kept = History()
    for t in (1.0, 2.0):
        kept.add(pose(t, on=False))
    for t in (3.0, 4.0):
        kept.add(pose(t))
    kept.add(pose(5.0, on=False))
    assert [row[0] for row in kept.rows()] == [3.0, 4.0, 5.0]
    kept.add(pose(6.0))
    assert [row[0] for row in kept.rows()] == [6.0]


def test_the_past_is_bounded_and_the_whole_trail_stays(monkeypatch):
    monkeypatch.setattr(history, "MAX_OLDER", 50)
    kept = History()
    for step in range(20_000):
        kept.add(pose(0.1 * step, x=0.02 * step))
    rows = kept.rows()
    recent = [row for row in rows if row[0] >= rows[-1][0] - history.RECENT_S]
    assert len(recent) == pytest.approx(600, abs=2)
    assert len(rows) <= 50 + len(recent)
    assert rows[0][0] == 0.0
    gaps = [after[1] - before[1] for before, after in pairwise(rows)]
    assert max(gaps) < 40.0


def test_where_it_hovers_only_a_change_of_state_is_kept():
    kept = History()
    for step in range(3000):
        kept.add(pose(0.1 * step, state=step // 1000))
    older = [row for row in kept.rows() if row[0] < 0.1 * 2999 - history.RECENT_S]
    assert [(row[0], row[14]) for row in older] == [(0.0, 0), (100.0, 1), (200.0, 2)]
