import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.boundary import Boundary
from scenarios.models import Arena

BOUNDARY = Boundary(Arena())  # x and y within ±5, z up to 4


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


def test_the_border_is_inside():
    assert BOUNDARY.holds((5, -5, 4))
    assert not BOUNDARY.holds((5.001, 0, 1))
    assert not BOUNDARY.holds((0, 0, 4.001))


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
    if BOUNDARY.holds(start) and BOUNDARY.holds(end):
        assert share == 0.0
