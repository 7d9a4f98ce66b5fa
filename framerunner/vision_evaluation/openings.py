"""Between the corners of a gate's outline and those of its opening: both are in the gate's middle plane.

The map from that plane to the image is a homography, which four corners determine.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShape
from vision.gate_model import Point, rectangle
from vision.types import GateCorner

Corners = tuple[Point, ...]
Floats = npt.NDArray[np.float64]


def outline_of(opening: Sequence[Point], shape: GateShape) -> Corners:
    """The corners of the outline, from those of the opening: pixels of an ideal camera."""
    return _mapped(opening, rectangle(*shape.opening_m), _outer(shape))


def opening_of(outline: Sequence[GateCorner], shape: GateShape) -> tuple[GateCorner, ...]:
    """The corners of the opening as a detector sees them, from its four of the outline."""
    places = _mapped(
        [(corner.right_px, corner.down_px) for corner in outline], _outer(shape), rectangle(*shape.opening_m)
    )
    # Of a parallelogram each is a mean of the four: itself, the next, the opposite and the last one.
    inner_width_m, inner_height_m = shape.opening_m
    across, down = (
        (1 + inner_width_m / shape.outer_width_m) / 2,
        (1 + inner_height_m / shape.outer_height_m) / 2,
    )
    even = np.array([across * down, (1 - across) * down, (1 - across) * (1 - down), across * (1 - down)])
    variances = np.array([(corner.std_right_px, corner.std_down_px) for corner in outline]) ** 2
    found = []
    for number, place in enumerate(places):
        weights = even if number % 2 == 0 else even[[0, 3, 2, 1]]
        found.append(GateCorner(*place, *np.sqrt(weights**2 @ np.roll(variances, -number, axis=0)).tolist()))
    return tuple(found)


def _outer(shape: GateShape) -> Floats:
    return rectangle(shape.outer_width_m, shape.outer_height_m)


def _mapped(image: Sequence[Point], of_m: Floats, wanted_m: Floats) -> Corners:
    """Where points of a plane are in the image in which four others of it are at `image`."""
    plane = of_m[:, :2].astype(np.float32)
    homography = cv2.getPerspectiveTransform(plane, np.array(image, np.float32))
    mapped = cv2.perspectiveTransform(wanted_m[None, :, :2], homography)[0]
    return tuple((x, y) for x, y in mapped.tolist())
