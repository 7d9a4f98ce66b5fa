"""The filter of the place: its derivatives, its covariance, and the IMU's integral."""

from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape
from framerunner.geometry.rotations import quaternion_from_euler, rotated_by_rate, rotation, to_body
from offboard.drone import ImuInterval
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.gates.gate_measurement import GateView, predicted
from offboard.navigation.gates.gate_track import CERTAIN_M
from offboard.place.inertial_track import GRAVITY_M_S2, InertialTrack
from offboard.place.landmarks import GATE_SIZE_STD, SIZE_STD
from offboard.place.measurements import Eye, corners, points, report, size, stands
from offboard.place.place_filter import OWN, TURN, TURN_SETTLING_RAD, PlaceFilter
from scenarios.models import Camera

CAMERA = CameraModel.of(Camera())
LEVEL = (1.0, 0.0, 0.0, 0.0)
EYE = Eye(CAMERA, quaternion_from_euler(0.1, -0.05, 0.4), (0.02, -0.01, 0.03))
BASE_M = np.array(((2.1, 0.4, 0.5), (2.1, 0.9, 0.5), (1.8, 0.2, 0.0)))
OF_DRONE = (0.1, -0.3, 1.2, 0.05, 0.5, -0.2, 0.1, 0.02, -0.01, 0.03)
STATE = np.array((*OF_DRONE, 2.1, 0.9, 1.4, 0.7, 0.15, -0.6, 0.1, 1.0))


def tilted(time_s):
    """Attitude and rate of a body that rolls, pitches and turns."""
    return (0.6 * cos(3 * time_s), 0.4 * sin(2 * time_s), 0.8)


def samples(seconds, acceleration, step_us=4_000):
    """The attitude at each end, the IMU's means over each step, for an acceleration in the arena."""
    attitude, found = quaternion_from_euler(0.1, 0.05, 0.3), []
    for end_us in range(step_us, round(seconds * 1e6) + 1, step_us):
        rate = tilted((end_us - step_us / 2) * 1e-6)
        middle = rotation(rotated_by_rate(attitude, rate, step_us * 5e-7))
        ax, ay, az = acceleration((end_us - step_us / 2) * 1e-6)
        force = to_body(middle, ax, ay, az + GRAVITY_M_S2)
        attitude = rotated_by_rate(attitude, rate, step_us * 1e-6)
        found.append((ImuInterval(end_us, rate, force), attitude))
    return found


def test_the_track_integrates_motion_between_any_two_times():
    track = InertialTrack()
    assert not track.add((), 0, quaternion_from_euler(0.1, 0.05, 0.3))
    pending = []
    for sample, attitude in samples(2.0, lambda t: (cos(t), -0.5, 0.3 * t)):
        pending.append(sample)
        if sample.time_us % 20_000 == 0:
            assert track.add(tuple(pending), sample.time_us, attitude)
            pending = []
    start_s, end_s = 0.3137, 1.8721
    motion = track.between(round(start_s * 1e6), round(end_s * 1e6))
    step_s = end_s - start_s
    gained = (sin(end_s) - sin(start_s), -0.5 * step_s, 0.15 * (end_s**2 - start_s**2))
    assert motion.velocity_m_s == pytest.approx(gained, abs=2e-4)
    moved = (
        cos(start_s) - cos(end_s) - sin(start_s) * step_s,
        -0.25 * step_s**2,
        0.05 * (end_s**3 - start_s**3) - 0.15 * start_s**2 * step_s,
    )
    assert motion.position_m == pytest.approx(moved, abs=2e-4)
    assert motion.turn_rad == pytest.approx(0.0, abs=1e-3)
    assert track.between(round(end_s * 1e6), 2_200_000) is None  # beyond the samples


def test_a_heading_that_the_gyroscope_does_not_confirm_is_a_turn_of_the_reports():
    track = InertialTrack()
    track.add((), 0, LEVEL)
    for tick in range(1, 11):
        rest = tuple(
            ImuInterval(tick * 50_000 - late, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY_M_S2))
            for late in range(40_000, -1, -10_000)
        )
        track.add(rest, tick * 50_000, quaternion_from_euler(0.0, 0.0, 0.004 * tick))
    motion = track.between(0, 500_000)
    assert motion.turn_rad == pytest.approx(-0.04, abs=1e-9)
    place = PlaceFilter(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    place.predict(motion, TURN_SETTLING_RAD)
    assert -0.04 <= place.turn_rad < -0.038  # the gyroscope is believed while the vehicle corrects itself


def test_a_gap_in_the_samples_begins_the_track_anew():
    track = InertialTrack()
    one = ImuInterval(50_000, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY_M_S2))
    later = ImuInterval(700_000, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY_M_S2))
    track.add((), 0, LEVEL)
    assert track.add((one,), 50_000, LEVEL)
    assert not track.add((later,), 700_000, LEVEL)
    assert track.between(50_000, 700_000) is None


def view(seen=(True, True, True, True)):
    count = 2 * sum(seen)
    return GateView(
        colour="red",
        shape=GateShape(),
        whole=all(seen),
        time_us=0,
        camera=CAMERA.pose((0.0, 0.0, 1.0), LEVEL),
        focal_px=CAMERA.focal_px,
        seen=seen,
        corners_px=np.zeros(count),
        noise_px2=np.eye(count),
        position_var_m2=0.0,
    )


@pytest.mark.parametrize(
    "model",
    [
        report((0.6, -0.1, 0.2), 0.1, 0.05),
        report((0.6, -0.1, 0.2), 0.1, 0.05, position_m=(0.2, 0.1, 1.3), height_std_m=0.05),
        report(
            (0.6, -0.1, 0.2), 0.1, 0.05, position_m=(0.2, 0.1, 1.3), height_std_m=0.05, position_std_m=0.01
        ),
        stands((0.2, 0.1, 1.0), 0.1, 0.01, 0.01, 0.01),
        corners(view(), EYE, OWN, 0.0),
        corners(view((True, False, False, True)), EYE, OWN, 0.0),
        size(OWN, 0.1),
        points(BASE_M, np.array(((5.0, 60.0), (-40.0, 55.0), (20.0, 70.0))), np.eye(6), EYE, 0.003),
    ],
)
def test_the_derivatives_of_a_measurement_are_those_of_its_residual(model):
    at = model(STATE)
    for index in range(len(STATE)):
        step = np.zeros(len(STATE))
        step[index] = 1e-6
        slope = (model(STATE + step).residual - model(STATE - step).residual) / 2e-6
        assert -slope == pytest.approx(at.jacobian[:, index], abs=2e-4 * max(1.0, np.abs(slope).max()))


def test_the_prediction_has_the_derivatives_of_its_motion():
    track = InertialTrack()
    track.add((), 0, quaternion_from_euler(0.1, 0.05, 0.3))
    for sample, attitude in samples(0.2, lambda t: (0.8, -0.5, 0.3)):
        track.add((sample,), sample.time_us, attitude)
    motion = track.between(0, 200_000)

    def after(state):
        place = PlaceFilter(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        place.x = state.copy()
        place.predict(motion)
        return place.x

    place = PlaceFilter(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    place.x = STATE[:OWN].copy()
    spread = 1e3  # so that the noise is small beside it
    place.p = spread * np.eye(OWN)
    place.predict(motion)
    slopes = np.array(
        [(after(STATE[:OWN] + step) - after(STATE[:OWN] - step)) / 2e-6 for step in 1e-6 * np.eye(OWN)]
    ).T
    assert place.p / spread == pytest.approx(slopes @ slopes.T, abs=1e-4)


def test_a_gate_is_known_as_well_from_the_drone_as_it_was_seen_however_far_that_has_drifted():
    place = PlaceFilter(0, (1.0, 2.0, 1.5), (0.0, 0.0, 0.0), position_std_m=0.5)
    place.p[TURN, TURN] = 0.1**2
    seen = np.diag((0.02, 0.01, 0.01, 0.03)) ** 2
    place.add_gate("red", np.array((3.0, 1.0, 1.2, 0.3)), seen, 0.3)
    place.add_gate("blue", np.array((-3.0, 1.0, 1.2, 1.3)), seen, 0.3)
    assert place.gate_from_drone("red") == pytest.approx(seen, abs=1e-9)
    assert place.p[OWN, OWN] > 0.25  # in the arena it is as uncertain as the drone
    place.drop_gate("red")
    assert place.gate("red") is None
    assert place.gate("blue").tolist() == [-3.0, 1.0, 1.2, 1.3]
    assert place.gate_from_drone("blue") == pytest.approx(seen, abs=1e-9)


CORNERS_M = np.array(
    [(2.4 + x, 0.1 + y, z) for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (0.0, 0.5)]
)


def corners_from(true_m):
    """The corners of a base in an image that is taken at a place."""
    eye = Eye(CAMERA, LEVEL, (0.0, 0.0, 0.0))
    camera = CAMERA.pose(true_m, LEVEL)
    pixels = np.array([CAMERA.project(camera, tuple(corner)) for corner in CORNERS_M])
    return lambda spoilt_px: points(
        CORNERS_M, pixels + spoilt_px, 0.25 * np.eye(2 * len(pixels)), eye, attitude_std_rad=0.003
    )


def test_a_place_that_is_far_off_is_found_by_known_corners_once_it_is_doubted():
    true_m = (0.9, 0.3, 0.9)
    measured = corners_from(true_m)
    place = PlaceFilter(0, (0.2, -0.4, 0.93), (0.0, 0.0, 0.0), position_std_m=0.05)
    assert not place.update(measured(0.0), 30.0)
    assert place.x[:3] == pytest.approx((0.2, -0.4, 0.93))
    place.doubt((0.5, 0.5, 0.05), 0.07)
    other = np.random.default_rng(1).normal(0.0, 12.0, (len(CORNERS_M), 2))
    assert not place.update(measured(other), 30.0)
    assert place.update(measured(0.0), 30.0)
    assert place.x[:3] == pytest.approx(true_m, abs=0.02)


def test_a_doubted_place_is_known_as_well_as_before_relative_to_the_gates():
    place = PlaceFilter(0, (0.2, -0.4, 0.9), (0.0, 0.0, 0.0))
    place.add_gate("red", np.array((2.0, 0.5, 1.2, 0.3)), 1e-4 * np.eye(4), 0.3)
    before, gate_m = place.gate_from_drone("red"), place.p[OWN, OWN]
    place.doubt((0.5, 0.5, 0.05), 0.07)
    assert place.gate_from_drone("red") == pytest.approx(before, abs=1e-9)
    assert place.p[0, 0] > 0.25
    assert place.p[OWN, OWN] > gate_m + 0.25


def see_from(place, true_m, larger=1.0):
    """Bring the filter to a place with an error of 5 cm, and show it a gate there."""
    place.displace(0, tuple(np.array(true_m) - place.x[:3]), 0.05, 0.0)
    camera = CAMERA.pose(true_m, LEVEL)
    shape = GateShape(larger * PAPER_GATE.outer_width_m, larger * PAPER_GATE.outer_height_m)
    looks = replace(view(), shape=shape, camera=camera, noise_px2=0.25 * np.eye(8))
    expected = predicted(np.array((2.1, 0.9, 1.4, 0.3)), looks)
    shown = replace(looks, shape=PAPER_GATE, corners_px=expected[0])
    for _ in range(5):
        place.update(corners(shown, Eye(CAMERA, LEVEL, (0.0, 0.0, 0.0)), OWN, 0.0))


def test_a_gate_is_known_as_well_far_from_where_it_was_seen_first_once_its_size_is_known():
    place = PlaceFilter(0, (-6.0, 0.1, 1.2), (0.0, 0.0, 0.0))
    place.add_gate("red", np.array((2.1, 0.9, 1.4, 0.3)), 1e-2 * np.eye(4), SIZE_STD)
    for true_m in ((-6.0, 0.1, 1.2), (-3.0, -1.0, 1.3), (1.0, 0.4, 1.4)):
        see_from(place, true_m)
        if true_m[0] == -3.0:
            place.update(size(OWN, GATE_SIZE_STD))
    x, y, z, _ = np.sqrt(place.gate_from_drone("red").diagonal()).tolist()
    assert max(x, y, z) < CERTAIN_M


def test_a_gate_of_another_size_does_not_tell_where_the_drone_is_in_the_arena():
    place = PlaceFilter(0, (-2.0, 0.1, 1.2), (0.0, 0.0, 0.0), position_std_m=0.3)
    place.add_gate("red", np.array((0.7, 0.6, 1.3, 0.3)), 1e-1 * np.eye(4), SIZE_STD)
    for true_m in ((-2.0, 0.1, 1.2), (-1.6, -0.3, 1.3), (-1.2, 0.3, 1.4), (-1.0, -0.2, 1.2)):
        see_from(place, true_m, larger=1.5)
    assert place.size("red")[1] < 0.1  # it has shown its size
    assert np.sqrt(place.p.diagonal()[:3]).min() > 0.29
