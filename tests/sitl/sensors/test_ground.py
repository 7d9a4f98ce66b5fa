"""Range finder and optical flow: geometry and limits."""

from math import cos, isnan, pi

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler, rotated_by_rate, rotation, to_body, to_world
from sitl.sensors.ground import OpticalFlow, RangeFinder
from sitl.sensors.suite import load_suite
from tests.sitl.sensors.statistics import TICK_US, motion, samples, without_errors

SPEC = load_suite("flow")
RANGE, FLOW = without_errors(SPEC.range_finder), without_errors(SPEC.optical_flow)
EACH_TICK = FLOW.model_copy(update={"rate_hz": 250.0})
TICK_S = TICK_US * 1e-6


def distance_m(**parts):
    return RangeFinder(RANGE, 1).sample(motion(**parts)).distance_m


def test_the_distance_is_along_body_down_to_the_surface_below():
    assert distance_m() == pytest.approx(1.5)
    assert distance_m(ground_z_m=0.51) == pytest.approx(0.99)
    for roll_rad, pitch_rad in ((0.4, 0.0), (0.0, -0.4), (0.3, 0.2)):
        tilted = distance_m(attitude=quaternion_from_euler(roll_rad, pitch_rad, 1.0))
        assert tilted == pytest.approx(1.5 / (cos(roll_rad) * cos(pitch_rad)))


@pytest.mark.parametrize(
    "parts",
    [
        {"position_ned_m": (0.0, 0.0, -0.05)},
        {"position_ned_m": (0.0, 0.0, -12.5)},
        {"position_ned_m": (0.0, 0.0, -11.0), "attitude": quaternion_from_euler(0.5, 0.0, 0.0)},
        {"attitude": quaternion_from_euler(pi / 2, 0.0, 0.0)},
        {"attitude": quaternion_from_euler(pi, 0.0, 0.0)},
    ],
)
def test_out_of_its_range_there_is_no_distance(parts):
    assert isnan(distance_m(**parts))


def test_the_noise_of_distances():
    spec = SPEC.range_finder
    values = np.array([each.distance_m for each in samples(RangeFinder(spec, 1), 5000, 20_000)])
    assert values.std() == pytest.approx(spec.noise_m, rel=0.05)
    offsets = [RangeFinder(spec, seed)._offset_m for seed in range(300)]
    assert np.std(offsets) == pytest.approx(spec.offset_m, rel=0.12)


def flow_of(spec=EACH_TICK, **parts):
    return OpticalFlow(spec, 1).sample(motion(**parts))


def test_forward_motion_turns_the_image_about_body_right_and_motion_to_the_right_backwards_about_forward():
    """At 2 m height 1 m/s is 0.5 rad/s; heading east, forward is east."""
    east = quaternion_from_euler(0.0, 0.0, pi / 2)
    parts = {"position_ned_m": (0.0, 0.0, -2.0), "attitude": east}
    forwards = flow_of(velocity_ned_m_s=(0.0, 1.0, 0.0), **parts)
    assert forwards.flow_rad == pytest.approx((0.0, 0.5 * TICK_S))
    assert forwards.gyro_rad == (0.0, 0.0)
    to_the_right = flow_of(velocity_ned_m_s=(-1.0, 0.0, 0.0), **parts)
    assert to_the_right.flow_rad == pytest.approx((-0.5 * TICK_S, 0.0))
    assert to_the_right.quality == FLOW.quality


def test_of_a_drone_that_only_turns_flow_and_gyroscope_are_equal():
    sample = flow_of(angular_rate_frd_rad_s=(0.3, -0.2, 1.0))
    assert sample.flow_rad == pytest.approx((0.3 * TICK_S, -0.2 * TICK_S))
    assert sample.gyro_rad == sample.flow_rad


def test_the_flow_is_the_motion_of_a_point_of_the_ground_seen_from_the_drone():
    """The point straight ahead of the sensor, seen again a tick later, for a drone that turns and moves."""
    attitude = quaternion_from_euler(0.2, -0.3, 0.8)
    velocity, rate = (0.7, -0.4, 0.2), (0.3, -0.5, 0.9)
    height_m = 1.5
    before = (0.0, 0.0, -height_m)
    ray = to_world(rotation(attitude), 0.0, 0.0, 1.0)
    point = [p + r * height_m / ray[2] for p, r in zip(before, ray, strict=True)]
    after = [p + v * TICK_S for p, v in zip(before, velocity, strict=True)]
    turned = rotated_by_rate(attitude, rate, TICK_S)
    forward, right, down = to_body(rotation(turned), *[a - b for a, b in zip(point, after, strict=True)])
    seen = flow_of(attitude=attitude, velocity_ned_m_s=velocity, angular_rate_frd_rad_s=rate)
    # A drone that rolls to the right sees the point move to its right; one that pitches up, backwards.
    assert seen.flow_rad == pytest.approx((right / down, -forward / down), rel=2e-2)


def test_a_sample_has_the_sum_of_all_ticks_since_the_one_before():
    sensor = OpticalFlow(FLOW, 1)
    found = [
        sensor.sample(motion(tick * TICK_US, angular_rate_frd_rad_s=(0.1 * tick, 0.0, 0.0)))
        for tick in range(11)
    ]
    times = [each.time_us for each in found if each]
    assert times == [0, 20_000, 40_000]
    assert found[5].integration_us == 20_000
    assert found[5].gyro_rad[0] == pytest.approx(0.1 * (1 + 2 + 3 + 4 + 5) * TICK_S)
    assert found[10].gyro_rad[0] == pytest.approx(0.1 * (6 + 7 + 8 + 9 + 10) * TICK_S)


@pytest.mark.parametrize(
    "parts",
    [
        {"position_ned_m": (0.0, 0.0, -0.05)},
        {"position_ned_m": (0.0, 0.0, -5.5)},
        {"velocity_ned_m_s": (12.0, 0.0, 0.0)},
        {"attitude": quaternion_from_euler(pi, 0.0, 0.0)},
    ],
)
def test_a_flow_that_cannot_be_seen_has_no_quality(parts):
    assert flow_of(**parts).quality == 0


def test_a_share_of_the_floor_reflects_in_squares_and_shows_no_flow():
    spec = EACH_TICK.model_copy(update={"shiny_share": 0.1, "shiny_size_m": 0.5})
    places = [(0.25 + 0.5 * north, 0.25 + 0.5 * east) for north in range(-32, 32) for east in range(-32, 32)]
    seen = {at: flow_of(spec, position_ned_m=(*at, -1.0)).quality for at in places}
    assert sum(quality == 0 for quality in seen.values()) / len(seen) == pytest.approx(0.1, abs=0.02)
    assert {quality for quality in seen.values() if quality} == {spec.quality}
    beside = flow_of(spec, position_ned_m=(places[0][0] + 0.2, places[0][1] - 0.2, -1.0))
    assert beside.quality == seen[places[0]]


def test_the_noise_of_flow_and_of_its_gyroscope():
    found = samples(OpticalFlow(SPEC.optical_flow, 1), 5000, 20_000)[1:]
    assert all(each.integration_us == TICK_US for each in found)  # here, a tick before each sample
    flow, gyro = (np.array([getattr(each, name) for each in found]) for name in ("flow_rad", "gyro_rad"))
    assert flow.std(axis=0) == pytest.approx(SPEC.optical_flow.noise_rad_s * TICK_S, rel=0.05)
    density = SPEC.optical_flow.gyro_noise_density_rad_s_sqrt_hz
    assert gyro.std(axis=0) == pytest.approx(density * TICK_S**0.5, rel=0.05)
