"""Boxes that touch."""

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.geometry.solids import Solid
from scenarios.models import Gate
from sitl.solids import gate_solids, touch

DRONE = (0.125, 0.125, 0.0225)


def about_z(yaw):
    c, s = cos(yaw), sin(yaw)
    return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))


def euler(yaw, pitch, roll):
    def turn(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        m = np.eye(3)
        m[i, i] = m[j, j] = c
        m[i, j], m[j, i] = -s, s
        return m

    return tuple(map(tuple, turn(2, yaw) @ turn(1, pitch) @ turn(0, roll)))


def test_bars_enclose_the_opening():
    bars = gate_solids(Gate(colour="red", x_m=1, y_m=2, z_m=1.5, yaw_rad=pi / 2))
    assert [bar.name for bar in bars] == ["red"] * 4
    tops = [bar.centre_arena_m[2] for bar in bars[:2]]
    assert tops == pytest.approx([1.6, 1.4])
    # Facing y, its left and right bars lie along x.
    assert [bar.centre_arena_m[0] for bar in bars[2:]] == pytest.approx([0.8, 1.2])
    assert [bar.centre_arena_m[1] for bar in bars[2:]] == pytest.approx([2.0, 2.0])


def test_bars_are_as_deep_as_they_should_be():
    gate = Gate(colour="red", x_m=0, y_m=0, z_m=1, outer_width_m=1.0, bar_m=0.1, depth_m=0.01)
    top, _, left, _ = gate_solids(gate.model_copy(update={"outer_height_m": 0.6}))
    assert top.half_extents_m == pytest.approx((0.005, 0.5, 0.05))
    assert left.half_extents_m == pytest.approx((0.005, 0.05, 0.2))


@given(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-pi, pi))
def test_a_centred_drone_fits_through(y, z, yaw):
    gate = Gate(colour="green", x_m=0, y_m=0, z_m=1, yaw_rad=yaw)
    centre = (-sin(yaw) * y, cos(yaw) * y, 1 + z)
    assert all(touch(bar, centre, about_z(yaw), DRONE) is None for bar in gate_solids(gate))


@pytest.mark.parametrize(
    ("centre", "normal"),
    [((0.0, 0.075, 1.0), (0, -1, 0)), ((0.0, 0.0, 1.075), (0, 0, -1)), ((0.125, 0.15, 1.0), (1, 0, 0))],
)
def test_pushes_out_the_shortest_way(centre, normal):
    gate = Gate(colour="green", x_m=0, y_m=0, z_m=1)
    found = [hit for bar in gate_solids(gate) if (hit := touch(bar, centre, about_z(0.0), DRONE))]
    assert len(found) == 1
    assert found[0].normal_arena == pytest.approx(normal, abs=1e-9)
    assert 0 < found[0].depth_m <= 0.0101


ANGLES = st.floats(-pi, pi)
PLACES = st.floats(-0.5, 0.5)


@given(PLACES, PLACES, PLACES, ANGLES, ANGLES, ANGLES, ANGLES)
def test_agrees_with_points_sampled_in_both_boxes(x, y, z, yaw, pitch, roll, solid_yaw):
    solid = Solid("box", (0.0, 0.0, 0.0), solid_yaw, (0.1, 0.21, 0.15))
    rotation = euler(yaw, pitch, roll)
    found = touch(solid, (x, y, z), rotation, DRONE)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3), axis=-1).reshape(-1, 3)
    points = (grid * DRONE) @ np.array(rotation).T + (x, y, z)
    local = points @ np.array(about_z(solid_yaw))
    inside = np.any(np.all(np.abs(local) < np.array(solid.half_extents_m) - 1e-9, axis=1))
    if inside:
        assert found is not None
    if found is not None:
        assert np.linalg.norm(found.normal_arena) == pytest.approx(1.0)
        # Pushed out by the depth along the normal, they are apart.
        out = [c + n * (found.depth_m + 1e-6) for c, n in zip((x, y, z), found.normal_arena, strict=True)]
        assert touch(solid, tuple(out), rotation, DRONE) is None
