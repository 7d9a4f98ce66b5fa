"""Following a path: the simulated drone in lockstep stays clean through layouts that it knows."""

from __future__ import annotations

import asyncio
from math import hypot

import pytest

from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from framerunner.flying.response import ResponseDelay
from offboard.drone import DroneState
from offboard.mission import load_mission
from offboard.navigation.control.path_clock import MAX_RATE_CHANGE_PER_S, PathClock
from offboard.navigation.following import PathFollower
from offboard.navigation.goals import CONTEST, Motion, Obstacles, PathGate, Point, style_of
from offboard.navigation.path import Path
from offboard.navigation.planning import plan
from scenarios.models import Arena
from tests.offboard.navigation.flown_layouts import Layout, fly


@pytest.mark.parametrize("seed", [200, 203])
def test_known_layout_is_flown_cleanly_while_planning_again(seed: int):
    report, farthest_m, limited_s = fly(Layout.random(seed), replan_s=0.4)
    assert report.verdict == "clean"
    assert max(report.crossing_offsets_m) < 0.05
    assert farthest_m < 0.3
    assert limited_s == 0.0


def test_vehicle_that_answers_late_is_flown_cleanly_but_more_slowly():
    late = ResponseDelay(lag_s=0.6, dead_time_s=0.15, height_wander_m=0.05)
    report, _, limited_s = fly(Layout.random(203), replan_s=0.8, response=late)
    assert report.verdict == "clean"
    assert max(report.crossing_offsets_m) < 0.05
    assert limited_s == 0.0


def test_vehicle_that_was_pushed_aside_before_a_gate_waits_and_goes_on_when_it_is_back():
    gate = PathGate((2.0, 0.0, 1.0), 0.0)
    start = Motion((0.0, 0.6, 1.0), yaw_rad=0.6)
    path = plan(start, [gate], obstacles=Obstacles((gate,)), arena=Arena(), style=CONTEST)
    assert isinstance(path, Path)
    follower, waited, before_s = PathFollower(), 0, 0.0
    for tick in range(500):
        motion, gate_s = path.at(follower.progress_s), path.crossings[0].time_s - follower.progress_s
        pushed_m = 0.2 if 0.5 < gate_s < 1.2 and tick < 200 else 0.0
        x, y, z = motion.position_m
        state = DroneState(
            tick * 50_000, x, y + pushed_m, z, motion.yaw_rad, motion.velocity_m_s, landed=False
        )
        follower.command(path, state, tick * 0.05)
        waited += pushed_m > 0.0 and follower.progress_s - before_s < 0.005
        before_s = follower.progress_s
        if follower.finished:
            break
    assert waited > 20
    assert follower.finished


def test_the_pace_of_the_path_changes_gradually():
    clock, before = PathClock(0.35), 1.0
    for tick in range(200):
        clock.advance(0.05, 100.0)
        clock.change(0.0 if tick % 40 < 20 else 1.0, 0.8, 0.05, in_gate=False, brake_m_s2=0.0)
        rate = clock.pace[0]
        assert abs(rate - before) <= MAX_RATE_CHANGE_PER_S * 0.05 + 1e-9
        assert -1e-9 <= rate <= 1.0 + 1e-9
        before = rate
        (late_s, _), (soon_s, _) = clock.in_(0.0), clock.in_(0.35)
        assert 0.0 <= soon_s - late_s <= 0.35 + 1e-9


@pytest.mark.parametrize(("from_m", "least_m_s2", "most_m_s2"), [(1.4, 0.9, 1.6), (0.25, 0.2, 0.45)])
def test_a_drone_that_has_waited_hardly_speeds_up_in_a_gate(
    from_m: float, least_m_s2: float, most_m_s2: float
):
    """Speeding up tilts the drone, whose box then does not fit through the opening."""
    gate = PathGate((2.0, 0.0, 1.0), 0.0)
    path = plan(Motion((0.0, 0.0, 1.0)), [gate], obstacles=Obstacles((gate,)), arena=Arena(), style=CONTEST)
    assert isinstance(path, Path)
    follower, held, rises_m_s2, rate = PathFollower(), 0, [], 1.0
    for tick in range(80):
        motion, before_s = path.at(follower.progress_s), follower.progress_s
        x, y, z = motion.position_m
        held += x > gate.centre_m[0] - from_m
        behind_m = 0.4 if 0 < held < 8 else 0.0  # the path's time waits for it
        state = DroneState(tick * 50_000, x - behind_m, y, z, 0.0, motion.velocity_m_s, landed=False)
        follower.observe(state, tick * 0.05, None)  # it does not answer, so nothing is learnt
        follower.command(path, state, tick * 0.05)
        was, rate = rate, (follower.progress_s - before_s) / 0.05
        if held > 9 and abs(x - gate.centre_m[0]) < from_m:
            rises_m_s2.append((rate - was) / 0.05 * hypot(*motion.velocity_m_s))
    assert least_m_s2 < max(rises_m_s2) < most_m_s2


def test_height_is_kept_where_a_fast_drone_changes_its_tilt():
    drone = LockstepVehicle(FlightPlan(Layout.random(200).scenario, load_mission("racer"))).drone
    asyncio.run(drone.ready())
    asyncio.run(drone.motors_on())
    limits = FlightPlan(Layout.random(200).scenario, load_mission("racer")).command_limits
    follower, state = PathFollower(limits=limits), drone.next_state()
    towards = -1.0 if state.x > 0.0 else 1.0
    goals = [Point((state.x, state.y, 2.0)), Point((state.x + 4.0 * towards, state.y, 3.0))]
    start = Motion((state.x, state.y, state.z), yaw_rad=state.yaw)
    path = plan(start, goals, obstacles=Obstacles(), arena=Arena(), style=style_of(limits))
    assert isinstance(path, Path)
    off_m: list[float] = []
    while not follower.finished:
        drone.command(follower.command(path, state, state.time_us * 1e-6))
        state = drone.next_state()
        if state.z > 2.05:
            off_m.append(abs(state.z - path.at(follower.progress_s).position_m[2]))
    assert max(off_m) < 0.07  # before it is known how far drag along the thrust disturbs the climb


def test_drone_that_brakes_and_turns_stops_on_its_path():
    drone = LockstepVehicle(FlightPlan(Layout.random(200).scenario)).drone
    asyncio.run(drone.ready())
    asyncio.run(drone.motors_on())
    follower, state = PathFollower(), drone.next_state()
    towards = -1.0 if state.x > 0.0 else 1.0  # through the arena, above all gates
    goals = [Point((state.x, state.y, 3.4)), Point((state.x + 4.0 * towards, state.y, 3.4))]
    start = Motion((state.x, state.y, state.z), yaw_rad=state.yaw)
    path = plan(start, goals, obstacles=Obstacles(), arena=Arena(), style=CONTEST)
    assert isinstance(path, Path)
    side_m, moved_m, began_m, y_m = 0.0, 0.0, state.x, state.y
    while moved_m < 1.5:
        drone.command(follower.command(path, state, state.time_us * 1e-6))
        state = drone.next_state()
        moved_m = abs(state.x - began_m)
    fast_m_s = hypot(*state.velocity_arena_m_s)
    for _ in range(60):
        now_s = state.time_us * 1e-6
        drone.command(follower.command(path, state, now_s, turn_rad_s=0.9, brake_m_s2=1.3))
        state = drone.next_state()
        side_m = max(side_m, abs(state.y - y_m))
    assert fast_m_s > 0.7
    assert hypot(*state.velocity_arena_m_s) < 0.05
    assert abs(state.x - began_m) - moved_m < 0.7
    assert side_m < 0.08
    braking = follower.braking()
    assert braking is not None
    assert hypot(*braking.velocity_m_s) < 0.01
