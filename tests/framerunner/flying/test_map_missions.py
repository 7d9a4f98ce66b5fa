"""The missions with a map, each in a whole flight of a layout."""

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.loader import load_scenario


def test_explorer_with_a_soft_landing_comes_down_on_the_base_without_falling():
    flown = fly_lockstep(FlightPlan(load_scenario("calm-17"), load_mission("explorer_soft_landing")))
    assert flown.result.verdict == "clean"
    assert flown.outcome.mission_state == "landing.touch_down"
