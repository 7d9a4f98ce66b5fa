"""Several drones in one world."""

from itertools import combinations
from math import dist

import pytest

from framerunner.vehicle.airframe import load_airframe
from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import StartPose, ground_height, is_over_base
from sitl.fleet import Fleet, side_by_side
from sitl.world import World

AIRFRAME = load_airframe("abejorro")
WIDTH_M = max(AIRFRAME.envelope_m[:2])


@pytest.mark.parametrize("name", list_scenarios())
def test_drones_start_apart_beside_base_and_gates(name):
    scenario = load_scenario(name)
    starts = [one.start for one in side_by_side(scenario, 8, WIDTH_M)]
    assert starts[0] == scenario.start
    assert all(dist((a.x_m, a.y_m), (b.x_m, b.y_m)) >= 1.5 for a, b in combinations(starts, 2))
    for start in starts[1:]:
        assert not is_over_base(scenario.base, start.x_m, start.y_m)
        assert ground_height(scenario, start.x_m, start.y_m) == 0.0
        assert abs(start.x_m) < scenario.arena.length_x_m / 2
        assert abs(start.y_m) < scenario.arena.width_y_m / 2
        assert start.yaw_rad == scenario.start.yaw_rad


def test_too_many_have_no_room():
    with pytest.raises(ValueError, match="room for"):
        side_by_side(load_scenario("empty"), 1000, WIDTH_M)


def test_four_stand_nearest_to_the_first():
    starts = [(one.start.x_m, one.start.y_m) for one in side_by_side(load_scenario("empty"), 5, WIDTH_M)]
    assert set(starts) == {(0, 0), (0, 1.5), (0, -1.5), (1.5, 0), (-1.5, 0)}


def worlds_at(*places):
    scenario = load_scenario("empty")
    return [
        World(scenario.model_copy(update={"start": StartPose(x_m=x, y_m=y, yaw_rad=0.0)}), AIRFRAME)
        for x, y in places
    ]


def idle(worlds, fleet, ticks):
    stopped = (0.0, 0.0, 0.0, 0.0)
    for _ in range(ticks):
        for world in worlds:
            world.step(stopped)
        fleet.tick()


def test_drones_that_overlap_push_each_other_apart_and_it_is_said():
    worlds = worlds_at((2.0, 0.0), (2.0 + 0.9 * AIRFRAME.envelope_m[0], 0.0))
    notices = []
    fleet = Fleet(worlds, notices.append)
    before_m = dist(worlds[0].position_arena_m, worlds[1].position_arena_m)
    idle(worlds, fleet, 250)
    after_m = dist(worlds[0].position_arena_m, worlds[1].position_arena_m)
    assert after_m > before_m + 0.01
    assert notices == ["drone 1 and drone 2 touch each other"]
    first, second = (world.position_arena_m for world in worlds)
    assert first[0] < 2.0 - 0.005 and second[0] > 2.0 + 0.9 * AIRFRAME.envelope_m[0] + 0.005


def test_drones_apart_do_not_disturb_each_other():
    alone = worlds_at((2.0, 0.0))
    idle(alone, Fleet(alone), 100)
    together = worlds_at((2.0, 0.0), (2.0, 1.5))
    notices = []
    idle(together, Fleet(together, notices.append), 100)
    assert notices == []
    assert together[0].position_arena_m == alone[0].position_arena_m


def test_one_drone_flies_as_before():
    (world,) = worlds_at((0.0, 0.0))
    fleet = Fleet([world])
    fleet.tick()
    assert world.touched == set()
