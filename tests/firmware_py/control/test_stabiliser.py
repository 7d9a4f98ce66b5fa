"""Step responses of the stabiliser with the JSBSim model."""

from math import dist, radians

import pytest

from firmware_py.commands import VelocityFrdCommand
from framerunner.vehicle.airframe import load_airframe
from tests.flight import fly

HOVER_S = 3.0


def response(field, target, samples, after_s=HOVER_S):
    """Return (time to 90 %, overshoot as a part, last value as a part) of a step at `after_s`."""
    part = [
        (sample.time_s - after_s, getattr(sample, field) / target)
        for sample in samples
        if sample.time_s >= after_s
    ]
    rise_s = next((time for time, value in part if value >= 0.9), None)
    return rise_s, max(value for _, value in part) - 1.0, part[-1][1]


@pytest.mark.parametrize(
    ("field", "target", "command", "limit_s"),
    [
        ("forward_m_s", 1.0, VelocityFrdCommand((1.0, 0.0, 0.0)), 0.7),
        ("forward_m_s", -1.0, VelocityFrdCommand((-1.0, 0.0, 0.0)), 0.7),
        ("right_m_s", 1.0, VelocityFrdCommand((0.0, 1.0, 0.0)), 0.7),
        ("forward_m_s", 0.2, VelocityFrdCommand((0.2, 0.0, 0.0)), 0.7),
        ("down_m_s", -0.5, VelocityFrdCommand((0.0, 0.0, -0.5)), 0.6),
        ("down_m_s", 0.5, VelocityFrdCommand((0.0, 0.0, 0.5)), 0.6),
        ("yaw_rate_rad_s", 1.0, VelocityFrdCommand(yaw_rate_rad_s=1.0), 0.3),
        ("yaw_rate_rad_s", -1.0, VelocityFrdCommand(yaw_rate_rad_s=-1.0), 0.3),
    ],
)
def test_step_response(field, target, command, limit_s):
    samples = fly([(HOVER_S, VelocityFrdCommand()), (6.0, command)])
    rise_s, overshoot, final = response(field, target, samples)
    assert rise_s is not None
    assert rise_s < limit_s
    assert overshoot < 0.08
    assert final == pytest.approx(1.0, abs=0.002)


def test_ten_seconds_of_hover_drift_less_than_two_centimetres():
    samples = fly([(12.0, VelocityFrdCommand())])
    start = samples[500].position_ned_m
    assert max(dist(start, sample.position_ned_m) for sample in samples[500:]) < 0.02


def test_hover_after_flight_comes_to_rest():
    samples = fly([(3.0, VelocityFrdCommand((1.0, 0.0, 0.0))), (13.0, VelocityFrdCommand())])
    settled = samples[-2500:]
    assert max(dist(settled[0].position_ned_m, sample.position_ned_m) for sample in settled) < 0.02


def test_a_velocity_is_constant_in_turning_level_axes():
    last = fly([(6.0, VelocityFrdCommand((1.0, 0.0, 0.0), 1.0))])[-1]
    assert last.forward_m_s == pytest.approx(1.0, abs=0.01)
    assert last.right_m_s == pytest.approx(0.0, abs=0.01)
    assert last.yaw_rate_rad_s == pytest.approx(1.0, abs=0.01)


def test_tilt_is_limited_and_nothing_winds_up():
    airframe = load_airframe("abejorro")
    limited = airframe.model_copy(
        update={"limits": airframe.limits.model_copy(update={"tilt_rad": radians(8)})}
    )
    samples = fly([(4.0, VelocityFrdCommand((3.0, 0.0, 0.0))), (4.0, VelocityFrdCommand())], airframe=limited)
    assert max(sample.tilt_rad for sample in samples) < radians(9.5)
    # 8 degrees hold about 0.8 m/s against drag; four seconds of asking for more must not delay stopping.
    assert 0.6 < samples[999].forward_m_s < 1.1
    stopped = [sample for sample in samples if sample.time_s > 6.0]
    assert all(abs(sample.forward_m_s) < 0.2 for sample in stopped)
