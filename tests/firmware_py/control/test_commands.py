"""Commands other than a velocity, on both airframes, and changes between commands."""

from math import hypot, nan, pi, radians

import pytest

from firmware_py.commands import (
    AccelerationCommand,
    AttitudeCommand,
    BodyRateCommand,
    MotorCommand,
    TiltCommand,
    VelocityFrdCommand,
)
from firmware_py.control.stabiliser import Stabiliser
from firmware_py.types import VehicleState
from framerunner.vehicle.airframe import load_airframe
from tests.flight import PERIOD_S, Hover

NAMES = ["abejorro", "x500"]


def hover_share(airframe):
    return airframe.weight_n / airframe.full_thrust_n


@pytest.fixture(params=NAMES)
def hover(request):
    flight = Hover(load_airframe(request.param))
    flight.fly(2.0, VelocityFrdCommand())
    return flight


def test_an_acceleration_does_not_control_the_velocity():
    hover = Hover(load_airframe("x500"))
    hover.fly(2.0, VelocityFrdCommand())
    samples = hover.fly(1.5, AccelerationCommand((2.0, -1.0, 0.0)))
    early, late = samples[125], samples[250]  # the tilt is reached, drag is small
    assert late.forward_m_s - early.forward_m_s == pytest.approx(1.0, abs=0.1)
    assert late.right_m_s - early.right_m_s == pytest.approx(-0.5, abs=0.05)
    assert abs(samples[-1].down_m_s) < 0.05
    coasting = hover.fly(2.0, AccelerationCommand((0.0, 0.0, 0.0)))
    assert coasting[-1].forward_m_s > 1.5
    assert coasting[-1].tilt_rad < radians(0.5)


def test_upward_acceleration():
    hover = Hover(load_airframe("x500"))
    hover.fly(1.0, VelocityFrdCommand())
    samples = hover.fly(0.6, AccelerationCommand((0.0, 0.0, -1.0)))
    assert samples[149].down_m_s - samples[50].down_m_s == pytest.approx(-0.4, abs=0.1)


def test_tilt_and_yaw_rate_are_held_with_the_vertical_velocity(hover):
    last = hover.fly(2.5, TiltCommand(0.3, -0.2, 0.5, down_m_s=-0.5))[-1]
    assert last.state.roll_rad == pytest.approx(0.3, abs=0.01)
    assert last.state.pitch_rad == pytest.approx(-0.2, abs=0.01)
    assert last.down_m_s == pytest.approx(-0.5, abs=0.02)
    before = hover.samples[-251].state.yaw_rad
    turned = (last.state.yaw_rad - before + pi) % (2 * pi) - pi
    assert turned == pytest.approx(0.5, abs=0.01)


def test_a_commanded_tilt_may_exceed_the_limit_of_velocity_flight():
    hover = Hover(load_airframe("x500"))
    hover.stabiliser.limits.limit_tilt(radians(20))
    last = hover.fly(1.0, AttitudeCommand(radians(40), 0.0, 0.0, 0.7))[-1]
    assert last.state.roll_rad == pytest.approx(radians(40), abs=0.02)


def test_thrust_is_a_share_of_full_thrust(hover):
    share = hover_share(hover.airframe)
    level = hover.fly(1.0, AttitudeCommand(0.0, 0.0, 0.0, share))[-1]
    assert abs(level.down_m_s) < 0.02
    assert level.output.throttle == pytest.approx(share, rel=1e-3)
    rising = hover.fly(0.3, AttitudeCommand(0.0, 0.0, 0.0, 1.2 * share))[-1]
    assert rising.down_m_s < -0.3


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_body_rates_are_followed(hover, axis):
    rates = [0.0, 0.0, 0.0]
    rates[axis] = 1.0
    samples = hover.fly(0.8, BodyRateCommand(tuple(rates), hover_share(hover.airframe)))
    got = samples[-1].state.angular_rate_frd_rad_s
    assert got == pytest.approx(tuple(rates), abs=0.06)


def test_body_rates_hold_against_an_unknown_moment():
    hover = Hover(load_airframe("x500"))
    hover.fly(1.0, VelocityFrdCommand())
    hover.dynamics.push((0.0, 0.0, 0.0), (0.2, -0.2, 0.05))
    last = hover.fly(2.5, BodyRateCommand((0.0, 0.0, 0.0), 0.59))[-1]
    assert last.state.angular_rate_frd_rad_s == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_recovery_from_a_roll_beyond_inverted(hover):
    share = hover_share(hover.airframe)
    highest = max(sample.tilt_rad for sample in hover.fly(1.5, BodyRateCommand((4.3, 0.0, 0.0), share)))
    assert highest > radians(120)
    last = hover.fly(5.0, VelocityFrdCommand())[-1]
    assert last.tilt_rad < radians(1)
    assert hypot(*last.state.velocity_ned_m_s) < 0.05


def test_motor_outputs_are_passed_through(hover):
    maximum = hover.airframe.motor.max_speed_rad_s
    output = hover.stabiliser.step(VehicleState(), MotorCommand((0.0, 0.25, 1.0, 4.0)))
    assert output.speeds_rad_s == pytest.approx((0.0, maximum / 2, maximum, maximum))
    assert output.throttle == pytest.approx(2.25 / 4)


@pytest.mark.parametrize("outputs", [(), (nan,) * 4, (-1.0,) * 4, (0.0,) * 16])
def test_invalid_motor_outputs_stop_the_motors(outputs):
    stabiliser = Stabiliser(load_airframe("x500"), PERIOD_S)
    assert stabiliser.step(VehicleState(), MotorCommand(outputs)).speeds_rad_s == (0.0,) * 4


@pytest.mark.parametrize("thrust", [nan, -1.0, 0.0])
def test_no_thrust_with_body_rates_idles_the_motors(thrust):
    stabiliser = Stabiliser(load_airframe("x500"), PERIOD_S)
    output = stabiliser.step(VehicleState(), BodyRateCommand((0.0, 0.0, 0.0), thrust))
    assert output.speeds_rad_s == pytest.approx(stabiliser.idle().speeds_rad_s)


def others(airframe):
    share = hover_share(airframe)
    return [
        AccelerationCommand((0.0, 0.0, 0.0)),
        TiltCommand(0.0, 0.0),
        AttitudeCommand(0.0, 0.0, 0.0, share),
        BodyRateCommand((0.0, 0.0, 0.0), share),
        MotorCommand((share,) * 4),
    ]


@pytest.mark.parametrize("kind", range(5))
def test_changing_between_commands_is_smooth_at_hover(hover, kind):
    hover.fly(0.3, others(hover.airframe)[kind])
    back = hover.fly(1.0, VelocityFrdCommand())
    for sample in hover.samples[450:]:
        assert sample.output.throttle == pytest.approx(hover_share(hover.airframe), rel=0.02)
        assert sample.tilt_rad < radians(0.3)
    assert hypot(*back[-1].state.velocity_ned_m_s) < 0.02


def test_a_change_to_velocity_is_smooth_at_speed(hover):
    speed = 1.5
    steady = hover.fly(6.0, VelocityFrdCommand((speed, 0.0, 0.0)))[-1]
    hover.fly(0.1, TiltCommand(0.0, steady.state.pitch_rad))
    after = hover.fly(2.0, VelocityFrdCommand((speed, 0.0, 0.0)))
    assert all(abs(sample.forward_m_s - speed) < 0.06 for sample in after)
    assert all(abs(sample.down_m_s) < 0.06 for sample in after)


def test_acceleration_feed_forward_quickens_a_velocity():
    for name in NAMES:
        plain, helped = Hover(load_airframe(name)), Hover(load_airframe(name))
        for flight, feed in ((plain, 0.0), (helped, 2.0)):
            flight.fly(1.0, VelocityFrdCommand())
            flight.fly(0.3, VelocityFrdCommand((0.3, 0.0, 0.0), 0.0, (feed, 0.0, 0.0)))
        assert helped.samples[-1].forward_m_s > plain.samples[-1].forward_m_s + 0.05


def test_an_unknown_kind_of_command_is_refused():
    with pytest.raises(TypeError, match="str"):
        Stabiliser(load_airframe("x500"), PERIOD_S).step(VehicleState(), "up")  # type: ignore[arg-type]
