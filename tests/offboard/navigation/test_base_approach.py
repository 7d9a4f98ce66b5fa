"""The way home of a drone that does not know its place."""

from math import atan2, cos, hypot, pi, remainder, sin

import pytest

from offboard.drone import DroneState
from offboard.navigation.base_approach import (
    BEFORE_M,
    CORRECT_S,
    FARTHER_M,
    KNOWN_M,
    PAUSE_S,
    PLACES,
    REACH_S,
    ROUNDS,
    SEARCH_S,
    SIGHTINGS,
    UNSURE_M,
    WayHome,
)
from scenarios.models import Arena, Base

BASE = Base(x_m=1.0, y_m=-2.0)
GOAL_M = (1.02, -1.97, 0.6)
NOT_SEEN, SEEN = (0, 0.2), (SIGHTINGS, 0.01)


def state_at(x: float, y: float, z: float, time_s: float = 10.0) -> DroneState:
    return DroneState(round(time_s * 1e6), x, y, z, 0.0, (0.0, 0.0, 0.0))


def away_m(point: tuple[float, float, float]) -> float:
    return hypot(point[0] - BASE.x_m, point[1] - BASE.y_m)


def test_a_drone_that_knows_its_place_flies_to_the_goal() -> None:
    way = WayHome(BASE, Arena())
    assert way.goal(GOAL_M, state_at(-3.0, 0.0, 1.0), None, no_path=False).position_m == GOAL_M
    assert not way.looks


def test_a_goal_beside_the_base_is_flown_to_at_once() -> None:
    beside_m = (BASE.x_m + 0.4, BASE.y_m, 0.6)
    way = WayHome(BASE, Arena())
    assert way.goal(beside_m, state_at(-3.0, 0.0, 1.0), NOT_SEEN, no_path=False).position_m == beside_m


def test_the_base_is_looked_at_from_before_it_and_then_landed_on() -> None:
    way = WayHome(BASE, Arena())
    here = state_at(-3.0, 0.0, 1.0)
    place = way.goal(GOAL_M, here, SEEN, no_path=False)
    assert away_m(place.position_m) == pytest.approx(BEFORE_M)
    x, y, _ = place.position_m
    assert place.yaw_rad == pytest.approx(atan2(BASE.y_m - y, BASE.x_m - x))
    assert hypot(x + 3.0, y) < hypot(BASE.x_m + 3.0, BASE.y_m)  # on the drone's side
    assert way.looks
    there = state_at(*place.position_m)
    assert way.goal(GOAL_M, there, NOT_SEEN, no_path=False) == place
    landing = way.goal(GOAL_M, there, SEEN, no_path=False)
    assert landing.position_m == GOAL_M
    assert not way.looks


def test_one_that_is_not_seen_is_looked_for_from_other_sides_again_and_again_before_it_lands() -> None:
    way, time_s = WayHome(BASE, Arena()), 10.0
    place = way.goal(GOAL_M, state_at(-3.0, 0.0, 1.0), NOT_SEEN, no_path=False)
    sides: list[float] = []
    looked = []
    while way.looks:
        x, y, _ = place.position_m
        side = atan2(y - BASE.y_m, x - BASE.x_m)
        if not any(abs(remainder(side - other, 2 * pi)) < 0.1 for other in sides):
            sides.append(side)
        looked.append(away_m(place.position_m))
        here = place
        while place == here:
            time_s += 0.2
            place = way.goal(GOAL_M, state_at(*here.position_m, time_s), NOT_SEEN, no_path=False)
    assert place.position_m == GOAL_M
    assert len(sides) >= PLACES
    assert looked == pytest.approx([BEFORE_M, FARTHER_M] * PLACES * ROUNDS)


def test_a_place_that_is_not_reached_is_given_up() -> None:
    way, here = WayHome(BASE, Arena()), state_at(-3.0, 0.0, 1.0)
    place = way.goal(GOAL_M, here, NOT_SEEN, no_path=False)
    for time_s in (11.0, 9.9 + REACH_S):
        assert way.goal(GOAL_M, state_at(-3.0, 0.0, 1.0, time_s), NOT_SEEN, no_path=False) == place
    later = state_at(-3.0, 0.0, 1.0, 10.1 + REACH_S)
    assert way.goal(GOAL_M, later, NOT_SEEN, no_path=False) != place


def test_places_are_inside_the_arena() -> None:
    corner = Base(x_m=-4.2, y_m=-4.2)
    way, time_s = WayHome(corner, Arena()), 10.0
    goal_m = (-4.2, -4.2, 0.6)
    place = way.goal(goal_m, state_at(-4.5, -4.5, 1.0), NOT_SEEN, no_path=False)
    while way.looks:
        assert max(map(abs, place.position_m[:2])) < 5.0
        time_s += 0.1
        place = way.goal(goal_m, state_at(-4.5, -4.5, 1.0, time_s), NOT_SEEN, no_path=True)
    assert place.position_m == goal_m


def test_a_new_way_looks_again() -> None:
    way = WayHome(BASE, Arena())
    near = state_at(BASE.x_m + cos(2.0), BASE.y_m + sin(2.0), 1.0)
    way.goal(GOAL_M, near, SEEN, no_path=False)
    assert not way.looks
    way.begin()
    way.goal(GOAL_M, near, NOT_SEEN, no_path=False)
    assert way.looks


def test_one_that_is_not_seen_is_first_looked_for_farther_around_and_from_farther_away() -> None:
    way = WayHome(BASE, Arena())
    place = way.goal(GOAL_M, state_at(-3.0, 0.0, 1.0), NOT_SEEN, no_path=False)
    assert way.goal(GOAL_M, state_at(*place.position_m, 10.0), NOT_SEEN, no_path=False) == place
    assert not way.searches
    farther = way.goal(GOAL_M, state_at(*place.position_m, 10.1 + SEARCH_S), NOT_SEEN, no_path=False)
    assert way.searches
    assert farther.yaw_rad == pytest.approx(place.yaw_rad)
    assert away_m(farther.position_m) == pytest.approx(FARTHER_M)
    way.goal(GOAL_M, state_at(*farther.position_m, 13.0), NOT_SEEN, no_path=False)
    seen_there = way.goal(GOAL_M, state_at(*farther.position_m, 13.5), SEEN, no_path=False)
    assert seen_there.position_m == GOAL_M


BESIDE_M = (BASE.x_m - 3.0, BASE.y_m, 1.0)  # a goal that is not on the base
LOST, FOUND, BETWEEN = (0, UNSURE_M + 0.1), (0, KNOWN_M - 0.05), (0, 0.4)


def corrected(way: WayHome, known: tuple[int, float], time_s: float) -> bool:
    """Whether the drone flies to a place from which it looks at the base instead of to its goal."""
    place = way.goal(BESIDE_M, state_at(-3.0, 0.0, 1.0, time_s), known, no_path=False)
    return place.position_m != BESIDE_M


def test_a_place_that_is_too_uncertain_is_corrected_at_the_base_before_the_drone_goes_on() -> None:
    way = WayHome(BASE, Arena())
    assert not corrected(way, BETWEEN, 10.0)
    place = way.goal(BESIDE_M, state_at(-3.0, 0.0, 1.0, 10.1), LOST, no_path=False)
    assert away_m(place.position_m) == pytest.approx(BEFORE_M)
    x, y, _ = place.position_m
    assert place.yaw_rad == pytest.approx(atan2(BASE.y_m - y, BASE.x_m - x))
    assert way.looks
    assert corrected(way, BETWEEN, 15.0)  # not until it is known well
    assert not corrected(way, FOUND, 16.0)
    assert not way.looks


def test_a_correction_that_does_not_help_ends_and_is_not_tried_again_at_once() -> None:
    way = WayHome(BASE, Arena())
    assert corrected(way, LOST, 10.0)
    assert corrected(way, LOST, 10.0 + CORRECT_S - 0.1)
    assert not corrected(way, LOST, 10.0 + CORRECT_S + 0.1)
    assert not corrected(way, LOST, 10.0 + CORRECT_S + PAUSE_S - 0.1)
    assert corrected(way, LOST, 10.0 + CORRECT_S + PAUSE_S + 0.3)


def test_the_way_to_a_correction_that_is_shut_leads_from_another_side() -> None:
    way = WayHome(BASE, Arena())
    here = state_at(-3.0, 0.0, 1.0)
    first = way.correction(here, LOST, no_path=False)
    other = way.correction(here, LOST, no_path=True)
    assert first is not None
    assert other is not None
    assert first.position_m != other.position_m
    assert away_m(other.position_m) == pytest.approx(BEFORE_M)
