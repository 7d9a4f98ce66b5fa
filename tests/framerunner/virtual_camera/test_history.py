"""Where a vehicle was, between and beyond its reports."""

from math import cos, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.virtual_camera.history import (
    AHEAD_US,
    GAP_US,
    AttitudeReport,
    PoseHistory,
    PositionReport,
    multiply,
    quaternion_from_euler,
)
from framerunner.virtual_camera.placement import yaw_of

angles = st.floats(-pi, pi)
speeds = st.floats(-12, 12)


def attitude(time_us, yaw=0.0, roll=0.0, rates=(0.0, 0.0, 0.0)):
    return AttitudeReport(time_us, quaternion_from_euler(roll, 0.0, yaw), rates)


def position(time_us, x=0.0, velocity=(0.0, 0.0, 0.0)):
    return PositionReport(time_us, (x, 0.0, 0.0), velocity)


def turned_apart(a, b):
    """Cosine of half the angle between two attitudes, 1 if they are the same."""
    return abs(sum(p * q for p, q in zip(a, b, strict=True)))


def test_nothing_is_known_before_both_kinds_have_come():
    history = PoseHistory()
    assert history.newest_us is None
    history.add_attitude(attitude(20_000))
    assert history.covered_us is None
    assert history.pose(20_000) is None
    history.add_position(position(30_000))
    assert (history.newest_us, history.covered_us) == (30_000, 20_000)
    assert history.pose(30_000) is not None
    assert history.pose(29_999) is None  # before the first position


@given(speed=speeds, yaw_rate=st.floats(-2, 2), at=st.floats(0.1, 0.9), offset_us=st.integers(0, 30_000))
def test_even_motion_is_filled_in_exactly(speed, yaw_rate, at, offset_us):
    """Attitude at 50 Hz, position at 30 Hz, on clocks that do not meet."""
    history = PoseHistory()
    for time_us in range(0, 1_200_000, 1000):
        if time_us % 20_000 == 0:
            history.add_attitude(attitude(time_us, yaw_rate * time_us * 1e-6))
        if time_us % 33_000 == 0:
            place = time_us + offset_us
            history.add_position(position(place, speed * place * 1e-6, (speed, 0.0, 0.0)))
    pose = history.pose(round(at * 1e6))
    assert pose.position_ned_m[0] == pytest.approx(speed * at, abs=1e-4)
    assert pose.velocity_ned_m_s == pytest.approx((speed, 0.0, 0.0))
    wanted = quaternion_from_euler(0.0, 0.0, yaw_rate * at)
    assert turned_apart(pose.attitude_ned, wanted) == pytest.approx(1.0, abs=1e-7)


@given(roll=angles, yaw=angles, turn=st.floats(-1.0, 1.0), flipped=st.booleans(), share=st.floats(0, 1))
def test_attitudes_are_filled_in_the_short_way_and_stay_of_unit_length(roll, yaw, turn, flipped, share):
    """A quaternion and its negative are one attitude; reports may change between them."""
    first = quaternion_from_euler(roll, 0.2, yaw)
    second = multiply(first, (cos(turn / 2), 0.0, sin(turn / 2), 0.0))
    if flipped:
        second = tuple(-part for part in second)
    history = PoseHistory()
    history.add_attitude(AttitudeReport(0, first))
    history.add_attitude(AttitudeReport(20_000, second))
    history.add_position(position(0))
    found = history.pose(round(20_000 * share)).attitude_ned
    assert hypot(*found) == pytest.approx(1.0)
    middle = multiply(first, (cos(share * turn / 2), 0.0, sin(share * turn / 2), 0.0))
    assert turned_apart(found, middle) > cos(0.02)


@given(speed=speeds, rate=st.floats(-3, 3), ahead_us=st.integers(0, AHEAD_US))
def test_the_last_reports_are_carried_on_a_little(speed, rate, ahead_us):
    history = PoseHistory()
    history.add_attitude(attitude(1_000_000, 0.5, rates=(0.0, 0.0, rate)))
    history.add_position(position(1_000_000, 2.0, (speed, 0.0, 0.0)))
    pose = history.pose(1_000_000 + ahead_us)
    assert pose.position_ned_m[0] == pytest.approx(2.0 + speed * ahead_us * 1e-6)
    assert yaw_of(pose.attitude_ned) == pytest.approx(0.5 + rate * ahead_us * 1e-6)
    assert history.pose(1_000_000 + AHEAD_US + 1) is None


def test_nothing_is_made_up_across_a_hole():
    history = PoseHistory()
    for time_us in (0, 100_000, 100_000 + GAP_US + 1):
        history.add_attitude(attitude(time_us))
        history.add_position(position(time_us))
    assert history.pose(50_000) is not None
    assert history.pose(250_000) is None


@given(st.permutations(range(12)))
def test_reports_may_come_in_any_order_and_twice(order):
    history = PoseHistory()
    for step in (*order, *order):
        history.add_attitude(attitude(step * 20_000, 0.01 * step))
        history.add_position(position(step * 20_000, float(step)))
    pose = history.pose(130_000)
    assert pose.position_ned_m[0] == pytest.approx(6.5)
    assert yaw_of(pose.attitude_ned) == pytest.approx(0.065, abs=1e-6)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_reports_that_are_not_finite_are_passed_over(bad):
    history = PoseHistory()
    history.add_attitude(AttitudeReport(10_000, (bad, 0.0, 0.0, 0.0)))
    history.add_attitude(AttitudeReport(10_000, (0.0, 0.0, 0.0, 0.0)))
    history.add_attitude(attitude(10_000, rates=(0.0, bad, 0.0)))
    history.add_position(position(10_000, bad))
    history.add_position(position(10_000, velocity=(0.0, 0.0, bad)))
    assert history.newest_us is None


def test_a_clock_that_goes_back_begins_a_new_history():
    history = PoseHistory()
    for time_us in (60_000_000, 4_000_000, 4_020_000):
        history.add_attitude(attitude(time_us))
        history.add_position(position(time_us))
    assert history.restarts == 1
    assert history.newest_us == 4_020_000
    assert history.pose(4_010_000) is not None


def test_what_is_old_is_forgotten():
    history = PoseHistory()
    for step in range(1000):
        history.add_attitude(attitude(step * 20_000))
        history.add_position(position(step * 20_000))
    assert history.pose(10_000_000) is None
    assert history.pose(19_000_000) is not None
