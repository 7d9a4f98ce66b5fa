"""The arena lies where the vehicle stands, whichever way its north is."""

from math import cos, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.virtual_camera.placement import HELD_AFTER_FLIGHT_US, Placement
from geometry.axes import Pose
from geometry.rotations import quaternion_from_euler
from wire.vehicle_telemetry import VehiclePose

START = Pose((-3.0, -3.0, 0.55), 1.0)
places = st.tuples(st.floats(-500, 500), st.floats(-500, 500), st.floats(-50, 50))
angles = st.floats(-pi, pi)


def pose(position=(0.0, 0.0, 0.0), yaw=0.0, velocity=(0.0, 0.0, 0.0), roll=0.0, pitch=0.0):
    return VehiclePose(0, position, velocity, quaternion_from_euler(roll, pitch, yaw))


def laid(position=(0.0, 0.0, 0.0), yaw=0.0):
    """A placement at a vehicle that stands disarmed."""
    placement = Placement(START)
    placement.see_pose(pose(position, yaw))
    placement.see_heartbeat(0, armed=False)
    return placement


def axes(quaternion):
    """Forward and up of a body, in the axes of its attitude."""
    w, x, y, z = quaternion
    forward = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
    return forward, (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))


@given(places, angles)
def test_the_standing_vehicle_is_on_the_start_and_looks_the_starts_way(position, yaw):
    where = laid(position, yaw).arena_pose(pose(position, yaw))
    assert where.position_arena_m == pytest.approx(START.position_m, abs=1e-9)
    forward, up = axes(where.attitude_arena)
    assert forward == pytest.approx((cos(1.0), sin(1.0), 0.0), abs=1e-9)
    assert up == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)


@given(places, angles, st.floats(0, 5), st.floats(-2, 2))
def test_flying_ahead_and_up_is_ahead_and_up_in_the_arena(position, yaw, ahead_m, up_m):
    north, east, down = position
    moved = (north + ahead_m * cos(yaw), east + ahead_m * sin(yaw), down - up_m)
    velocity = (cos(yaw), sin(yaw), -0.5)
    where = laid(position, yaw).arena_pose(pose(moved, yaw, velocity))
    x, y, z = START.position_m
    assert where.position_arena_m == pytest.approx(
        (x + ahead_m * cos(1.0), y + ahead_m * sin(1.0), z + up_m), abs=1e-6
    )
    assert where.velocity_arena_m_s == pytest.approx((cos(1.0), sin(1.0), 0.5))


@given(angles, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_turning_right_leaning_right_and_nose_up_are_the_same_in_the_arena(yaw, roll, pitch):
    placement = laid(yaw=yaw)
    turned, _ = axes(placement.arena_pose(pose(yaw=yaw + 0.3)).attitude_arena)
    assert turned == pytest.approx((cos(0.7), sin(0.7), 0.0), abs=1e-9)
    forward, up = axes(placement.arena_pose(pose(yaw=yaw, roll=roll, pitch=pitch)).attitude_arena)
    assert forward[2] == pytest.approx(sin(pitch), abs=1e-9)
    rightwards = up[0] * sin(1.0) - up[1] * cos(1.0)
    assert rightwards == pytest.approx(sin(roll), abs=1e-9)


def test_a_vehicle_in_the_air_has_no_arena():
    placement = Placement(START)
    placement.see_pose(pose())
    placement.see_heartbeat(0, armed=True)
    placement.see_pose(pose())
    assert placement.arena_pose(pose()) is None


def test_what_came_after_the_last_disarmed_heartbeat_does_not_move_the_arena():
    """The vehicle may have been armed and have moved since."""
    placement = laid()
    placement.see_pose(pose((0.0, 0.0, -0.4)))
    placement.see_heartbeat(1_000_000, armed=True)
    assert placement.arena_pose(pose()).position_arena_m == pytest.approx(START.position_m)


def test_the_arena_follows_a_vehicle_that_is_carried_before_its_flight():
    placement = laid()
    placement.see_pose(pose((5.0, 1.0, 0.0), yaw=2.0))
    placement.see_heartbeat(1_000_000, armed=False)
    assert placement.arena_pose(pose((5.0, 1.0, 0.0), yaw=2.0)).position_arena_m == pytest.approx(
        START.position_m
    )


def test_noise_at_rest_is_averaged_also_across_south():
    placement = Placement(START)
    for north, yaw in ((0.02, pi - 0.02), (-0.02, -pi + 0.02)):
        placement.see_pose(pose((north, 0.0, 0.0), yaw))
    placement.see_heartbeat(0, armed=False)
    where = placement.arena_pose(pose(yaw=pi))
    assert where.position_arena_m == pytest.approx(START.position_m)
    assert axes(where.attitude_arena)[0] == pytest.approx((cos(1.0), sin(1.0), 0.0))


def test_after_a_landing_the_arena_stays_until_the_verdict_is_made():
    placement = laid()
    landed = pose((0.1, 0.0, 0.0))
    placement.see_heartbeat(1_000_000, armed=True)
    for time_us in (5_000_000, 6_000_000, 5_000_000 + HELD_AFTER_FLIGHT_US - 1):
        placement.see_heartbeat(time_us, armed=False)
        placement.see_pose(landed)
        assert placement.arena_pose(landed).position_arena_m != pytest.approx(START.position_m)
    placement.see_heartbeat(5_000_000 + HELD_AFTER_FLIGHT_US, armed=False)
    assert placement.arena_pose(landed).position_arena_m == pytest.approx(START.position_m)


def test_a_try_soon_after_another_begins_from_where_the_vehicle_stands():
    placement = laid()
    landed = pose((0.1, 0.0, 0.0))
    placement.see_heartbeat(1_000_000, armed=True)
    placement.see_heartbeat(5_000_000, armed=False)
    placement.see_pose(landed)
    placement.see_heartbeat(6_000_000, armed=False)
    placement.see_heartbeat(7_000_000, armed=True)
    assert placement.arena_pose(landed).position_arena_m == pytest.approx(START.position_m)
