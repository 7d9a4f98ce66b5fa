"""Commands that make the simulated drone fly a motion."""

from __future__ import annotations

from math import hypot

import pytest

from firmware_py.control import level_law
from firmware_py.control.design import design
from framerunner.geometry.vectors import ZERO3
from framerunner.vehicle.airframe import load_airframe
from offboard.drone import DroneState
from offboard.navigation.control import loop_inverse
from offboard.navigation.control.loop_inverse import HOLD_S, LoopInverse, Own, OwnMotion
from offboard.navigation.goals import Motion

TICK_S = 0.05


def test_loops_and_drag_are_those_of_the_airframe():
    airframe = load_airframe("abejorro")
    gains = design(airframe, 0.004)
    inertia, yaw_inertia = airframe.inertia_kg_m2[1:]
    angle, rate = gains.kx[2, 1], gains.kx[2, 3]
    tilt, climb, turn, drag = loop_inverse.TILT, loop_inverse.CLIMB, loop_inverse.TURN, loop_inverse.DRAG
    expected = [
        (tilt.gain, -gains.kx[2, 5] / angle),
        (tilt.integral_gain, -gains.ki[2, 0] / angle),
        (tilt.weight, level_law._WEIGHT_HORIZONTAL),
        (climb.gain, -gains.kx[0, 7] / airframe.mass_kg),
        (climb.integral_gain, -gains.ki[0, 2] / airframe.mass_kg),
        (climb.weight, level_law._WEIGHT_VERTICAL),
        (turn.gain, gains.kx[3, 4] / yaw_inertia),
        (turn.integral_gain, gains.ki[3, 3] / yaw_inertia),
        (turn.weight, level_law._WEIGHT_YAW),
        (drag.level_per_m, airframe.drag.force_n_s2_m2[0] / airframe.mass_kg),
        (drag.up_per_m, airframe.drag.force_n_s2_m2[2] / airframe.mass_kg),
        (drag.turn, airframe.drag.moment_nm_s2[2] / yaw_inertia),
        (loop_inverse.TILT_RATE_S, rate / angle),
        (loop_inverse.TILT_DRAG_S2, airframe.drag.moment_nm_s2[1] / angle),
        (loop_inverse.TILT_INERTIA_S2, inertia / angle),
        (loop_inverse.MOTOR_S, airframe.motor.time_constant_s),
    ]
    for value, of_airframe in expected:
        assert value == pytest.approx(of_airframe, rel=0.01)
    assert 0.9 * airframe.limits.tilt_rad < loop_inverse.MAX_TILT_RAD < airframe.limits.tilt_rad


@pytest.mark.parametrize("known", [True, False], ids=["all was observed", "observed late"])
def test_a_tilt_is_asked_for_whatever_the_loop_has_added_up(known: bool):
    """Wind holds the drone, which tilts more and more to follow its command, and then is told not to tilt."""
    inverse, still, tilt = LoopInverse(), Motion((0.0, 0.0, 1.0)), loop_inverse.TILT
    sent_m_s, added_up = 0.2, 0.0
    inverse.observe(Own((0.0, 0.0), (0.0, 0.0), 0.0), None, TICK_S)
    for tick in range(200):
        added_up += 0.2 * TICK_S if tick < 40 else 0.0
        if tick == 40:
            sent_m_s = 0.0
        tilted = tilt.gain * tilt.weight * sent_m_s + tilt.integral_gain * (added_up + HOLD_S * sent_m_s)
        if known or tick > 40:
            inverse.observe(Own((0.0, 0.0), (tilted, 0.0), 0.0), (sent_m_s, 0.0), TICK_S)
    (velocity_m_s, _, _), _ = inverse.command(still, (still, still, still), (ZERO3, ZERO3), 0.0)
    demand = tilt.gain * tilt.weight * velocity_m_s
    demand += tilt.integral_gain * (added_up + HOLD_S * velocity_m_s)
    assert added_up == pytest.approx(0.4)
    assert demand == pytest.approx(0.0, abs=0.005)


def test_what_was_added_up_before_another_control_flew_the_drone_is_forgotten():
    inverse, still = LoopInverse(), Motion((0.0, 0.0, 1.0))
    for _ in range(40):
        inverse.observe(Own((0.0, 0.0), (0.0, 0.0), 0.0), (2.0, -1.0), TICK_S)
    wound_up, _ = inverse.command(still, (still, still, still), (ZERO3, ZERO3), 0.0)
    inverse.restart()
    begun_again, _ = inverse.command(still, (still, still, still), (ZERO3, ZERO3), 0.0)
    assert hypot(*wound_up[:2]) > 1.0
    assert begun_again == pytest.approx(ZERO3, abs=1e-6)


def test_a_disturbance_is_learnt_from_velocities_that_tilt_and_drag_do_not_explain():
    own, speed_m_s = OwnMotion(), 0.5  # level, and yet no slower: wind that is as fast
    for tick in range(100):
        own.update(DroneState(tick * 50_000, 0.0, 0.0, 1.0, 0.0, (speed_m_s, 0.0, 0.0), landed=False), 0.0)
    drag_m_s2 = loop_inverse.DRAG.level_per_m * speed_m_s**2
    assert own.disturbance_m_s2 == pytest.approx((drag_m_s2, 0.0), rel=0.02)
    assert own.velocity_in(0.1) == pytest.approx((speed_m_s, 0.0), abs=0.002)
