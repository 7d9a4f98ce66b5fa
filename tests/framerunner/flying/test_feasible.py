"""The flight that is said to be possible is possible: it is flown in lockstep, cleanly and in that time."""

import asyncio
from math import hypot

import pytest

from framerunner.flying.envelopes import bound_s
from framerunner.flying.feasible import feasible, feasible_path
from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from offboard.navigation.following import PathFollower
from scenarios.loader import load_scenario
from scenarios.models import Wall


def fly(plan, path):
    """Follow a path; the referee's report."""
    vehicle = LockstepVehicle(plan)
    drone, follower, limits = vehicle.drone, PathFollower(limits=plan.command_limits), plan.command_limits
    asyncio.run(drone.ready())
    asyncio.run(drone.motors_on(confirmed=False))
    state = drone.next_state()
    end_us = state.time_us + 60_000_000
    while not (follower.finished and follower.error_m < 0.15) and state.time_us < end_us:
        command = follower.command(path, state, state.time_us * 1e-6)
        assert max(abs(command.forward_m_s), abs(command.left_m_s)) <= limits.forward_m_s
        assert hypot(command.forward_m_s, command.left_m_s) <= limits.level_m_s + 1e-9
        assert -limits.down_m_s <= command.up_m_s <= limits.up_m_s
        drone.command(command)
        state = drone.next_state()
    asyncio.run(drone.motors_off())
    drone.settle()
    return vehicle.simulation.referee.report()


@pytest.mark.parametrize(
    ("name", "mission"),
    [
        ("test-case-2", "explorer"),
        ("calm-8", "explorer"),
        ("crowded-5", "explorer"),
        ("calm-12", "racer"),
    ],
)
def test_a_possible_flight_is_flown_in_its_time_and_not_faster_than_the_bound(name, mission):
    plan = FlightPlan(load_scenario(name), load_mission(mission))
    mission_class = plan.chart.mission_class
    report = fly(plan, feasible_path(plan, mission_class))
    assert report.verdict == "clean", report.reason
    assert report.try_time_s == pytest.approx(feasible(plan, mission_class).time_s, abs=0.2)
    assert bound_s(plan, mission_class) < report.try_time_s < 3.0 * bound_s(plan, mission_class)


def test_more_speed_makes_a_faster_flight_possible():
    plan = FlightPlan(load_scenario("calm-8"))
    assert bound_s(plan, "open") < feasible(plan, "open").time_s < feasible(plan, "contest").time_s


def test_no_flight_leads_through_a_wall():
    scenario = load_scenario("test-case-1")
    wall = Wall(x_m=-5, y_m=-1.5, end_x_m=5, end_y_m=-1.5)  # between the start and all gates
    blocked = FlightPlan(scenario.model_copy(update={"walls": (wall,)}))
    assert isinstance(feasible(blocked, "contest"), str)
