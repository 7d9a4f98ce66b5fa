"""What is in a hall: windows, pictures and people, where they should be and hidden by what is before them."""

from math import atan2, pi

import cv2
import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler
from scenarios.imaging.effects import Hall
from scenarios.imaging.furnishings import Person, Picture, Window
from scenarios.loader import parse_scenario
from scenarios.models import Gate, Light, Scenario, ScenarioError
from sitl.camera import SimulatedCamera
from sitl.optics import pictures

AHEAD = quaternion_from_euler(0.0, 0.0, 0.0)
EYE = (0.0, 0.0, 2.0)
LIT = Light(ambient=1.0)


def seen(hall, eye=EYE, attitude=AHEAD, **parts):
    return SimulatedCamera(Scenario(name="hall", hall=hall, light=LIT, **parts)).render(eye, attitude)


def place(x_m, y_m, z_m, eye=EYE):
    """Column and row of a place that a camera sees that looks along x."""
    ahead = x_m - eye[0] - 0.08
    return round(159.5 - 160.1 * (y_m - eye[1]) / ahead), round(119.5 - 160.1 * (z_m - eye[2]) / ahead)


def colour_at(image, *where):
    column, row = place(*where)
    return tuple(image[row, column].tolist())


def test_a_window_shines_between_the_bars_of_its_frame():
    window = Window(
        surface="front", across_m=1.0, up_m=2.0, width_m=1.6, height_m=1.2, bar_m=0.1, colour="red"
    )
    for ambient in (1.0, 0.3):
        light = Light(ambient=ambient, sun_direction_arena=(1.0, 0.0, -0.1))
        scenario = Scenario(name="window", hall=Hall(windows=(window,)), light=light)
        image = SimulatedCamera(scenario).render(EYE, AHEAD)
        # Across the front wall is to the right, and its panes are on both sides of the bar in its middle.
        for across in (0.7, 1.3):
            assert min(colour_at(image, 6.5, -across, 2.0)) >= 235
        for across, up in ((1.0, 2.0), (0.25, 2.0), (1.0, 2.55)):
            blue, green, red = colour_at(image, 6.5, -across, up)
            assert red > 3 * max(blue, green)


def test_a_picture_hangs_upright_and_not_mirrored(tmp_path):
    corners = np.zeros((60, 80, 3), np.uint8)
    corners[:30, :40], corners[:30, 40:] = (250, 250, 250), (0, 0, 250)
    corners[30:, :40], corners[30:, 40:] = (0, 250, 0), (250, 0, 0)
    cv2.imwrite(str(tmp_path / "corners.png"), corners)
    for surface, yaw in (("front", 0.0), ("left", pi / 2), ("back", pi), ("right", -pi / 2)):
        picture = Picture(
            surface=surface,
            image=str(tmp_path / "corners.png"),
            across_m=0.0,
            up_m=2.0,
            width_m=2.0,
            height_m=1.5,
        )
        image = seen(Hall(pictures=(picture,)), attitude=quaternion_from_euler(0.0, 0.0, yaw))
        upper_left, upper_right, lower_left, lower_right = (
            image[119 + down, 159 + right].astype(int) for down in (-8, 9) for right in (-10, 11)
        )
        assert upper_left.min() > 200
        assert upper_right.argmax() == 2
        assert lower_left.argmax() == 1
        assert lower_right.argmax() == 0


def test_photographs_that_are_not_installed_are_drawn_and_differ(monkeypatch):
    monkeypatch.setattr(pictures, "find_spec", lambda name: None)
    one, other = (
        seen(Hall(pictures=(Picture(surface="front", image=name, across_m=0.0, up_m=2.0, width_m=2.0),)))
        for name in ("coffee", "rocket")
    )
    plain = seen(Hall())
    assert np.abs(one.astype(int) - plain).max() > 60
    assert not np.array_equal(one, other)


def person_at(x_m, y_m, **fields):
    return Person(
        x_m=x_m, y_m=y_m, yaw_rad=round(atan2(-y_m, -x_m), 3), shirt="red", trousers="blue", **fields
    )


def test_a_person_has_head_shirt_and_trousers_and_is_as_tall_as_stated():
    image = seen(Hall(beyond_m=2.0, people=(person_at(6.2, 0.0, height_m=1.8),)), eye=(3.0, 0.0, 1.5))
    plain = seen(Hall(beyond_m=2.0), eye=(3.0, 0.0, 1.5))
    eye = (3.0, 0.0, 1.5)
    blue, green, red = image[place(6.1, 0.0, 1.2, eye)[1], 159].tolist()
    assert red > 3 * max(blue, green)
    blue, green, red = image[place(6.1, 0.11, 0.4, eye)[1], place(6.1, 0.11, 0.4, eye)[0]].tolist()
    assert blue > 2 * max(red, green)
    # Between the legs the floor or the wall is seen.
    column, row = place(6.1, 0.0, 0.4, eye)
    assert np.abs(image[row, column].astype(int) - plain[row, column]).max() < 30
    rows = np.flatnonzero(np.abs(image.astype(int) - plain).sum(axis=(1, 2)))
    top, bottom = (place(6.1, 0.0, z, eye)[1] for z in (1.8, 0.0))
    assert rows[0] == pytest.approx(top, abs=1.5)
    assert rows[-1] == pytest.approx(bottom, abs=1.5)


@pytest.mark.parametrize("height_m", [0.4, 1.6, 3.5])
@pytest.mark.parametrize("around", range(8))
def test_a_persons_nearer_parts_hide_the_farther_ones(height_m, around):
    """The colours seen are those of the parts that a ray from the eye meets first."""
    person = Person(x_m=6.5, y_m=0.0, yaw_rad=0.3 + around * pi / 4, shirt="red", trousers="blue")
    eye = (4.5, 0.4, height_m)
    pitch = -atan2(height_m - 0.9, 2.0)
    image = seen(Hall(beyond_m=3.0, people=(person,)), eye, quaternion_from_euler(0.0, -pitch, 0.0))
    expected = first_parts(person, eye, -pitch)
    parts = np.stack([image[..., 2] > 2.5 * image[..., 0], image[..., 0] > 2.0 * image[..., 2]], axis=-1)
    wrong = (expected["shirt"] & parts[..., 1]) | (expected["trousers"] & parts[..., 0])
    assert expected["shirt"].sum() > 100
    assert wrong.sum() <= 0.02 * (expected["shirt"] | expected["trousers"]).sum()


def first_parts(person, eye, pitch_down):
    """By rays against boxes (slabs): which pixels see the shirt and which the trousers first."""
    c, s = np.cos(pitch_down), np.sin(pitch_down)
    rows, columns = np.mgrid[0:240, 0:320]
    right, down = (columns - 159.5) / 160.1, (rows - 119.5) / 160.1
    rays = np.stack([c - s * down, -right, -s - c * down], axis=-1)
    centre = np.array([eye[0] + 0.08 * c, eye[1], eye[2] - 0.08 * s])
    cy, sy = np.cos(person.yaw_rad), np.sin(person.yaw_rad)
    turn = np.array([[cy, sy, 0.0], [-sy, cy, 0.0], [0.0, 0.0, 1.0]])
    origin = turn @ (centre - [person.x_m, person.y_m, 0.0])
    rays = rays @ turn.T
    from sitl.optics.people import _HEAD, _LEGS, _TRUNK

    nearest = np.full((240, 320), np.inf)
    label = np.zeros((240, 320), int)
    for number, layer in enumerate((_LEGS, _TRUNK, _HEAD), start=1):
        for low_y, high_y in layer.spans_m:
            low = np.array([-layer.half_depth_m, low_y, layer.bottom * 1.75])
            high = np.array([layer.half_depth_m, high_y, layer.top * 1.75])
            with np.errstate(divide="ignore"):
                one, two = (low - origin) / rays, (high - origin) / rays
            enter, leave = np.minimum(one, two).max(axis=-1), np.maximum(one, two).min(axis=-1)
            hit = (enter < leave) & (enter > 0) & (enter < nearest)
            nearest[hit], label[hit] = enter[hit], number
    kernel = np.ones((3, 3), np.uint8)
    inside = {number: cv2.erode((label == number).astype(np.uint8), kernel) > 0 for number in (1, 2)}
    return {"trousers": inside[1], "shirt": inside[2]}


def test_a_gate_hides_the_people_behind_it():
    gate = Gate(colour="green", x_m=4.0, y_m=0.0, z_m=1.2, outer_width_m=1.0, outer_height_m=0.5, bar_m=0.1)
    image = seen(Hall(beyond_m=2.0, people=(person_at(6.2, 0.0),)), eye=(2.0, 0.0, 1.2), frames=[gate])
    top = image[place(3.95, 0.0, 1.4, (2.0, 0.0, 1.2))[1], 159].tolist()
    middle = image[place(6.1, 0.0, 1.2, (2.0, 0.0, 1.2))[1], 159].tolist()
    assert np.argmax(top) == 1
    assert np.argmax(middle) == 2


def test_people_stand_between_the_arena_and_the_walls():
    for x_m in (4.0, 5.1, 6.9):
        text = f"name: people\nhall:\n  people:\n    - {{x_m: {x_m}, y_m: 0.0}}\n"
        with pytest.raises(ScenarioError, match="not between arena and walls"):
            parse_scenario(text)
