"""From telemetry to images: the arena is placed at the vehicle, and the images are the simulator's own."""

from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mavlink

from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import GROUND
from framerunner.flying.plan import FlightPlan
from framerunner.geometry.axes import Pose
from framerunner.geometry.rotations import multiply, quaternion_from_euler, quaternion_from_yaw
from framerunner.virtual_camera.camera import HELD_AFTER_FLIGHT_US, StartPlacement, VirtualCamera
from framerunner.wire.vehicle_telemetry import VehiclePose
from scenarios.loader import load_scenario
from sitl.camera import CameraFeed, SimulatedCamera
from sitl.simulation import Simulation
from tests.node_input import deliver
from vision.detector import detect

SCENARIO = load_scenario("test-case-1")
START_POSE = FlightPlan(SCENARIO).start_pose
START = Pose(START_POSE[:3], START_POSE[3])
PLACEMENT_START = Pose((-3.0, -3.0, 0.55), 1.0)


def heartbeat(armed):
    return mavlink.MAVLink_heartbeat_message(2, 12, 128 * armed, 0, 4, 3)


def reports(time_us, north=0.0, east=0.0, up=0.0, yaw=0.0, armed=None):
    """What a level vehicle sends at one instant."""
    ms = time_us // 1000
    sent = [
        mavlink.MAVLink_attitude_quaternion_message(ms, cos(yaw / 2), 0.0, 0.0, sin(yaw / 2), 0.0, 0.0, 0.0),
        mavlink.MAVLink_local_position_ned_message(ms, north, east, -up, 0.0, 0.0, 0.0),
    ]
    return sent if armed is None else [*sent, heartbeat(armed)]


def send(camera, messages):
    for message in messages:
        camera.take(message)


def ready_camera(scenario=SCENARIO, yaw=0.0):
    """A camera on a disarmed vehicle that has stood for a second."""
    camera = VirtualCamera(scenario)
    for time_us in range(0, 1_000_001, 20_000):
        send(camera, reports(time_us, yaw=yaw))
    camera.take(heartbeat(False))
    return camera


def test_a_vehicle_at_rest_sees_what_the_start_shows_whatever_its_heading():
    half = START.yaw_rad / 2
    wanted = SimulatedCamera(SCENARIO).render(START.position_m, (cos(half), 0.0, 0.0, sin(half)))
    for yaw in (0.0, 2.5, -pi):
        exposure_us, image = ready_camera(yaw=yaw).step()
        assert exposure_us == 936_000
        np.testing.assert_array_equal(image, wanted)


def test_no_image_before_the_arena_is_placed():
    camera = VirtualCamera(SCENARIO)
    for time_us in range(0, 1_000_001, 20_000):
        send(camera, reports(time_us))
        assert camera.step() is None
    camera.take(heartbeat(True))
    assert camera.step() is None


def test_exposures_are_on_the_grid_and_none_is_repeated():
    camera = ready_camera()
    times = [camera.step()[0]]
    for time_us in range(1_000_000, 2_000_001, 20_000):
        send(camera, reports(time_us))
        shot = camera.step()
        if shot is not None:
            times.append(shot[0])
            assert 30_000 <= time_us - shot[0] < 50_000
    assert times == [936_000 + 100_000 * k for k in range(11)]


def test_after_a_gap_in_the_telemetry_only_the_latest_image_is_rendered():
    camera = ready_camera()
    assert camera.step() is not None
    for time_us in (5_000_000, 5_020_000, 5_040_000, 5_100_000):
        send(camera, reports(time_us))
    assert camera.step()[0] == 5_036_000
    assert camera.step() is None


def test_after_a_restart_of_the_vehicle_the_arena_is_placed_again():
    camera = ready_camera()
    send(camera, reports(100_000_000))
    send(camera, reports(2_000_000))
    assert camera.restarts == 1
    assert camera.placement.alignment is None
    for time_us in range(2_020_000, 2_500_000, 20_000):
        send(camera, reports(time_us, north=4.0))
    camera.take(heartbeat(False))
    assert camera.step() is not None


def test_euler_angles_are_used_where_no_quaternion_is_received():
    camera = VirtualCamera(SCENARIO)
    for time_us in range(0, 1_000_001, 20_000):
        ms = time_us // 1000
        camera.take(mavlink.MAVLink_attitude_message(ms, 0.0, 0.0, 1.2, 0.0, 0.0, 0.0))
        camera.take(mavlink.MAVLink_local_position_ned_message(ms, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    camera.take(heartbeat(False))
    half = START.yaw_rad / 2
    wanted = SimulatedCamera(SCENARIO).render(START.position_m, (cos(half), 0.0, 0.0, sin(half)))
    difference = np.abs(camera.step()[1].astype(int) - wanted)
    assert np.mean(difference > 8) < 0.001  # single precision of the angles moves some edges


def test_a_level_camera_follows_the_heading_only():
    tilted, level = VirtualCamera(SCENARIO), VirtualCamera(SCENARIO, level=True)
    for time_us in range(0, 1_000_001, 20_000):
        for camera in (tilted, level):
            send(camera, reports(time_us, armed=False if time_us == 1_000_000 else None))
    for time_us in range(1_020_000, 1_100_001, 20_000):
        ms = time_us // 1000
        for camera in (tilted, level):
            camera.take(mavlink.MAVLink_attitude_message(ms, 0.2, -0.3, 0.1, 0.0, 0.0, 0.0))
            camera.take(mavlink.MAVLink_local_position_ned_message(ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    half = (START.yaw_rad - 0.1) / 2
    upright = SimulatedCamera(SCENARIO).render(START.position_m, (cos(half), 0.0, 0.0, sin(half)))
    assert np.mean(np.abs(level.step()[1].astype(int) - upright) > 8) < 0.01
    assert np.mean(np.abs(tilted.step()[1].astype(int) - upright) > 8) > 0.2


@pytest.mark.parametrize("to_north", [False, True])
def test_a_camera_on_the_vehicles_gimbal_looks_where_that_does(to_north):
    """The vehicle is tilted and turned; the gimbal looks 20 degrees down and 0.3 rad to the right."""
    camera = ready_camera()
    q = quaternion_from_euler(0.0, -0.35, 0.3 if to_north else 0.2)
    flags = 4 | 8 | (16 | 64 if to_north else 32)
    for time_us in range(1_020_000, 1_100_001, 20_000):
        ms = time_us // 1000
        camera.take(mavlink.MAVLink_attitude_message(ms, 0.2, -0.3, 0.1, 0.0, 0.0, 0.0))
        camera.take_gimbal(
            mavlink.MAVLink_gimbal_device_attitude_status_message(0, 0, ms, flags, q, 0.0, 0.0, 0.0, 0)
        )
        camera.take(mavlink.MAVLink_local_position_ned_message(ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert camera.has_gimbal
    level = multiply(quaternion_from_yaw(START.yaw_rad), quaternion_from_euler(0.0, 0.35, -0.3))  # FLU
    wanted = SimulatedCamera(SCENARIO).render(START.position_m, level)
    assert np.mean(np.abs(camera.step()[1].astype(int) - wanted) > 8) < 0.05
    for time_us in range(1_120_000, 3_400_001, 20_000):
        send(camera, reports(time_us))
    assert not camera.has_gimbal  # it reports no more


def test_the_referee_follows_a_flight_through_a_gate_and_back():
    """Straight through red, back over it, down on the start: crossed and landed."""
    camera = ready_camera()
    red = SCENARIO.frames[0]
    x, y, z = START.position_m
    ahead = (-cos(red.yaw_rad), -sin(red.yaw_rad))  # red's normal points to the drone
    stations = [(x, y, z), (red.x_m - ahead[0], red.y_m - ahead[1], red.z_m)]
    stations += [(red.x_m + ahead[0], red.y_m + ahead[1], red.z_m), (x, y, 3.0), (x, y, z)]
    time_us = 1_020_000
    send(camera, reports(time_us, armed=True))
    for start, end in pairwise(stations):
        for step in range(1, 151):
            time_us += 20_000
            px, py, pz = (a + (b - a) * step / 150 for a, b in zip(start, end, strict=True))
            # The vehicle stood at its local zero, looking along the arena's start yaw as north.
            c, s = cos(START.yaw_rad), sin(START.yaw_rad)
            north, left = c * (px - x) + s * (py - y), -s * (px - x) + c * (py - y)
            send(camera, reports(time_us, north, -left, pz - z))
    assert camera.standing().snapshot.crossed == ("red",)
    assert camera.standing().snapshot.motors_on
    for step in range(150):
        time_us += 20_000
        send(camera, reports(time_us, armed=False if step % 50 == 0 else None))
    standing = camera.standing("landing.stop")
    assert standing.scenario == "test-case-1" and standing.source == "telemetry"
    assert standing.snapshot.settled
    assert standing.report.landed_on_base
    assert standing.report.landing_error_m == pytest.approx(0.0, abs=1e-3)
    assert standing.report.frames_crossed == ("red",)


def test_without_a_base_the_layout_is_as_high_above_the_start_as_declared_above_the_floor():
    camera = VirtualCamera(SCENARIO, base=False)
    lift_m = camera.standing().lift_m
    assert lift_m == SCENARIO.base.top_m
    layout = camera.plan.layout
    assert layout.name == SCENARIO.name
    for gate, raised in zip(SCENARIO.frames, layout.frames, strict=True):
        assert raised.z_m - lift_m == pytest.approx(gate.z_m)
    assert layout.arena.height_m - lift_m == pytest.approx(SCENARIO.arena.height_m)
    assert camera.plan.start_pose == START_POSE


def fly_simulation(scenario, seconds):
    """The simulator's own images and the virtual camera's, of the same flight, by time of exposure."""
    simulation, feed, camera = Simulation(scenario), CameraFeed(scenario), VirtualCamera(scenario)
    node = MavlinkNode(simulation.autopilot, (GROUND,))
    wire, pilot = mavlink.MAVLink(None), mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    orders = {3_000_000: (22, 0, 0, 0, 0, 0, 0, 491.0), 3_200_000: (400, 1, 0, 0, 0, 0, 0, 0)}
    own, rendered = {}, {}
    while simulation.time_us < seconds * 1_000_000:
        simulation.tick()
        order = orders.get(simulation.time_us)
        if order is not None:
            deliver(node, GROUND.name, pilot.command_long_encode(1, 1, order[0], 0, *order[1:]).pack(pilot))
        node.update(simulation.autopilot.state.time_us)
        for _, data in node.take_output():
            for message in wire.parse_buffer(data) or ():
                if message.get_srcComponent() == 1:
                    camera.take(message)
        for store, shot in ((own, feed.step(simulation.truth)), (rendered, camera.step())):
            if shot is not None:
                store[shot[0]] = shot[1]
    return simulation, own, rendered


def test_beside_the_simulator_the_images_are_the_simulators_own_within_a_pixel_or_two():
    simulation, own, rendered = fly_simulation(SCENARIO, 10)
    assert simulation.truth.position_arena_m[2] > 1.5  # it did fly
    common = sorted(own.keys() & rendered.keys())
    assert len(common) > 80
    off_px = []
    for exposure_us in common:
        ours, theirs = detect(rendered[exposure_us], None), detect(own[exposure_us], None)
        for colour in ("red", "green", "blue"):
            a, b = getattr(ours, colour), getattr(theirs, colour)
            if a.seen and b.seen:
                off_px += [abs(getattr(a, side) - getattr(b, side)) for side in ("n", "s", "e", "w")]
    assert len(off_px) > 500
    assert max(off_px) <= 2.0


places = st.tuples(st.floats(-500, 500), st.floats(-500, 500), st.floats(-50, 50))
angles = st.floats(-pi, pi)


def pose(position=(0.0, 0.0, 0.0), yaw=0.0, velocity=(0.0, 0.0, 0.0), roll=0.0, pitch=0.0):
    return VehiclePose(0, position, velocity, quaternion_from_euler(roll, pitch, yaw))


def placed(position=(0.0, 0.0, 0.0), yaw=0.0):
    """A placement at a vehicle that stands disarmed."""
    placement = StartPlacement(PLACEMENT_START)
    placement.see_pose(pose(position, yaw))
    placement.see_heartbeat(0, armed=False)
    return placement


def axes(quaternion):
    """Forward and up of a body, in the axes of its attitude."""
    w, x, y, z = quaternion
    forward = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
    return forward, (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))


@given(places, angles)
def test_the_standing_vehicle_is_on_the_start_with_the_starts_heading(position, yaw):
    where = placed(position, yaw).arena_pose(pose(position, yaw))
    assert where.position_arena_m == pytest.approx(PLACEMENT_START.position_m, abs=1e-9)
    forward, up = axes(where.attitude_arena)
    assert forward == pytest.approx((cos(1.0), sin(1.0), 0.0), abs=1e-9)
    assert up == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)


@given(places, angles, st.floats(0, 5), st.floats(-2, 2))
def test_flying_ahead_and_up_is_ahead_and_up_in_the_arena(position, yaw, ahead_m, up_m):
    north, east, down = position
    moved = (north + ahead_m * cos(yaw), east + ahead_m * sin(yaw), down - up_m)
    velocity = (cos(yaw), sin(yaw), -0.5)
    where = placed(position, yaw).arena_pose(pose(moved, yaw, velocity))
    x, y, z = PLACEMENT_START.position_m
    assert where.position_arena_m == pytest.approx(
        (x + ahead_m * cos(1.0), y + ahead_m * sin(1.0), z + up_m), abs=1e-6
    )
    assert where.velocity_arena_m_s == pytest.approx((cos(1.0), sin(1.0), 0.5))


@given(angles, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_yaw_roll_and_pitch_are_the_same_in_the_arena(yaw, roll, pitch):
    placement = placed(yaw=yaw)
    turned, _ = axes(placement.arena_pose(pose(yaw=yaw + 0.3)).attitude_arena)
    assert turned == pytest.approx((cos(0.7), sin(0.7), 0.0), abs=1e-9)
    forward, up = axes(placement.arena_pose(pose(yaw=yaw, roll=roll, pitch=pitch)).attitude_arena)
    assert forward[2] == pytest.approx(sin(pitch), abs=1e-9)
    rightwards = up[0] * sin(1.0) - up[1] * cos(1.0)
    assert rightwards == pytest.approx(sin(roll), abs=1e-9)


def test_a_vehicle_in_the_air_has_no_arena():
    placement = StartPlacement(PLACEMENT_START)
    placement.see_pose(pose())
    placement.see_heartbeat(0, armed=True)
    placement.see_pose(pose())
    assert placement.arena_pose(pose()) is None


def test_poses_after_the_last_disarmed_heartbeat_do_not_move_the_arena():
    """The vehicle may have been armed and have moved since."""
    placement = placed()
    placement.see_pose(pose((0.0, 0.0, -0.4)))
    placement.see_heartbeat(1_000_000, armed=True)
    assert placement.arena_pose(pose()).position_arena_m == pytest.approx(PLACEMENT_START.position_m)


def test_the_arena_follows_a_vehicle_that_is_carried_before_its_flight():
    placement = placed()
    placement.see_pose(pose((5.0, 1.0, 0.0), yaw=2.0))
    placement.see_heartbeat(1_000_000, armed=False)
    assert placement.arena_pose(pose((5.0, 1.0, 0.0), yaw=2.0)).position_arena_m == pytest.approx(
        PLACEMENT_START.position_m
    )


def test_noise_at_rest_is_averaged_also_across_south():
    placement = StartPlacement(PLACEMENT_START)
    for north, yaw in ((0.02, pi - 0.02), (-0.02, -pi + 0.02)):
        placement.see_pose(pose((north, 0.0, 0.0), yaw))
    placement.see_heartbeat(0, armed=False)
    where = placement.arena_pose(pose(yaw=pi))
    assert where.position_arena_m == pytest.approx(PLACEMENT_START.position_m)
    assert axes(where.attitude_arena)[0] == pytest.approx((cos(1.0), sin(1.0), 0.0))


def test_after_a_landing_the_arena_stays_until_the_verdict_is_made():
    placement = placed()
    landed = pose((0.1, 0.0, 0.0))
    placement.see_heartbeat(1_000_000, armed=True)
    for time_us in (5_000_000, 6_000_000, 5_000_000 + HELD_AFTER_FLIGHT_US - 1):
        placement.see_heartbeat(time_us, armed=False)
        placement.see_pose(landed)
        assert placement.arena_pose(landed).position_arena_m != pytest.approx(PLACEMENT_START.position_m)
    placement.see_heartbeat(5_000_000 + HELD_AFTER_FLIGHT_US, armed=False)
    assert placement.arena_pose(landed).position_arena_m == pytest.approx(PLACEMENT_START.position_m)


def test_a_try_soon_after_another_begins_where_the_vehicle_stands():
    placement = placed()
    landed = pose((0.1, 0.0, 0.0))
    placement.see_heartbeat(1_000_000, armed=True)
    placement.see_heartbeat(5_000_000, armed=False)
    placement.see_pose(landed)
    placement.see_heartbeat(6_000_000, armed=False)
    placement.see_heartbeat(7_000_000, armed=True)
    assert placement.arena_pose(landed).position_arena_m == pytest.approx(PLACEMENT_START.position_m)
