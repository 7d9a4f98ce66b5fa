"""What the navigator knows, from images and states that come late, in bursts or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from math import dist, inf

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler, rotation, to_world
from offboard.drone import DroneState
from offboard.navigation.goals import CONTEST
from offboard.navigation.planner.clearance import DRONE_RADIUS_M
from offboard.navigation.view import GateEstimate, Surroundings
from offboard.navigation.world_model import WorldModel
from scenarios.imaging.effects import CameraEffects
from scenarios.models import Arena, Base, Camera, Gimbal
from tests.offboard.navigation.sightings import corners_px, gate_at, sighting
from vision.types import Detections, GateCorner, GateSighting

RED = gate_at(2.0, 0.0, 1.0, 0.3)
TICK_US = 50_000
TICKS = range(20, 61)  # two seconds of flight


def state(time_us: int) -> DroneState:
    """A drone that flies towards red at 0.6 m/s and swings to the side."""
    t = time_us * 1e-6
    place, velocity = (0.6 * (t - 2.0), 0.2 * np.sin(2 * t), 1.0), (0.6, 0.4 * np.cos(2 * t), 0.0)
    yaw = 0.1 * np.sin(3 * t)
    attitude = quaternion_from_euler(0.0, 0.0, yaw)
    return DroneState(time_us, *place, yaw, velocity, attitude_arena=attitude)


def image(time_us: int) -> Detections:
    """What the camera showed when it was exposed, without noise."""
    exposed = state(time_us)
    place = (exposed.x, exposed.y, exposed.z)
    seen = sighting(RED, place, exposed.attitude_arena, np.random.default_rng(0), noise=0.0)
    return Detections(time_us=time_us, frames=() if seen is None else (seen,))


def test_a_camera_on_a_gimbal_gives_the_place_of_what_it_looks_at():
    """The drone flies with its nose 40 degrees to the right of red and tilts; the camera looks at red."""
    turned, offset_m = quaternion_from_euler(0.0, 0.1, 0.0), Camera().position_flu_m
    tilted = quaternion_from_euler(0.2, -0.15, -0.7)

    def at(time_us: int) -> DroneState:
        return replace(state(time_us), attitude_arena=tilted, yaw=-0.7, camera_attitude_arena=turned)

    def seen(time_us: int) -> Detections:
        exposed = at(time_us)
        place = np.array((exposed.x, exposed.y, exposed.z))
        eye = place + to_world(rotation(tilted), *offset_m)
        carrier = eye - to_world(rotation(turned), *offset_m)
        found = sighting(RED, tuple(carrier), turned, np.random.default_rng(0), noise=0.0)
        return Detections(time_us=time_us, frames=() if found is None else (found,))

    def place_of_red(camera: Camera, image_of: Callable[[int], Detections]) -> float:
        surroundings = Surroundings(Arena(), Base(x_m=-3.0, y_m=-3.0), camera)
        world = WorldModel(surroundings, CONTEST)
        for tick in TICKS:
            due = [us for us in IMAGES_US if us // TICK_US == tick - 2]
            world.observe(at(tick * TICK_US), [image_of(us) for us in due])
        red = world.gate("red")
        return inf if red is None else dist(red.position_m, RED.position_arena_m)

    assert place_of_red(Camera(gimbal=Gimbal()), seen) < 0.03
    assert place_of_red(Camera(), seen) > 0.5  # the drone's attitude is not the camera's


IMAGES_US = range(1_030_000, 2_900_000, 100_000)  # exposed between ticks


def red_after(ticks: Iterable[tuple[DroneState, list[Detections]]]) -> GateEstimate | None:
    """What is known of red after these ticks."""
    surroundings = Surroundings(Arena(), Base(x_m=-3.0, y_m=-3.0), Camera())
    world = WorldModel(surroundings, CONTEST)
    for at, images in ticks:
        world.observe(at, images)
    return world.gate("red")


def on_time(delay_us: int) -> list[tuple[DroneState, list[Detections]]]:
    """Every tick, with the images that have arrived since the one before: `delay_us` after exposure."""
    ticks = []
    for number in TICKS:
        now_us = number * TICK_US
        arrived = [us for us in IMAGES_US if now_us - TICK_US < us + delay_us <= now_us]
        ticks.append((state(now_us), [image(us) for us in arrived]))
    return ticks


def error_m(estimate: GateEstimate | None) -> float:
    assert estimate is not None
    return dist(estimate.position_m, (RED.x_m, RED.y_m, RED.z_m))


def test_an_image_that_is_newer_than_the_state_waits_for_its_pose() -> None:
    newer = red_after(on_time(delay_us=-30_000))
    assert newer == red_after(on_time(delay_us=60_000))
    assert error_m(newer) < 0.01


@pytest.mark.parametrize("late_us", [200_000, 500_000, 1_400_000])
def test_after_a_stall_all_images_and_states_are_used(late_us: int) -> None:
    regular = on_time(delay_us=60_000)
    first = 10
    stalled = regular[first : first + late_us // TICK_US]
    states = [at for at, _ in stalled]
    late = (replace(states[-1], missed=tuple(states[:-1])), [one for _, images in stalled for one in images])
    after = red_after([*regular[:first], late, *regular[first + len(stalled) :]])
    assert after == red_after(regular)


def test_images_from_a_time_without_states_are_lost_and_those_after_it_are_used() -> None:
    regular = on_time(delay_us=60_000)
    images = [one for _, images in regular[10:20] for one in images]
    gap = red_after([*regular[:10], (regular[20][0], images), *regular[20:]])
    assert error_m(gap) < 0.01


def test_images_are_used_once_whatever_their_number() -> None:
    regular = on_time(delay_us=60_000)
    twice = [(at, [*images, *images]) for at, images in regular]
    assert red_after(twice) == red_after(regular)
    flood = [(at, [replace(one, time_us=None) for one in images] * 40) for at, images in regular]
    assert red_after(flood) is None


def test_what_seems_to_stand_at_the_start_leaves_room_for_the_drone() -> None:
    surroundings = Surroundings(Arena(), Base(x_m=-3.0, y_m=-3.0), Camera())
    world = WorldModel(surroundings, CONTEST)
    start = state(1_000_000)
    world.observe(start, [])
    places_m = [(start.x + 0.1, start.y, 1.0), (start.x + 0.35, start.y, 1.0), (start.x + 3.0, start.y, 1.0)]
    for place_m in places_m:
        world.seen_space.suspect(place_m)
    gaps_m = [dist((start.x, start.y), (x, y)) - radius_m for x, y, radius_m in world.obstacles().columns_m]
    assert len(gaps_m) == 2
    assert min(gaps_m) > DRONE_RADIUS_M + CONTEST.bar_margin_m


def test_gate_that_seems_to_be_above_the_ceiling_is_crossed_below_it():
    surroundings = Surroundings(Arena(), Base(x_m=-3.0, y_m=-3.0), Camera())
    other = GateEstimate("red", (5.3, 0.0, 4.4), 0.5, (0.5, 0.5, 0.5), 0.1, True, False, 1, 0)
    gate = WorldModel(surroundings, CONTEST).gate_of(other)
    assert gate.centre_m == pytest.approx((5.0, 0.0, 3.89))
    assert gate.yaw_rad == pytest.approx(0.5)


def rolled_error_m(readout_s: float) -> float:
    """Error of a gate's position that a turning drone learns through a rolling shutter of 16 ms.

    Args:
        readout_s: of the shutter, as the navigator knows it.
    """
    camera = Camera(effects=CameraEffects(readout_s=readout_s))
    surroundings = Surroundings(Arena(), Base(), camera)
    world = WorldModel(surroundings, CONTEST)
    gate = gate_at(2.0, 0.3, 2.4, 0.2)  # high in the image, where rows are read early

    def yaw(time_s: float) -> float:
        return 0.6 * (time_s - 1.0)

    images: list[Detections] = []
    for tick in range(32):
        time_s = 0.05 * tick
        if tick % 2:
            at_s = time_s - 0.03
            row_s = at_s
            for _ in range(3):  # the row depends on its own time
                points = corners_px(gate, (0.0, 0.0, 1.5), quaternion_from_euler(0.0, 0.0, yaw(row_s)))
                assert points is not None
                row_s = at_s + 0.016 * float(points[:, 1].mean()) / camera.height_px
            a, b, c, d = (GateCorner(right, down, 0.2, 0.2) for right, down in points.tolist())
            seen = GateSighting("red", (a, b, c, d), True, ())
            images = [Detections(time_us=round(1e6 * at_s), frames=(seen,))]
        attitude = quaternion_from_euler(0.0, 0.0, yaw(time_s))
        now = DroneState(round(1e6 * time_s), 0.0, 0.0, 1.5, yaw(time_s), attitude_arena=attitude)
        world.observe(now, images)
        images = []
    estimate = world.gate("red")
    assert estimate is not None
    return dist(estimate.position_m, (gate.x_m, gate.y_m, gate.z_m))


def test_rows_of_a_rolling_shutter_are_used_at_their_own_time() -> None:
    assert rolled_error_m(0.016) < 0.5 * rolled_error_m(0.0)
