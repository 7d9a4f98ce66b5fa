"""The point that vehicles follow: never too hard, never past its place."""

from math import dist, hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_py.airframe import load_airframe
from firmware_py.guidance.limits import speed_limits
from firmware_py.guidance.reference import Pace, Reference, stopping_speed
from firmware_py.guidance.travel import Traveller
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState

PERIOD_S = 0.004
X500 = load_airframe("x500")
LIMITS = speed_limits(X500, Parameters(defaults=X500.parameters))
speeds = st.floats(-12.0, 12.0)
places = st.floats(-80.0, 80.0)


@settings(max_examples=30)
@given(st.lists(st.tuples(speeds, speeds, speeds), min_size=1, max_size=3))
def test_acceleration_and_jerk_keep_within_the_pace(wanted):
    pace, reference, state = Pace(3.0, 4.0, 2.0, 5.0), Reference(), VehicleState()
    reference.start(state, pace)
    before = reference.acceleration_ned_m_s2
    for velocity in wanted:
        for _ in range(500):
            state.position_ned_m = reference.position_ned_m
            reference.move(state, velocity, pace, PERIOD_S)
            north, east, down = reference.acceleration_ned_m_s2
            assert hypot(north, east) <= 3.0 + 1e-9
            assert -4.0 - 1e-9 <= down <= 2.0 + 1e-9
            assert hypot(north - before[0], east - before[1]) <= 5.0 * PERIOD_S + 1e-9
            assert abs(down - before[2]) <= 5.0 * PERIOD_S + 1e-9
            before = reference.acceleration_ned_m_s2


@settings(max_examples=20)
@given(st.tuples(places, places, st.floats(-30.0, 0.0)))
def test_a_journey_ends_at_its_target_and_passes_it_by_no_more_than_a_decimetre(target):
    traveller, state = Traveller(), VehicleState()
    traveller.start(state, LIMITS)
    traveller.go(target)
    length_m = hypot(target[0], target[1])
    farthest_m = 0.0
    for _ in range(round(45.0 / PERIOD_S)):
        velocity, _ = traveller.step(state, LIMITS, PERIOD_S)
        state.position_ned_m = traveller.reference.position_ned_m
        assert hypot(velocity[0], velocity[1]) < LIMITS.cruise_m_s + 0.05
        farthest_m = max(farthest_m, hypot(state.position_ned_m[0], state.position_ned_m[1]))
    assert dist(state.position_ned_m, target) < 0.01
    assert farthest_m < length_m + 0.1


@pytest.mark.parametrize("length_m", [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 13.0, 20.0, 40.0])
def test_no_length_of_journey_is_passed(length_m):
    traveller, state = Traveller(), VehicleState()
    traveller.start(state, LIMITS)
    traveller.go((0.0, length_m, 0.0))
    farthest_m = 0.0
    for _ in range(round(20.0 / PERIOD_S)):
        traveller.step(state, LIMITS, PERIOD_S)
        state.position_ned_m = traveller.reference.position_ned_m
        farthest_m = max(farthest_m, state.position_ned_m[1])
    assert farthest_m < length_m + 0.02


def test_the_point_waits_for_a_vehicle_that_cannot_follow():
    traveller, state = Traveller(), VehicleState()
    traveller.start(state, LIMITS)
    traveller.go((100.0, 0.0, 0.0))
    for _ in range(5000):
        traveller.step(state, LIMITS, PERIOD_S)
    assert traveller.reference.position_ned_m[0] < 2.1


def test_what_was_reached_once_is_left_for_the_same_place_again():
    traveller, state, target = Traveller(), VehicleState(), (1.0, 0.0, 0.0)
    for start in ((0.0, 0.0, 0.0), (5.0, 0.0, 0.0)):
        state.position_ned_m = start
        traveller.start(state, LIMITS)
        traveller.go(target)
        for _ in range(4000):
            traveller.step(state, LIMITS, PERIOD_S)
            state.position_ned_m = traveller.reference.position_ned_m
        assert state.position_ned_m == target


def test_it_may_be_faster_where_it_passes():
    assert stopping_speed(0.0, 3.0, 4.0) == pytest.approx(0.0, abs=1e-9)
    assert stopping_speed(0.0, 3.0, 4.0, 5.0) == pytest.approx(5.0)
    assert (
        stopping_speed(10.0, 3.0, 4.0) < stopping_speed(10.0, 3.0, 4.0, 2.0) < stopping_speed(20.0, 3.0, 4.0)
    )


def test_a_point_that_was_overtaken_does_not_wait_for_ever():
    traveller, state = Traveller(), VehicleState()
    traveller.start(state, LIMITS)
    traveller.go((0.0, 40.0, 0.0))
    for _ in range(round(3.0 / PERIOD_S)):  # it stands still, as on the ground: the point waits ahead of it
        traveller.step(state, LIMITS, PERIOD_S)
    waiting_m = traveller.reference.position_ned_m[1]
    assert 0.5 < waiting_m < 3.0
    state.position_ned_m = (0.0, waiting_m + 5.0, 0.0)  # a gust has carried it past
    for _ in range(round(5.0 / PERIOD_S)):
        traveller.step(state, LIMITS, PERIOD_S)
    assert traveller.reference.position_ned_m[1] > waiting_m + 5.0
