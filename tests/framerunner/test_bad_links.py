"""Flights over links that lose, swap, duplicate, delay and stop: all end safely, inside the box."""

import pytest

from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.framerunner.simulated_link import Impairment, fly_over
from tests.offboard.fakes import runaway

SEEDS = range(4)
IMPAIRMENTS = {
    "5 % lost": Impairment(loss=0.05),
    "20 % lost": Impairment(loss=0.2),
    "5 % lost, 100 ± 100 ms": Impairment(loss=0.05, jitter_s=0.2),
    "swapped once a second": Impairment(swap_every_s=1.03),
    "doubled": Impairment(doubled=0.3),
    "200 ms jitter": Impairment(jitter_s=0.2),
    "3 s of silence": Impairment(silent_s=(6.0, 9.0)),
}
TRY_LIMIT_S = 11.0
SLOW_AND_LOSSY = IMPAIRMENTS["5 % lost, 100 ± 100 ms"]


def before_a_low_gate():
    """Test case 1, but the drone starts before red, which is low: after seconds it shifts before it."""
    scenario = load_scenario("test-case-1")
    base = scenario.base.model_copy(update={"x_m": 1.5, "y_m": 2.0})
    start = scenario.start.model_copy(update={"x_m": 1.5, "y_m": 2.0, "yaw_rad": 0.0})
    red = scenario.frames[0].model_copy(update={"z_m": 0.3})
    gates = (red, *scenario.frames[1:])
    update = {"base": base, "start": start, "frames": gates, "try_limit_s": TRY_LIMIT_S}
    return scenario.model_copy(update=update)


def silence_later(impairment, seed):
    """The same silence at another time of the flight."""
    begin_s, end_s = impairment.silent_s
    if end_s == 0.0:
        return impairment
    later_s = 0.3 * seed
    return Impairment(silent_s=(begin_s + later_s, end_s + later_s))


@pytest.mark.parametrize("name", IMPAIRMENTS)
def test_every_flight_ends_safely_inside_its_box(name):
    scenario, mission = before_a_low_gate(), load_mission("frame_challenge")
    for seed in SEEDS:
        flight = fly_over(silence_later(IMPAIRMENTS[name], seed), scenario, mission, seed=seed)
        message = f"{name}, seed {seed}: {flight.outcome}, {flight.mode.name}"
        assert flight.ended_safely, message
        assert flight.farthest_outside_m < 0.0, message
        assert flight.lowest_m() > 0.1, message
        assert "ran back" not in flight.outcome.reason, message


@pytest.mark.parametrize("mission", ["frame_challenge", "careful_crossing"])
def test_a_flight_with_swapped_datagrams_is_completed(mission):
    scenario = load_scenario("test-case-3")
    flight = fly_over(Impairment(swap_every_s=1.03, doubled=0.1), scenario, load_mission(mission))
    assert flight.outcome.ended == "finished", flight.outcome
    assert flight.frames == ("red", "green", "blue")
    assert not flight.outcome.kept_in_box_s


@pytest.mark.parametrize(
    ("first", "then"),
    [((1, 0, 0), (1, 0, 0)), ((0, 1, 0), (0, 1, 0)), ((0, 0, 1), (0, 0, 1)), ((0.5, 0, 0), (0, 0, -1))],
)
def test_no_mission_leads_out_over_a_slow_and_lossy_link(tmp_path, first, then):
    mission = runaway(tmp_path, first, then)
    scenario = before_a_low_gate().model_copy(update={"frames": (), "try_limit_s": 14.0})
    for seed in range(2):
        flight = fly_over(SLOW_AND_LOSSY, scenario, mission, seed=seed)
        assert flight.outcome.kept_in_box_s > 1.0
        assert flight.ended_safely
        assert flight.farthest_outside_m < 0.01
        assert flight.lowest_m() > 0.1
