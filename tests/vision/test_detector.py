"""The paper's detector against hand-computed images and a naive reference."""

from math import acos, degrees, inf, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vision.colour_regions import find_primaries, split_planes
from vision.detector import detect, measure
from vision.types import NOT_SEEN, Detection, Detections, Image

BGR = {"red": (0, 0, 200), "green": (0, 200, 0), "blue": (200, 0, 0)}


def picture(width: int = 320, height: int = 240) -> Image:
    return np.full((height, width, 3), 128, np.uint8)


def box(image: Image, rows: tuple[int, int], columns: tuple[int, int], colour: tuple[int, int, int]) -> Image:
    """Paint rows and columns, counted from 1, inclusive."""
    image[rows[0] - 1 : rows[1], columns[0] - 1 : columns[1]] = colour
    return image


@pytest.mark.parametrize("colour", list(BGR))
def test_box_of_one_colour_by_hand(colour: str) -> None:
    seen = detect(box(picture(), (100, 123), (201, 243), BGR[colour]), 42)
    found = getattr(seen, colour)
    assert (found.n, found.s, found.e, found.w) == (20, -3, 82, 40)
    # l = 23, h = s + l/2 = 8.5: d = 0.23/23 * sqrt(160^2 + 8.5^2); ap = 42 of 0.43/0.23*23 = 43.
    assert found.d == pytest.approx(0.01 * sqrt(160**2 + 8.5**2), rel=1e-12)
    assert found.a == pytest.approx(degrees(acos(42 / 43)), rel=1e-12)
    assert seen.time_us == 42
    assert all(getattr(seen, other) is NOT_SEEN for other in BGR if other != colour)


def test_three_colours_at_once() -> None:
    image = picture()
    for i, colour in enumerate(BGR.values()):
        box(image, (50, 60 + i), (20 + 90 * i, 50 + 90 * i), colour)
    seen = detect(image)
    assert [seen.red.w, seen.green.w, seen.blue.w] == [-141, -51, 39]
    assert [seen.red.s, seen.green.s, seen.blue.s] == [60, 59, 58]


def test_nothing_seen() -> None:
    seen = detect(picture())
    assert seen == Detections()
    assert not seen.red.seen
    assert seen.red == Detection(-inf, inf, -inf, inf, inf, inf)


def test_scattered_pixels_make_one_box() -> None:
    image = box(box(picture(), (30, 30), (40, 40), BGR["red"]), (90, 90), (70, 70), BGR["red"])
    found = detect(image).red
    assert (found.n, found.s, found.e, found.w) == (90, 30, -91, -121)


def test_one_pixel_has_no_size() -> None:
    found = detect(box(picture(), (120, 120), (161, 161), BGR["blue"])).blue
    assert (found.n, found.s, found.e, found.w) == (0, 0, 0, 0)
    assert found.seen
    assert (found.d, found.a) == (inf, inf)


def test_wider_than_a_gate_has_angle_zero() -> None:
    assert detect(box(picture(), (100, 110), (100, 200), BGR["green"])).green.a == 0.0


def test_one_column_is_seen_edge_on() -> None:
    found = detect(box(picture(), (100, 110), (100, 100), BGR["green"])).green
    assert found.a == 90.0
    assert found.d < inf


@pytest.mark.parametrize(
    ("rows", "columns"),
    [((1, 20), (100, 140)), ((221, 240), (100, 140)), ((100, 120), (1, 40)), ((100, 120), (281, 320))],
)
def test_touching_a_border_gives_no_distance(rows: tuple[int, int], columns: tuple[int, int]) -> None:
    found = detect(box(picture(), rows, columns, BGR["red"])).red
    assert found.seen
    assert (found.d, found.a) == (inf, inf)


@pytest.mark.parametrize(
    ("rows", "columns"),
    [((2, 20), (100, 140)), ((221, 239), (100, 140)), ((100, 120), (2, 40)), ((100, 120), (281, 319))],
)
def test_next_to_a_border_is_whole(rows: tuple[int, int], columns: tuple[int, int]) -> None:
    assert detect(box(picture(), rows, columns, BGR["red"])).red.d < inf


@pytest.mark.parametrize(
    ("bgr", "seen"),
    [
        ((0, 0, 50), False),
        ((0, 0, 51), True),
        ((0, 19, 70), True),
        ((0, 20, 90), False),
        ((19, 0, 51), True),
        ((20, 0, 255), False),
        ((200, 200, 251), True),
        ((200, 200, 250), False),
        ((200, 0, 255), False),
    ],
)
def test_thresholds_are_strict(bgr: tuple[int, int, int], *, seen: bool) -> None:
    blue, green, red = bgr
    pixel = ((10, 10), (10, 10))
    assert detect(box(picture(), *pixel, bgr)).red.seen is seen
    assert detect(box(picture(), *pixel, (green, red, blue))).green.seen is seen
    assert detect(box(picture(), *pixel, (red, blue, green))).blue.seen is seen


def test_centre_and_focal_length_follow_the_size() -> None:
    image = box(picture(640, 480), (200, 245), (401, 485), BGR["red"])
    found = detect(image).red
    assert (found.n, found.s, found.e, found.w) == (40, -5, 164, 80)
    assert found.d == pytest.approx(0.23 / 45 * sqrt(320**2 + 17.5**2))
    assert detect(image, focal_px=640.0).red.d == pytest.approx(0.23 / 45 * sqrt(640**2 + 17.5**2))


def test_measure_needs_no_image() -> None:
    assert measure(100, 123, 201, 243) == detect(box(picture(), (100, 123), (201, 243), BGR["red"])).red


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 3)),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((0, 4, 3), np.uint8),
    ],
)
def test_other_arrays_are_refused(image: Image) -> None:
    with pytest.raises(ValueError, match="image: need") as refused:
        detect(image)
    assert "\n" not in str(refused.value)


def test_a_view_into_a_larger_image_works() -> None:
    large = box(picture(), (100, 123), (201, 243), BGR["red"])
    part = large[50:200, 100:300]
    assert detect(part) == detect(part.copy())


def naive(image: Image) -> dict[str, Detection]:
    """The formulas, pixel by pixel; pixels of thin lines are those of the detector of frames."""
    height, width = image.shape[:2]
    lines = {line.colour: line.mask for line in find_primaries(split_planes(image))}
    found = {}
    for name, (shown, following, other) in {"red": (2, 1, 0), "green": (1, 0, 2), "blue": (0, 2, 1)}.items():
        numbers = image.astype(int)
        excess = np.maximum(numbers[..., shown] - numbers[..., following], 0)
        around = np.pad(excess, 1)
        hits = [
            (row + 1, column + 1)
            for row in range(height)
            for column in range(width)
            if (
                abs(numbers[row, column, following] - numbers[row, column, other]) < 20
                and excess[row, column] > 50
                and excess[row, column] > round(0.45 * around[row : row + 3, column : column + 3].max())
            )
            or (name in lines and lines[name][row, column])
        ]
        if not hits:
            found[name] = NOT_SEEN
            continue
        rows, columns = [hit[0] for hit in hits], [hit[1] for hit in hits]
        found[name] = measure(
            min(rows), max(rows), min(columns), max(columns),
            width_px=width, height_px=height, focal_px=width / 2,
        )  # fmt: skip
    return found


@settings(max_examples=60)
@given(
    image=hnp.arrays(
        np.uint8,
        st.tuples(st.integers(1, 12), st.integers(1, 14), st.just(3)),
        elements=st.sampled_from([0, 19, 20, 50, 51, 69, 70, 71, 128, 204, 205, 255]),
        fill=st.just(128),
    )
)
def test_agrees_with_a_naive_reference(image: Image) -> None:
    seen = detect(image)
    assert {"red": seen.red, "green": seen.green, "blue": seen.blue} == naive(image)
