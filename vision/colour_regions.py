"""Which pixels have the colour of a gate or an obstacle, whatever the light: masks by colour.

A pure colour keeps its hue and its saturation under any brightness of light, so the tests compare channels
with each other. Every test begins with saturating subtractions of whole planes, which take microseconds, and
goes on only in the part of the image where that leaves something.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from vision.types import Image

Plane = npt.NDArray[np.uint8]

PRIMARIES = ("red", "green", "blue")
SECONDARIES = ("cyan", "magenta")
OBSTACLE = "violet"

MIN_EXCESS = 25
"""A colour's own channels must exceed one and a half times the other ones by more than this.

The factor tells pure colours from pale ones in any light.
"""
HALF_FILLED = 0.45
"""Beside such a pixel it is enough to exceed the other channels by this share of what that one does.

It is somewhat less than a half: two faces of a bar differ in brightness.
"""
MAX_HUE_GAP = 0.4
"""The channels that should be equal may differ by this share of the excess ..."""
HUE_SLACK = 12
"""... and by this much more, for noise."""
VIOLET_RED = (0.25, 0.7)
"""Where red is between green (0) and blue (1) in the obstacles' colour."""
MIN_VIOLET_EXCESS = 15
"""Obstacles may be darker than gates, as a few wrong pixels of theirs do less harm."""
MIN_PIXELS = 8
"""A colour with fewer pixels than this is not looked at."""

_LEAST_EXCESS = 12.0
_BESIDE = np.ones((3, 3), np.uint8)

_Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class ColourMask:
    """The pixels of one colour."""

    colour: str
    mask: Plane  # of the whole image: 255 where it has the colour, else 0
    box: tuple[int, int, int, int]  # column, row, columns and rows of the smallest box around them


def split_planes(image: Image) -> list[Plane]:
    """Blue, green and red of an image, BGR, each of shape (height, width), uint8.

    Raises:
        ValueError: the image is not of shape (height, width, 3) and type uint8.
    """
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or image.size == 0:
        raise ValueError(f"image: need (height, width, 3) of uint8, got {image.shape} of {image.dtype}")
    height, width = image.shape[:2]
    # Splitting into allocated planes is several times quicker than letting OpenCV allocate them.
    planes: list[Plane] = list(np.empty((3, height, width), np.uint8))
    return list(cv2.split(image, planes))


def find_colours(image: Image) -> list[ColourMask]:
    """Find the pixels of all colours that gates and obstacles have.

    Args:
        image: BGR, shape (height, width, 3), uint8.

    Returns:
        One mask for every colour that is seen, in the order of the names above; a pixel has one colour.

    Raises:
        ValueError: the image is not of that shape and type.
    """
    blue, green, red = split_planes(image)
    spare: list[Plane] = list(np.empty((2, *image.shape[:2]), np.uint8))
    found = [
        _primary("red", red, green, blue, spare),
        _primary("green", green, red, blue, spare),
        _primary("blue", blue, red, green, spare),
        _secondary("cyan", blue, green, red, spare),
        _secondary("magenta", blue, red, green, spare),
        _violet(blue, green, red, spare),
    ]
    return [mask for mask in found if mask is not None]


def _primary(colour: str, shown: Plane, one: Plane, other: Plane, spare: list[Plane]) -> ColourMask | None:
    """One channel is bright, the other two are dark and equal."""
    return _grown(colour, (shown, cv2.max(one, other, dst=spare[0])), one, other, spare[1])


def _secondary(
    colour: str, first: Plane, second: Plane, dark: Plane, spare: list[Plane]
) -> ColourMask | None:
    """Two channels are bright and equal, the other one is dark."""
    return _grown(colour, (cv2.min(first, second, dst=spare[0]), dark), first, second, spare[1])


def _excess(shown: Plane, pale: Plane, result: Plane) -> Plane:
    """How far one plane exceeds one and a half times another; saturating subtraction is the quickest way."""
    cv2.subtract(shown, pale, dst=result)
    cv2.subtract(result, np.right_shift(pale, 1), dst=result)
    return result


def _grown(
    colour: str, planes: tuple[Plane, Plane], one: Plane, other: Plane, spare: Plane
) -> ColourMask | None:
    """The mask of one colour, given its brightness and that of the others, and the channels that are equal.

    A lens or a compression mixes thin bars and edges with what is behind them. However bright that is, a
    pixel that the bar fills by half has half the excess of those beside it; so beside pixels that are sure,
    that is the test.
    """
    shown, pale = planes
    found = _above(_excess(shown, pale, spare), MIN_EXCESS)
    if found is None:
        return None
    sure, (column, row, columns, rows) = found
    left, top = max(column - 1, 0), max(row - 1, 0)
    part = (left, top, column + columns + 1 - left, row + rows + 1 - top)
    excess = cv2.subtract(_crop(shown, part), _crop(pale, part))
    half = cv2.convertScaleAbs(cv2.dilate(excess, _BESIDE), alpha=HALF_FILLED)
    filled = cv2.compare(excess, cv2.max(half, _LEAST_EXCESS), cv2.CMP_GT)
    limit = cv2.convertScaleAbs(excess, alpha=MAX_HUE_GAP, beta=HUE_SLACK)
    same = cv2.compare(cv2.absdiff(_crop(one, part), _crop(other, part)), limit, cv2.CMP_LT)
    cv2.bitwise_and(filled, cv2.dilate(_crop(sure, part), _BESIDE), dst=filled)
    cv2.bitwise_or(filled, _crop(sure, part), dst=filled)
    cv2.bitwise_and(filled, same, dst=filled)
    _crop(sure, part)[...] = filled
    return _kept(colour, sure, (*part[:2], filled.shape[1], filled.shape[0]), filled)


def _violet(blue: Plane, green: Plane, red: Plane, spare: list[Plane]) -> ColourMask | None:
    """The obstacles' colour: red is between green and blue."""
    found = _above(_excess(blue, green, spare[0]), MIN_VIOLET_EXCESS)
    if found is None:
        return None
    mask, part = found
    low, high = _crop(green, part), _crop(blue, part)
    span, share = cv2.subtract(high, low), cv2.subtract(_crop(red, part), low)
    above = cv2.compare(share, cv2.convertScaleAbs(span, alpha=VIOLET_RED[0]), cv2.CMP_GT)
    below = cv2.compare(share, cv2.convertScaleAbs(span, alpha=VIOLET_RED[1]), cv2.CMP_LT)
    return _kept(OBSTACLE, mask, part, cv2.bitwise_and(above, below))


def _above(excess: Plane, least: int) -> tuple[Plane, _Box] | None:
    """The pixels that exceed a limit, and the box around them; None if there are only a few."""
    if cv2.minMaxLoc(excess)[1] <= least:  # quicker than a mask
        return None
    _, mask = cv2.threshold(excess, least, 255, cv2.THRESH_BINARY)
    if cv2.countNonZero(mask) < MIN_PIXELS:
        return None
    return mask, _box(mask)


def _kept(colour: str, mask: Plane, part: _Box, passed: Plane) -> ColourMask | None:
    """What is left of a mask after a further test in the box around it."""
    crop = _crop(mask, part)
    cv2.bitwise_and(crop, passed, dst=crop)
    left, top, columns, rows = _box(crop)
    if rows == 0:
        return None
    return ColourMask(colour, mask, (part[0] + left, part[1] + top, columns, rows))


def _crop(plane: Plane, box: _Box) -> Plane:
    column, row, columns, rows = box
    return plane[row : row + rows, column : column + columns]


def _box(mask: Plane) -> _Box:
    column, row, columns, rows = cv2.boundingRect(mask)
    return (column, row, columns, rows)
