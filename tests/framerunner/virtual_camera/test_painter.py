"""From telemetry to images: the simulator's own drone gives the simulator's own images."""

from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.streams import GROUND
from framerunner.flying.plan import FlightPlan
from framerunner.virtual_camera.painter import VirtualCamera
from geometry.axes import Pose
from scenarios.loader import load_scenario
from sitl.camera import Camera, CameraFeed
from sitl.simulation import Simulation
from tests.node_input import deliver
from vision.detector import detect

SCENARIO = load_scenario("test-case-1")
START_POSE = FlightPlan(SCENARIO).start_pose
START = Pose(START_POSE[:3], START_POSE[3])


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


def tell(camera, messages):
    for message in messages:
        camera.take(message)


def ready_camera(scenario=SCENARIO, yaw=0.0):
    """A camera on a disarmed vehicle that has stood for a second."""
    camera = VirtualCamera(scenario)
    for time_us in range(0, 1_000_001, 20_000):
        tell(camera, reports(time_us, yaw=yaw))
    camera.take(heartbeat(False))
    return camera


def test_a_vehicle_at_rest_sees_what_the_start_shows_whatever_its_heading():
    half = START.yaw_rad / 2
    wanted = Camera(SCENARIO).render(START.position_m, (cos(half), 0.0, 0.0, sin(half)))
    for yaw in (0.0, 2.5, -pi):
        exposure_us, image = ready_camera(yaw=yaw).step()
        assert exposure_us == 936_000
        np.testing.assert_array_equal(image, wanted)


def test_no_image_before_the_arena_is_laid():
    camera = VirtualCamera(SCENARIO)
    for time_us in range(0, 1_000_001, 20_000):
        tell(camera, reports(time_us))
        assert camera.step() is None
    camera.take(heartbeat(True))
    assert camera.step() is None


def test_exposures_keep_to_the_grid_and_none_comes_twice():
    camera = ready_camera()
    times = [camera.step()[0]]
    for time_us in range(1_000_000, 2_000_001, 20_000):
        tell(camera, reports(time_us))
        shot = camera.step()
        if shot is not None:
            times.append(shot[0])
            assert 30_000 <= time_us - shot[0] < 50_000
    assert times == [936_000 + 100_000 * k for k in range(11)]


def test_after_a_hole_in_the_telemetry_only_the_latest_image_is_painted():
    camera = ready_camera()
    assert camera.step() is not None
    for time_us in (5_000_000, 5_020_000, 5_040_000, 5_100_000):
        tell(camera, reports(time_us))
    assert camera.step()[0] == 5_036_000
    assert camera.step() is None


def test_a_vehicle_that_starts_anew_gets_its_arena_anew():
    camera = ready_camera()
    tell(camera, reports(100_000_000))
    tell(camera, reports(2_000_000))
    assert camera.restarts == 1
    assert camera.placement.alignment is None
    for time_us in range(2_020_000, 2_500_000, 20_000):
        tell(camera, reports(time_us, north=4.0))
    camera.take(heartbeat(False))
    assert camera.step() is not None


def test_euler_angles_serve_where_no_quaternion_comes():
    camera = VirtualCamera(SCENARIO)
    for time_us in range(0, 1_000_001, 20_000):
        ms = time_us // 1000
        camera.take(mavlink.MAVLink_attitude_message(ms, 0.0, 0.0, 1.2, 0.0, 0.0, 0.0))
        camera.take(mavlink.MAVLink_local_position_ned_message(ms, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    camera.take(heartbeat(False))
    half = START.yaw_rad / 2
    wanted = Camera(SCENARIO).render(START.position_m, (cos(half), 0.0, 0.0, sin(half)))
    difference = np.abs(camera.step()[1].astype(int) - wanted)
    assert np.mean(difference > 8) < 0.001  # single precision of the angles moves a border here and there


def test_a_level_camera_turns_with_the_heading_only():
    leaning, level = VirtualCamera(SCENARIO), VirtualCamera(SCENARIO, level=True)
    for time_us in range(0, 1_000_001, 20_000):
        for camera in (leaning, level):
            tell(camera, reports(time_us, armed=False if time_us == 1_000_000 else None))
    for time_us in range(1_020_000, 1_100_001, 20_000):
        ms = time_us // 1000
        for camera in (leaning, level):
            camera.take(mavlink.MAVLink_attitude_message(ms, 0.2, -0.3, 0.1, 0.0, 0.0, 0.0))
            camera.take(mavlink.MAVLink_local_position_ned_message(ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    half = (START.yaw_rad - 0.1) / 2
    upright = Camera(SCENARIO).render(START.position_m, (cos(half), 0.0, 0.0, sin(half)))
    assert np.mean(np.abs(level.step()[1].astype(int) - upright) > 8) < 0.01
    assert np.mean(np.abs(leaning.step()[1].astype(int) - upright) > 8) > 0.2


def test_the_referee_follows_a_flight_through_a_frame_and_back():
    """Straight through red, back over it, down on the start: crossed and landed."""
    camera = ready_camera()
    red = SCENARIO.frames[0]
    x, y, z = START.position_m
    ahead = (-cos(red.yaw_rad), -sin(red.yaw_rad))  # red looks towards the drone
    stations = [(x, y, z), (red.x_m - ahead[0], red.y_m - ahead[1], red.z_m)]
    stations += [(red.x_m + ahead[0], red.y_m + ahead[1], red.z_m), (x, y, 3.0), (x, y, z)]
    time_us = 1_020_000
    tell(camera, reports(time_us, armed=True))
    for start, end in pairwise(stations):
        for step in range(1, 151):
            time_us += 20_000
            px, py, pz = (a + (b - a) * step / 150 for a, b in zip(start, end, strict=True))
            # The vehicle stood at its local zero, looking along the arena's start yaw as north.
            c, s = cos(START.yaw_rad), sin(START.yaw_rad)
            north, left = c * (px - x) + s * (py - y), -s * (px - x) + c * (py - y)
            tell(camera, reports(time_us, north, -left, pz - z))
    assert camera.standing().snapshot.crossed == ("red",)
    assert camera.standing().snapshot.motors_on
    for step in range(150):
        time_us += 20_000
        tell(camera, reports(time_us, armed=False if step % 50 == 0 else None))
    standing = camera.standing("landing.stop")
    assert standing.scenario == "test-case-1" and standing.source == "telemetry"
    assert standing.snapshot.settled
    assert standing.report.landed_on_base
    assert standing.report.landing_error_m == pytest.approx(0.0, abs=1e-3)
    assert standing.report.frames_crossed == ("red",)


def test_without_a_base_all_hangs_as_high_above_where_the_drone_stands_as_above_the_floor():
    camera = VirtualCamera(SCENARIO, base=False)
    lift_m = camera.standing().lift_m
    assert lift_m == SCENARIO.base.top_m
    layout = camera.plan.layout
    assert layout.name == SCENARIO.name
    for frame, raised in zip(SCENARIO.frames, layout.frames, strict=True):
        assert raised.z_m - lift_m == pytest.approx(frame.z_m)
    assert layout.arena.height_m - lift_m == pytest.approx(SCENARIO.arena.height_m)
    assert camera.plan.start_pose == START_POSE


def fly_simulation(scenario, seconds):
    """The simulator's own images and the virtual camera's, of the same flight, by time of exposure."""
    simulation, feed, camera = Simulation(scenario), CameraFeed(scenario), VirtualCamera(scenario)
    node = MavlinkNode(simulation.autopilot, (GROUND,))
    wire, pilot = mavlink.MAVLink(None), mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    orders = {3_000_000: (22, 0, 0, 0, 0, 0, 0, 491.0), 3_200_000: (400, 1, 0, 0, 0, 0, 0, 0)}
    own, painted = {}, {}
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
        for store, shot in ((own, feed.step(simulation.truth)), (painted, camera.step())):
            if shot is not None:
                store[shot[0]] = shot[1]
    return simulation, own, painted


def test_beside_the_simulator_the_images_are_the_simulators_own_within_a_pixel_or_two():
    simulation, own, painted = fly_simulation(SCENARIO, 10)
    assert simulation.truth.position_arena_m[2] > 1.5  # it did fly
    common = sorted(own.keys() & painted.keys())
    assert len(common) > 80
    off_px = []
    for exposure_us in common:
        ours, theirs = detect(painted[exposure_us], None), detect(own[exposure_us], None)
        for colour in ("red", "green", "blue"):
            a, b = getattr(ours, colour), getattr(theirs, colour)
            if a.seen and b.seen:
                off_px += [abs(getattr(a, side) - getattr(b, side)) for side in ("n", "s", "e", "w")]
    assert len(off_px) > 500
    assert max(off_px) <= 2.0
