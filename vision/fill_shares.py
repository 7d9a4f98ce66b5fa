"""How far a gate's colour fills each pixel: linear unmixing against what is around it.

A bar that is narrower than a pixel, or that a lens or a compression has smeared, has no pixels of its own
colour. A pixel that a bar of the colour c fills by the share a, before a background b, has the value

    p = a c + (1 - a) b,    so    a = (p - b)·(c - b) / |c - b|²

in the least squares of its channels (linear mixture model: N. Keshava, J. Mustard, "Spectral unmixing", IEEE
Signal Processing Magazine, 2002). The background is the mean around the pixel. Brightness, in which images
are sharp, takes part in it beside colour, of which most cameras send half the resolution. How far the channel
of the colour exceeds the others, compared with what is around, tells which pixels are of that colour at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from vision.colour_regions import Plane, split_planes
from vision.types import Image

Shares = npt.NDArray[np.float32]
Box = tuple[int, int, int, int]  # column, row, columns, rows

CHANNELS = {"red": (2,), "green": (1,), "blue": (0,), "cyan": (0, 1), "magenta": (0, 2)}
"""Of each colour of a gate the channels that are bright in it."""
_PRIMARIES = (0, 1, 2)

_LEAST_EXCESS = 12  # more than around
_COLUMNS = 160  # to which an image is reduced before anything is looked for
_THIN = np.ones((5, 5), np.uint8)  # what is narrower stands out against what is around it
_MIN_PIXELS = 6
_AROUND_PX = 15
_DARK = 0.1  # of the bright channels' value
_BRIGHT_PERCENT, _BRIGHT = 90, 0.75  # a gate is less bright than the brightest tenth of an image
_LEAST_BRIGHT = 60.0
_LEAST_SQUARE = 900.0  # of the difference between a colour and what is around
_GRID = 4
_GAP_ROWS = 4  # between the planes of two colours


@dataclass(frozen=True, slots=True, eq=False)
class FilledPixels:
    """How far colours fill the pixels of a part of an image.

    Attributes:
        origin: column and row of the part in the image.
        scale: columns and rows of the image for one of the part.
        pitch: rows of the plane of a colour, which are below one another.
        share: how far each of `CHANNELS` fills each pixel, about 0..1, shape (colours * pitch, columns).
        pixels: of the part, BGR, without the noise of single pixels, shape (rows, columns, 3).
    """

    origin: tuple[int, int]
    scale: tuple[float, float]
    pitch: int
    share: Shares
    pixels: Image


def has_coloured_lines(image: Image, known: Sequence[Box]) -> bool:
    """Whether there may be more gates: thin things of their colours outside some boxes."""
    shrink = image.shape[1] / _COLUMNS
    size = (_COLUMNS, max(round(image.shape[0] / shrink), 1))
    planes = split_planes(np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8))
    for own in _PRIMARIES:
        excess = _pure_excess(planes, own)
        thin = cv2.morphologyEx(excess, cv2.MORPH_TOPHAT, _THIN)
        for column, row, columns, rows in known:
            left, top = int(column / shrink), int(row / shrink)
            right, bottom = int((column + columns) / shrink), int((row + rows) / shrink)
            thin[max(top - 1, 0) : bottom + 2, max(left - 1, 0) : right + 2] = 0
        # Most of a gate also exceeds the other channels, which grey between other colours does not.
        more = cv2.bitwise_and(
            cv2.compare(thin, _LEAST_EXCESS, cv2.CMP_GT), cv2.compare(excess, 2.0, cv2.CMP_GT)
        )
        if cv2.countNonZero(more) >= _MIN_PIXELS:
            return True
    return False


def brightness_of_gates(image: Image) -> float:
    """How bright the channels of a gate's colour are in the light of an image, 0..255."""
    brightness = np.percentile(np.maximum.reduce(cv2.split(image[::_GRID, ::_GRID])), _BRIGHT_PERCENT)
    return max(_LEAST_BRIGHT, _BRIGHT * float(brightness))


def fill_around(
    image: Image, corners: npt.NDArray[np.float64], most_px: float, bright: float
) -> FilledPixels:
    """How far each colour fills the pixels around a quadrilateral.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        corners: of it, columns and rows, shape (4, 2).
        most_px: a larger quadrilateral is reduced to about this size.
        bright: see `brightness_of_gates`.
    """
    height, width = image.shape[:2]
    low, high = corners.min(axis=0), corners.max(axis=0)
    shrink = max(1, round(float((high - low).max()) / most_px))
    margin = shrink * _AROUND_PX
    left, top = (max(int(each) - margin, 0) for each in low.tolist())
    right, bottom = min(int(high[0]) + margin + 1, width), min(int(high[1]) + margin + 1, height)
    part = image[top:bottom, left:right]
    size = (max((right - left) // shrink, 1), max((bottom - top) // shrink, 1))
    if shrink > 1:
        part = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), np.uint8)
    scale = ((right - left) / size[0], (bottom - top) / size[1])
    share = np.vstack(
        [
            cv2.copyMakeBorder(plane, 0, _GAP_ROWS, 0, 0, cv2.BORDER_REPLICATE)
            for plane in _shares(part, bright)
        ]
    )
    pixels = np.asarray(cv2.blur(part, (3, 3)), np.uint8)
    return FilledPixels((left, top), scale, size[1] + _GAP_ROWS, share, pixels)


def _pure_excess(planes: Sequence[Plane], own: int) -> npt.NDArray[np.int16]:
    """How far a channel exceeds the larger of the others, less half of the difference of these."""
    one, other = (plane for channel, plane in enumerate(planes) if channel != own)
    excess = cv2.addWeighted(planes[own], 1.0, cv2.max(one, other), -1.5, 0.0, dtype=cv2.CV_16S)
    return np.asarray(cv2.add(excess, np.right_shift(cv2.min(one, other), 1), dtype=cv2.CV_16S), np.int16)


def _shares(part: Image, bright: float) -> list[Shares]:
    """How far each colour fills each pixel of a part of an image."""
    pixels = part.astype(np.float32)
    around = cv2.blur(pixels, (_AROUND_PX, _AROUND_PX))
    beyond = pixels - around
    one = np.ones((1, 3), np.float32)
    along = cv2.transform(beyond * around, one)
    around_square = cv2.transform(around * around, one)
    shares = []
    for own in CHANNELS.values():
        colour = np.full((1, 3), _DARK * bright, np.float32)
        colour[0, list(own)] = bright
        above = cv2.transform(beyond, colour) - along
        square = around_square - 2.0 * cv2.transform(around, colour) + float((colour * colour).sum())
        shares.append(above / np.maximum(square, _LEAST_SQUARE))
    return shares
