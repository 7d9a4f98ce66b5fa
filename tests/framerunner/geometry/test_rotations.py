"""Rotations against numpy and against themselves."""

from math import acos, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from framerunner.geometry.rotations import (
    euler_from_quaternion,
    interpolated,
    multiply,
    normalized,
    quaternion_from_euler,
    quaternion_from_yaw,
    rotated_by_rate,
    rotation,
    rotation_rows,
    tilt_error,
    to_body,
    to_world,
    yaw_of,
)

part = st.floats(-1.0, 1.0)
angle = st.floats(-pi, pi)


@st.composite
def units(draw, size):
    values = draw(st.tuples(*[part] * size))
    length = sqrt(sum(value * value for value in values))
    assume(length > 0.1)
    return tuple(value / length for value in values)


@given(units(4), st.tuples(part, part, part))
def test_the_matrix_turns_as_the_quaternion_does(attitude, vector):
    w, x, y, z = attitude
    expected = multiply(multiply(attitude, (0.0, *vector)), (w, -x, -y, -z))[1:]
    m = rotation(attitude)
    assert to_world(m, *vector) == pytest.approx(expected, abs=1e-12)
    assert to_body(m, *expected) == pytest.approx(vector, abs=1e-12)
    np.testing.assert_allclose(np.reshape(m, (3, 3)).T @ np.reshape(m, (3, 3)), np.eye(3), atol=1e-12)


@given(units(4), units(3))
def test_turning_by_the_error_brings_the_axis_where_it_should_be(attitude, down_ned):
    m = rotation(attitude)
    roll, pitch = tilt_error(m, down_ned)
    angle = hypot(roll, pitch)
    between = acos(max(-1.0, min(1.0, m[2] * down_ned[0] + m[5] * down_ned[1] + m[8] * down_ned[2])))
    assert angle == pytest.approx(between, abs=1e-6)
    assume(1e-6 < angle < pi - 1e-3)
    half = angle / 2
    turn = (cos(half), sin(half) * roll / angle, sin(half) * pitch / angle, 0.0)
    after = rotation(multiply(attitude, turn))
    assert (after[2], after[5], after[8]) == pytest.approx(down_ned, abs=1e-6)


def test_upside_down_it_turns_over_by_some_axis():
    roll, pitch = tilt_error(rotation((0.0, 1.0, 0.0, 0.0)), (0.0, 0.0, 1.0))
    assert hypot(roll, pitch) == pytest.approx(pi)


@given(angle, st.floats(-1.5, 1.5), angle)
def test_euler_angles_go_to_a_quaternion_and_back(roll, pitch, yaw):
    attitude = quaternion_from_euler(roll, pitch, yaw)
    assert hypot(*attitude) == pytest.approx(1.0)
    for found, given_rad in zip(euler_from_quaternion(attitude), (roll, pitch, yaw), strict=True):
        assert cos(found) == pytest.approx(cos(given_rad), abs=1e-6)
        assert sin(found) == pytest.approx(sin(given_rad), abs=1e-6)
    assert cos(yaw_of(attitude) - yaw) == pytest.approx(1.0, abs=1e-6)


@given(units(4))
def test_a_quaternion_goes_to_euler_angles_and_back(attitude):
    w, x, y, z = attitude
    assume(abs(2 * (w * y - z * x)) < 0.999)  # nose straight up or down, roll and yaw are one
    again = quaternion_from_euler(*euler_from_quaternion(attitude))
    assert abs(sum(a * b for a, b in zip(attitude, again, strict=True))) == pytest.approx(1.0, abs=1e-6)


@given(angle, angle, angle, st.tuples(part, part, part))
def test_euler_angles_turn_about_z_then_y_then_x(roll, pitch, yaw, vector):
    def about(axis, turn_rad):
        half = [0.0, 0.0, 0.0]
        half[axis] = sin(turn_rad / 2)
        return rotation((cos(turn_rad / 2), *half))

    expected = to_world(about(2, yaw), *to_world(about(1, pitch), *to_world(about(0, roll), *vector)))
    assert to_world(rotation(quaternion_from_euler(roll, pitch, yaw)), *vector) == pytest.approx(
        expected, abs=1e-12
    )


def test_straight_up_and_down_have_a_pitch():
    half = 0.5**0.5
    assert euler_from_quaternion((half, 0.0, half + 1e-12, 0.0))[1] == pytest.approx(pi / 2)
    assert euler_from_quaternion((half, 0.0, -half - 1e-12, 0.0))[1] == pytest.approx(-pi / 2)


@given(angle)
def test_a_heading_is_an_attitude_without_roll_and_pitch(yaw):
    assert quaternion_from_yaw(yaw) == pytest.approx(quaternion_from_euler(0.0, 0.0, yaw))
    assert np.reshape(rotation_rows(rotation(quaternion_from_yaw(yaw))), 9) == pytest.approx(
        rotation(quaternion_from_yaw(yaw))
    )


@given(units(4), units(3), st.floats(-2.0, 2.0), st.floats(0.0, 1.0))
def test_attitudes_between_two_are_those_of_an_even_turn(first, axis, turn_rad, share):
    def turned(angle_rad):
        return rotated_by_rate(first, tuple(angle_rad * part for part in axis), 1.0)

    last = turned(turn_rad)
    for other in (last, tuple(-part for part in last)):  # the same attitude
        between = interpolated(first, other, share)
        assert hypot(*between) == pytest.approx(1.0)
        apart = abs(sum(a * b for a, b in zip(between, turned(share * turn_rad), strict=True)))
        assert apart > cos(0.05)


@given(units(4), st.floats(0.1, 10.0))
def test_a_quaternion_of_any_length_is_made_one_of_unit_length(attitude, length):
    assert normalized(tuple(length * part for part in attitude)) == pytest.approx(attitude)
