"""Gates of bars thinner than a pixel, by shares of colour."""

import cv2
import numpy as np
import pytest

from vision.bar_edges import find_edges
from vision.fill_shares import find_filled
from vision.gate_finder import GateFinder
from vision.patch import ImagePatch
from vision.thin_gates import find_rings

OUTLINE = np.array([[140.0, 100.0], [162.0, 103.0], [161.0, 114.5], [139.0, 111.0]])  # the bars' axes


def scene(colour_bgr, ground_bgr, *, fill=0.4, scale=8):
    """A ring whose bars fill a pixel by a share, before a ground of one colour."""
    filled = np.zeros((240 * scale, 320 * scale), np.float32)
    points = np.rint((OUTLINE + 0.5) * scale).astype(np.int32)
    cv2.polylines(filled, [points], True, 1.0, round(fill * scale), cv2.LINE_8)
    share = cv2.resize(filled, (320, 240), interpolation=cv2.INTER_AREA)[..., None]
    return np.rint(share * np.array(colour_bgr) + (1.0 - share) * np.array(ground_bgr)).astype(np.uint8)


@pytest.mark.parametrize("ground", [(200, 205, 210), (40, 42, 45), (120, 140, 135)])
@pytest.mark.parametrize(
    ("colour", "bgr"), [("red", (10, 10, 220)), ("green", (10, 220, 10)), ("blue", (220, 10, 10))]
)
def test_a_ring_of_faint_bars_is_found_where_it_is(colour, bgr, ground):
    filled = find_filled(scene(bgr, ground), [])
    rings = [ring for ring in find_rings(filled) if ring.colour == colour]
    assert len(rings) == 1
    off_px = min(np.abs(np.roll(rings[0].corners, k, axis=0) - OUTLINE).max() for k in range(4))
    assert off_px < 0.5


def test_what_is_known_is_not_looked_for():
    image = scene((10, 10, 220), (200, 205, 210))
    assert find_filled(image, [(136, 96, 30, 24)]) is None


def test_three_bars_or_a_shadow_on_a_coloured_floor_are_no_ring():
    image = scene((10, 10, 220), (200, 205, 210))
    image[104:118, 134:144] = (200, 205, 210)
    shadow = scene((20, 60, 80), (56, 176, 226))
    for nothing in (image, shadow):
        filled = find_filled(nothing, [])
        assert filled is None or not find_rings(filled)


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
