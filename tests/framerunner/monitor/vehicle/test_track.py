"""Where a vehicle is in the arena: by the referee, by the start, by the app; and where it was."""

from itertools import pairwise
from math import cos, pi, sin

import pytest

from framerunner.monitor.vehicle import track
from framerunner.monitor.vehicle.track import History, Placement, Source
from framerunner.wire.dialect import mavlink
from framerunner.wire.vehicle_telemetry import PositionReport, VehicleTelemetry


def standing(x, y, z, yaw_ned_rad):
    telemetry = VehicleTelemetry()
    half = yaw_ned_rad / 2
    telemetry.take(mavlink.MAVLink_attitude_quaternion_message(0, cos(half), 0, 0, sin(half), 0, 0, 0), 0.0)
    telemetry.take(mavlink.MAVLink_local_position_ned_message(0, x, y, z, 0, 0, 0), 0.0)
    return telemetry


def test_the_start_gives_rotation_and_translation():
    placement = Placement()
    placement.lay_by_start((2.0, -1.0, 0.5, pi / 2), standing(10.0, 20.0, -3.0, 0.3))
    assert placement.alignment.position((10.0, 20.0, -3.0)) == pytest.approx((2.0, -1.0, 0.5))
    ahead = (10.0 + cos(0.3), 20.0 + sin(0.3), -3.0)  # a metre ahead is a metre along y
    assert placement.alignment.position(ahead) == pytest.approx((2.0, 0.0, 0.5))
    assert placement.alignment.vector((cos(0.3), sin(0.3), -1.0)) == pytest.approx((0.0, 1.0, 1.0))
    w, x, y, z = placement.alignment.attitude((cos(0.15), 0.0, 0.0, sin(0.15)))
    assert (x, y) == (0.0, 0.0)
    assert (w, z) == pytest.approx((cos(pi / 4), sin(pi / 4)))


def test_the_referee_s_frame_has_priority():
    placement = Placement()
    placement.lay_by_frame((1.0, 2.0, 3.0), pi / 2)
    assert placement.alignment.position((1.0, 0.0, 0.0)) == pytest.approx((1.0, 3.0, 3.0))
    placement.lay_by_start((9.0, 9.0, 9.0, 0.0), standing(0.0, 0.0, 0.0, 0.0))
    placement.lay_by_app((9.0, 9.0, 9.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0))
    assert placement.source is Source.REFEREE
    assert placement.alignment.position((0.0, 0.0, 0.0)) == pytest.approx((1.0, 2.0, 3.0))


def test_the_app_s_pair_with_the_lowest_speed_counts():
    placement = Placement()
    placement.lay_by_app((1.0, 0.0, 0.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0))
    assert placement.alignment.position((0.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0))
    placement.lay_by_app((2.0, 0.0, 0.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.0))
    placement.lay_by_app((3.0, 0.0, 0.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.0))
    assert placement.alignment.position((0.0, 0.0, 0.0)) == pytest.approx((2.0, 0.0, 0.0))


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_poses_that_are_not_finite_are_ignored(bad):
    placement = Placement()
    placement.lay_by_frame((bad, 0.0, 0.0), 0.0)
    placement.lay_by_app((0.0, 0.0, 0.0, bad), PositionReport(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0))
    assert placement.source is Source.GUESS


def test_a_moving_drone_is_not_placed_by_its_start():
    telemetry = standing(0.0, 0.0, 0.0, 0.0)
    telemetry.take(mavlink.MAVLink_local_position_ned_message(20, 0, 0, 0, 0.5, 0, 0), 0.0)
    placement = Placement()
    placement.lay_by_start((1.0, 1.0, 1.0, 0.0), telemetry)
    assert placement.source is Source.GUESS


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


def test_a_sample_has_all_columns():
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


def test_the_number_of_samples_is_bounded_and_the_whole_trail_stays(monkeypatch):
    monkeypatch.setattr(track, "MAX_OLDER", 50)
    kept = History()
    for step in range(20_000):
        kept.add(pose(0.1 * step, x=0.02 * step))
    rows = kept.rows()
    recent = [row for row in rows if row[0] >= rows[-1][0] - track.RECENT_S]
    assert len(recent) == pytest.approx(600, abs=2)
    assert len(rows) <= 50 + len(recent)
    assert rows[0][0] == 0.0
    gaps = [after[1] - before[1] for before, after in pairwise(rows)]
    assert max(gaps) < 40.0


def test_where_it_hovers_only_a_change_of_state_is_kept():
    kept = History()
    for step in range(3000):
        kept.add(pose(0.1 * step, state=step // 1000))
    older = [row for row in kept.rows() if row[0] < 0.1 * 2999 - track.RECENT_S]
    assert [(row[0], row[14]) for row in older] == [(0.0, 0), (100.0, 1), (200.0, 2)]
