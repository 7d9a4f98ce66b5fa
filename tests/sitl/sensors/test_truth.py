"""Mean motions: strapdown integration gives the true trajectory, contacts included."""

from math import acos, cos, degrees, dist, pi, sin

import pytest

from firmware_py.commands import VelocityFrdCommand
from firmware_py.control.stabiliser import Stabiliser
from framerunner.geometry.rotations import quaternion_from_euler, rotated_by_rate, rotation, to_world
from framerunner.geometry.vectors import ZERO3
from framerunner.vehicle.airframe import GRAVITY_M_S2, load_airframe
from scenarios.models import Base, Gate, Pole, Scenario, StartPose, ground_height
from sitl.sensors.truth import MotionTracker
from sitl.world import CONTROL_PERIOD_US, World
from tests.flight import state_of

AIRFRAME = load_airframe("abejorro")
LEVEL = (1.0, 0.0, 0.0, 0.0)
STEP_S = CONTROL_PERIOD_US * 1e-6


def motions_of_flight(seconds):
    """True motions of a world in which a drone flies sharp turns, hits a pole and lands hard."""
    scenario = Scenario(
        name="test",
        base=Base(x_m=-2.0),
        start=StartPose(x_m=-2.0),
        frames=(Gate(colour="red", x_m=0.0, y_m=0.0, z_m=1.5),),
        poles=(Pole(x_m=2.0, y_m=0.0),),
    )
    world = World(scenario, AIRFRAME)
    stabiliser = Stabiliser(AIRFRAME, STEP_S)
    tracker = MotionTracker(CONTROL_PERIOD_US)
    motions = []
    touched = False
    for tick in range(round(seconds / STEP_S)):
        sensors = world.sensors()
        x_m, y_m, _ = world.position_arena_m
        motions.append(
            tracker.update(
                sensors.time_us,
                sensors.position_ned_m,
                sensors.velocity_ned_m_s,
                sensors.attitude,
                motor_speeds_rad_s=world.dynamics.motor_speeds_rad_s(),
                ground_z_m=ground_height(scenario, x_m, y_m),
            )
        )
        time_s = tick * STEP_S
        down_m_s = -0.6 if time_s < 3.0 else 1.0 if time_s > seconds - 4.0 else 0.0
        velocity = (1.2 * cos(0.7 * time_s), 1.2 * sin(1.1 * time_s), down_m_s)
        if 10.0 < time_s < 20.0:
            velocity = (0.8 * (2.0 - x_m), 0.8 * y_m, 0.0)  # towards the pole
        state = state_of(world.dynamics, world.time_us)
        world.step(stabiliser.step(state, VelocityFrdCommand(velocity, 1.5 * sin(time_s))).speeds_rad_s)
        touched |= "pole" in world.touched
    assert touched
    return motions


def test_strapdown_integration_of_a_minutes_flight_gives_its_attitude_and_velocity():
    motions = motions_of_flight(60.0)
    attitude, velocity, position = (
        motions[0].attitude,
        motions[0].velocity_ned_m_s,
        motions[0].position_ned_m,
    )
    for motion in motions[1:]:
        middle = rotated_by_rate(attitude, motion.angular_rate_frd_rad_s, STEP_S / 2)
        attitude = rotated_by_rate(attitude, motion.angular_rate_frd_rad_s, STEP_S)
        force = to_world(rotation(middle), *motion.specific_force_frd_m_s2)
        after = tuple(
            v + (f + g) * STEP_S for v, f, g in zip(velocity, force, (0.0, 0.0, GRAVITY_M_S2), strict=True)
        )
        position = tuple(p + (v + w) / 2 * STEP_S for p, v, w in zip(position, velocity, after, strict=True))
        velocity = after
    last = motions[-1]
    cosine = abs(sum(a * b for a, b in zip(attitude, last.attitude, strict=True)))
    assert degrees(2 * acos(min(1.0, cosine))) < 0.01
    assert dist(velocity, last.velocity_ned_m_s) < 1e-3
    assert dist(position, last.position_ned_m) < 0.02


def test_at_rest_the_specific_force_is_minus_gravity():
    motion = MotionTracker(4000).update(
        0, (0.0, 0.0, -1.0), ZERO3, LEVEL, motor_speeds_rad_s=(0.0,) * 4, ground_z_m=0.0
    )
    assert motion.specific_force_frd_m_s2 == pytest.approx((0.0, 0.0, -GRAVITY_M_S2))
    assert motion.angular_rate_frd_rad_s == ZERO3


@pytest.mark.parametrize("angle_rad", [1e-12, 1e-9, 1e-6, 1e-3, 0.5, 3.0])
def test_rates_are_exact_for_small_and_large_turns_and_either_sign_of_the_quaternion(angle_rad):
    for sign in (1.0, -1.0):
        tracker = MotionTracker(4000)
        after = tuple(sign * part for part in quaternion_from_euler(0.0, 0.0, angle_rad))
        for attitude in (LEVEL, after):
            motion = tracker.update(0, ZERO3, ZERO3, attitude, motor_speeds_rad_s=(0.0,) * 4, ground_z_m=0.0)
        assert motion.angular_rate_frd_rad_s == pytest.approx((0.0, 0.0, angle_rad / 4e-3), rel=1e-9)


def test_an_acceleration_forwards_is_felt_forwards_with_the_headings_axes():
    tracker = MotionTracker(4000)
    east = quaternion_from_euler(0.0, 0.0, pi / 2)
    for velocity in (ZERO3, (0.0, 0.004, 0.0)):
        motion = tracker.update(0, ZERO3, velocity, east, motor_speeds_rad_s=(0.0,) * 4, ground_z_m=0.0)
    assert motion.specific_force_frd_m_s2 == pytest.approx((1.0, 0.0, -GRAVITY_M_S2))
