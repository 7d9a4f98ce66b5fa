"""Stepped by plain calls, the drone flies as it does under a mission."""

import asyncio

import pytest

from framerunner.flying.lockstep_drone import LockstepDrone
from framerunner.gym.flight import run_through
from offboard.drone import VelocityFluCommand
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

START = (0.0, 0.0, 0.5, 0.0)
TICKS = 40


def command(tick):
    return VelocityFluCommand(forward_m_s=0.3, up_m_s=0.8 - 0.01 * tick, yaw_rate_rad_s=0.5)


async def flown_by_a_mission():
    drone = LockstepDrone(Simulation(load_scenario("empty")), START)
    await drone.ready()
    await drone.motors_on(confirmed=False)
    states = []
    async for state in drone.ticks():
        states.append(state)
        if len(states) == TICKS:
            return states
        drone.command(command(len(states)))
    return states


def test_its_states_are_those_of_a_mission_s_ticks():
    drone = LockstepDrone(Simulation(load_scenario("empty")), START)
    run_through(drone.ready())
    run_through(drone.motors_on(confirmed=False))
    states = [drone.next_state()]
    while len(states) < TICKS:
        drone.command(command(len(states)))
        states.append(drone.next_state())
    assert states == asyncio.run(flown_by_a_mission())
    assert states[-1].z > 0.7


def test_a_coroutine_that_waits_is_an_error():
    with pytest.raises(RuntimeError, match="waits for an event"):
        run_through(asyncio.sleep(0))
