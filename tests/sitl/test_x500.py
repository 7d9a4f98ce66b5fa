"""The x500 as a body in JSBSim, and whole in the world: stands, lifts, flies, lands, loses a motor."""

from math import cos, hypot, radians, sin, sqrt, tanh

import pytest

from firmware_py.commands import VelocityFrdCommand
from framerunner.vehicle.airframe import load_airframe
from scenarios.loader import load_scenario
from sitl.dynamics import Dynamics
from sitl.world import World
from tests.flight import ORIGIN, Hover

X500 = load_airframe("x500")
RATE_HZ = 500
G = 9.8085  # as in test_dynamics


def body(height_m=100.0, frame=X500):
    return Dynamics(frame, (0.0, 0.0, -height_m), 0.0, rate_hz=RATE_HZ, **ORIGIN)


def run(dynamics, seconds):
    for _ in range(round(seconds * RATE_HZ)):
        dynamics.run()


def test_hovers_at_six_tenths_of_its_thrust():
    assert X500.weight_n / X500.full_thrust_n == pytest.approx(0.592, abs=0.001)
    dynamics = body()
    dynamics.command_motors((X500.hover_speed_rad_s,) * 4)
    run(dynamics, 0.3)
    before = dynamics.velocity_ned_m_s()[2]
    run(dynamics, 1.0)
    assert dynamics.velocity_ned_m_s()[2] == pytest.approx(before, abs=0.02)


def test_falls_to_its_terminal_speed():
    dynamics = body(400.0)
    terminal = sqrt(X500.mass_kg * G / X500.drag.force_n_s2_m2[2])
    run(dynamics, 2.0)
    assert dynamics.velocity_ned_m_s()[2] == pytest.approx(terminal * tanh(G * 2.0 / terminal), rel=0.02)


@pytest.mark.parametrize(
    ("stronger", "axis", "sign"),
    [((1, 2), 0, 1.0), ((0, 3), 0, -1.0), ((0, 2), 1, 1.0), ((1, 3), 1, -1.0), ((0, 1), 2, 1.0)],
)
def test_rotors_are_in_px4s_order_and_turn_as_px4s_do(stronger, axis, sign):
    dynamics = body()
    dynamics.command_motors(tuple(800.0 if index in stronger else 700.0 for index in range(4)))
    run(dynamics, 0.1)
    rates = dynamics.angular_rate_frd_rad_s()
    assert rates[axis] * sign > 0.01
    assert all(abs(rate) < 0.01 for index, rate in enumerate(rates) if index != axis)


def test_cruise_takes_the_tilt_that_the_drag_asks_for():
    hover = Hover(X500, height_m=60.0)
    last = hover.fly(6.0, VelocityFrdCommand((12.0, 0.0, 0.0)))[-1]
    assert 10.0 < last.tilt_rad * 57.3 < 18.0
    forward, _, down = X500.drag.force_n_s2_m2
    along, through = 12.0 * cos(last.tilt_rad), 12.0 * sin(last.tilt_rad)
    drag_n = forward * along**2 * cos(last.tilt_rad) + down * through**2 * sin(last.tilt_rad)
    up_n = X500.weight_n + forward * along**2 * sin(last.tilt_rad) - down * through**2 * cos(last.tilt_rad)
    assert sin(last.tilt_rad) / cos(last.tilt_rad) == pytest.approx(drag_n / up_n, rel=0.05)


def test_stands_still_on_its_skids():
    dynamics = body(height_m=0.23)
    run(dynamics, 1.0)
    stood = dynamics.position_ned_m()
    run(dynamics, 1.0)
    assert dynamics.touches_ground()
    assert dynamics.position_ned_m() == pytest.approx(stood, abs=1e-5)
    assert 0.225 < -stood[2] < 0.23
    assert dynamics.motion()[3][2] == pytest.approx(-G, rel=2e-3)


@pytest.mark.parametrize("drop_m", [0.2, 2.0])
def test_a_drop_comes_to_rest(drop_m):
    dynamics = body(height_m=0.23 + drop_m)
    highest, fallen = 0.0, False
    for _ in range(4 * RATE_HZ):
        dynamics.run()
        fallen = fallen or dynamics.touches_ground()
        if fallen:
            highest = max(highest, -dynamics.position_ned_m()[2] - 0.23)
    assert highest < 0.5 * drop_m
    assert hypot(*dynamics.velocity_ned_m_s()) < 1e-3
    assert hypot(*dynamics.angular_rate_frd_rad_s()) < 1e-3


@pytest.mark.parametrize("stuck", [False, True])
def test_a_failed_motor_hears_no_command_until_repaired(stuck):
    dynamics = body()
    dynamics.command_motors((700.0,) * 4)
    run(dynamics, 0.3)
    dynamics.fail_motor(1, stuck=stuck)
    dynamics.command_motors((800.0,) * 4)
    run(dynamics, 0.3)
    speeds = dynamics.motor_speeds_rad_s()
    assert speeds[1] == pytest.approx(700.0 if stuck else 0.0, abs=1.0)
    assert speeds[0] == pytest.approx(800.0, abs=1.0)
    dynamics.repair_motor(1)
    dynamics.command_motors((800.0,) * 4)
    run(dynamics, 0.3)
    assert dynamics.motor_speeds_rad_s()[1] == pytest.approx(800.0, abs=1.0)


def test_in_the_world_it_stands_and_a_lost_motor_tips_it_over():
    world = World(load_scenario("empty"), X500)
    before = world.sensors()
    for _ in range(250):
        world.step((0.0,) * 4)
    after = world.sensors()
    assert after.position_ned_m == pytest.approx(before.position_ned_m, abs=1e-5)
    assert after.attitude == pytest.approx(before.attitude, abs=1e-5)
    lift = (1.05 * X500.hover_speed_rad_s,) * 4
    for _ in range(250):
        world.step(lift)
    assert world.sensors().position_ned_m[2] < before.position_ned_m[2] - 0.2
    world.dynamics.fail_motor(0)
    for _ in range(100):
        world.step(lift)
    _, x, y, _ = world.sensors().attitude
    assert 1.0 - 2.0 * (x * x + y * y) < cos(radians(45))
