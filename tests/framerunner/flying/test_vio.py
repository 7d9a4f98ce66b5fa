"""Flights that know their place by camera and IMU alone."""

import asyncio
from math import hypot

import pytest

from framerunner.flying.lockstep import lockstep_flight
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.loader import load_scenario

SEED = 7


def flown(tracked=True):
    """The result, and how far off the estimate was at the ticks."""
    scenario = load_scenario("test-case-1").model_copy(update={"sensors": "vio"})
    plan = FlightPlan(scenario, load_mission("explorer"), SEED)
    truths, errors_m = {}, []

    def note(truth):
        truths[truth.time_us] = truth

    def look(moment):
        truth = truths.get(moment.state.time_us)
        if truth is not None and moment.state.armed:
            x, y, _ = truth.position_arena_m
            errors_m.append(hypot(moment.state.x - x, moment.state.y - y))

    return asyncio.run(lockstep_flight(plan, observers=(look,), truth_observers=(note,))), errors_m


@pytest.fixture(scope="module")
def flight():
    return flown()


def test_a_drone_without_compass_and_flow_flies_the_challenge(flight):
    result = flight[0].result
    assert result.verdict in ("clean", "completed")


def test_the_vehicle_knows_its_place_by_what_it_is_sent(flight):
    """Without it, the velocity is lost within seconds and the place with it."""
    errors_m = sorted(flight[1])
    assert errors_m[len(errors_m) // 2] < 0.3
    assert errors_m[-1] < 0.8


def test_the_same_seed_gives_the_same_flight(flight):
    assert flown()[0].result.state_sha256 == flight[0].result.state_sha256
