"""Other drones in the image."""

import numpy as np
import pytest

from framerunner.geometry.solids import Solid
from scenarios.loader import load_scenario
from scenarios.models import Base, Doorway, Scenario, StartPose, Wall
from sitl.camera import SimulatedCamera
from sitl.camera_scene import DRONE_BGR, PaintTree, build_scene

LEVEL = (1.0, 0.0, 0.0, 0.0)
HALF_M = (0.15, 0.15, 0.05)


@pytest.fixture(scope="module")
def camera():
    return SimulatedCamera(load_scenario("test-case-1"))


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


def test_a_wall_hides_what_is_behind_it_and_a_doorway_does_not():
    wall = Wall(x_m=2, y_m=-4, end_x_m=2, end_y_m=4, doorway=Doorway(offset_m=4.2, width_m=1.2))
    camera = SimulatedCamera(
        Scenario(name="a", base=Base(x_m=-4, y_m=-4), start=StartPose(x_m=-4, y_m=-4), walls=(wall,))
    )

    def is_seen(x_m, y_m):
        return dark(camera.render((-1.0, y_m, 1.0), LEVEL, [Solid("d", (x_m, y_m, 1.0), 0.0, HALF_M)])).any()

    # Near the wall's end its middle is far away: distances to centres would tell the wrong order.
    assert [is_seen(1.4, 3.5), is_seen(2.6, 3.5), is_seen(2.6, 0.2)] == [True, False, True]


@pytest.mark.parametrize("seed", range(8))
def test_a_place_in_the_order_is_behind_what_hides_it_and_before_what_it_hides(seed):
    """By rays: a face that one meets before the point is painted after it, one beyond the point before."""
    rng = np.random.default_rng(seed)
    bodies = build_scene(load_scenario(f"crowded-{seed}")).bodies
    tree = PaintTree(bodies)
    eye = rng.uniform((-6, -6, 0.2), (6, 6, 5))
    near = [face.corners_arena_m.mean(axis=0) + rng.normal(0, 0.05, 3) for face in tree.faces]
    points = np.vstack((rng.uniform((-5, -5, 0.05), (5, 5, 4), (40, 3)), near))
    # What is in a gate's opening is before a part of the gate and behind another.
    outside = [all(body.hull.distance_m(tuple(point)) > 0.0 for body in bodies) for point in points]
    points = points[outside]
    order = tree.back_to_front(tuple(eye))
    for point, place in zip(points, tree.places(tuple(eye), points), strict=True):
        for number, index in enumerate(order):
            met = where_met(tree.faces[index], eye, point)
            if met is not None and abs(met - 1) > 1e-6:
                assert (number >= place) == (met < 1)


def where_met(face, eye, point):
    """Where the ray from the eye through a point meets a face that the eye sees: 1 is the point."""
    normal, corners = np.array(face.normal_arena), face.corners_arena_m
    toward = normal @ (point - eye)
    if toward >= -1e-9:
        return None
    met = normal @ (corners[0] - eye) / toward
    at = eye + met * (point - eye)
    turns = np.cross(np.roll(corners, -1, axis=0) - corners, at - corners) @ normal
    return met if met > 0 and (np.all(turns > 0) or np.all(turns < 0)) else None


def test_without_other_drones_nothing_changes(camera):
    assert (camera.render((-3.0, 0.5, 1.0), LEVEL) == camera.render((-3.0, 0.5, 1.0), LEVEL, [])).all()
