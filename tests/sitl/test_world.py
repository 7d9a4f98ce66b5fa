"""The world: standing, bouncing, determinism."""

from math import hypot, isfinite, pi

import pytest

from firmware_py.commands import VelocityFrdCommand
from firmware_py.control.stabiliser import Stabiliser
from framerunner.vehicle.airframe import load_airframe
from scenarios.models import Base, Decoy, Gate, Pole, Scenario, StartPose, Wall
from sitl.world import CONTROL_PERIOD_US, MAX_RATE_RAD_S, PHYSICS_RATE_HZ, World
from tests.flight import state_of

AIRFRAME = load_airframe("abejorro")


def world(**parts):
    return World(Scenario(name="test", **parts), AIRFRAME)


class Flight:
    """A stabiliser flying a world, judged by its true states."""

    def __init__(self, world):
        self.world = world
        self.stabiliser = Stabiliser(AIRFRAME, CONTROL_PERIOD_US / 1e6)
        self.truths = []

    def fly(self, seconds, command):
        for _ in range(round(seconds * 1e6 / CONTROL_PERIOD_US)):
            state = state_of(self.world.dynamics, self.world.time_us)
            self.world.step(self.stabiliser.step(state, command).speeds_rad_s)
            self.truths.append(self.world.truth(self.world.sensors(), motors_on=True))
        return self.truths[-1]


def test_stands_on_the_base_at_rest_with_the_given_heading():
    w = world(base=Base(x_m=-3, y_m=-3), start=StartPose(x_m=-3, y_m=-3, yaw_rad=1.0))
    truth = w.truth(w.sensors(), motors_on=False)
    assert w.time_us == 0
    assert truth.position_arena_m == pytest.approx((-3, -3, 0.51 + 0.0225), abs=3e-3)
    assert truth.velocity_arena_m_s == pytest.approx((0, 0, 0), abs=1e-3)
    assert truth.contacts == ("base",)
    assert truth.attitude_arena[3] == pytest.approx(0.4794, abs=1e-3)  # sin(yaw / 2), left turn positive
    assert w.sensors().position_ned_m == pytest.approx((-3, 3, -0.5325), abs=3e-3)


def test_stands_on_the_floor_beside_the_base():
    w = world(base=Base(x_m=2), start=StartPose(x_m=0))
    truth = w.truth(w.sensors(), motors_on=False)
    assert truth.position_arena_m[2] == pytest.approx(0.0225, abs=3e-3)
    assert truth.contacts == ("floor",)


def test_time_is_exact():
    w = world()
    for _ in range(250):
        w.step((0.0, 0.0, 0.0, 0.0))
    assert w.time_us == 1_000_000


def test_same_inputs_give_the_same_states_bit_for_bit():
    def states():
        flight = Flight(world(frames=(Gate(colour="red", x_m=1.0, y_m=0.1, z_m=1.0),)))
        flight.fly(1.0, VelocityFrdCommand((0.0, 0.0, -0.8)))
        flight.fly(3.0, VelocityFrdCommand((1.0, 0.1, 0.0), 0.3))
        return [(t.position_arena_m, t.attitude_arena, t.contacts) for t in flight.truths]

    first = states()
    assert first == states()


def test_flies_through_a_gate_without_touching():
    flight = Flight(world(frames=(Gate(colour="red", x_m=1.0, y_m=0.0, z_m=1.5),)))
    flight.fly(3.0, VelocityFrdCommand((0.0, 0.0, -0.322)))
    height = flight.fly(1.0, VelocityFrdCommand()).position_arena_m[2]
    flight.fly(1.0, VelocityFrdCommand((0.0, 0.0, height - 1.5)))
    flight.fly(1.0, VelocityFrdCommand())
    last = flight.fly(5.0, VelocityFrdCommand((0.4, 0.0, 0.0)))
    assert last.position_arena_m[0] > 1.5
    assert not any("red" in truth.contacts for truth in flight.truths)


@pytest.mark.parametrize("speed_m_s", [0.3, 1.0, 2.0])
def test_a_gate_is_solid(speed_m_s):
    """Flown at beside its opening, the drone touches it, loses speed and does not come out behind it."""
    gate = Gate(colour="blue", x_m=1.2, y_m=0.2, z_m=1.0)
    flight = Flight(world(base=Base(x_m=-4), frames=(gate,)))
    flight.fly(1.6, VelocityFrdCommand((0.0, 0.0, -0.65)))
    flight.fly(1.0, VelocityFrdCommand())
    before = len(flight.truths)
    flight.fly(1.0 + 1.2 / speed_m_s, VelocityFrdCommand((speed_m_s, 0.0, 0.0)))
    touched = [truth for truth in flight.truths if "blue" in truth.contacts]
    assert touched
    # The drone's front face stays short of the bar's far side (it gives by a spring's travel).
    assert max(truth.position_arena_m[0] for truth in touched) < 1.2 - 0.01 - 0.125 + 0.025
    assert all(hypot(*truth.velocity_arena_m_s) < speed_m_s * 1.3 for truth in flight.truths[before:])


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("pole", {"poles": (Pole(x_m=1.2, y_m=0.1),)}),
        ("wall", {"walls": (Wall(x_m=1.2, y_m=-3, end_x_m=1.2, end_y_m=3),)}),
        ("cyan", {"decoys": (Decoy(colour="cyan", x_m=1.2, y_m=0.2, z_m=1.0),)}),
    ],
)
def test_obstacles_are_solid(name, parts):
    flight = Flight(world(base=Base(x_m=-4), **parts))
    flight.fly(1.6, VelocityFrdCommand((0.0, 0.0, -0.65)))
    flight.fly(1.0, VelocityFrdCommand())
    flight.fly(2.5, VelocityFrdCommand((1.0, 0.0, 0.0)))
    touched = [truth for truth in flight.truths if name in truth.contacts]
    assert touched
    near_side_m = 1.2 - {"pole": 0.075, "wall": 0.05, "cyan": 0.01}[name]
    assert max(truth.position_arena_m[0] for truth in touched) < near_side_m - 0.125 + 0.025


def test_the_side_of_the_base_is_solid():
    flight = Flight(world(base=Base(x_m=1.5), start=StartPose(x_m=0)))
    flight.fly(1.0, VelocityFrdCommand((0.0, 0.0, -0.3)))
    flight.fly(3.0, VelocityFrdCommand((0.6, 0.0, 0.0)))
    assert any("base" in truth.contacts for truth in flight.truths)
    assert max(truth.position_arena_m[0] for truth in flight.truths) < 1.5 - 0.25 - 0.125 + 0.03
    assert max(truth.position_arena_m[2] for truth in flight.truths) < 0.6


def test_motors_off_above_the_base_falls_onto_it_and_stays():
    w = world(base=Base(), start=StartPose())
    flight = Flight(w)
    flight.fly(1.0, VelocityFrdCommand((0.0, 0.0, -0.2)))
    for _ in range(500):
        w.step((0.0, 0.0, 0.0, 0.0))
    truth = w.truth(w.sensors(), motors_on=False)
    assert truth.contacts == ("base",)
    assert truth.position_arena_m[2] == pytest.approx(0.5325, abs=4e-3)
    assert truth.velocity_arena_m_s == pytest.approx((0, 0, 0), abs=5e-3)


def test_a_drone_past_the_edge_falls_off():
    w = world(base=Base(x_m=0.0), start=StartPose(x_m=0.24, yaw_rad=pi / 4))
    flight = Flight(w)
    flight.fly(1.0, VelocityFrdCommand((0.0, 0.0, -0.2)))
    flight.fly(1.0, VelocityFrdCommand((0.1, 0.1, 0.0)))
    for _ in range(750):
        w.step((0.0, 0.0, 0.0, 0.0))
    assert w.truth(w.sensors(), motors_on=False).position_arena_m[2] < 0.3


def in_the_air(airframe):
    w = World(Scenario(name="test"), airframe)
    for _ in range(250):
        w.step((0.7 * airframe.motor.max_speed_rad_s,) * 4)
    return w


@pytest.mark.parametrize("name", ["abejorro", "x500", "racer-3in"])
@pytest.mark.parametrize("kick_rad_s", [20.0, 150.0, 400.0])
def test_a_drone_that_is_made_to_turn_however_fast_still_moves_by_numbers(name, kick_rad_s):
    airframe = load_airframe(name)
    w = in_the_air(airframe)
    w.dynamics.push((0.0, 0.0, 0.0), tuple(i * kick_rad_s * PHYSICS_RATE_HZ for i in airframe.inertia_kg_m2))
    w.dynamics.run()
    w.dynamics.push((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for _ in range(1000):
        w.step((0.0,) * 4)
    sensors = w.sensors()
    assert isfinite(sum(w.position_arena_m))
    assert max(map(abs, sensors.angular_rate_frd_rad_s)) < MAX_RATE_RAD_S


def test_a_drone_that_turns_too_fast_has_crashed_and_its_motors_stop_until_they_are_armed_again():
    airframe = load_airframe("racer-3in")
    w, full = in_the_air(airframe), airframe.motor.max_speed_rad_s
    assert w.truth(w.sensors(), motors_on=True).crash == ""
    for _ in range(1000):
        w.step((full, 0.0, full, 0.0))
    assert w.truth(w.sensors(), motors_on=True).crash == "turned faster than 100 rad/s"
    assert isfinite(sum(w.position_arena_m))
    assert max(w.dynamics.motor_speeds_rad_s()) < 1.0
    w.repair()
    for _ in range(25):
        w.step((full,) * 4)
    assert min(w.dynamics.motor_speeds_rad_s()) > 0.5 * full
