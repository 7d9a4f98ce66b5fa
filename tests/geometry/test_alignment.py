"""Local axes laid into the arena."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry.alignment import ORIGIN, Alignment, Pose

finite = st.floats(-500, 500)
angle = st.floats(-3.1, 3.1)
vector = st.tuples(finite, finite, finite)
poses = st.builds(Pose, vector, angle)


@given(poses, poses)
def test_at_the_start_the_drone_is_where_it_is_known_to_stand(arena, ned):
    pose = Alignment(arena, ned).pose(ned)
    assert pose.position_m == pytest.approx(arena.position_m, abs=1e-9)
    assert math.remainder(pose.yaw_rad - arena.yaw_rad, 2 * math.pi) == pytest.approx(0, abs=1e-9)


@given(poses, poses, poses)
def test_distances_and_turns_are_kept(arena, start, later):
    alignment = Alignment(arena, start)
    a, b = alignment.pose(start), alignment.pose(later)
    assert math.dist(a.position_m, b.position_m) == pytest.approx(
        math.dist(start.position_m, later.position_m), abs=1e-6
    )
    turned = math.remainder(b.yaw_rad - a.yaw_rad, 2 * math.pi)
    assert math.remainder(turned + later.yaw_rad - start.yaw_rad, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    assert -math.pi <= b.yaw_rad <= math.pi


def test_forward_is_forward_whatever_north_is():
    alignment = Alignment(Pose((1.0, 2.0, 0.5), 0.3), Pose((10.0, 20.0, -3.0), 1.2))
    ahead = Pose((10.0 + math.cos(1.2), 20.0 + math.sin(1.2), -4.0), 1.2)
    assert alignment.pose(ahead).position_m == pytest.approx((1 + math.cos(0.3), 2 + math.sin(0.3), 1.5))
    assert alignment.vector((math.cos(1.2), math.sin(1.2), -1.0)) == pytest.approx(
        (math.cos(0.3), math.sin(0.3), 1.0)
    )


@given(poses)
def test_a_frame_given_by_its_origin_is_laid_there(origin_arena):
    """As a referee tells it: where the local origin is, and how far north is turned from x, to the left."""
    alignment = Alignment(origin_arena, ORIGIN)
    assert alignment.pose(ORIGIN).position_m == pytest.approx(origin_arena.position_m)
    c, s = math.cos(origin_arena.yaw_rad), math.sin(origin_arena.yaw_rad)
    assert alignment.vector((1.0, 0.0, 0.0)) == pytest.approx((c, s, 0.0))
    assert alignment.attitude((1.0, 0.0, 0.0, 0.0)) == pytest.approx(
        (math.cos(origin_arena.yaw_rad / 2), 0.0, 0.0, math.sin(origin_arena.yaw_rad / 2))
    )
