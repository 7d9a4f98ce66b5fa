from math import nan, pi, radians

import numpy as np
import pytest

from firmware_py.mavlink.gimbal.model import GimbalTarget
from framerunner.geometry.rotations import quaternion_from_euler, yaw_of
from scenarios.loader import load_scenario
from scenarios.models import Gimbal, Scenario
from sitl.camera import CameraFeed
from sitl.payload.gimbal import SimulatedGimbal
from sitl.simulation import Simulation

STEP_S = 0.004
LEVEL = quaternion_from_euler(0.0, 0.0, 0.0)


def after(gimbal, seconds, attitude=LEVEL):
    for _ in range(round(seconds / STEP_S)):
        gimbal.step(STEP_S, attitude)
    return gimbal.pitch_rad, gimbal.yaw_rad


def test_it_turns_at_its_rate_and_stops_at_its_limits():
    gimbal = SimulatedGimbal(Gimbal(pitch_min_rad=-1.0, yaw_max_rad=0.5, rate_max_rad_s=0.5))
    gimbal.turn(GimbalTarget(-1.5, 1.0))
    assert after(gimbal, 0.8) == pytest.approx((-0.4, 0.4))
    assert (gimbal.pitch_rate_rad_s, gimbal.yaw_rate_rad_s) == pytest.approx((-0.5, 0.5))
    assert after(gimbal, 3.0) == pytest.approx((-1.0, 0.5))
    assert gimbal.pitch_rate_rad_s == 0.0
    gimbal.turn(GimbalTarget(pitch_rate_rad_s=0.2, yaw_rate_rad_s=nan))
    assert after(gimbal, 1.0) == pytest.approx((-0.8, 0.5))


def test_the_camera_stays_level_however_the_drone_tilts():
    gimbal = SimulatedGimbal(Gimbal())
    gimbal.step(STEP_S, quaternion_from_euler(0.4, -0.3, 1.0))
    assert gimbal.motion.attitude_arena == pytest.approx(quaternion_from_euler(0.0, 0.0, -1.0))


@pytest.mark.parametrize(("locked", "yaw_rad", "heading_ned_rad"), [(False, 0.3, 1.3), (True, -0.7, 0.3)])
def test_the_yaw_follows_the_drone_or_stays_to_north(locked, yaw_rad, heading_ned_rad):
    gimbal = SimulatedGimbal(Gimbal(rate_max_rad_s=0.5))
    gimbal.turn(GimbalTarget(0.0, 0.3, yaw_locked=locked))
    after(gimbal, 2.0)
    gimbal.step(STEP_S, quaternion_from_euler(0.0, 0.0, 1.0))  # at once: it does not lag
    assert gimbal.yaw_rad == pytest.approx(yaw_rad)
    assert yaw_of(gimbal.motion.attitude_arena) == pytest.approx(-heading_ned_rad)


@pytest.mark.parametrize(("locked", "rate_rad_s"), [(False, 0.5), (True, 0.0)])
def test_the_camera_turns_with_the_drone_unless_its_yaw_is_locked(locked, rate_rad_s):
    gimbal = SimulatedGimbal(Gimbal())
    gimbal.turn(GimbalTarget(0.0, 0.0, yaw_locked=locked))
    for number in range(10):
        gimbal.step(STEP_S, quaternion_from_euler(0.0, 0.0, 0.5 * STEP_S * number))
    assert gimbal.motion.rate_frd_rad_s == pytest.approx((0.0, 0.0, rate_rad_s))
    assert gimbal.yaw_rate_rad_s == pytest.approx(0.0)


def test_a_gimbal_needs_an_axis():
    with pytest.raises(ValueError, match="yaw_max_rad"):
        Gimbal(pitch_min_rad=0.0, pitch_max_rad=0.0, yaw_max_rad=0.0)


def scenario(**camera):
    base = load_scenario("test-case-1").model_dump()
    base["camera"] |= camera
    return Scenario.model_validate(base)


def view(simulation):
    """The image at a simulation's present state."""
    feed = CameraFeed(simulation.scenario)
    feed.step(simulation.truth)
    simulation.truth.time_us += 100_000
    _, image = feed.step(simulation.truth)
    return image


def test_images_follow_the_gimbal():
    """Looking 20 degrees down moves the horizon up by the focal length times the tangent of that."""
    fixed, carried = Simulation(scenario()), Simulation(scenario(gimbal={}))
    for _ in range(25):
        fixed.tick()
        carried.tick()
    assert np.array_equal(view(fixed), view(carried))  # on the base the drone is level
    carried.gimbal.turn(GimbalTarget(radians(-20.0), 0.0))
    for _ in range(250):
        carried.tick()
    sky = view(fixed)[0, 0]
    heights = [int(np.argmax((view(each)[:, 160] != sky).any(axis=1))) for each in (fixed, carried)]
    assert heights[1] < heights[0]
    carried.gimbal.turn(GimbalTarget(0.0, pi / 2))
    for _ in range(500):
        carried.tick()
    assert not np.array_equal(view(fixed), view(carried))


def test_straight_down_the_image_is_ground():
    """The camera is exactly level in roll, so the horizon has no direction in the image."""
    carried = Simulation(scenario(gimbal={}))
    for _ in range(25):
        carried.tick()
    sky = view(carried)[0, 0]
    carried.gimbal.turn(GimbalTarget(nan, nan, radians(-60.0), 0.0, False))
    for _ in range(600):
        carried.tick()
    assert carried.gimbal.pitch_rad == -pi / 2
    assert not (view(carried) == sky).all(axis=2).any()


def test_a_scenario_without_a_gimbal_has_none_and_says_nothing_of_it():
    plain = Simulation(scenario())
    plain.tick()
    assert plain.gimbal is None
    assert plain.truth.camera is None
    assert "gimbal" not in scenario().model_dump()["camera"]
