import math
from math import cos, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.geometry.axes import ORIGIN, ArenaAlignment, Pose, flip_quaternion, flip_vector, flip_yaw

number = st.floats(-100, 100)
coordinate = st.floats(-500, 500)
poses = st.builds(Pose, st.tuples(coordinate, coordinate, coordinate), st.floats(-3.1, 3.1))


@given(st.tuples(number, number, number), st.tuples(number, number, number, number), number)
def test_each_is_its_own_inverse(vector, quaternion, yaw):
    assert flip_vector(flip_vector(vector)) == vector
    assert flip_quaternion(flip_quaternion(quaternion)) == quaternion
    assert flip_yaw(flip_yaw(yaw)) == yaw


def test_arena_left_and_up_are_west_and_minus_down():
    assert flip_vector((1.0, 2.0, 3.0)) == (1.0, -2.0, -3.0)


@given(st.floats(-3, 3))
def test_a_yaw_flips_alike_as_angle_and_as_quaternion(yaw):
    arena = (cos(yaw / 2), 0.0, 0.0, sin(yaw / 2))
    ned = (cos(flip_yaw(yaw) / 2), 0.0, 0.0, sin(flip_yaw(yaw) / 2))
    assert flip_quaternion(arena) == ned


@given(poses, poses)
def test_the_known_pose_is_mapped_to_itself(arena, ned):
    pose = ArenaAlignment(arena, ned).pose(ned)
    assert pose.position_m == pytest.approx(arena.position_m, abs=1e-9)
    assert math.remainder(pose.yaw_rad - arena.yaw_rad, 2 * math.pi) == pytest.approx(0, abs=1e-9)


@given(poses, poses, poses)
def test_distances_and_turns_are_kept(arena, start, later):
    alignment = ArenaAlignment(arena, start)
    a, b = alignment.pose(start), alignment.pose(later)
    assert math.dist(a.position_m, b.position_m) == pytest.approx(
        math.dist(start.position_m, later.position_m), abs=1e-6
    )
    turned = math.remainder(b.yaw_rad - a.yaw_rad, 2 * math.pi)
    assert math.remainder(turned + later.yaw_rad - start.yaw_rad, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    assert -math.pi <= b.yaw_rad <= math.pi


def test_forward_is_forward_for_any_north():
    alignment = ArenaAlignment(Pose((1.0, 2.0, 0.5), 0.3), Pose((10.0, 20.0, -3.0), 1.2))
    ahead = Pose((10.0 + cos(1.2), 20.0 + sin(1.2), -4.0), 1.2)
    assert alignment.pose(ahead).position_m == pytest.approx((1 + cos(0.3), 2 + sin(0.3), 1.5))
    assert alignment.vector((cos(1.2), sin(1.2), -1.0)) == pytest.approx((cos(0.3), sin(0.3), 1.0))


@given(poses)
def test_a_local_frame_given_by_its_origin_is_placed_there(origin_arena):
    """As a referee reports it: where the local origin is, and the yaw of its north."""
    alignment = ArenaAlignment(origin_arena, ORIGIN)
    assert alignment.pose(ORIGIN).position_m == pytest.approx(origin_arena.position_m)
    yaw_rad = origin_arena.yaw_rad
    assert alignment.vector((1.0, 0.0, 0.0)) == pytest.approx((cos(yaw_rad), sin(yaw_rad), 0.0))
    assert alignment.attitude((1.0, 0.0, 0.0, 0.0)) == pytest.approx(
        (cos(yaw_rad / 2), 0.0, 0.0, sin(yaw_rad / 2))
    )


def test_an_arena_position_comes_back_from_the_vehicles_axes():
    alignment = ArenaAlignment(Pose((1.0, -2.0, 0.5), 0.7), Pose((10.0, 20.0, -3.0), -2.1))
    position = (3.0, 4.0, 1.5)
    assert alignment.position(alignment.to_ned(position)) == pytest.approx(position)
