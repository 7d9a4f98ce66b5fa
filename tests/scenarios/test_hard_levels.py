"""The levels crowded and tight: what they draw is hard, and possible."""

import itertools
from math import cos, dist, hypot, sin

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.files.yaml_text import to_yaml
from scenarios.loader import dump_yaml, parse_scenario
from scenarios.models import Wall
from scenarios.random_numbers import MAX_SEED, LevelError
from scenarios.random_scenarios import LEVEL_FILES, load_level, random_scenario

CROWDED, TIGHT = load_level("crowded"), load_level("tight")
seeds = st.integers(0, MAX_SEED) | st.integers(0, 1000)
CELLS_PER_M = 10


def along(gate, way_m):
    return gate.x_m + way_m * cos(gate.yaw_rad), gate.y_m + way_m * sin(gate.yaw_rad)


def pairs(scenario):
    return itertools.combinations(scenario.frames, 2)


def filled(wall):
    (solid,) = Wall.model_validate(dict(wall) | {"doorway": None}).solids(4.0)
    return solid


@given(seeds)
def test_crowded_has_the_layout_of_calm_and_obstacles_with_room_around_each(seed):
    scenario = random_scenario(CROWDED, seed)
    calm = random_scenario(load_level("calm"), seed)
    assert (scenario.base, scenario.start, scenario.frames) == (calm.base, calm.start, calm.frames)
    assert [decoy.colour for decoy in scenario.decoys] == ["cyan", "magenta"]
    assert (len(scenario.poles), len(scenario.walls)) == (3, 1)
    assert all(0.1 <= pole.edge_m <= 0.2 for pole in scenario.poles)
    (wall,) = scenario.walls
    assert wall.doorway.width_m == 1.2
    round_things = [(scenario.base, 0.25)]
    round_things += [(gate, gate.outer_width_m / 2) for gate in scenario.all_gates]
    round_things += [(pole, pole.edge_m / 2) for pole in scenario.poles]
    fixed = 1 + len(scenario.frames)  # base and gates are as far apart as in calm
    for (i, (one, radius_m)), (j, (other, other_m)) in itertools.combinations(enumerate(round_things), 2):
        if max(i, j) >= fixed:
            assert dist((one.x_m, one.y_m), (other.x_m, other.y_m)) - radius_m - other_m > 0.699
    for thing, radius_m in round_things:
        assert filled(wall).plan_distance_m(thing.x_m, thing.y_m) - radius_m > 0.699
    for gate, way_m in itertools.product(scenario.frames, (-0.8, -0.4, 0.4, 0.8)):
        assert all(prism.plan_distance_m(*along(gate, way_m)) > 0.1 for prism in scenario.prisms)
    assert parse_scenario(dump_yaml(scenario)) == scenario


@pytest.mark.parametrize("seed", range(6))
def test_in_crowded_a_drone_gets_everywhere(seed):
    """Seen from above: from the base to both sides of each gate, and through the doorway."""
    scenario = random_scenario(CROWDED, seed)
    cells = np.full((10 * CELLS_PER_M, 10 * CELLS_PER_M), 255, np.uint8)
    centres = (np.arange(len(cells)) + 0.5) / CELLS_PER_M - 5
    solids = [*scenario.prisms, *(gate.hull for gate in scenario.all_gates)]
    for i, x in enumerate(centres):
        for j, y in enumerate(centres):
            if any(solid.plan_distance_m(x, y) < 0.18 for solid in solids):
                cells[i, j] = 0
    _, labels = cv2.connectedComponents(cells)

    def label(x, y):
        return labels[int((x + 5) * CELLS_PER_M), int((y + 5) * CELLS_PER_M)]

    places = [along(gate, way_m) for gate in scenario.frames for way_m in (-0.6, 0.6)]
    (wall,) = scenario.walls
    share = wall.doorway.offset_m / wall.length_m
    places.append(
        (wall.x_m + share * (wall.end_x_m - wall.x_m), wall.y_m + share * (wall.end_y_m - wall.y_m))
    )
    assert {label(*place) for place in places} == {label(scenario.base.x_m, scenario.base.y_m)} != {0}


@given(seeds)
def test_in_tight_each_gate_has_a_straight_way_through_it(seed):
    scenario = random_scenario(TIGHT, seed)
    base = scenario.base
    for gate in scenario.frames:
        assert hypot(gate.x_m - base.x_m, gate.y_m - base.y_m) >= 0.8
        others = [base.solid, *(each.hull for each in scenario.frames if each is not gate)]

        def is_free(way_m, gate=gate, others=others):
            x, y = along(gate, way_m)
            clear = all(solid.distance_m((x, y, gate.z_m)) >= 0.175 for solid in others)
            return clear and max(abs(x), abs(y)) < 4.801

        ways = [np.linspace(-0.6, 0.5, 31) * side for side in (1, -1)]
        assert any(all(is_free(way_m) for way_m in way) for way in ways)


def test_in_tight_gates_are_near_each_other_and_sides_floor_or_ceiling():
    scenarios = [random_scenario(TIGHT, seed) for seed in range(100)]
    gates = [gate for scenario in scenarios for gate in scenario.frames]
    assert max(max(abs(gate.x_m), abs(gate.y_m)) for gate in gates) > 4.55
    assert min(gate.z_m for gate in gates) < 0.27
    assert max(gate.z_m for gate in gates) > 3.73
    assert any(hypot(a.x_m - b.x_m, a.y_m - b.y_m) < 0.3 for s in scenarios for a, b in pairs(s))
    for scenario in scenarios:
        nearest_m = min(dist(a.position_arena_m, b.position_arena_m) for a, b in pairs(scenario))
        assert 0.8 < nearest_m <= 1.2
        for gate in scenario.frames:
            assert min(5 - abs(gate.x_m), 5 - abs(gate.y_m), gate.z_m, 4 - gate.z_m) <= 0.8


def test_a_kind_that_is_left_out_changes_no_other():
    obstacles = CROWDED.obstacles.model_copy(update={"decoys": None})
    fewer = CROWDED.model_copy(update={"obstacles": obstacles})
    for seed in range(10):
        whole, part = random_scenario(CROWDED, seed), random_scenario(fewer, seed)
        assert (part.walls, part.poles, part.decoys) == (whole.walls, whole.poles, ())


def test_no_room_for_obstacles_is_said_in_one_line():
    full = CROWDED.model_copy(update={"obstacles": CROWDED.obstacles.model_copy(update={"free_m": 9.0})})
    with pytest.raises(LevelError) as caught:
        random_scenario(full, 3)
    assert str(caught.value) == (
        "crowded-3: 20000 draws found no room for obstacles.wall; lower obstacles.free_m or widen "
        "obstacles.x_m and obstacles.y_m"
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("low: -4.5", "low: -5.5", "obstacles.x_m.low -5.5 cannot be flown; keep within -5 and 5"),
        ("high: 0.2", "high: 3.0", "obstacles.poles.edge_m.high 3.0 cannot be flown; keep within 0.02 and 2"),
        (
            "low: 4.0",
            "low: 2.0",
            "obstacles.wall.length_m.low 2.0 cannot be flown; keep within 2.2 and 14.14",
        ),
        ("doorway_m: 1.2", "doorway_m: 0.9", "obstacles.wall.doorway_m is 0.9: must be at least 1.0"),
        ("count: 3", "count: 0", "obstacles.poles.count is 0: must be at least 1"),
    ],
)
def test_faults_of_obstacles_give_one_line(old, new, message):
    text = to_yaml(CROWDED.model_dump())
    with pytest.raises(LevelError) as caught:
        LEVEL_FILES.parse(text.replace(old, new, 1), "f.yaml")
    assert message in str(caught.value)
