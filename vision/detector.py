"""The paper's detector: from an image to [n s e w d a] for red, green and blue.

Source of all formulas: Casado & Bermúdez, "A Simulation Framework for Developing Autonomous Drone
Navigation Systems", Electronics 2021, 10, 7, and their published implementation.

Choices where the sources leave room:

- The colour test for red, |g - b| < 20 and r - g > 50, is used for green and blue with r -> g -> b -> r.
- A camera mixes what shares a pixel, and the paper's test is for pixels that do not. So one at a gate's edge
  counts if it is filled by half, and those of lines thinner than a pixel do if they differ from what is
  around them as the gate's colour does (`colour_regions.py`).
- Distance and angle are given for a gate *wholly* in view, as the paper says: its box touches no border of
  the image. The published code looks at the top and bottom rows only, so that a gate cut off at a side
  seems narrower than it is and its angle is far too large.
- A box one pixel high (l = 0) has no measurable size: neither distance nor angle.
"""

from __future__ import annotations

from math import acos, degrees, hypot

import cv2
import numpy as np

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape, GateShapes
from vision.colour_regions import Plane, find_primaries, half_filled, split_planes
from vision.types import NOT_SEEN, Detection, Detections, Image

GATE_HEIGHT_M = 0.23
"""Height of the challenge's gate in the paper's formulas (the gate itself is 0.22 m high)."""
GATE_WIDTH_M = 0.43
"""Its width there (the gate itself is 0.42 m wide); gates of other shapes are taken to be larger alike."""
ALL_PAPER = GateShapes()
MIN_EXCESS = 50
"""The shown channel must exceed the next one by more than this."""
MAX_GREY_GAP = 20
"""The other two channels must differ by less than this."""


def detect(
    image: Image,
    time_us: int | None = None,
    *,
    focal_px: float | None = None,
    shapes: GateShapes = ALL_PAPER,
) -> Detections:
    """Find the gates of all three colours.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        time_us: vehicle time of the image, passed on.
        focal_px: focal length of the camera; by default the paper's, half the image's width (160 for 320).
        shapes: of the gates of each colour.

    Returns:
        One detection per colour; all pixels of a colour make one box.

    Raises:
        ValueError: the image is not of that shape and type.
    """
    planes = blue, green, red = split_planes(image)
    lines = {found.colour: found.mask for found in find_primaries(planes)}
    focal = image.shape[1] / 2 if focal_px is None else focal_px
    return Detections(
        red=_find((red, green, blue), lines.get("red"), focal, shapes.of("red")),
        green=_find((green, blue, red), lines.get("green"), focal, shapes.of("green")),
        blue=_find((blue, red, green), lines.get("blue"), focal, shapes.of("blue")),
        time_us=time_us,
    )


def measure(
    row_min: int,
    row_max: int,
    col_min: int,
    col_max: int,
    *,
    width_px: int = 320,
    height_px: int = 240,
    focal_px: float = 160.0,
    shape: GateShape = PAPER_GATE,
) -> Detection:
    """The paper's six numbers of a bounding box of a gate.

    Rows and columns are counted from 1 at the image's upper left corner, inclusive.
    """
    n, s = height_px / 2 - row_min, height_px / 2 - row_max
    e, w = col_max - (width_px / 2 + 1), col_min - (width_px / 2 + 1)
    length = n - s
    whole = row_min > 1 and row_max < height_px and col_min > 1 and col_max < width_px
    if not whole or length <= 0:
        return Detection(n, s, e, w)
    middle = s + length / 2
    height_m = GATE_HEIGHT_M * (shape.outer_height_m / PAPER_GATE.outer_height_m)
    width_m = GATE_WIDTH_M * (shape.outer_width_m / PAPER_GATE.outer_width_m)
    distance_m = height_m / length * hypot(focal_px, middle)
    apparent_width = e - w
    full_width = max(width_m / height_m * length, apparent_width)
    return Detection(n, s, e, w, distance_m, degrees(acos(apparent_width / full_width)))


def _find(
    planes: tuple[Plane, Plane, Plane], line: Plane | None, focal_px: float, shape: GateShape
) -> Detection:
    """Detect one colour, given the planes of its channel, the next channel and the remaining one."""
    shown, following, other = planes
    # Saturating subtraction keeps every difference in uint8; a pixel stays non-zero where a test passes.
    excess = cv2.subtract(shown, following)
    _, mask = cv2.threshold(excess, MIN_EXCESS, 255, cv2.THRESH_BINARY)
    column, row, columns, rows = cv2.boundingRect(mask)
    if rows:
        # With the pixels beside them, which the test for half filled ones compares them with.
        part = np.s_[max(row - 1, 0) : row + rows + 1, max(column - 1, 0) : column + columns + 1]
        gap = cv2.absdiff(following[part], other[part])
        _, grey = cv2.threshold(gap, MAX_GREY_GAP - 1, 255, cv2.THRESH_BINARY_INV, dst=gap)
        passed = cv2.bitwise_and(grey, half_filled(excess[part]))
        cv2.bitwise_and(mask[part], passed, dst=mask[part])
    if line is not None:
        cv2.bitwise_or(mask, line, dst=mask)
    column, row, columns, rows = cv2.boundingRect(mask)
    if rows == 0:
        return NOT_SEEN
    height, width = shown.shape
    return measure(
        row + 1, row + rows, column + 1, column + columns,
        width_px=width, height_px=height, focal_px=focal_px, shape=shape,
    )  # fmt: skip
