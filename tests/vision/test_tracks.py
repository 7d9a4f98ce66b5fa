"""Points that are followed from image to image, in pictures that are moved by a known way."""

import cv2
import numpy as np
import pytest

from vision.tracks.tracker import LONGEST_US, PointTracker
from vision.types import Detections

PERIOD_US = 100_000


def picture(seed=1):
    """Patches of grey, larger than an image."""
    coarse = np.random.default_rng(seed).integers(60, 190, (36, 46), np.uint8)
    return cv2.resize(coarse, (640, 500), interpolation=cv2.INTER_CUBIC)


def view(right_px, down_px, seed=1):
    """320 x 240 pixels of it, from a place."""
    moved = np.float64([[1.0, 0.0, -60.0 - right_px], [0.0, 1.0, -60.0 - down_px]])
    grey = cv2.warpAffine(picture(seed), moved, (320, 240), flags=cv2.INTER_CUBIC)
    return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)


def by_number(tracks):
    return dict(zip(tracks.numbers.tolist(), tracks.pixels, strict=True))


@pytest.mark.parametrize(("right_px", "down_px"), [(3.3, -2.6), (24.0, 7.5), (0.0, 0.0)])
def test_points_are_followed_to_where_the_picture_has_moved(right_px, down_px):
    tracker = PointTracker()
    before = by_number(tracker.track(view(0.0, 0.0), PERIOD_US))
    after = by_number(tracker.track(view(right_px, down_px), 2 * PERIOD_US))
    both = before.keys() & after.keys()
    assert len(both) > 20
    moved = np.array([after[each] - before[each] for each in both])
    off_px = np.abs(np.array(moved) + np.array((right_px, down_px))).max(axis=1)
    assert np.percentile(off_px, 90) < 0.15  # some may be mistaken; the filter leaves them out


def test_points_that_leave_the_image_are_forgotten_and_others_begin():
    tracker = PointTracker()
    first = by_number(tracker.track(view(0.0, 0.0), PERIOD_US))
    for image in range(1, 9):
        last = by_number(tracker.track(view(15.0 * image, 0.0), (1 + image) * PERIOD_US))
    stayed = first.keys() & last.keys()
    assert all(first[each][0] > -45.0 for each in stayed)
    assert len(last) > 20
    assert max(last) > max(first)


def test_another_picture_has_few_of_the_points():
    tracker = PointTracker()
    first = by_number(tracker.track(view(0.0, 0.0), PERIOD_US))
    after = by_number(tracker.track(view(0.0, 0.0, seed=2), 2 * PERIOD_US))
    assert len(first.keys() & after.keys()) < 0.3 * len(first)


def test_after_a_long_time_all_points_are_new():
    tracker = PointTracker()
    first = by_number(tracker.track(view(0.0, 0.0), PERIOD_US))
    after = by_number(tracker.track(view(0.0, 0.0), 2 * PERIOD_US + LONGEST_US))
    assert not first.keys() & after.keys()


def test_an_image_without_structure_has_no_points():
    assert not len(PointTracker().track(np.full((240, 320, 3), 128, np.uint8), 0).numbers)
    assert Detections().tracks is None
