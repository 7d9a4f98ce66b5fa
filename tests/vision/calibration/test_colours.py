"""Colours of gates learnt from swatches."""

import numpy as np
import pytest

from vision.calibration.colours import correct_colours, learn_colours, share_seen, swatch_of
from vision.calibration.model import Calibration, CalibrationError
from vision.detectors import new_detector
from vision.types import Image

# What a camera makes of red, green and blue paint under a warm lamp (BGR).
PAINT = {"red": (72, 88, 190), "green": (80, 150, 104), "blue": (140, 104, 76)}


def swatch(colour: tuple[int, int, int], noise: float = 2.0) -> Image:
    random = np.random.default_rng(sum(colour))
    return np.clip(random.normal(colour, noise, (60, 80, 3)), 0, 255).astype(np.uint8)


def hall_with_a_gate(colour: tuple[int, int, int]) -> Image:
    """A red gate of 84 x 44 pixels before a grey wall."""
    image = swatch((120, 125, 130))
    image = np.tile(image, (4, 4, 1))
    image[100:144, 110:194] = colour
    image[104:140, 114:190] = (120, 125, 130)
    return image


def test_paint_under_a_lamp_is_seen_after_learning() -> None:
    swatches = {name: swatch(colour) for name, colour in PAINT.items()}
    assert min(share_seen(each, name) for name, each in swatches.items()) < 0.5
    matrix = learn_colours(swatches)
    assert np.sum(matrix, axis=1) == pytest.approx([1.0, 1.0, 1.0], abs=1e-3)
    for name, each in swatches.items():
        assert share_seen(correct_colours(each, matrix), name) > 0.9


def test_the_detectors_use_it_and_grey_stays_grey() -> None:
    matrix = learn_colours({name: swatch(colour) for name, colour in PAINT.items()})
    calibration = Calibration.ideal(320, 240, 200.0).model_copy(update={"colour_matrix": matrix})
    image = hall_with_a_gate(PAINT["green"])
    for kind in ("boxes", "frames"):
        if kind == "boxes":  # networks know a gate in wrong colours, too
            assert not new_detector(kind, focal_px=200.0)(image, None).green.seen
        found = new_detector(kind, calibration=calibration)(image, None)
        assert found.green.seen
        assert not found.red.seen
        assert not found.blue.seen


@pytest.mark.parametrize(
    ("name", "colour", "said"),
    [
        ("red", (10, 12, 30), "too dark"),
        ("blue", (255, 240, 230), "too bright"),
        ("green", (74, 90, 188), "too much alike|would be seen"),
    ],
)
def test_swatches_that_do_not_do_are_said(name: str, colour: tuple[int, int, int], said: str) -> None:
    swatches = {each: swatch(paint) for each, paint in PAINT.items()} | {name: swatch(colour, 0.0)}
    with pytest.raises(CalibrationError, match=said):
        learn_colours(swatches)


def test_a_missing_swatch_is_said() -> None:
    with pytest.raises(CalibrationError, match="blue: no swatch"):
        learn_colours({"red": swatch(PAINT["red"]), "green": swatch(PAINT["green"])})


def test_the_swatch_is_the_middle_of_the_image() -> None:
    assert swatch_of(np.zeros((240, 320, 3), np.uint8)).shape == (48, 64, 3)
