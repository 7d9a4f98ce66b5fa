"""What the navigator does with a goal, and when it needs every image."""

from dataclasses import replace

import pytest

from framerunner.flying.plan import FlightPlan
from offboard.drone import DroneState
from offboard.mission import load_mission
from offboard.navigation import path_flight
from offboard.navigation.goals import PathGate, Refusal
from offboard.navigation.navigator import Navigator
from offboard.navigation.view import GateEstimate
from offboard.navigation.world_model import WorldModel
from scenarios.random_scenarios import load_level, random_scenario
from tests.offboard.navigation.flown_layouts import flown

STATE = DroneState(0, 0.0, 0.0, 1.0, 0.0, (0.5, 0.0, 0.0), armed=True, offboard=True)


def test_images_are_left_out_only_in_slow_flight_to_what_is_known():
    plan = FlightPlan(random_scenario(load_level("calm"), 1), load_mission("explorer"))
    navigator = Navigator(plan.surroundings, plan.command_limits)
    assert navigator.image_period_s == 0.0
    navigator.observe(STATE, ())
    navigator.explore()
    assert 0.1 < navigator.image_period_s < 0.2
    navigator.observe(replace(STATE, time_us=50_000, velocity_arena_m_s=(1.2, 1.2, 0.0)), ())
    assert navigator.image_period_s == 0.0
    navigator.observe(replace(STATE, time_us=100_000), ())
    assert navigator.image_period_s > 0.0
    navigator.cross("red")  # which is not on the map
    assert navigator.image_period_s == 0.0


def test_a_drone_that_finds_no_way_to_a_viewpoint_looks_elsewhere(monkeypatch):
    """No way is found to anywhere that is higher than the drone, nor to the east of it."""
    plan = FlightPlan(random_scenario(load_level("calm"), 1), load_mission("explorer"))
    navigator = Navigator(plan.surroundings, plan.command_limits)
    asked = []

    class Refusing(path_flight.Search):
        def path(self, start=None):
            x, _, z = self.goals[0].position_m
            asked.append(self.goals[0])
            return Refusal("something is in the way") if x > -0.1 or z > 1.1 else super().path(start)

    monkeypatch.setattr(path_flight, "Search", Refusing)
    for tick in range(20 * 20):
        navigator.observe(replace(STATE, time_us=50_000 * tick, velocity_arena_m_s=(0.0, 0.0, 0.0)), ())
        navigator.explore()
        if navigator.view().path_m:
            break
    assert navigator.view().path_m
    assert len(set(asked)) > 3


def test_a_drone_that_something_unseen_holds_flies_back_the_way_it_came():
    """It is led through what it cannot pass until it sees that from a distance."""
    plan = FlightPlan(random_scenario(load_level("calm"), 1), load_mission("explorer"))
    navigator = Navigator(plan.surroundings, plan.command_limits)
    state, wall_x_m, stopped, least_x_m = STATE, 1.0, False, 9.0
    for _ in range(20 * 9):
        navigator.observe(state, ())
        before, state = state, flown(state, navigator.fly_to((3.0, 0.0, 1.0)))
        x_m, (_, y_m_s, up_m_s) = min(state.x, wall_x_m), state.velocity_arena_m_s
        held = x_m == wall_x_m  # also sideways: the drone does not slide along it
        y_m, y_m_s = (before.y, 0.0) if held else (state.y, y_m_s)
        state = replace(state, x=x_m, y=y_m, velocity_arena_m_s=((x_m - before.x) / 0.05, y_m_s, up_m_s))
        stopped = stopped or held
        least_x_m = min(least_x_m, x_m) if stopped else 9.0
    assert stopped
    assert least_x_m < wall_x_m - 0.5


def farthest_at(xs_m):
    return next((tick for tick, x_m in enumerate(xs_m) if x_m > 1.2), len(xs_m))


@pytest.mark.parametrize("refused", [True, False], ids=["no path is found", "each path is obstructed"])
def test_a_drone_from_which_no_way_leads_on_flies_back_the_way_it_came(monkeypatch, refused):
    plan = FlightPlan(random_scenario(load_level("calm"), 1), load_mission("explorer"))
    navigator, xs_m = Navigator(plan.surroundings, plan.command_limits), [0.0]

    def is_shut(to_x_m):
        """The way is blocked from when the drone is at 1.2 m until it has been back at 0.8 m."""
        return min(xs_m[farthest_at(xs_m) :], default=0.0) > 0.8 and to_x_m > xs_m[-1]

    class Refusing(path_flight.Search):
        def path(self, start=None):
            shut = refused and is_shut(self.goals[0].position_m[0])
            return Refusal("obstacles block the way") if shut else super().path(start)

    monkeypatch.setattr(path_flight, "Search", Refusing)
    monkeypatch.setattr(
        path_flight, "obstructed", lambda places_m, *_, **__: not refused and is_shut(places_m[-1][0])
    )
    state = STATE
    while len(xs_m) < 20 * 40 and xs_m[-1] < 2.8:
        navigator.observe(state, ())
        state = flown(state, navigator.fly_to((3.0, 0.3 if max(xs_m) > 1.2 else 0.0, 1.0)))
        xs_m.append(state.x)
    assert xs_m[-1] >= 2.8
    assert min(xs_m[farthest_at(xs_m) :]) < 0.8


def test_a_gate_that_is_not_certain_is_not_flown_through(monkeypatch):
    """It seems to be above the ceiling, and no path is found to a place from which it would be looked at."""
    plan = FlightPlan(random_scenario(load_level("calm"), 1), load_mission("explorer"))
    navigator, state = Navigator(plan.surroundings, plan.command_limits), replace(STATE, z=3.5)
    ceiling_m = plan.surroundings.arena.height_m
    unsure = GateEstimate("red", (3.0, 0.0, ceiling_m + 0.46), 0.0, (0.1, 0.1, 0.1), 0.1, False, False, 3, 0)
    monkeypatch.setattr(WorldModel, "gate", lambda self, colour: unsure if colour == "red" else None)

    class Refusing(path_flight.Search):
        def path(self, start=None):
            gate = isinstance(self.goals[0], PathGate)
            return super().path(start) if gate else Refusal("obstacles block the way")

    monkeypatch.setattr(path_flight, "Search", Refusing)
    xs_m = []
    while not navigator.refused and len(xs_m) < 20 * 15:
        navigator.observe(state, ())
        state = flown(state, navigator.cross("red"))
        xs_m.append(state.x)
    assert 2.0 < max(xs_m) < 2.9
    assert navigator.refused


def test_a_gate_that_is_refused_again_and_again_begins_anew(monkeypatch):
    plan = FlightPlan(random_scenario(load_level("calm"), 1), load_mission("explorer"))
    navigator, state, forgotten = Navigator(plan.surroundings, plan.command_limits), STATE, []
    monkeypatch.setattr(WorldModel, "forget", lambda self, colour: forgotten.append(colour))
    counts = []
    for _ in range(6):
        for action in (navigator.step_back, navigator.cross):
            navigator.observe(state, ())
            state = flown(state, action("red"))
        counts.append(len(forgotten))
    assert counts == [0, 0, 1, 1, 1, 2]
    assert set(forgotten) == {"red"}
