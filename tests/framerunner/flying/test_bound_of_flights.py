"""The bound of real flights: no try beats it, and results quote it."""

import pytest

from framerunner.evaluation.runner import fly_task
from framerunner.flying.envelopes import EnvelopeError, bound_of, bound_s
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.air import Wind
from scenarios.loader import load_scenario
from scenarios.models import Gate, Scenario, ScenarioError
from tests.framerunner import reference_flights


@pytest.mark.parametrize("name", reference_flights.SCENARIOS)
def test_no_stored_flight_is_shorter_than_its_bound(name):
    ticks = reference_flights.load(name)
    flown_s = (ticks[-1].time_us - ticks[0].time_us) * 1e-6
    assert 5.0 < bound_s(FlightPlan(load_scenario(name)), "contest") < flown_s


def test_a_result_quotes_the_bound_and_its_multiple_of_it():
    scenario = load_scenario("test-case-2")
    result = fly_task(FlightPlan(scenario, load_mission("frame_challenge")))
    assert result.bound_s == bound_s(FlightPlan(scenario), "contest") < result.try_time_s
    assert result.times_bound == pytest.approx(result.try_time_s / result.bound_s, abs=1e-3)
    limited = scenario.model_copy(update={"try_limit_s": 5.0})
    failed = fly_task(FlightPlan(limited, load_mission("frame_challenge")))
    assert (failed.bound_s, failed.times_bound) == (result.bound_s, None)


def test_more_speed_means_a_lower_bound():
    plan = FlightPlan(load_scenario("calm-17"))
    assert bound_of(plan, "open").time_s < bound_of(plan, "contest").time_s


def test_gates_lifted_for_a_drone_without_a_base_are_bounded_where_they_are():
    plan = FlightPlan(load_scenario("test-case-1"))
    heights_m = [point[2] for point in bound_of(plan.lifted(0.5), "contest").points_arena_m[1:4]]
    gates = (gate.z_m + 0.5 for gate in plan.scenario.frames)
    assert all(abs(z_m - lifted_m) <= 0.09 + 1e-9 for z_m, lifted_m in zip(heights_m, gates, strict=True))


def test_without_frames_or_a_measured_airframe_or_in_wind_there_is_no_bound():
    empty = FlightPlan(load_scenario("empty"))
    gate = Gate(colour="red", x_m=2, y_m=0, z_m=1, yaw_rad=0)
    other = FlightPlan(Scenario(name="other", airframe="x500", frames=(gate,)))
    with pytest.raises(ScenarioError, match="has no frames"):
        bound_of(empty, "contest")
    with pytest.raises(EnvelopeError, match="airframe x500: its motion was not measured, so no bound; use"):
        bound_of(other, "contest")
    windy = FlightPlan(Scenario(name="windy", frames=(gate,), wind=Wind(gust_m_s=1.0)))
    with pytest.raises(EnvelopeError, match="windy: wind pushes a drone beyond its limits, so no bound"):
        bound_of(windy, "contest")
    assert all(bound_s(plan, "contest") is None for plan in (empty, other, windy))
