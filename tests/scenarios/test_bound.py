"""The lower bound: equal to a search over grids of points, its envelope as calculated by hand."""

from itertools import pairwise
from math import cos, sin

import numpy as np
import pytest

from scenarios.bound import Envelope, Fall, Reach, lower_bound, ordered_gates
from scenarios.models import Base, Gate, Scenario, ScenarioError, StartPose
from scenarios.random_scenarios import load_level, random_scenario
from scenarios.touchdown import STANDING_TOLERANCE_M

HEIGHT_M = 0.04
POLYGON = 1.001  # the polygon's corners are so much farther out than the disc, at most


def envelope(level=Reach(1.4), up=Reach(1.0), down=Reach(1.0), **more):  # noqa: B008 - immutable
    return Envelope(level, up, down, **more)


def straight(*x_m, z_m=1.0):
    """Gates across the x axis; the start is at x = 0, on the base."""
    gates = tuple(
        Gate(colour=colour, x_m=x, y_m=0, z_m=z_m, yaw_rad=0)
        for colour, x in zip(("red", "green", "blue"), x_m, strict=False)
    )
    return Scenario(name="straight", base=Base(top_m=1.0 - HEIGHT_M / 2), start=StartPose(), frames=gates)


def bound(scenario, limits):
    start = scenario.start
    z_m = scenario.base.top_m + HEIGHT_M / 2
    return lower_bound(scenario, (start.x_m, start.y_m, z_m), HEIGHT_M, limits)


def best_of_grid(scenario, limits, across=25, high=13):
    """The least time over a grid of points in each opening, the motors stopping at the nearest place."""
    start, base = scenario.start, scenario.base
    resting_m = base.top_m + HEIGHT_M / 2
    layers = [np.array([(start.x_m, start.y_m, resting_m)])]
    for gate in ordered_gates(scenario):
        width_m, height_m = gate.opening_m
        a, b = np.meshgrid(
            np.linspace(-width_m / 2, width_m / 2, across), np.linspace(-height_m / 2, height_m / 2, high)
        )
        x = gate.x_m - sin(gate.yaw_rad) * a
        y = gate.y_m + cos(gate.yaw_rad) * a
        layers.append(np.column_stack((x.ravel(), y.ravel(), gate.z_m + b.ravel())))
    half_m = base.edge_m / 2
    centre = np.array((base.x_m, base.y_m, resting_m))
    low = np.subtract(centre, (half_m, half_m, 0))
    above = np.add(centre, (half_m, half_m, STANDING_TOLERANCE_M))
    least = np.zeros(1)
    for here, there in pairwise(layers):
        least = (least[:, None] + leg_s(here[:, None], there[None], limits)).min(axis=0)
    ends = np.clip(layers[-1], low, above)
    return (least + leg_s(layers[-1], ends, limits)).min()


def leg_s(here, there, limits):
    x, y, z = np.moveaxis(there - here, -1, 0)
    level_s = np.hypot(x, y) / limits.level.speed_m_s
    return np.maximum(level_s, np.maximum(z / limits.up.speed_m_s, -z / limits.down.speed_m_s))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("vertical_m_s", [1.0, 0.2])
def test_bound_equals_a_search_over_points(seed, vertical_m_s):
    scenario = random_scenario(load_level("calm"), seed)
    limits = envelope(up=Reach(vertical_m_s), down=Reach(1.5 * vertical_m_s))
    found = bound(scenario, limits)
    searched_s = best_of_grid(scenario, limits)
    assert found.time_s <= searched_s + 1e-9
    assert found.time_s * POLYGON >= searched_s * 0.999  # the grid's points are 1.6 cm apart
    assert sum(found.leg_times_s) == pytest.approx(found.time_s)


def test_points_lie_in_the_openings():
    scenario = random_scenario(load_level("calm"), 17)
    found = bound(scenario, envelope())
    for gate, point in zip(ordered_gates(scenario), found.points_arena_m[1:], strict=False):
        x, y, z = (a - b for a, b in zip(point, gate.position_arena_m, strict=True))
        assert cos(gate.yaw_rad) * x + sin(gate.yaw_rad) * y == pytest.approx(0, abs=1e-9)
        assert abs(cos(gate.yaw_rad) * y - sin(gate.yaw_rad) * x) <= 0.19 + 1e-9
        assert abs(z) <= 0.09 + 1e-9


def test_each_part_of_an_envelope_counts_as_calculated():
    scenario = straight(4.0)  # 4 m out, and back to the base's edge at 0.25 m
    assert bound(scenario, envelope(Reach(2.0))).time_s == pytest.approx((4 + 3.75) / 2)
    assert bound(scenario, envelope(Reach(2.0, 1.0))).time_s == pytest.approx((3 + 2.75) / 2)
    assert bound(scenario, envelope(Reach(2.0, 1.0, 2.5))).time_s == pytest.approx(4 / 2.5 + 3.75 / 2.5)
    total = envelope(Reach(2.0, 1.0), total_excess_m=-0.5)
    assert bound(scenario, total).time_s == pytest.approx((4 + 3.75 + 0.5) / 2)
    glide = Fall(level_m=0.5, level_per_m=2.0, longest_m=9.0, deepest_m=1.0)
    # The motors may stop 0.09 + 1 x t above the height at rest, t after the opening's upper edge.
    t = (3.75 - 0.5 - 2.0 * 0.09) / (2.0 + 2.0 * 1.0)
    assert bound(scenario, envelope(Reach(2.0), fall=glide)).time_s == pytest.approx(4 / 2 + t)
    near = Fall(level_m=0.5, level_per_m=2.0, longest_m=1.0, deepest_m=1.0)
    assert bound(scenario, envelope(Reach(2.0), fall=near)).time_s == pytest.approx((4 + 2.75) / 2)


def test_gates_are_crossed_in_order_whatever_their_order_in_the_file():
    there_and_back = straight(1.0, -1.0, 2.0)
    shuffled = there_and_back.model_copy(update={"frames": there_and_back.frames[::-1]})
    found = bound(shuffled, envelope(Reach(1.0)))
    assert found == bound(there_and_back, envelope(Reach(1.0)))
    assert found.time_s == pytest.approx(1 + 2 + 3 + 1.75)


def test_a_scenario_without_gates_has_no_bound():
    with pytest.raises(ScenarioError, match="has no frames"):
        bound(straight(), envelope())
