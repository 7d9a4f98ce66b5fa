"""Where the corners of a gate are in an image, and what one image tells of its pose."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.vectors import Vec3
from offboard.navigation.gates.gate_measurement import GateView, Prior, predicted, solutions, view_of
from offboard.navigation.gates.gate_track import half_turn
from offboard.navigation.pose_history import DronePose
from scenarios.models import Arena, Gate
from tests.offboard.navigation.sightings import CAMERA, corners_px, gate_at, sighting

GATE = gate_at(0.3, -0.2, 1.5, 0.4)
STATE = np.array((0.3, -0.2, 1.5, 0.4))
# Frontal, beside, beside and above, from the rear and below, partly out of view, oblique.
PLACES: list[tuple[Vec3, float]] = [
    ((2.2, 0.6, 1.5), pi + 0.4),
    ((1.0, 1.9, 1.4), -2.0),
    ((2.0, -2.2, 2.6), 2.2),
    ((-1.5, -0.5, 0.8), 0.1),
    ((1.4, 0.1, 1.4), pi + 0.9),
    ((1.9, -2.0, 1.3), 2.3),
]


def view(place_m: Vec3, yaw_rad: float, noise: float = 0.0, gate: Gate = GATE) -> GateView:
    """What is seen of a gate from a place."""
    attitude = quaternion_from_euler(0.04, 0.08, yaw_rad)
    seen = sighting(gate, place_m, attitude, np.random.default_rng(5), noise)
    assert seen is not None
    made = view_of(seen, gate.shape, CAMERA, DronePose(0, place_m, attitude))
    assert made is not None
    return made


@pytest.mark.parametrize(("place_m", "yaw_rad"), PLACES)
def test_predicted_corners_are_those_of_the_gate_as_seen(place_m: Vec3, yaw_rad: float) -> None:
    seen = view(place_m, yaw_rad)
    prediction = predicted(STATE, seen)
    assert prediction is not None
    assert prediction[0] == pytest.approx(seen.corners_px, abs=1e-6)
    truth = corners_px(GATE, place_m, quaternion_from_euler(0.04, 0.08, yaw_rad))
    assert truth is not None
    assert sum(seen.seen) == sum(CAMERA.contains(right, down) for right, down in truth)


@pytest.mark.parametrize(("place_m", "yaw_rad"), PLACES)
def test_jacobian_and_curvature_are_derivatives(place_m: Vec3, yaw_rad: float) -> None:
    seen = view(place_m, yaw_rad)
    prediction = predicted(STATE, seen)
    assert prediction is not None
    corners, jacobian, curvature = prediction
    for column, step in enumerate(np.eye(4) * 1e-4):
        after, before = predicted(STATE + step, seen), predicted(STATE - step, seen)
        assert after is not None
        assert before is not None
        size = np.abs(jacobian[:, column]).max()
        assert (after[0] - before[0]) / 2e-4 == pytest.approx(jacobian[:, column], abs=1e-4 * size)
    bent = (after[0] + before[0] - 2.0 * corners) / 1e-8
    # What perspective adds is left out; it is small.
    assert bent[0::2] == pytest.approx(curvature[0::2], abs=0.4 * np.abs(bent).max())


def test_a_gate_of_another_shape_is_found_where_it_is() -> None:
    wide = GATE.model_copy(update={"outer_width_m": 1.2, "outer_height_m": 0.5, "bar_m": 0.05})
    place_m, yaw_rad = (3.0, 1.0, 1.6), pi + 0.45
    best = solutions([view(place_m, yaw_rad, gate=wide)], Prior.of(Arena()))[0]
    assert best.state[:3] == pytest.approx(STATE[:3], abs=0.02)
    assert half_turn(best.state[3] - STATE[3]) == pytest.approx(0.0, abs=0.02)


def test_one_of_the_solutions_of_one_image_is_right_and_likely() -> None:
    place_m, yaw_rad = PLACES[1]
    found = solutions([view(place_m, yaw_rad, noise=1.0)], Prior.of(Arena()))
    likely = [solution for solution in found if solution.log_weight > found[0].log_weight - 4.0]
    errors = [solution.state - STATE for solution in likely]
    for error in errors:
        error[3] = half_turn(error[3])
    squares = [e @ np.linalg.solve(s.covariance, e) for e, s in zip(errors, likely, strict=True)]
    assert min(squares) < 13.3  # chi-squared, 99 %


def test_edge_on_and_from_behind_nothing_is_predicted() -> None:
    edge_on = (0.3 - 2.0 * np.sin(0.4), -0.2 + 2.0 * np.cos(0.4), 1.5)
    assert predicted(STATE, view(*PLACES[0])) is not None
    seen = view(*PLACES[0])
    for place_m, yaw_rad in ((edge_on, 0.4 - pi / 2), (PLACES[0][0], 0.4)):
        camera = CAMERA.pose(place_m, quaternion_from_euler(0.0, 0.0, yaw_rad))
        turned = replace(seen, camera=camera)
        assert predicted(STATE, turned) is None
