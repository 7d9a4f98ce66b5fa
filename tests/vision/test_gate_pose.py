"""Poses of a gate from its corners, compared with OpenCV's solver."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.geometry.gate_shape import PAPER_GATE
from vision.gate_model import GateModel, ModelPose
from vision.gate_pose import find_poses

FOCAL_PX = 160.0
MODEL = GateModel(PAPER_GATE, FOCAL_PX)


def seen_at(turns_rad, shift_m):
    """The corners of a gate that is turned about its upright axis, then about right and ahead, and moved."""
    about_down, about_right, about_ahead = turns_rad
    vectors = ([about_right, 0.0, 0.0], [0.0, 0.0, about_ahead], [0.0, about_down, 0.0])
    first, second, third = (cv2.Rodrigues(np.array(vector))[0] for vector in vectors)
    corners = ModelPose(first @ second @ third, np.array(shift_m), 0.0).project(MODEL.axes_corners, FOCAL_PX)
    assert corners is not None
    return corners


@pytest.mark.parametrize("noise_px", [0.0, 0.3])
def test_poses_are_the_upright_ones_of_opencv_with_the_better_one_first(noise_px):
    random = np.random.default_rng(3)
    for _ in range(50):
        shift_m = random.uniform(0.5, 6.0) * np.array([*random.uniform(-0.6, 0.6, 2), 1.0])
        turns_rad = random.uniform(-1.0, 1.0) * np.array([1.0, 0.3, 0.2])
        corners = seen_at(turns_rad, shift_m) + noise_px * random.standard_normal((4, 2))
        camera = np.diag((FOCAL_PX, FOCAL_PX, 1.0))
        answer = cv2.solvePnPGeneric(MODEL.axes_corners, corners, camera, None, flags=cv2.SOLVEPNP_IPPE)
        rotations = [cv2.Rodrigues(turn)[0] for turn in answer[1]]
        found = find_poses([(x, y) for x, y in corners.tolist()], MODEL, 100.0)
        upright = [at for at, rotation in enumerate(rotations) if rotation[1, 1] > 0.6]
        assert upright
        for pose, at in zip(found, upright, strict=True):
            assert pose.rotation == pytest.approx(rotations[at], abs=1e-5)
            assert pose.shift_m == pytest.approx(answer[2][at][:, 0], rel=1e-5, abs=1e-5)


def test_a_gate_seen_exactly_from_the_front_has_a_pose():
    poses = find_poses([(-20.0, -10.0), (20.0, -10.0), (20.0, 10.0), (-20.0, 10.0)], MODEL, 0.1)
    assert poses
    assert poses[0].shift_m == pytest.approx([0.0, 0.0, 1.6])
    assert poses[0].rotation == pytest.approx(np.eye(3))


def test_corners_on_a_line_have_no_pose():
    assert find_poses([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)], MODEL, 100.0) == []


PIXELS = st.integers(-4, 4).map(float)


@given(st.lists(st.tuples(PIXELS, PIXELS), min_size=4, max_size=4), st.tuples(PIXELS, PIXELS))
def test_any_corners_have_poses_of_numbers_or_none(corners, away):
    """Also corners of which two are one, as an outline of few pixels has."""
    moved = [(x + 20.0 * away[0], y + 20.0 * away[1]) for x, y in corners]
    for pose in find_poses(moved, MODEL, 100.0):
        assert np.isfinite(pose.rotation).all()
        assert np.isfinite(pose.shift_m).all()


def test_four_corners_of_which_two_are_one_have_no_pose():
    corners = [(-61.0, 1.5), (-60.0, 2.5), (-60.0, 3.5), (-61.0, 1.5)]
    assert find_poses(corners, MODEL, 100.0) == []
