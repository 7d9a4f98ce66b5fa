"""Motion capture: delay, honest variances, constant errors."""

from math import isnan, pi

import numpy as np
import pytest

from framerunner.geometry.rotations import multiply, quaternion_from_euler
from sitl.sensors.motion_capture import MotionCapture
from sitl.sensors.suite import load_suite
from tests.sitl.sensors.statistics import TICK_US, motion, samples, without_errors

SPEC = load_suite("mocap").external_pose


def attitude_error(measured, true):
    """Small rotation vector from the true to the measured attitude, body axes."""
    w, x, y, z = multiply((true[0], -true[1], -true[2], -true[3]), measured)
    return tuple(2 * part / w for part in (x, y, z))


def test_poses_arrive_late_with_the_time_and_pose_of_when_they_were_true():
    sensor = MotionCapture(without_errors(SPEC), 1)
    found = []
    for tick in range(251):
        time_us = tick * TICK_US
        attitude = quaternion_from_euler(0.0, 0.1, time_us * 1e-6)
        pose = sensor.sample(motion(time_us, position_ned_m=(time_us * 1e-6, 2.0, -1.0), attitude=attitude))
        if pose is not None:
            found.append(pose)
            assert 30_000 <= time_us - pose.time_us < 30_000 + TICK_US
            assert pose.position_ned_m == pytest.approx((pose.time_us * 1e-6, 2.0, -1.0))
            assert pose.attitude == pytest.approx(quaternion_from_euler(0.0, 0.1, pose.time_us * 1e-6))
            assert pose.velocity_ned_m_s is None
            assert all(isnan(each) for each in pose.velocity_variance_m2_s2)
    assert len(found) == 49


def test_the_variances_are_those_of_the_noise_without_the_constant_errors():
    attitude = quaternion_from_euler(0.1, -0.2, 2.0)
    positions, turns = [], []
    for seed in range(40):
        poses = samples(MotionCapture(SPEC, seed), 100, 20_000, attitude=attitude)
        positions.append(np.var([pose.position_ned_m for pose in poses], axis=0, ddof=1))
        turns.append(np.var([attitude_error(pose.attitude, attitude) for pose in poses], axis=0, ddof=1))
    assert np.mean(positions) == pytest.approx(poses[0].position_variance_m2[0], rel=0.1)
    assert np.mean(turns) == pytest.approx(poses[0].attitude_variance_rad2[0], rel=0.1)


def test_the_constant_errors_are_fixed_to_the_body():
    spec = SPEC.model_copy(update={"position_noise_m": 0.0, "attitude_noise_rad": 0.0, "delay_s": 0.0})
    sensor = MotionCapture(spec, 3)
    headings = [quaternion_from_euler(0.0, 0.0, yaw_rad) for yaw_rad in (0.0, pi / 2)]
    level, east = (
        sensor.sample(motion(index * 20_000, attitude=attitude)) for index, attitude in enumerate(headings)
    )
    north_m, east_m, down_m = np.array(level.position_ned_m) - (0.0, 0.0, -1.5)
    assert abs(north_m) + abs(east_m) + abs(down_m) > 1e-4
    turned = np.array(east.position_ned_m) - (0.0, 0.0, -1.5)
    assert turned == pytest.approx((-east_m, north_m, down_m))
    errors = [attitude_error(pose.attitude, true) for pose, true in zip((level, east), headings, strict=True)]
    assert errors[0] == pytest.approx(errors[1])
    assert np.linalg.norm(errors[0]) > 1e-3


def test_the_noise_from_pose_to_pose():
    found = samples(MotionCapture(SPEC, 1), 4000, 20_000)
    places = np.array([pose.position_ned_m for pose in found])
    turns = np.array([attitude_error(pose.attitude, (1.0, 0.0, 0.0, 0.0)) for pose in found])
    assert places.std(axis=0) == pytest.approx(SPEC.position_noise_m, rel=0.05)
    assert turns.std(axis=0) == pytest.approx(SPEC.attitude_noise_rad, rel=0.05)
    assert np.linalg.norm([pose.attitude for pose in found], axis=1) == pytest.approx(1.0)
