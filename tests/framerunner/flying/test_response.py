"""A simulated vehicle that answers late."""

from __future__ import annotations

from math import cos

import pytest

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.lockstep_drone import LockstepDrone
from framerunner.flying.plan import FlightPlan
from framerunner.flying.response import LateResponse, ResponseDelay
from offboard.drone import VelocityFluCommand
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

START = (0.0, 0.0, 0.5, 0.3)
CLIMB = VelocityFluCommand(up_m_s=0.5)


async def fly(drone, command, ticks):
    states = []
    async for state in drone.ticks():
        states.append(state)
        drone.command(command)
        if len(states) == ticks:
            return states
    return states


async def in_the_air(response, seed=0):
    simulation = Simulation(load_scenario("empty"))
    drone = LockstepDrone(simulation, START, response=LateResponse(response, seed))
    await drone.ready()
    await drone.motors_on()
    await fly(drone, CLIMB, 60)
    await fly(drone, VelocityFluCommand(), 100)
    return drone


async def answer(response):
    """Speed along a command, as a share of it, at each tick of four seconds after it was given."""
    drone = await in_the_air(response)
    states = await fly(drone, VelocityFluCommand(forward_m_s=0.8), 80)
    return [state.velocity_arena_m_s[0] / cos(START[3]) / 0.8 for state in states]


def delay_s(shares):
    """How far an answer is behind its command: the area between both."""
    return 0.05 * sum(1.0 - share for share in shares)


async def test_speed_comes_after_the_dead_time_with_the_lag():
    own, dead = await answer(ResponseDelay()), await answer(ResponseDelay(dead_time_s=0.3))
    assert delay_s(dead) - delay_s(own) == pytest.approx(0.3, abs=0.02)
    assert max(dead[:7]) < 0.02 < own[6]
    late = await answer(ResponseDelay(lag_s=0.6, dead_time_s=0.3))
    assert delay_s(late) - delay_s(own) == pytest.approx(0.9, abs=0.03)
    assert max(late) < 1.01


async def test_a_late_vehicle_that_turns_flies_where_it_was_sent_not_where_it_looks():
    drone = await in_the_air(ResponseDelay(dead_time_s=1.0))
    await fly(drone, VelocityFluCommand(yaw_rate_rad_s=0.8), 40)
    first = (await fly(drone, VelocityFluCommand(forward_m_s=0.8), 1))[0]
    await fly(drone, VelocityFluCommand(), 20)  # meanwhile it turns on
    (seen,) = await fly(drone, VelocityFluCommand(), 1)
    assert abs(seen.yaw - first.yaw) > 0.5
    moved = (seen.x - first.x, seen.y - first.y)
    assert moved == pytest.approx((0.0, 0.0), abs=0.05)  # one tick of 0.8 m/s in all


async def test_height_wanders_as_told_in_a_hover_and_not_on_the_ground():
    drone = await in_the_air(ResponseDelay(height_wander_m=0.05), seed=3)
    heights_m = [state.z for state in await fly(drone, VelocityFluCommand(), 600)]
    assert 0.05 < max(heights_m) - min(heights_m) <= 0.105
    simulation = Simulation(load_scenario("empty"))
    grounded = LockstepDrone(simulation, START, response=LateResponse(ResponseDelay(height_wander_m=0.5), 3))
    await grounded.ready()
    await grounded.motors_on()
    assert all(state.landed for state in await fly(grounded, VelocityFluCommand(), 100))


def test_a_late_flight_repeats_differs_by_seed_and_says_what_it_was():
    scenario = load_scenario("test-case-2").model_copy(update={"try_limit_s": 8.0})
    plans = [
        FlightPlan(scenario, load_mission("frame_challenge"), seed, response=response)
        for response in (ResponseDelay(0.3, 0.1, 0.05), None)
        for seed in (1, 1, 2)
    ]
    results = [fly_lockstep(plan).result for plan in plans]
    hashes = [result.state_sha256 for result in results]
    assert hashes[0] == hashes[1] != hashes[2]
    assert hashes[3] == hashes[4] == hashes[5] not in hashes[:3]
    assert results[0].response == "lag=0.3,dead-time=0.1,height-wander=0.05"
    assert results[3].response == ""


def test_explorer_learns_how_late_the_vehicle_answers_and_stays_clean():
    response = ResponseDelay(0.6, 0.15, 0.05)
    result = fly_lockstep(
        FlightPlan(load_scenario("calm-5004"), load_mission("explorer"), 5004, response=response)
    ).result
    assert result.verdict == "clean"
    assert max(result.crossing_offsets_m) < 0.05
