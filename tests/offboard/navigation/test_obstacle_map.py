"""The map of obstacles, from the pixels in which posts on the floor would end."""

from __future__ import annotations

from math import atan2, hypot, pi, sqrt

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler, quaternion_from_yaw
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.obstacle_map import ObstacleMap
from scenarios.models import Arena, Camera
from vision.types import ObstacleEdge

CAMERA = CameraModel.of(Camera(position_flu_m=(0.0, 0.0, 0.0)))
POST = (2.0, 0.5, 0.15)  # x, y, radius


def edges_of(posts, position_m, yaw_rad=0.0):
    """Where a level camera would see the nearest post end, in every eighth column."""
    x, y, z = position_m
    edges = []
    for column in range(0, 320, 8):
        right_px = column - 159.5
        bearing = yaw_rad - atan2(right_px, CAMERA.focal_px)
        ux, uy = np.cos(bearing), np.sin(bearing)
        ranges_m = []
        for post_x, post_y, radius_m in posts:
            along, across = (post_x - x) * ux + (post_y - y) * uy, (post_x - x) * uy - (post_y - y) * ux
            if abs(across) < radius_m and along > 0:
                ranges_m.append(along - sqrt(radius_m**2 - across**2))
        if ranges_m:
            ahead_m = min(ranges_m) * CAMERA.focal_px / hypot(CAMERA.focal_px, right_px)
            down_px = CAMERA.focal_px * z / ahead_m
            edges.append(ObstacleEdge(right_px, min(down_px, 119.5), cut=down_px > 119.5))
    return tuple(edges)


def look(obstacle_map, posts, position_m, yaw_rad=0.0):
    obstacle_map.update(position_m, quaternion_from_yaw(yaw_rad), edges_of(posts, position_m, yaw_rad))


def flown_past(posts):
    obstacle_map = ObstacleMap(CAMERA, Arena())
    for step in range(30):
        look(obstacle_map, posts, (-1.5 + 0.05 * step, 0.02 * step, 1.0), 0.1 - 0.01 * step)
    return obstacle_map


def test_posts_are_mapped_where_they_stand_and_nothing_else_is():
    posts = [POST, (3.0, -1.5, 0.1), (1.5, -0.5, 0.05)]
    obstacle_map = flown_past(posts)
    occupied = obstacle_map.occupied
    for x, y in zip(*np.nonzero(occupied), strict=True):
        at = (obstacle_map.x_m[x], obstacle_map.y_m[y])
        assert min(hypot(at[0] - px, at[1] - py) - radius for px, py, radius in posts) < 0.2
    for post_x, post_y, radius_m in posts:
        discs = obstacle_map.columns_m
        assert min(hypot(x - post_x, y - post_y) - radius for x, y, radius in discs) < radius_m


def test_discs_cover_all_that_is_occupied():
    obstacle_map = flown_past([POST, (2.5, -1.0, 0.6)])
    for x, y in zip(*np.nonzero(obstacle_map.occupied), strict=True):
        corner = max(
            min(
                hypot(obstacle_map.x_m[x] + dx - cx, obstacle_map.y_m[y] + dy - cy) - radius
                for cx, cy, radius in obstacle_map.columns_m
            )
            for dx in (-0.05, 0.05)
            for dy in (-0.05, 0.05)
        )
        assert corner < 1e-6


def test_a_passage_between_two_posts_stays_open():
    obstacle_map = flown_past([(2.0, 0.6, 0.1), (2.0, -0.6, 0.1)])
    assert not obstacle_map.occupied[:, abs(obstacle_map.y_m) < 0.3].any()
    assert obstacle_map.occupied[:, abs(obstacle_map.y_m) < 0.75].any()


def test_an_end_below_the_image_says_nothing():
    obstacle_map = ObstacleMap(CAMERA, Arena())
    cut = tuple(ObstacleEdge(each.right_px, 119.5, cut=True) for each in edges_of([POST], (0.0, 0.0, 1.0)))
    for _ in range(10):
        obstacle_map.update((0.0, 0.0, 1.0), quaternion_from_yaw(0.0), cut)
    assert not obstacle_map.occupied.any()
    assert obstacle_map.columns_m == ()


def test_far_ends_need_more_views_than_near_ones():
    near, far = ObstacleMap(CAMERA, Arena()), ObstacleMap(CAMERA, Arena())
    look(near, [(2.0, 0.0, 0.3)], (0.0, 0.0, 1.0))
    look(far, [(4.5, 0.0, 0.3)], (-0.5, 0.0, 1.0))
    assert near.occupied.any()
    assert not far.occupied.any()
    for _ in range(5):
        look(far, [(4.5, 0.0, 0.3)], (-0.5, 0.0, 1.0))
    assert far.occupied.any()


def test_what_is_no_longer_seen_is_removed():
    obstacle_map = ObstacleMap(CAMERA, Arena())
    look(obstacle_map, [POST], (0.0, 0.0, 1.0))
    assert obstacle_map.occupied.any()
    for _ in range(20):
        look(obstacle_map, [], (0.0, 0.0, 1.0))
    assert not obstacle_map.occupied.any()


def test_the_attitude_is_taken_into_account():
    edges = (ObstacleEdge(0.5, 0.0, cut=False),)
    obstacle_map = ObstacleMap(CAMERA, Arena())
    for _ in range(3):
        obstacle_map.update((0.0, 0.0, 1.0), quaternion_from_euler(0.0, 0.4, pi / 2), edges)  # nose down
    [(x, y, _)] = obstacle_map.columns_m
    assert x == pytest.approx(0.0, abs=0.1)
    assert y == pytest.approx(1.0 / np.tan(0.4), abs=0.15)
