"""Which pixels have the colour of a gate or an obstacle, whatever the light: masks by colour.

A pure colour keeps its hue and its saturation under any brightness of light, so the tests compare channels
with each other. Every test begins with saturating subtractions of whole planes, which take microseconds, and
goes on only in the part of the image where that leaves something.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from vision.types import Image

Plane = npt.NDArray[np.uint8]
Signed = npt.NDArray[np.int16]

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
THIN_FILLED = 0.27
"""A thin line may stand out against what is around it by as little as this share of its strongest neighbour.

A line thinner than a pixel fills some of its pixels less than others, wherever it passes between two.
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

_LEAST_EXCESS = np.uint8(12)
_FEWEST_SURE = 2  # pixels; of thin lines far away only a few are sure
_BESIDE = np.ones((3, 3), np.uint8)
_THIN = np.ones((5, 5), np.uint8)  # what is narrower than this is a line
_AROUND = np.ones((9, 9), np.uint8)  # as far as a pixel has a part in what stands out
_LIGHTER = 1.2
_REACH_PX = 8  # from sure pixels, to others of lines of the same colour
_REACH = np.ones((2 * _REACH_PX + 1, 2 * _REACH_PX + 1), np.uint8)

_Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class ColourMask:
    """The pixels of one colour."""

    colour: str
    mask: Plane  # of the whole image: 255 where it has the colour, else 0
    box: tuple[int, int, int, int]  # column, row, columns and rows of the smallest box around them
    shown: tuple[Plane, ...]  # the channels of the image that are bright in it
    pale: tuple[Plane, ...]  # and those that are dark

    def excess(self, box: tuple[int, int, int, int]) -> Signed:
        """How far the bright channels exceed the dark ones in a box; less than 0 beside other colours.

        It is linear in the light, so a pixel that is filled by half is half-way between what is beside it.
        """
        shown, pale = ([_crop(plane, box) for plane in planes] for planes in (self.shown, self.pale))
        least = shown[0] if len(shown) == 1 else cv2.min(*shown)
        most = pale[0] if len(pale) == 1 else cv2.max(*pale)
        return np.asarray(cv2.subtract(least, most, dtype=cv2.CV_16S), np.int16)


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
    planes = blue, green, red = split_planes(image)
    spare: list[Plane] = list(np.empty((2, *image.shape[:2]), np.uint8))
    sure = [
        *_primaries(planes, spare),
        _secondary("cyan", blue, green, red, spare),
        _secondary("magenta", blue, red, green, spare),
    ]
    violet = _violet(blue, green, red, spare)
    found = [*_all_grown(sure, violet), violet]
    return [mask for mask in found if mask is not None]


def find_primaries(planes: Sequence[Plane]) -> list[ColourMask]:
    """Find the pixels of red, green and blue only, given blue, green and red of an image."""
    spare: list[Plane] = list(np.empty((2, *planes[0].shape), np.uint8))
    return [mask for mask in _all_grown(_primaries(planes, spare)) if mask is not None]


def _primaries(planes: Sequence[Plane], spare: list[Plane]) -> list[ColourMask | None]:
    blue, green, red = planes
    return [
        _primary("red", red, green, blue, spare),
        _primary("green", green, red, blue, spare),
        _primary("blue", blue, red, green, spare),
    ]


def _all_grown(
    sure: Sequence[ColourMask | None], violet: ColourMask | None = None
) -> list[ColourMask | None]:
    """The masks of colours, from the pixels that are sure to have them, and those of obstacles."""
    seen = [mask for mask in sure if mask is not None]
    beside = [[other.mask.copy() for other in seen if other is not mask] for mask in seen]
    return [_grown(mask, others, violet) for mask, others in zip(seen, beside, strict=True)]


def _primary(colour: str, shown: Plane, one: Plane, other: Plane, spare: list[Plane]) -> ColourMask | None:
    """Where one channel is bright for sure, the other two dark."""
    found = _above(_excess(shown, cv2.max(one, other, dst=spare[0]), spare[1]), MIN_EXCESS, _FEWEST_SURE)
    return None if found is None else ColourMask(colour, *found, (shown,), (one, other))


def _secondary(
    colour: str, first: Plane, second: Plane, dark: Plane, spare: list[Plane]
) -> ColourMask | None:
    """Where two channels are bright for sure, the other one dark."""
    found = _above(_excess(cv2.min(first, second, dst=spare[0]), dark, spare[1]), MIN_EXCESS, _FEWEST_SURE)
    return None if found is None else ColourMask(colour, *found, (first, second), (dark,))


def _excess(shown: Plane, pale: Plane, result: Plane) -> Plane:
    """How far one plane exceeds one and a half times another; saturating subtraction is the quickest way."""
    cv2.subtract(shown, pale, dst=result)
    cv2.subtract(result, np.right_shift(pale, 1), dst=result)
    return result


def _grown(sure: ColourMask, others: Sequence[Plane], violet: ColourMask | None) -> ColourMask | None:
    """The mask of one colour, from the pixels that are sure to have it, and those of other colours.

    A camera mixes thin bars and edges with what is behind them. However bright that is, a pixel that the bar
    fills by half has half the excess of those beside it; so beside pixels that are sure, that is the test.
    Some pixels of lines thinner than a pixel are filled by less, and have hardly a hue of their own.
    """
    column, row, columns, rows = sure.box
    left, top = max(column - _REACH_PX, 0), max(row - _REACH_PX, 0)
    part = (left, top, column + columns + _REACH_PX - left, row + rows + _REACH_PX - top)
    known = _crop(sure.mask, part)
    difference = sure.excess(part)
    excess = cv2.convertScaleAbs(cv2.max(difference, 0))
    equal = sure.shown if len(sure.shown) == 2 else sure.pale
    gap = cv2.absdiff(*(_crop(plane, part) for plane in equal))
    filled = half_filled(excess)
    cv2.bitwise_and(filled, cv2.dilate(known, _BESIDE), dst=filled)
    cv2.bitwise_or(filled, known, dst=filled)
    cv2.bitwise_and(filled, _same_hue(gap, excess), dst=filled)
    thin = _thin_lines(difference, gap)
    cv2.bitwise_and(thin, cv2.dilate(known, _REACH), dst=thin)
    for other in others:  # beside another colour everything stands out
        cv2.subtract(thin, cv2.dilate(_crop(other, part), _AROUND), dst=thin)
    if violet is not None:  # a pole is a thin line itself, somewhat blue and red
        cv2.subtract(thin, cv2.dilate(_crop(violet.mask, part), _BESIDE), dst=thin)
    cv2.bitwise_or(filled, thin, dst=thin)
    with_others = cv2.compare(cv2.boxFilter(thin & 1, -1, (3, 3), normalize=False), 1.0, cv2.CMP_GT)
    cv2.bitwise_or(filled, cv2.bitwise_and(thin, with_others), dst=filled)
    known[...] = filled
    if cv2.countNonZero(filled) < MIN_PIXELS:
        return None
    return _kept(sure, (*part[:2], filled.shape[1], filled.shape[0]), filled)


def _thin_lines(excess: Signed, gap: Plane) -> Plane:
    """Where thin lines stand out in their neighbourhood by excess and hue (white top-hat transform).

    Args:
        excess: of the colour over the others, less than 0 where these are brighter.
        gap: between the channels that should be equal.
    """
    line = cv2.morphologyEx(excess, cv2.MORPH_TOPHAT, _THIN)
    # In a shadow an excess below 0 is smaller by as much as all is darker; a line is to fill a fifth or more.
    lighter = cv2.compare(cv2.addWeighted(excess, _LIGHTER, line, 1.0, 0.0), 0.0, cv2.CMP_GT)
    line = cv2.convertScaleAbs(line)
    least = cv2.convertScaleAbs(cv2.dilate(line, _BESIDE), alpha=THIN_FILLED)
    found = cv2.compare(line, np.maximum(least, np.uint8(MIN_EXCESS)), cv2.CMP_GT)
    same = _same_hue(cv2.morphologyEx(gap, cv2.MORPH_TOPHAT, _THIN), line)
    return np.asarray(cv2.bitwise_and(cv2.bitwise_and(found, same), lighter), np.uint8)


def half_filled(excess: Plane) -> Plane:
    """Where a colour fills a pixel by about a half or more, given by how much it exceeds the others."""
    half = cv2.convertScaleAbs(cv2.dilate(excess, _BESIDE), alpha=HALF_FILLED)
    return np.asarray(cv2.compare(excess, np.maximum(half, _LEAST_EXCESS), cv2.CMP_GT), np.uint8)


def _same_hue(gap: Plane, excess: Plane) -> Plane:
    """Where two channels that should be equal are so, given how far the others exceed them."""
    limit = cv2.convertScaleAbs(excess, alpha=MAX_HUE_GAP, beta=HUE_SLACK)
    return np.asarray(cv2.compare(gap, limit, cv2.CMP_LT), np.uint8)


def _violet(blue: Plane, green: Plane, red: Plane, spare: list[Plane]) -> ColourMask | None:
    """The obstacles' colour: red is between green and blue."""
    found = _above(_excess(blue, green, spare[0]), MIN_VIOLET_EXCESS, MIN_PIXELS)
    if found is None:
        return None
    mask, part = found
    low, high = _crop(green, part), _crop(blue, part)
    span, share = cv2.subtract(high, low), cv2.subtract(_crop(red, part), low)
    above = cv2.compare(share, cv2.convertScaleAbs(span, alpha=VIOLET_RED[0]), cv2.CMP_GT)
    below = cv2.compare(share, cv2.convertScaleAbs(span, alpha=VIOLET_RED[1]), cv2.CMP_LT)
    return _kept(ColourMask(OBSTACLE, mask, part, (blue,), (green,)), part, cv2.bitwise_and(above, below))


def _above(excess: Plane, least: int, fewest: int) -> tuple[Plane, _Box] | None:
    """The pixels that exceed a limit, and the box around them; None if there are only a few."""
    if cv2.minMaxLoc(excess)[1] <= least:  # quicker than a mask
        return None
    _, mask = cv2.threshold(excess, least, 255, cv2.THRESH_BINARY)
    if cv2.countNonZero(mask) < fewest:
        return None
    return mask, _box(mask)


def _kept(found: ColourMask, part: _Box, passed: Plane) -> ColourMask | None:
    """What is left of a mask after a further test in the box around it."""
    crop = _crop(found.mask, part)
    cv2.bitwise_and(crop, passed, dst=crop)
    left, top, columns, rows = _box(crop)
    if rows == 0:
        return None
    return replace(found, box=(part[0] + left, part[1] + top, columns, rows))


def _crop(plane: Plane, box: _Box) -> Plane:
    column, row, columns, rows = box
    return plane[row : row + rows, column : column + columns]


def _box(mask: Plane) -> _Box:
    column, row, columns, rows = cv2.boundingRect(mask)
    return (column, row, columns, rows)
