"""The simulated body against closed forms."""

from math import cos, exp, sqrt, tanh

import pytest

from framerunner.vehicle.airframe import load_airframe
from sitl.dynamics import Dynamics
from tests.flight import ORIGIN

G = 9.8085  # WGS 84 at 47.4 degrees north, 489 m, less the centrifugal part; the tests tolerate 0.1 %
RATE_HZ = 500


def airframe(*, drag=True, lag_s=0.03):
    base = load_airframe("abejorro")
    update = {"motor": base.motor.model_copy(update={"time_constant_s": lag_s})}
    if not drag:
        update["drag"] = type(base.drag)()
    return base.model_copy(update=update)


def body(frame, height_m=100.0, yaw_rad=0.0):
    return Dynamics(frame, (0.0, 0.0, -height_m), yaw_rad, rate_hz=RATE_HZ, **ORIGIN)


def run(dynamics, seconds):
    for _ in range(round(seconds * RATE_HZ)):
        dynamics.run()


def test_free_fall_without_drag():
    dynamics = body(airframe(drag=False))
    run(dynamics, 2.0)
    assert dynamics.velocity_ned_m_s()[2] == pytest.approx(G * 2.0, rel=2e-3)
    assert dynamics.position_ned_m()[2] + 100.0 == pytest.approx(G * 2.0**2 / 2, rel=3e-3)
    assert dynamics.motion()[3] == pytest.approx((0, 0, 0), abs=1e-6)


def test_fall_with_quadratic_drag_follows_its_closed_form():
    frame = airframe()
    dynamics = body(frame)
    terminal = sqrt(frame.mass_kg * G / frame.drag.force_n_s2_m2[2])
    for tenths in range(1, 11):
        run(dynamics, 0.1)
        expected = terminal * tanh(G * tenths / 10 / terminal)
        assert dynamics.velocity_ned_m_s()[2] == pytest.approx(expected, rel=0.02)
    run(dynamics, 1.0)
    assert dynamics.velocity_ned_m_s()[2] == pytest.approx(terminal, rel=1e-3)


def test_hover_thrust_carries_the_weight():
    frame = airframe(drag=False, lag_s=0.0)
    dynamics = body(frame)
    dynamics.command_motors((frame.hover_speed_rad_s,) * 4)
    run(dynamics, 2.0)
    # Thrust is for standard gravity; what is left is the difference to gravity here.
    assert dynamics.velocity_ned_m_s()[2] == pytest.approx(2.0 * (G - 9.80665), abs=0.01)
    assert dynamics.motion()[3][2] == pytest.approx(-9.80665, rel=1e-5)


def test_motor_lag_is_first_order():
    frame = airframe(lag_s=0.05)
    dynamics = body(frame)
    dynamics.command_motors((1000.0,) * 4)
    run(dynamics, 0.05)
    assert dynamics.motor_speeds_rad_s()[0] == pytest.approx(1000.0 * (1 - exp(-1)), rel=0.02)
    run(dynamics, 0.5)
    assert dynamics.motor_speeds_rad_s()[0] == pytest.approx(1000.0, rel=1e-3)


@pytest.mark.parametrize(("faster", "sign"), [((2, 3), 1.0), ((0, 1), -1.0)])
def test_yaw_torque_is_the_difference_of_the_rotors_drag(faster, sign):
    frame = airframe(drag=False, lag_s=0.0)
    dynamics = body(frame)
    high, low = 500.0, 400.0
    dynamics.command_motors(tuple(high if index in faster else low for index in range(4)))
    run(dynamics, 0.5)
    acceleration = 2 * frame.motor.torque_nm_s2 * (high**2 - low**2) / frame.inertia_kg_m2[2]
    assert dynamics.angular_rate_frd_rad_s()[2] == pytest.approx(sign * acceleration * 0.5, rel=0.01)


@pytest.mark.parametrize(
    ("stronger", "axis", "sign"),
    [((1, 2), 0, 1.0), ((0, 3), 0, -1.0), ((0, 2), 1, 1.0), ((1, 3), 1, -1.0)],
)
def test_roll_and_pitch_moments_have_the_true_arm(stronger, axis, sign):
    frame = airframe(drag=False, lag_s=0.0)
    dynamics = body(frame)
    high, low = 440.0, 420.0
    dynamics.command_motors(tuple(high if index in stronger else low for index in range(4)))
    run(dynamics, 0.1)
    moment = 2 * 0.075 * frame.motor.thrust_n_s2 * (high**2 - low**2)
    expected = sign * moment / frame.inertia_kg_m2[axis] * 0.1
    assert dynamics.angular_rate_frd_rad_s()[axis] == pytest.approx(expected, rel=0.02)


def test_terminal_yaw_rate_balances_quadratic_drag():
    frame = airframe(lag_s=0.0)
    dynamics = body(frame, height_m=400.0)
    dynamics.command_motors((400.0, 400.0, 450.0, 450.0))
    torque = 2 * frame.motor.torque_nm_s2 * (450.0**2 - 400.0**2)
    run(dynamics, 10.0)
    expected = sqrt(torque / frame.drag.moment_nm_s2[2])
    assert dynamics.angular_rate_frd_rad_s()[2] == pytest.approx(expected, rel=0.01)


def test_rests_on_the_ground_with_the_weight_on_its_feet():
    frame = airframe()
    dynamics = body(frame, height_m=0.0225)
    run(dynamics, 2.0)
    sunk_m = frame.weight_n / (4 * frame.contact.stiffness_n_m)
    assert dynamics.position_ned_m()[2] == pytest.approx(-0.0225 + sunk_m, abs=5e-4)
    assert dynamics.velocity_ned_m_s() == pytest.approx((0, 0, 0), abs=1e-4)
    assert dynamics.motion()[3][2] == pytest.approx(-G, rel=2e-3)
    assert dynamics.touches_ground()


def test_a_bounce_takes_energy_and_gives_none():
    frame = airframe(drag=False)
    dynamics = body(frame, height_m=0.5)
    highest, falling, drop_m = 0.0, True, 0.5 - 0.0225
    for _ in range(3 * RATE_HZ):
        dynamics.run()
        height_m = -dynamics.position_ned_m()[2] - 0.0225
        falling = falling and dynamics.velocity_ned_m_s()[2] >= 0
        if not falling:
            highest = max(highest, height_m)
    assert 0.0 < highest < 0.6 * drop_m
    assert dynamics.velocity_ned_m_s() == pytest.approx((0, 0, 0), abs=1e-3)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.0, 3.1])
def test_attitude_is_a_unit_quaternion_with_the_given_yaw(yaw_rad):
    w, x, y, z = body(airframe(), yaw_rad=yaw_rad).attitude()
    assert w * w + x * x + y * y + z * z == pytest.approx(1.0)
    assert abs(w) == pytest.approx(abs(cos(yaw_rad / 2)), abs=1e-6)
    assert (x, y) == pytest.approx((0, 0), abs=1e-9)


def test_two_instances_do_not_disturb_each_other():
    alone = body(airframe())
    run(alone, 1.0)
    first, second = body(airframe()), body(airframe())
    second.command_motors((700.0, 300.0, 400.0, 500.0))
    for _ in range(RATE_HZ):
        first.run()
        second.run()
    assert first.position_ned_m() == alone.position_ned_m()
    assert second.position_ned_m() != alone.position_ned_m()
