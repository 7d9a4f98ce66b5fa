"""Trajectories keep to their acceleration limits and stop at their target."""

from math import dist, hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_py.guidance.limits import AccelerationLimits, SpeedLimits, stopping_speed
from firmware_py.guidance.trajectory import Reference, Trajectory
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from framerunner.vehicle.airframe import load_airframe

PERIOD_S = 0.004
X500 = load_airframe("x500")
LIMITS = SpeedLimits(X500, Parameters(defaults=X500.parameters))
speeds = st.floats(-12.0, 12.0)
places = st.floats(-80.0, 80.0)


@settings(max_examples=30)
@given(st.lists(st.tuples(speeds, speeds, speeds), min_size=1, max_size=3))
def test_acceleration_and_jerk_are_limited(wanted):
    limits, reference, state = AccelerationLimits(3.0, 4.0, 2.0, 5.0), Reference(), VehicleState()
    reference.start(state, limits)
    before = reference.acceleration_ned_m_s2
    for velocity in wanted:
        for _ in range(500):
            state.position_ned_m = reference.position_ned_m
            reference.move(state, velocity, limits, PERIOD_S)
            north, east, down = reference.acceleration_ned_m_s2
            assert hypot(north, east) <= 3.0 + 1e-9
            assert -4.0 - 1e-9 <= down <= 2.0 + 1e-9
            assert hypot(north - before[0], east - before[1]) <= 5.0 * PERIOD_S + 1e-9
            assert abs(down - before[2]) <= 5.0 * PERIOD_S + 1e-9
            before = reference.acceleration_ned_m_s2


@settings(max_examples=20)
@given(st.tuples(places, places, st.floats(-30.0, 0.0)))
def test_a_trajectory_ends_at_its_target_and_overshoots_by_less_than_a_decimetre(target):
    trajectory, state = Trajectory(), VehicleState()
    trajectory.start(state, LIMITS)
    trajectory.go(target)
    length_m = hypot(target[0], target[1])
    farthest_m = 0.0
    for _ in range(round(45.0 / PERIOD_S)):
        velocity, _ = trajectory.step(state, LIMITS, PERIOD_S)
        state.position_ned_m = trajectory.reference.position_ned_m
        assert hypot(velocity[0], velocity[1]) < LIMITS.cruise_m_s + 0.05
        farthest_m = max(farthest_m, hypot(state.position_ned_m[0], state.position_ned_m[1]))
    assert dist(state.position_ned_m, target) < 0.01
    assert farthest_m < length_m + 0.1


@pytest.mark.parametrize("length_m", [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 13.0, 20.0, 40.0])
def test_no_distance_makes_it_overshoot(length_m):
    trajectory, state = Trajectory(), VehicleState()
    trajectory.start(state, LIMITS)
    trajectory.go((0.0, length_m, 0.0))
    farthest_m = 0.0
    for _ in range(round(20.0 / PERIOD_S)):
        trajectory.step(state, LIMITS, PERIOD_S)
        state.position_ned_m = trajectory.reference.position_ned_m
        farthest_m = max(farthest_m, state.position_ned_m[1])
    assert farthest_m < length_m + 0.02


def test_the_reference_point_waits_for_a_vehicle_that_cannot_follow():
    trajectory, state = Trajectory(), VehicleState()
    trajectory.start(state, LIMITS)
    trajectory.go((100.0, 0.0, 0.0))
    for _ in range(5000):
        trajectory.step(state, LIMITS, PERIOD_S)
    assert trajectory.reference.position_ned_m[0] < 2.1


def test_the_same_target_can_be_reached_twice():
    trajectory, state, target = Trajectory(), VehicleState(), (1.0, 0.0, 0.0)
    for start in ((0.0, 0.0, 0.0), (5.0, 0.0, 0.0)):
        state.position_ned_m = start
        trajectory.start(state, LIMITS)
        trajectory.go(target)
        for _ in range(4000):
            trajectory.step(state, LIMITS, PERIOD_S)
            state.position_ned_m = trajectory.reference.position_ned_m
        assert state.position_ned_m == target


def test_the_speed_may_be_higher_where_the_target_is_passed():
    assert stopping_speed(0.0, 3.0, 4.0) == pytest.approx(0.0, abs=1e-9)
    assert stopping_speed(0.0, 3.0, 4.0, 5.0) == pytest.approx(5.0)
    assert (
        stopping_speed(10.0, 3.0, 4.0) < stopping_speed(10.0, 3.0, 4.0, 2.0) < stopping_speed(20.0, 3.0, 4.0)
    )


def test_a_reference_point_that_was_overtaken_does_not_wait_for_ever():
    trajectory, state = Trajectory(), VehicleState()
    trajectory.start(state, LIMITS)
    trajectory.go((0.0, 40.0, 0.0))
    for _ in range(round(3.0 / PERIOD_S)):  # the vehicle stands: the point waits ahead of it
        trajectory.step(state, LIMITS, PERIOD_S)
    waiting_m = trajectory.reference.position_ned_m[1]
    assert 0.5 < waiting_m < 3.0
    state.position_ned_m = (0.0, waiting_m + 5.0, 0.0)  # a gust has moved it past the point
    for _ in range(round(5.0 / PERIOD_S)):
        trajectory.step(state, LIMITS, PERIOD_S)
    assert trajectory.reference.position_ned_m[1] > waiting_m + 5.0
