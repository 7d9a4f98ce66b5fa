"""The estimate of the place beside a batch smoother over the same samples and images: that of GTSAM.

F. Dellaert & M. Kaess, "Factor graphs for robot perception", Foundations and Trends in Robotics 6, 2017. It
is skipped where GTSAM is not installed.
"""

from itertools import combinations, pairwise

import numpy as np
import pytest

from offboard.navigation.goals import CONTEST
from offboard.navigation.view import Surroundings
from offboard.navigation.world_model import WorldModel
from scenarios.models import Arena, Base, Camera
from tests.offboard.navigation.sightings import CAMERA, STD_PX
from tests.offboard.place.test_place import (
    GREEN,
    IMAGE_US,
    IMU_US,
    LATE_US,
    RED,
    TICK_US,
    Vehicle,
    at,
    std_m,
    truth,
)

gtsam = pytest.importorskip("gtsam")
SECONDS = 12.0
LEFT_US = 1_200_000  # the drone leaves the ground, at a place that it knows
X, V, B, L = (
    gtsam.symbol_shorthand.X,
    gtsam.symbol_shorthand.V,
    gtsam.symbol_shorthand.B,
    gtsam.symbol_shorthand.L,
)
OPTICAL = np.array(
    ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
)  # right, down, ahead in the body's axes


def recorded(seed):
    """A flight: samples, images by their times, and the states as the app estimates them by theirs."""
    vehicle, world = Vehicle(seed), WorldModel(Surroundings(Arena(), Base(), Camera()), CONTEST)
    samples, images, states = [], {}, {}
    for time_us in range(TICK_US, round(SECONDS * 1e6), TICK_US):
        image_us = time_us - LATE_US
        is_due = image_us > 0 and image_us % IMAGE_US == 0
        if is_due:
            images[image_us] = vehicle.image(image_us, (RED, GREEN))
        reported = vehicle.state(time_us)
        samples += reported.imu
        states[time_us] = world.observe(reported, (images[image_us],) if is_due else ())
    return samples, images, states


def isotropic(size, std):
    return gtsam.noiseModel.Isotropic.Sigma(size, std)


def pose(time_us):
    place, _, (w, x, y, z) = at(time_us * 1e-6)
    return gtsam.Pose3(gtsam.Rot3.Quaternion(w, x, y, z), np.array(place))


def add_motion(graph, samples, times_us):
    """The samples between images, preintegrated (Forster et al., IEEE T-RO 33(1), 2017)."""
    params = gtsam.PreintegrationParams.MakeSharedU(9.80665)
    params.setAccelerometerCovariance(0.027**2 * np.eye(3))
    params.setGyroscopeCovariance(1e-3**2 * np.eye(3))
    params.setIntegrationCovariance(1e-5**2 * np.eye(3))
    for number, (start_us, end_us) in enumerate(pairwise(times_us)):
        motion = gtsam.PreintegratedImuMeasurements(params, gtsam.imuBias.ConstantBias())
        for sample in samples:
            if start_us < sample.time_us <= end_us:
                force, rate = (
                    np.array(sample.specific_force_flu_m_s2),
                    np.array(sample.angular_rate_flu_rad_s),
                )
                motion.integrateMeasurement(force, rate, IMU_US * 1e-6)
        graph.add(gtsam.ImuFactor(X(number), V(number), X(number + 1), V(number + 1), B(0), motion))


def add_gates(graph, values, images, times_us):
    """The corners, each a point; a gate's are as far from each other as its shape says."""
    on_drone = gtsam.Pose3(
        gtsam.Rot3(OPTICAL), np.array(CAMERA.pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)).position_m)
    )
    focal = gtsam.Cal3_S2(CAMERA.focal_px, CAMERA.focal_px, 0.0, 0.0, 0.0)
    seen = set()
    for number, time_us in enumerate(times_us):
        for sighting in images[time_us].frames:
            first = 4 * (sighting.colour == "green")
            seen.add(sighting.colour)
            for corner_number, corner in enumerate(sighting.corners):
                pixel = np.array((corner.right_px, corner.down_px))
                graph.add(
                    gtsam.GenericProjectionFactorCal3_S2(
                        pixel, isotropic(2, STD_PX), X(number), L(first + corner_number), focal, on_drone
                    )
                )
    assert seen == {"red", "green"}
    for first, gate in ((0, RED), (4, GREEN)):
        half_w, half_h = gate.outer_width_m / 2, gate.outer_height_m / 2
        plane = np.array(((-half_w, half_h), (half_w, half_h), (half_w, -half_h), (-half_w, -half_h)))
        for one, other in combinations(range(4), 2):
            away_m = float(np.linalg.norm(plane[one] - plane[other]))
            graph.add(gtsam.RangeFactor3(L(first + one), L(first + other), away_m, isotropic(1, 5e-4)))
        across = np.array((-np.sin(gate.yaw_rad), np.cos(gate.yaw_rad), 0.0))
        for number, (right, up) in enumerate(plane):
            centre = np.array((gate.x_m, gate.y_m, gate.z_m))
            values.insert(L(first + number), centre - right * across + (0.0, 0.0, up))


def smoothed(samples, images):
    """Positions at the images' times, shape (n, 3): those that explain all samples and images best."""
    times_us = sorted(time_us for time_us in images if time_us >= LEFT_US)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    add_motion(graph, samples, times_us)
    add_gates(graph, values, images, times_us)
    start = gtsam.noiseModel.Diagonal.Sigmas(np.array((0.002, 0.002, 0.002, 0.003, 0.003, 0.003)))
    graph.add(gtsam.PriorFactorPose3(X(0), pose(times_us[0]), start))
    graph.add(gtsam.PriorFactorVector(V(0), np.zeros(3), isotropic(3, 0.5)))
    bias = gtsam.noiseModel.Diagonal.Sigmas(np.array((0.05,) * 3 + (0.001,) * 3))
    graph.add(gtsam.PriorFactorConstantBias(B(0), gtsam.imuBias.ConstantBias(), bias))
    values.insert(B(0), gtsam.imuBias.ConstantBias())
    for number, time_us in enumerate(times_us):
        values.insert(
            X(number), pose(time_us)
        )  # near the optimum, which a batch finds from farther away, too
        values.insert(V(number), np.zeros(3))
    best = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    return times_us, np.array([best.atPose3(X(number)).translation() for number in range(len(times_us))])


def test_the_estimate_is_within_its_stated_deviation_of_a_batch_smoother_s():
    inside, of_filter, of_smoother = [], [], []
    for seed in (21, 22, 23):
        samples, images, states = recorded(seed)
        times_us, best_m = smoothed(samples, images)
        for time_us, best in zip(times_us, best_m, strict=True):
            state = states[time_us]
            if state.landed:
                continue
            true = np.array(truth(time_us * 1e-6)[0])
            estimate = np.array((state.x, state.y, state.z))
            inside.append(np.abs(estimate - best) < 3.0 * std_m(state))
            of_filter.append(estimate - true)
            of_smoother.append(best - true)
    rms = [float(np.sqrt(np.mean(np.square(errors)))) for errors in (of_filter, of_smoother)]
    assert rms[1] < 0.03  # else it is no reference
    assert rms[0] < 1.5 * rms[1]
    assert np.mean(inside) > 0.97
