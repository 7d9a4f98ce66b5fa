"""The mixer gives the commanded wrench where possible, and cuts yaw first."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.control.mixer import Mixer, allocation
from framerunner.vehicle.airframe import load_airframe

AIRFRAME = load_airframe("abejorro")
MIXER = Mixer(AIRFRAME)
ALLOCATION = allocation(AIRFRAME)


def wrench(mixed):
    return ALLOCATION @ np.square(mixed.speeds_rad_s)


@given(st.floats(0.6, 1.6), st.floats(-0.03, 0.03), st.floats(-0.03, 0.03), st.floats(-0.01, 0.01))
def test_a_possible_wrench_is_exact(weights, roll, pitch, yaw):
    asked = [weights * AIRFRAME.weight_n, roll, pitch, yaw]
    mixed = MIXER.mix(*asked)
    assert not (mixed.thrust_high or mixed.thrust_low or mixed.yaw_cut)
    np.testing.assert_allclose(wrench(mixed), asked, atol=1e-9)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_speeds_stay_within_limits_for_every_wrench(thrust, roll, pitch, yaw):
    speeds = MIXER.mix(thrust, roll, pitch, yaw).speeds_rad_s
    assert all(0.25 * AIRFRAME.hover_speed_rad_s * 0.999 <= speed <= 1650.0 * 1.000001 for speed in speeds)


def test_yaw_is_cut_before_roll_and_thrust():
    asked = [AIRFRAME.weight_n, 0.02, -0.01, 5.0]
    mixed = MIXER.mix(*asked)
    got = wrench(mixed)
    assert mixed.yaw_cut
    assert 0 < got[3] < 5.0
    np.testing.assert_allclose(got[:3], asked[:3], atol=1e-9)


def test_thrust_is_cut_before_roll():
    asked = [60.0, 0.5, 0.0, 0.0]  # more thrust than there is
    mixed = MIXER.mix(*asked)
    got = wrench(mixed)
    assert mixed.thrust_high
    assert got[1] == pytest.approx(0.5)
    assert got[0] < 60.0


def test_roll_is_kept_with_little_thrust():
    mixed = MIXER.mix(0.0, 0.05, 0.0, 0.0)
    got = wrench(mixed)
    assert mixed.thrust_low
    assert got[1] == pytest.approx(0.05)
    assert got[0] > 0.0
