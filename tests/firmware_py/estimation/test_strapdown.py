"""Strapdown integration against closed forms."""

from math import cos, pi, sin

import pytest

from firmware_py.estimation.strapdown import GRAVITY_M_S2, Increments, NavigationState
from framerunner.geometry.rotations import euler_from_quaternion, rotation, to_body

PERIOD_S = 0.004


def test_a_circle_with_constant_speed_closes():
    """1 m/s and 1 rad/s, level: a centripetal specific force of 1 m/s^2 to the right."""
    state = NavigationState()
    state.velocity_ned_m_s = (1.0, 0.0, 0.0)
    turn = (0.0, 0.0, 2 * pi / 2000)
    period_s = 2 * pi / 2000
    for _ in range(2000):
        increments = Increments()
        increments.add(period_s, (0.0, 0.0, 1.0), (0.0, 1.0, -GRAVITY_M_S2))
        assert increments.turn_frd_rad == pytest.approx(turn)
        state.integrate(increments.turn_frd_rad, increments.push_frd_m_s, increments.period_s)
    assert state.position_ned_m == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)
    assert state.velocity_ned_m_s == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)
    assert euler_from_quaternion(state.attitude) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_sums_of_five_samples_give_the_motion_of_single_ones():
    """A coning and sculling motion: axis and force turn within the interval."""
    single, summed, increments = NavigationState(), NavigationState(), Increments()
    for step in range(1000):
        angle = 2 * pi * 4.0 * step * PERIOD_S  # 4 Hz
        rate = (3.0 * cos(angle), 3.0 * sin(angle), 0.5)
        force = (2.0 * sin(angle), 2.0 * cos(angle), -9.0)
        one = Increments()
        one.add(PERIOD_S, rate, force)
        single.integrate(one.turn_frd_rad, one.push_frd_m_s, PERIOD_S)
        increments.add(PERIOD_S, rate, force)
        if step % 5 == 4:
            summed.integrate(increments.turn_frd_rad, increments.push_frd_m_s, increments.period_s)
            increments.clear()
    assert summed.attitude == pytest.approx(single.attitude, abs=2e-4)
    assert summed.velocity_ned_m_s == pytest.approx(single.velocity_ned_m_s, abs=5e-3)
    assert summed.position_ned_m == pytest.approx(single.position_ned_m, abs=2e-2)


def test_a_correction_turns_about_the_axes_of_the_world():
    state = NavigationState()
    state.attitude = (cos(0.4), 0.0, 0.0, sin(0.4))  # heading 0.8 rad
    state.correct((0.01, 0.0, 0.05), (1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert euler_from_quaternion(state.attitude)[2] == pytest.approx(0.85, abs=1e-4)
    north = to_body(rotation(state.attitude), 0.0, 0.0, 1.0)
    assert north[:2] == pytest.approx((0.01 * sin(0.825), 0.01 * cos(0.825)), abs=3e-4)
    assert state.velocity_ned_m_s == (1.0, 2.0, 3.0)
    assert state.position_ned_m == (4.0, 5.0, 6.0)
