"""Other drones in the image."""

import numpy as np
import pytest

from geometry.solids import Solid
from scenarios.loader import load_scenario
from sitl.camera import Camera
from sitl.camera_scene import DRONE_BGR

LEVEL = (1.0, 0.0, 0.0, 0.0)
HALF_M = (0.15, 0.15, 0.05)


@pytest.fixture(scope="module")
def camera():
    return Camera(load_scenario("test-case-1"))


def dark(image):
    return (image == DRONE_BGR).all(axis=2)


def test_a_drone_ahead_is_where_and_as_large_as_it_is(camera):
    eye_x_m = -4.0 + 0.08
    image = camera.render((-4.0, 3.5, 1.0), LEVEL, [Solid("d", (-2.0, 3.5, 1.0), 0.0, HALF_M)])
    rows, columns = np.nonzero(dark(image))
    front_m = -2.0 - HALF_M[0] - eye_x_m
    assert np.ptp(columns) + 1 == pytest.approx(2 * HALF_M[1] * camera.focal_px / front_m, abs=2)
    assert columns.mean() == pytest.approx(159.5, abs=1)
    assert rows.mean() == pytest.approx(119.5, abs=1)


@pytest.mark.parametrize(
    "place", [(-6.0, 3.5, 1.0), (-4.0, 3.5, 1.0), (-2.0, 20.0, 1.0), (90.0, 3.5, 1.0), (-4.0, 3.5, 9.0)]
)
def test_what_is_not_before_the_camera_is_not_seen(camera, place):
    image = camera.render((-4.0, 3.5, 1.0), LEVEL, [Solid("d", place, 0.0, HALF_M)])
    assert not dark(image).any()


def test_the_base_hides_what_is_behind_it(camera):
    base = load_scenario("test-case-1").base
    x_m, y_m = base.x_m, base.y_m
    behind = camera.render((x_m - 2.0, y_m, 0.3), LEVEL, [Solid("d", (x_m + 2.0, y_m, 0.3), 0.0, HALF_M)])
    before = camera.render((x_m - 2.0, y_m, 0.3), LEVEL, [Solid("d", (x_m - 1.0, y_m, 0.3), 0.0, HALF_M)])
    assert not dark(behind).any()
    assert dark(before).any()


def test_without_other_drones_nothing_changes(camera):
    assert (camera.render((-3.0, 0.5, 1.0), LEVEL) == camera.render((-3.0, 0.5, 1.0), LEVEL, [])).all()
