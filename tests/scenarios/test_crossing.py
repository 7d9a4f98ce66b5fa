import itertools
from math import cos, hypot, pi, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scenarios.crossing import Boundary, GateWatch
from scenarios.models import Arena, Gate

GATE = Gate(colour="red", x_m=0, y_m=0, z_m=1)  # its plane is x = 0
BOUNDARY = Boundary(Arena())  # x and y within ±5, z up to 4


def passages(other, points):
    gate = GateWatch(other)
    found = [gate.follow(a, b) for a, b in zip([points[0], *points], points, strict=False)]
    return [passage for passage in found if passage is not None]


def test_through_the_middle_from_both_sides():
    (back,) = passages(GATE, [(-1, 0, 1), (3, 0, 1)])
    assert (back.side, back.offset_m, back.fraction) == ("back", 0.0, 0.25)
    (front,) = passages(GATE, [(1, 0, 1), (-1, 0, 1)])
    assert front.side == "front"


def test_offset_is_measured_in_the_plane():
    (passage,) = passages(GATE, [(-1, 0.06, 1.08), (1, 0.06, 1.08)])
    assert passage.offset_m == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("y_m", "z_m", "inside"),
    [
        (0.189, 1, True),
        (0.191, 1, False),
        (-0.191, 1, False),
        (0, 1.089, True),
        (0, 1.091, False),
        (0, 0.9, False),
    ],
)
def test_only_the_opening_counts(y_m, z_m, inside):
    assert bool(passages(GATE, [(-1, y_m, z_m), (1, y_m, z_m)])) is inside


@pytest.mark.parametrize("side", [-1, 1])
def test_touching_the_plane_is_no_passage(side):
    assert passages(GATE, [(side, 0, 1), (0, 0, 1), (side, 0, 1)]) == []
    assert passages(GATE, [(side, 0, 1), (0, 0, 1)]) == []


def test_a_stop_in_the_plane_passes_once_when_left_on_the_other_side():
    found = passages(GATE, [(-1, 0, 1), (0, 0.05, 1), (0, 0.05, 1), (0, 0.1, 1), (1, 0.1, 1)])
    assert [(passage.side, passage.offset_m) for passage in found] == [("back", pytest.approx(0.1))]


def test_a_path_that_begins_in_the_plane_has_no_passage():
    assert passages(GATE, [(0, 0, 1), (1, 0, 1)]) == []


def test_forward_and_back_are_two_passages():
    sides = [p.side for p in passages(GATE, [(-1, 0, 1), (1, 0, 1), (1, 0, 1), (-1, 0, 1)])]
    assert sides == ["back", "front"]


def test_a_restarted_path_is_not_joined_to_earlier_points():
    gate = GateWatch(GATE)
    gate.restart((-1, 0, 1))
    gate.restart((1, 0, 1))
    assert gate.follow((-1, 0, 1), (1, 0, 1)) is None
    assert gate.follow((1, 0, 1), (-1, 0, 1)) is not None


small = st.floats(-0.5, 0.5)
points = st.lists(st.tuples(st.floats(-2, 2), small, st.floats(0.5, 1.5)), min_size=2, max_size=6)


def clear_of_edges(path):
    """Whether no step meets the plane so near an edge, or a point lies so near it, that rounding decides."""
    if any(abs(x) < 1e-6 for x, _, _ in path):
        return False
    for (x0, y0, z0), (x1, y1, z1) in itertools.pairwise(path):
        if x0 * x1 < 0:
            t = x0 / (x0 - x1)
            y, z = y0 + t * (y1 - y0), z0 + t * (z1 - z0) - 1
            if abs(abs(y) - 0.19) < 1e-6 or abs(abs(z) - 0.09) < 1e-6:
                return False
    return True


@given(points, st.floats(-3, 3), st.floats(-3, 3), st.floats(-pi, pi))
def test_rotating_and_translating_the_scene_changes_nothing(path, dx, dy, turn):
    assume(clear_of_edges(path))

    def move(x, y):
        return cos(turn) * x - sin(turn) * y + dx, sin(turn) * x + cos(turn) * y + dy

    moved_gate = Gate(colour="red", x_m=dx, y_m=dy, z_m=1, yaw_rad=turn)
    moved = passages(moved_gate, [(*move(x, y), z) for x, y, z in path])
    still = passages(GATE, path)
    assert [p.side for p in moved] == [p.side for p in still]
    assert [p.offset_m for p in moved] == pytest.approx([p.offset_m for p in still], abs=1e-6)


@given(points, st.integers(2, 9))
def test_cutting_a_path_finer_changes_nothing(path, parts):
    assume(clear_of_edges(path))
    fine = [path[0]]
    for a, b in itertools.pairwise(path):
        fine += [
            tuple(p + (q - p) * i / parts for p, q in zip(a, b, strict=True)) for i in range(1, parts + 1)
        ]
    coarse, finer = passages(GATE, path), passages(GATE, fine)
    assert [p.side for p in finer] == [p.side for p in coarse]
    assert [p.offset_m for p in finer] == pytest.approx([p.offset_m for p in coarse], abs=1e-6)


@given(points)
def test_the_path_backwards_passes_from_the_other_sides(path):
    assume(clear_of_edges(path))
    swap = {"front": "back", "back": "front"}
    forth = [p.side for p in passages(GATE, path)]
    back = [p.side for p in passages(GATE, path[::-1])]
    assert back == [swap[side] for side in reversed(forth)]


@given(points)
def test_an_offset_is_within_the_opening(path):
    for passage in passages(GATE, path):
        assert passage.offset_m <= hypot(0.19, 0.09) + 1e-9
        assert 0 <= passage.fraction <= 1


@pytest.mark.parametrize(
    ("start", "end", "share"),
    [
        ((0, 0, 1), (4, 4, 3), 0.0),
        ((4, 0, 1), (6, 0, 1), 0.5),
        ((6, 0, 1), (4, 0, 1), 0.5),
        ((6, 0, 1), (7, 0, 1), 1.0),
        ((-10, 0, 1), (10, 0, 1), 0.5),  # in and out again within a step
        ((4, 6, 1), (6, 4, 1), 1.0),  # past the corner
        ((0, 0, 3), (0, 0, 7), 0.75),
        ((0, 0, -1), (0, 0, -9), 0.0),  # the floor is no side
        ((5, 5, 4), (5, -5, 4), 0.0),  # along the border
        ((6, 0, 1), (6, 0, 1), 1.0),
        ((1, 1, 1), (1, 1, 1), 0.0),
    ],
)
def test_share_of_a_step_outside(start, end, share):
    assert BOUNDARY.outside_share(start, end) == pytest.approx(share)


def test_the_margin_is_the_distance_from_the_nearest_side():
    assert BOUNDARY.margin((5, -5, 4)) == 0.0
    assert BOUNDARY.margin((5.001, 0, 1)) == pytest.approx(-0.001)
    assert BOUNDARY.margin((0, 0, 4.001)) == pytest.approx(-0.001)
    assert BOUNDARY.margin((0, -3, -9)) == 2.0


coordinate = st.floats(-12, 12)
point = st.tuples(coordinate, coordinate, coordinate)


@given(point, point, st.floats(0, 1))
def test_two_parts_of_a_step_are_outside_as_long_as_the_whole(start, end, cut):
    middle = tuple(a + (b - a) * cut for a, b in zip(start, end, strict=True))
    parts = cut * BOUNDARY.outside_share(start, middle) + (1 - cut) * BOUNDARY.outside_share(middle, end)
    assert parts == pytest.approx(BOUNDARY.outside_share(start, end), abs=1e-5)


@given(point, point)
def test_a_step_between_points_inside_is_inside(start, end):
    share = BOUNDARY.outside_share(start, end)
    assert 0.0 <= share <= 1.0
    if BOUNDARY.margin(start) >= 0 and BOUNDARY.margin(end) >= 0:
        assert share == 0.0
