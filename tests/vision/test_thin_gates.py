"""Gates of bars thinner than a pixel, by shares of colour."""

import cv2
import numpy as np
import pytest

from vision.bar_edges import find_edges
from vision.fill_shares import brightness_of_gates, fill_around, has_coloured_lines
from vision.gate_finder import GateFinder
from vision.patch import ImagePatch
from vision.thin_gates import MOST_PX, fit_ring

AXES = np.array([[140.0, 100.0], [162.0, 103.0], [161.0, 114.5], [139.0, 111.0]])
COLOURS = [("red", (10, 10, 220)), ("green", (10, 220, 10)), ("blue", (220, 10, 10))]


def scene(colour_bgr, ground_bgr, *, axes=AXES, fill=0.4, scale=8):
    """A ring whose bars fill a pixel by a share, before a ground of one colour."""
    filled = np.zeros((240 * scale, 320 * scale), np.float32)
    points = np.rint((axes + 0.5) * scale).astype(np.int32)
    cv2.polylines(filled, [points], True, 1.0, round(fill * scale), cv2.LINE_8)
    share = cv2.resize(filled, (320, 240), interpolation=cv2.INTER_AREA)[..., None]
    return np.rint(share * np.array(colour_bgr) + (1.0 - share) * np.array(ground_bgr)).astype(np.uint8)


def ring_near(image, axes):
    """What is fitted to an outline that is a pixel off."""
    outline = axes.mean(axis=0) + (axes - axes.mean(axis=0)) / 0.94 + np.array([[0.8, -0.7]])
    return fit_ring(fill_around(image, outline, MOST_PX, brightness_of_gates(image)), outline)


@pytest.mark.parametrize("ground", [(200, 205, 210), (40, 42, 45), (120, 140, 135)])
@pytest.mark.parametrize(("colour", "bgr"), COLOURS)
def test_a_ring_of_faint_bars_is_found_where_it_is(colour, bgr, ground):
    ring = ring_near(scene(bgr, ground), AXES)
    assert ring is not None
    assert ring.colour == colour
    assert np.abs(ring.corners - AXES).max() < 0.5


def test_a_large_ring_is_fitted_as_well():
    axes = (AXES - AXES.mean(axis=0)) * 5.0 + (160.0, 120.0)
    ring = ring_near(scene((10, 10, 220), (200, 205, 210), axes=axes, fill=5.0), axes)
    assert ring is not None
    assert ring.colour == "red"
    assert np.abs(ring.corners - axes).max() < 1.0


def test_a_grey_ring_has_no_colour():
    assert ring_near(scene((90, 90, 90), (200, 200, 200)), AXES) is None


@pytest.mark.parametrize(("colour", "bgr"), COLOURS)
def test_thin_lines_are_seen_outside_of_what_is_known(colour, bgr):
    image = scene(bgr, (200, 205, 210))
    assert has_coloured_lines(image, []), colour
    assert not has_coloured_lines(image, [(136, 96, 30, 24)])


def test_shadows_and_corners_of_a_coloured_floor_are_no_lines_of_a_gate():
    image = scene((20, 60, 80), (56, 176, 226))
    image[:90] = 130
    image[86:90, 100:110] = (56, 176, 226)
    assert not has_coloured_lines(image, [])


def test_the_finder_gives_its_pose():
    sightings = GateFinder(160.0).find(scene((10, 220, 10), (200, 205, 210))).frames
    assert [(sighting.colour, sighting.whole) for sighting in sightings] == [("green", True)]
    # 22.2 pixels between the axes of the upright bars, 0.40 m apart: about 2.9 m.
    assert 2.4 < np.hypot(*sightings[0].poses[0].position_flu_m[:2]) < 3.3


def test_a_bar_wider_than_the_image_is_looked_for_in_the_image_only():
    labels = np.zeros((40, 60), np.uint8)
    patch = ImagePatch(labels, np.zeros((40, 60), np.int16), (30.0, 20.0), (160.0, 120.0))
    a, b, c, d = (-10.0, -5.0), (10.0, -5.0), (10.0, 5.0), (-10.0, 5.0)
    edges = find_edges(patch, ((a, b), (b, c), (c, d), (d, a)), [(1e9, 1e9)] * 4)
    assert not edges.outer_ok.any()
