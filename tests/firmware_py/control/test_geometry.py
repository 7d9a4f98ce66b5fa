"""Rotations against numpy and against themselves."""

from math import acos, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from geometry.rotations import rotation, tilt_error, to_body, to_world

part = st.floats(-1.0, 1.0)


@st.composite
def units(draw, size):
    values = draw(st.tuples(*[part] * size))
    length = sqrt(sum(value * value for value in values))
    assume(length > 0.1)
    return tuple(value / length for value in values)


def product(a, b):
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@given(units(4), st.tuples(part, part, part))
def test_the_matrix_turns_as_the_quaternion_does(attitude, vector):
    w, x, y, z = attitude
    expected = product(product(attitude, (0.0, *vector)), (w, -x, -y, -z))[1:]
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
    after = rotation(product(attitude, turn))
    assert (after[2], after[5], after[8]) == pytest.approx(down_ned, abs=1e-6)


def test_upside_down_it_turns_over_by_some_axis():
    roll, pitch = tilt_error(rotation((0.0, 1.0, 0.0, 0.0)), (0.0, 0.0, 1.0))
    assert hypot(roll, pitch) == pytest.approx(pi)
