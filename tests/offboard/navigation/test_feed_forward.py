"""Commands that make the simulated drone fly a motion."""

from __future__ import annotations

import pytest

from firmware_py.airframe import load_airframe
from firmware_py.control import level_law
from firmware_py.control.design import design
from offboard.navigation.control import feed_forward
from offboard.navigation.control.feed_forward import FeedForward
from offboard.navigation.goals import Motion

TICK_S = 0.05


def test_loops_and_drag_are_those_of_the_airframe():
    airframe = load_airframe("abejorro")
    gains = design(airframe, 0.004)
    inertia, yaw_inertia = airframe.inertia_kg_m2[1:]
    angle, rate = gains.kx[2, 1], gains.kx[2, 3]
    tilt, climb, turn, drag = feed_forward.TILT, feed_forward.CLIMB, feed_forward.TURN, feed_forward.DRAG
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
        (feed_forward.TILT_RATE_S, rate / angle),
        (feed_forward.TILT_DRAG_S2, airframe.drag.moment_nm_s2[1] / angle),
        (feed_forward.TILT_INERTIA_S2, inertia / angle),
        (feed_forward.MOTOR_S, airframe.motor.time_constant_s),
    ]
    for value, of_airframe in expected:
        assert value == pytest.approx(of_airframe, rel=0.01)


def test_what_a_limit_cuts_off_is_commanded_later():
    still, flies = Motion((0.0, 0.0, 1.0)), Motion((0.0, 0.0, 1.0), (0.5, 0.0, 0.0))
    whole, cut = FeedForward(), FeedForward()
    for each, share in ((whole, 1.0), (cut, 0.5)):
        each.command(still, (still, still, still))
        velocity, turn = each.command(flies, (flies, flies, flies))
        each.sent((share * velocity[0], velocity[1], velocity[2]), turn, TICK_S)
    later = [each.command(flies, (flies, flies, flies))[0][0] for each in (whole, cut)]
    assert later[1] > later[0] > 0.5
