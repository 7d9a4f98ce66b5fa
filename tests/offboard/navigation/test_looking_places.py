"""Places to look at a gate from, also for gates in corners and beside obstacles."""

from __future__ import annotations

from math import cos, dist, hypot, pi, remainder, sin

import pytest

from offboard.navigation.goals import CONTEST, Obstacles, PathGate
from offboard.navigation.search.looking_places import LookingPlaces
from offboard.navigation.view import GateEstimate
from scenarios.models import Arena

PLACES = LookingPlaces(Arena(), CONTEST)
MARGIN_M = CONTEST.side_margin_m - 1e-6


def gate_at(position_m, yaw_rad=0.0):
    exact = (0.01, 0.01, 0.01)
    return GateEstimate("red", position_m, yaw_rad, exact, 0.01, False, True, views=9, seen_us=0)


@pytest.mark.parametrize("corner", [(4.4, 4.4), (-4.4, 4.4), (-4.4, -4.4), (4.4, -4.4)])
@pytest.mark.parametrize("yaw_rad", [0.0, 0.8, 1.6, 2.4])
def test_places_are_in_the_arena_and_face_the_gate(corner, yaw_rad):
    gate = gate_at((*corner, 3.7), yaw_rad)
    for away_m in (0.4, 1.5):
        here = (corner[0] - away_m * cos(yaw_rad), corner[1] - away_m * sin(yaw_rad), 3.5)
        for goal in [PLACES.before(gate, here, Obstacles()), PLACES.aside(gate, here, 1, Obstacles())]:
            x, y, z = goal.position_m
            assert max(abs(x), abs(y)) <= 5.0 - MARGIN_M
            assert 0.25 <= z <= 4.0 - MARGIN_M
            assert goal.yaw_rad is not None
            towards = (corner[0] - x) * cos(goal.yaw_rad) + (corner[1] - y) * sin(goal.yaw_rad)
            assert towards == pytest.approx(hypot(corner[0] - x, corner[1] - y))


def test_place_before_a_gate_is_on_its_normal_unless_something_is_there():
    gate, here = gate_at((0.0, 0.0, 1.0)), (2.0, 0.5, 1.0)
    assert PLACES.before(gate, here, Obstacles()).position_m == pytest.approx((1.0, 0.0, 1.0))
    nearer = PLACES.before(gate, here, Obstacles(columns_m=((1.2, 0.0, 0.1),)))
    assert dist(nearer.position_m, (1.2, 0.0, 1.0)) > 0.35
    assert nearer.position_m[1] == pytest.approx(0.0)
    other = PLACES.before(gate, here, Obstacles(gates=(PathGate((0.8, 0.0, 1.0), 0.0),)))
    assert abs(other.position_m[0] - 0.8) > 0.25 or abs(other.position_m[1]) > 0.45


def test_sides_are_taken_in_turn_and_the_other_one_if_the_first_is_not_free():
    gate, here = gate_at((0.0, 0.0, 1.0)), (2.0, 0.0, 1.0)
    left, right = (PLACES.aside(gate, here, side, Obstacles()).position_m for side in (1, -1))
    assert left[1] > 0.3 > -0.3 > right[1]
    wall = tuple((0.1 * step, 0.4, 0.2) for step in range(30))
    assert PLACES.aside(gate, here, 1, Obstacles(columns_m=wall)).position_m[1] < 0.0


def test_place_behind_the_drone_is_in_the_arena():
    goal = PLACES.back((-4.5, 0.0, 3.7), 0.0)
    assert goal.position_m == pytest.approx((-4.75, 0.0, 3.75))
    assert remainder(goal.yaw_rad, 2 * pi) == 0.0
