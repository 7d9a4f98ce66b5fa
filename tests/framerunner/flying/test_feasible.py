"""The flight that is said to be possible is possible: it is flown in lockstep, cleanly and in that time."""

import asyncio

import pytest

from framerunner.flying.envelopes import bound_s
from framerunner.flying.feasible import feasible, feasible_path
from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from offboard.navigation.following import PathFollower
from scenarios.loader import load_scenario
from scenarios.models import Wall


def fly(plan, path):
    """Follow a path; the referee's report."""
    vehicle = LockstepVehicle(plan)
    drone, follower, limits = vehicle.drone, PathFollower(), plan.command_limits
    asyncio.run(drone.ready())
    asyncio.run(drone.motors_on())
    state = drone.next_state()
    end_us = state.time_us + 60_000_000
    while not (follower.finished and follower.error_m < 0.15) and state.time_us < end_us:
        command = follower.command(path, state, state.time_us * 1e-6)
        assert max(abs(command.forward_m_s), abs(command.left_m_s)) <= limits.forward_m_s
        assert abs(command.up_m_s) <= limits.up_m_s
        drone.command(command)
        state = drone.next_state()
    asyncio.run(drone.motors_off())
    drone.settle()
    return vehicle.simulation.referee.report()


@pytest.mark.parametrize("name", ["test-case-2", "calm-8", "crowded-5"])
def test_a_possible_flight_is_flown_in_its_time_and_not_faster_than_the_bound(name):
    plan = FlightPlan(load_scenario(name))
    report = fly(plan, feasible_path(plan, "contest"))
    assert report.verdict == "clean", report.reason
    assert report.try_time_s == pytest.approx(feasible(plan, "contest").time_s, abs=0.5)
    assert bound_s(plan, "contest") < report.try_time_s < 3.0 * bound_s(plan, "contest")


def test_more_speed_makes_a_faster_flight_possible():
    plan = FlightPlan(load_scenario("calm-8"))
    assert bound_s(plan, "open") < feasible(plan, "open").time_s < feasible(plan, "contest").time_s


def test_no_flight_leads_through_a_wall():
    scenario = load_scenario("test-case-1")
    wall = Wall(x_m=-5, y_m=-1.5, end_x_m=5, end_y_m=-1.5)  # between the start and all frames
    blocked = FlightPlan(scenario.model_copy(update={"walls": (wall,)}))
    assert isinstance(feasible(blocked, "contest"), str)
