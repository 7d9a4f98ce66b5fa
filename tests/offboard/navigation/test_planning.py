"""Plans: continuous, within limits, clear of everything, through the openings in order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from framerunner.geometry.gate_shape import GateShape
from framerunner.geometry.vectors import Vec3
from offboard.navigation.goals import CONTEST, Motion, Obstacles, PathGate, Point, Refusal
from offboard.navigation.path import Path
from offboard.navigation.planner.clearance import Clearance
from offboard.navigation.planner.detours import MOST_WORK
from offboard.navigation.planner.legs import Array
from offboard.navigation.planner.passages import CELL_M, SPARE_M, Passages
from offboard.navigation.planning import Search, plan
from scenarios.models import Arena, Base
from tests.offboard.navigation.flown_layouts import (
    STEP_S,
    Layout,
    Sampled,
    base_distances,
    crossed,
    goals_left,
    least_margin,
    touching,
)

SEEDS = range(200, 212)


def planned(seed: int) -> tuple[Layout, Path]:
    layout = Layout.random(seed)
    path = layout.plan(layout.start, layout.goals)
    assert isinstance(path, Path), path
    return layout, path


@pytest.mark.parametrize("seed", SEEDS)
def test_path_crosses_the_gates_in_order_and_touches_none(seed: int):
    layout, path = planned(seed)
    sampled = Sampled(path)
    assert crossed(sampled, layout.gates) == [0, 1, 2]
    for gate in layout.gates:
        assert touching(sampled, gate) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_path_is_continuous_and_within_the_limits(seed: int):
    layout, path = planned(seed)
    sampled = Sampled(path)
    moved = np.diff(sampled.positions, axis=0) / STEP_S
    mean = (sampled.velocities[1:] + sampled.velocities[:-1]) / 2
    assert np.abs(moved - mean).max() < 0.02
    assert np.abs(np.diff(sampled.velocities, axis=0)).max() < 2.5 * STEP_S
    assert np.abs(sampled.level_velocities()).max() < 0.95
    assert np.abs(sampled.yaw_rates).max() < 0.95
    assert least_margin(sampled, layout.scenario.arena) > 0.24
    assert sampled.positions[:, 2].min() > 0.24
    away = base_distances(sampled, layout.scenario) > 1.0
    slowest = -(sampled.positions[:, 2] - 0.15) / 1.1  # the app limits descents near the floor to this
    assert (sampled.velocities[:, 2] > slowest)[away].all()


@pytest.mark.parametrize("seed", SEEDS)
def test_heading_is_the_gates_normal_while_the_drone_is_in_the_opening(seed: int):
    _, path = planned(seed)
    for crossing in path.crossings:
        ahead = [path.at(crossing.time_s + delay_s).yaw_rad for delay_s in (-0.15, 0.0, 0.12)]
        assert np.cos(np.array(ahead) - crossing.heading_rad).min() > np.cos(0.1)


@pytest.mark.parametrize("seed", [200, 202, 205])
def test_planning_again_from_the_path_changes_little(seed: int):
    layout, path = planned(seed)
    first_s, flown_s, goals = path.duration_s, 0.0, layout.goals
    while path.duration_s > 1.0:
        goals = goals_left(goals, path, 0.4)
        again = layout.plan(path.at(0.4), goals, path)
        assert isinstance(again, Path), (flown_s, again)
        path, flown_s = again, flown_s + 0.4
        assert flown_s < 2 * first_s
    assert flown_s + path.duration_s < first_s * 1.25


@pytest.mark.parametrize(
    ("level", "seed"), [("crowded", 200), ("crowded", 207), ("tight", 200), ("tight", 206)]
)
def test_harder_levels_are_planned_clear_of_everything(level: str, seed: int):
    layout = Layout.random(seed, level)
    path = layout.plan(layout.start, layout.goals)
    assert isinstance(path, Path), path
    sampled = Sampled(path)
    assert crossed(sampled, layout.gates) == [0, 1, 2]
    for gate in layout.gates:
        assert touching(sampled, gate) == []
    assert least_margin(sampled, layout.scenario.arena) > 0.24
    for x_m, y_m, radius_m in layout.columns_m:
        away_m = np.hypot(sampled.positions[:, 0] - x_m, sampled.positions[:, 1] - y_m)
        assert away_m.min() > radius_m + 0.22


def test_a_search_in_parts_finds_the_same_and_begins_where_the_drone_has_come_to():
    layout = Layout.random(201, "crowded")
    more = {"obstacles": layout.obstacles, "arena": layout.scenario.arena, "style": CONTEST}
    at_once, in_parts = (Search(layout.start, layout.goals, **more) for _ in range(2))
    at_once.advance(MOST_WORK)
    parts = 0
    while not in_parts.over:
        in_parts.advance(100_000)
        parts += 1
    assert parts > 3
    path, same = at_once.path(), in_parts.path()
    assert isinstance(path, Path)
    assert isinstance(same, Path)
    assert same.knots == path.knots
    later = in_parts.path(path.at(0.3))
    assert isinstance(later, Path)
    assert later.at(0.0).position_m == pytest.approx(path.at(0.3).position_m, abs=1e-3)
    assert later.duration_s == pytest.approx(path.duration_s - 0.3, abs=0.3)
    assert in_parts.path(Motion((-4.0, 4.0, 1.0))) is None  # from there it would be a long way


@pytest.mark.parametrize("height_m", [0.9, 1.1])
def test_a_way_round_columns_does_not_lead_through_the_gate_at_its_corner(height_m: float):
    wall = tuple((2.0, y_m, 0.2) for y_m in np.arange(-1.0, 5.0, 0.3))
    gate = PathGate((2.0, -1.45, height_m), 0.0)
    obstacles = Obstacles((gate,), wall)
    goals = [Point((4.0, 0.0, 1.0))]
    path = plan(Motion((0.0, 0.0, 1.0)), goals, obstacles=obstacles, arena=Arena(), style=CONTEST)
    assert isinstance(path, Path)
    assert Clearance(obstacles, Arena(), CONTEST).depths(Sampled(path).positions).max() < 0.03


def test_a_larger_gate_is_passed_farther_away_and_its_opening_is_flown_through():
    wide = PathGate((2.0, 0.0, 1.0), 0.0, GateShape(1.4, 0.9, 0.1, 0.2))
    beside, goal = Point((4.0, 0.0, 1.6)), Point((4.0, 0.0, 1.0))
    for goals, places in (([beside], []), ([wide, goal], [0])):
        start = Motion((0.0, 0.3, 1.5))
        path = plan(start, goals, obstacles=Obstacles((wide,)), arena=Arena(), style=CONTEST)
        assert isinstance(path, Path)
        flown = Sampled(path)
        assert crossed(flown, (wide,)) == places
        if not places:
            near = np.abs(flown.positions[:, 0] - 2.0) < 0.1
            away_m = np.abs(flown.positions[near] - np.array(wide.centre_m))
            assert ((away_m[:, 1] > 0.7 + 0.2) | (away_m[:, 2] > 0.45 + 0.1)).all()


def test_what_cannot_be_reached_is_refused():
    ring = tuple((1.0 * np.cos(angle), 1.0 * np.sin(angle), 0.2) for angle in np.arange(0.0, 6.3, 0.3))
    goals = [Point((3.0, 0.0, 1.0))]
    obstacles = Obstacles(columns_m=ring)
    path = plan(Motion((0.0, 0.0, 1.0)), goals, obstacles=obstacles, arena=Arena(), style=CONTEST)
    assert path == Refusal("obstacles block the way to the next point")


@pytest.mark.parametrize("home", [True, False])
def test_a_drone_before_a_gate_by_a_wall_slows_down_and_stays_in_the_arena(home: bool):
    gate = PathGate((4.4, 0.0, 1.0), 0.0)
    goals = [gate, Point((0.0, 0.0, 1.0))] if home else [gate]
    start = Motion((3.6, 0.0, 1.0), (0.9, 0.0, 0.0))
    path = plan(start, goals, obstacles=Obstacles((gate,)), arena=Arena(), style=CONTEST)
    assert isinstance(path, Path), path
    assert crossed(Sampled(path), (gate,)) == [0]
    assert least_margin(Sampled(path), Arena()) > 0.2


def test_no_goal_is_refused():
    path = plan(Motion((0.0, 0.0, 1.0)), [], obstacles=Obstacles(), arena=Arena(), style=CONTEST)
    assert path == Refusal("there is no goal to fly to")


@pytest.mark.parametrize("height_m", [0.53, 0.58, 0.62, 0.66, 0.7])
def test_drone_that_hovers_low_over_the_base_finds_a_way_from_it(height_m: float):
    base = Base(x_m=0.0, y_m=-3.9)
    start = Motion((-0.02, -4.0, height_m), (0.0, 0.0, 0.0), 2.0)
    obstacles = Obstacles(base=base)
    path = plan(start, [Point((0.0, 0.0, 1.5))], obstacles=obstacles, arena=Arena(), style=CONTEST)
    assert isinstance(path, Path), path


@pytest.mark.parametrize(
    ("start", "goal_m", "gates"),
    [
        (
            Motion((-0.88, -1.598, 0.3592), yaw_rad=-0.139),
            (3.787, -4.488, 0.8),
            (PathGate((-0.5365, -1.9318, 0.4932), 0.0675), PathGate((-1.4264, -1.5211, 0.3593), -0.1406)),
        ),
        (
            Motion((-1.9962, -4.3373, 0.6695), yaw_rad=2.98),
            (-2.0, -3.0, 0.6),
            (PathGate((-1.6539, -3.7981, 0.6779), 1.0825),),
        ),
    ],
    ids=["close before a low frame", "between a frame and a wall"],
)
def test_a_drone_in_a_narrow_place_moves_aside_first(
    start: Motion, goal_m: Vec3, gates: tuple[PathGate, ...]
):
    path = plan(start, [Point(goal_m)], obstacles=Obstacles(gates), arena=Arena(), style=CONTEST)
    assert isinstance(path, Path), path
    assert [touching(Sampled(path), gate) for gate in gates] == [[] for _ in gates]
    assert least_margin(Sampled(path), Arena()) > 0.2


@pytest.mark.parametrize("along_m", [-0.07, 0.0, 0.04])
@pytest.mark.parametrize("goal_m", [(0.3, 0.2, 3.0), (0.0, 3.0, 1.5), (-3.0, 0.0, 1.5)])
def test_a_drone_that_was_stopped_in_an_opening_leaves_it_along_the_normal(along_m: float, goal_m: Vec3):
    gate = PathGate((0.0, 0.0, 1.5), 0.0)
    start = Motion((along_m, 0.01, 1.51))
    path = plan(start, [Point(goal_m)], obstacles=Obstacles((gate,)), arena=Arena(), style=CONTEST)
    assert isinstance(path, Path), path
    assert touching(Sampled(path), gate) == []


@pytest.mark.parametrize("seed", range(2))
def test_a_way_between_columns_turns_only_where_it_must(seed: int):
    """Straight lines between its corners are clear, and a line that leaves out a corner is not."""
    random = np.random.default_rng(seed)
    columns = [tuple(random.uniform((-4.5, -4.5, 0.03), (4.5, 4.5, 0.3)).tolist()) for _ in range(25)]
    clearance = Clearance(Obstacles((), columns_m=tuple(columns)), Arena(), CONTEST)
    passages = Passages(clearance)

    def is_clear(one: Array, other: Array) -> bool:
        count = int(np.linalg.norm(other - one) / 0.05)
        points = one + np.linspace(0.0, 1.0, max(count, 1) + 1)[1:-1, None] * (other - one)
        return bool((clearance.column_depths(points).max(axis=1, initial=-1.0) < -SPARE_M).all())

    turns = 0
    for start, end in random.uniform(-4.6, 4.6, (40, 2, 2)):
        corners = passages.corners(start, end)
        if corners is None:
            continue
        way = [start, *corners, end]
        straight = [is_clear(one, other) for one, other in pairwise(way)]
        # The next point of the grid is always taken, also from a start within a column's margin.
        near = [np.linalg.norm(other - one) < 5 * CELL_M for one, other in pairwise(way)]
        assert all(np.logical_or(straight, near))
        assert not any(is_clear(one, other) for one, other in zip(way, way[2:], strict=False))
        turns += len(corners)
    assert turns > 20
