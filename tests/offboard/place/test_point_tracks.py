"""Followed points in the filter of the place: simulated points, seen by a drone that moves."""

from math import cos, sin

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler, rotation
from offboard.navigation.camera_model import CameraModel
from offboard.place.inertial_track import InertialMotion
from offboard.place.measurements import Eye, height
from offboard.place.place_filter import POSITION, VELOCITY, PlaceFilter
from offboard.place.point_tracks import MOST_IMAGES, PointWindow
from scenarios.models import Camera
from vision.types import PointTracks

CAMERA = CameraModel.of(Camera())
PERIOD_S = 0.1
WRONG_M_S = 0.3  # of the first velocity, which the filter is told is known to 0.2
ATTITUDE = quaternion_from_euler(0.02, 0.1, 0.3)
ZERO = (0.0, 0.0, 0.0)


def floor_points(seed, count=300):
    places = np.random.default_rng(seed).uniform(-6.0, 6.0, (count, 3))
    places[:, 2] = 0.0
    return places


def wall_points(seed, count=300):
    places = np.random.default_rng(seed).uniform(-3.0, 3.0, (count, 3))
    places[:, 0], places[:, 2] = 4.0 + 0.3 * places[:, 0], 1.8 + 0.5 * places[:, 2]
    return places


def true_place(time_s, speed_m_s):
    return (-1.0 + speed_m_s * time_s, 0.3 * sin(time_s) * speed_m_s, 1.2)


def tracks_at(time_s, speed_m_s, points_m, random, noise_px=0.2, wrong_share=0.0):
    """What the camera shows of points; some of them jump each time."""
    camera = CAMERA.pose(true_place(time_s, speed_m_s), ATTITUDE)
    seen = {
        number: pixel
        for number, point in enumerate(points_m.tolist())
        if (pixel := CAMERA.project(camera, point)) is not None and CAMERA.contains(*pixel)
    }
    pixels = np.array(list(seen.values())).reshape(-1, 2) + noise_px * random.standard_normal((len(seen), 2))
    jumps = random.uniform(size=len(seen)) < wrong_share
    pixels[jumps] += random.uniform(-30.0, 30.0, (int(jumps.sum()), 2))
    return PointTracks(np.array(list(seen)), pixels, pixels[:, 1])


def fly(points_m, speed_m_s=0.6, images=30, **noise):
    """The filter after some images; the drone accelerates only by its way's curve, which the IMU knows."""
    random = np.random.default_rng(1)
    vx, vy = speed_m_s, 0.3 * speed_m_s
    place = PlaceFilter(0, true_place(0.0, speed_m_s), (vx + WRONG_M_S, vy, 0.0), velocity_std_m_s=0.2)
    window = PointWindow(CAMERA.focal_px)
    eye = Eye(CAMERA, ATTITUDE, ZERO)
    for image in range(images):
        time_s = image * PERIOD_S
        if image:
            before_s = time_s - PERIOD_S
            v0 = 0.3 * speed_m_s * cos(before_s)
            gained = (0.0, 0.3 * speed_m_s * cos(time_s) - v0, 0.0)
            way = (0.0, 0.3 * speed_m_s * (sin(time_s) - sin(before_s)) - v0 * PERIOD_S, 0.0)
            place.predict(InertialMotion(PERIOD_S, gained, way, rotation(ATTITUDE)))
            place.update(height(1.2, 0.05))
        window.see(place, tracks_at(time_s, speed_m_s, points_m, random, **noise), eye, eye, eye)
    truth_m = np.array(true_place((images - 1) * PERIOD_S, speed_m_s))
    return place, truth_m


def test_points_of_the_floor_tell_the_velocity_that_was_not_known():
    place, truth_m = fly(floor_points(3))
    assert abs(float(place.x[VELOCITY][0]) - 0.6) < 0.05
    assert np.abs(place.x[POSITION] - truth_m).max() < 0.15


@pytest.mark.parametrize("points_m", [floor_points(5), wall_points(4)], ids=["floor", "wall"])
def test_a_drone_that_hovers_knows_that_it_stands(points_m):
    """Also by points whose distance is not known; how fast one flies, those alone do not tell."""
    place, truth_m = fly(points_m, speed_m_s=0.0)
    assert np.abs(place.x[VELOCITY]).max() < 0.03
    assert np.abs(place.x[POSITION] - truth_m).max() < 0.15


def test_points_that_jump_are_left_out():
    place, truth_m = fly(floor_points(6), wrong_share=0.1)
    assert abs(float(place.x[VELOCITY][0]) - 0.6) < 0.06
    assert np.abs(place.x[POSITION] - truth_m).max() < 0.2


def test_the_filter_keeps_no_more_places_than_points_need():
    place, _ = fly(floor_points(7))
    assert len(place.clones) <= MOST_IMAGES
    assert len(place.x) == 10 + 4 * len(place.clones)
    assert np.allclose(place.p, place.p.T)
    assert np.linalg.eigvalsh(place.p).min() > -1e-9
