"""Local axes laid into the arena: by the referee, by the start, by the app."""

from math import cos, pi, sin

import pytest
from pymavlink.dialects.v20 import common as mavlink

from monitor.vehicle.motion import Motion, Position
from monitor.vehicle.placement import Placement, Source


def standing(x, y, z, yaw_ned_rad):
    motion = Motion()
    half = yaw_ned_rad / 2
    motion.take_quaternion(
        mavlink.MAVLink_attitude_quaternion_message(0, cos(half), 0, 0, sin(half), 0, 0, 0), 0.0
    )
    motion.take_position(mavlink.MAVLink_local_position_ned_message(0, x, y, z, 0, 0, 0), 0.0)
    return motion


def test_the_start_gives_turn_and_shift():
    placement = Placement()
    placement.lay_by_start((2.0, -1.0, 0.5, pi / 2), standing(10.0, 20.0, -3.0, 0.3))
    assert placement.position((10.0, 20.0, -3.0)) == pytest.approx((2.0, -1.0, 0.5))
    ahead = (10.0 + cos(0.3), 20.0 + sin(0.3), -3.0)  # a metre ahead is a metre along y
    assert placement.position(ahead) == pytest.approx((2.0, 0.0, 0.5))
    assert placement.vector((cos(0.3), sin(0.3), -1.0)) == pytest.approx((0.0, 1.0, 1.0))
    w, x, y, z = placement.attitude((cos(0.15), 0.0, 0.0, sin(0.15)))
    assert (x, y) == (0.0, 0.0)
    assert (w, z) == pytest.approx((cos(pi / 4), sin(pi / 4)))


def test_the_frame_of_a_referee_counts_before_all():
    placement = Placement()
    placement.lay_by_frame((1.0, 2.0, 3.0), pi / 2)
    assert placement.position((1.0, 0.0, 0.0)) == pytest.approx((1.0, 3.0, 3.0))
    placement.lay_by_start((9.0, 9.0, 9.0, 0.0), standing(0.0, 0.0, 0.0, 0.0))
    placement.lay_by_app((9.0, 9.0, 9.0, 0.0), Position(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0))
    assert placement.source is Source.REFEREE
    assert placement.position((0.0, 0.0, 0.0)) == pytest.approx((1.0, 2.0, 3.0))


def test_of_the_apps_pairs_the_stillest_counts():
    placement = Placement()
    placement.lay_by_app((1.0, 0.0, 0.0, 0.0), Position(0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0))
    assert placement.position((0.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0))
    placement.lay_by_app((2.0, 0.0, 0.0, 0.0), Position(0, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.0))
    placement.lay_by_app((3.0, 0.0, 0.0, 0.0), Position(0, (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.0))
    assert placement.position((0.0, 0.0, 0.0)) == pytest.approx((2.0, 0.0, 0.0))


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_what_is_no_number_is_not_believed(bad):
    placement = Placement()
    placement.lay_by_frame((bad, 0.0, 0.0), 0.0)
    placement.lay_by_app((0.0, 0.0, 0.0, bad), Position(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0))
    assert placement.source is Source.GUESS


def test_one_that_is_carried_lays_nothing():
    motion = standing(0.0, 0.0, 0.0, 0.0)
    motion.take_position(mavlink.MAVLink_local_position_ned_message(20, 0, 0, 0, 0.5, 0, 0), 0.0)
    placement = Placement()
    placement.lay_by_start((1.0, 1.0, 1.0, 0.0), motion)
    assert placement.source is Source.GUESS


def test_between_two_reports_it_goes_straight():
    motion = Motion()
    for time_ms, x in ((1000, 0.0), (1100, 1.0)):
        motion.take_position(mavlink.MAVLink_local_position_ned_message(time_ms, x, 0, 0, 0, 0, 0), 0.0)
    assert motion.at(1_025_000).position_ned_m == pytest.approx((0.25, 0.0, 0.0))
    assert motion.at(1_150_000).position_ned_m == pytest.approx((1.0, 0.0, 0.0))
    assert motion.at(1_300_000) is None
    assert motion.at(500_000) is None


def test_late_and_doubled_reports_change_nothing():
    motion = Motion()
    for time_ms, x in ((1000, 0.0), (1100, 1.0), (1050, 0.5), (1100, 1.0), (1120, 1.2), (900, -1.0)):
        motion.take_position(mavlink.MAVLink_local_position_ned_message(time_ms, x, 0, 0, 0, 0, 0), 0.0)
        motion.take_angles(mavlink.MAVLink_attitude_message(time_ms, 0, 0, x / 10, 0, 0, 0), 0.0)
    assert (motion.time_us, motion.restarts) == (1_120_000, 0)
    assert motion.position.position_ned_m[0] == 1.2
    assert motion.yaw_ned_rad == pytest.approx(0.12)
    assert motion.at(1_025_000).position_ned_m == pytest.approx((0.25, 0.0, 0.0))
