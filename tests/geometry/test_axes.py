from math import cos, sin

from hypothesis import given
from hypothesis import strategies as st

from geometry.axes import flip_quaternion, flip_vector, flip_yaw

number = st.floats(-100, 100)


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
