"""The missions with a map, each in a whole flight of a layout."""

import asyncio
from math import cos, hypot, sin

import pytest

from framerunner.commands import with_sensors
from framerunner.flying.lockstep import LockstepVehicle, fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.flying.response import ResponseDelay
from offboard.app import fly_mission
from offboard.mission import load_mission
from offboard.navigation.goals import LATE_S
from offboard.response.estimate import ResponseEstimate
from scenarios.loader import load_scenario


def test_explorer_with_a_soft_landing_comes_down_on_the_base_without_falling():
    flown = fly_lockstep(FlightPlan(load_scenario("calm-17"), load_mission("explorer_soft_landing")))
    assert flown.result.verdict == "clean"
    assert flown.outcome.mission_state == "landing.touch_down"


@pytest.mark.parametrize(
    ("mission", "airframe", "response", "least_s", "most_s"),
    [
        ("explorer", "abejorro", None, 0.1, 0.5),
        ("explorer_soft_landing", "abejorro", None, 0.1, 0.5),
        ("racer", "abejorro", None, 0.1, 0.5),
        ("explorer", "abejorro", ResponseDelay(0.6, 0.15, 0.05), 0.3, 1.0),
        ("explorer", "x500", None, 2.5, 4.0),  # as with PX4, it leaves the ground after three seconds
        ("frame_challenge", "abejorro", None, 1.0, 2.0),  # waits for the next heartbeat
    ],
)
def test_the_drone_takes_off_at_once_but_for_the_paper_s_navigator(
    mission, airframe, response, least_s, most_s
):
    changed = {"airframe": airframe, "try_limit_s": 5.0}
    scenario = load_scenario("test-case-2").model_copy(update=changed)
    plan = FlightPlan(scenario, load_mission(mission), response=response)
    risen_s = []

    def watch(truth):
        if truth.position_arena_m[2] > plan.start_pose[2] + 0.1:
            risen_s.append(vehicle.simulation.referee.try_time_s)

    vehicle = LockstepVehicle(plan, observers=(watch,))
    surroundings = plan.surroundings
    flight = fly_mission(
        vehicle.drone, vehicle.perception, plan.chart, limit_s=4.5, surroundings=surroundings
    )
    outcome = asyncio.run(flight)
    assert (outcome.ended, outcome.pauses) == ("timed out", 0)
    assert least_s < risen_s[0] < most_s


@pytest.mark.parametrize("name", ["calm-21004", "calm-21036"])
def test_a_drone_that_is_flown_at_its_limits_is_not_taken_for_a_late_one(name):
    """Layouts of racer in which it was: it then braked and swung for seconds."""
    plan = FlightPlan(load_scenario(name), load_mission("racer"))
    vehicle, late_s = LockstepVehicle(plan), []
    with pytest.MonkeyPatch.context() as patch:
        summarise = ResponseEstimate._summarise

        def noting(estimate):
            summarise(estimate)
            late = estimate.response.late_s > LATE_S[0]
            late_s.extend([vehicle.simulation.referee.try_time_s] if late else [])

        patch.setattr(ResponseEstimate, "_summarise", noting)
        flight = fly_mission(
            vehicle.drone,
            vehicle.perception,
            plan.chart,
            limit_s=5.0,
            limits=plan.command_limits,
            surroundings=plan.surroundings,
        )
        asyncio.run(flight)
    assert late_s == []


def test_a_path_leads_on_from_a_gate_to_where_the_search_for_the_next_begins():
    plan = FlightPlan(load_scenario("calm-20037"), load_mission("racer"))
    red = next(gate for gate in plan.layout.frames if gate.colour == "red")
    ends_m = []

    def see(moment):
        if moment.mission_state == "red.crossing" and moment.navigation.path_m:
            ends_m.append(moment.navigation.path_m[-1])

    fly_lockstep(plan, observers=(see,))
    x, y, z = (end - at for end, at in zip(ends_m[-1], red.position_arena_m, strict=True))
    across_m = hypot(cos(red.yaw_rad) * y - sin(red.yaw_rad) * x, z)
    assert across_m > 0.3  # it does not only end straight behind


def test_a_result_says_how_exactly_a_drone_that_drifts_knew_its_place():
    scenario = with_sensors(load_scenario("calm-17"), "flow")
    flown = fly_lockstep(FlightPlan(scenario, load_mission("explorer"), 4))
    result, track = flown.result, flown.track
    assert len(result.place_errors_m) == len(result.crossing_times_s)
    assert max(*result.place_errors_m, result.last_place_error_m) < result.largest_reported_error_m
    assert result.largest_reported_error_m == pytest.approx(
        track.largest_error_m(track.reported_path), abs=1e-4
    )
    assert 0.0 < result.largest_place_std_m < 2.0
    for time_s, error_m in zip(result.crossing_times_s, result.place_errors_m, strict=True):
        assert hypot(*track.place_error_m(time_s)) == pytest.approx(error_m, abs=1e-4)
