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

_CHANNELS = {"red": 2, "green": 1, "blue": 0}
"""Of each colour of the task its channel."""

ZERO_EXCESS = 64.0
"""The excess of a pixel whose channels are equal."""
_LEAST_EXCESS = 12  # more than around
_LEAST_NEAR = 5  # beside a pixel of a line
_NEAR = np.ones((3, 3), np.uint8)
_THIN = np.ones((9, 9), np.uint8)  # what is narrower stands out against what is around it
_AROUND_PX = 15
_BESIDE = np.ones((5, 5), np.uint8)
_LEAST_SHARE, _HALF = (
    0.08,
    0.5,
)  # a pixel is of a bar with this share at least, and half the largest beside it
_DARK = 0.1  # of the bright channels' value
_BRIGHT_PERCENT, _BRIGHT = 90, 0.75  # a gate is less bright than the brightest tenth of an image
_LEAST_BRIGHT = 60.0
_LEAST_SQUARE = 900.0  # of the difference between a colour and what is around
_GRID = 4
_MIN_PIXELS = 20
_MARGIN_PX = 4
_GAP_ROWS = 4  # between the planes of two colours


@dataclass(frozen=True, slots=True, eq=False)
class FilledPixels:
    """The pixels that colours fill more than those around them, in a part of an image.

    The planes of several colours are below one another, so that what is done with them is done once.

    Attributes:
        colours: which.
        origin: column and row of the part in the image.
        pitch: rows from the first row of a colour to that of the next one.
        share: how far the colour fills each pixel, about 0..1, shape (colours * pitch, columns).
        excess: how far the colour's channel exceeds the larger of the others, plus `ZERO_EXCESS`, same shape.
        mask: 255 where it is a bar, the same.
        broad: 255 where it is a bar by colour alone, of which a camera sends half the resolution, the same.
    """

    colours: tuple[str, ...]
    origin: tuple[int, int]
    pitch: int
    share: Shares
    excess: Plane
    mask: Plane
    broad: Plane


def find_filled(image: Image, known: Sequence[Box]) -> FilledPixels | None:
    """Find what may be thin bars of the colours of gates; None if there is nothing.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        known: boxes in which nothing is looked for.
    """
    planes = split_planes(image)
    coloured: dict[str, tuple[Plane, Plane]] = {}
    boxes: list[Box] = []
    for colour, own in _CHANNELS.items():
        excess = _excess(planes, own)
        thin = np.asarray(cv2.morphologyEx(excess, cv2.MORPH_TOPHAT, _THIN), np.uint8)
        for column, row, columns, rows in known:
            thin[max(row - 2, 0) : row + rows + 2, max(column - 2, 0) : column + columns + 2] = 0
        # Most of a ring also exceeds the other channels, which grey between other colours does not.
        more = cv2.bitwise_and(
            cv2.compare(thin, _LEAST_EXCESS, cv2.CMP_GT), cv2.compare(excess, ZERO_EXCESS + 2.0, cv2.CMP_GT)
        )
        if cv2.countNonZero(more) >= _MIN_PIXELS:
            boxes.append(_grown(cv2.boundingRect(more), image.shape))
            coloured[colour] = (excess, thin)
    if not boxes:
        return None
    box = _union(boxes)
    mixture = _Mixture(image, box)
    left, top, wide, high = box
    part = (slice(top, top + high), slice(left, left + wide))
    pitch = high + _GAP_ROWS
    shape = (pitch * len(coloured), wide)
    share = np.zeros(shape, np.float32)
    excesses, mask, broad = np.zeros((3, *shape), np.uint8)
    for k, (colour, (excess, thin)) in enumerate(coloured.items()):
        rows_of = slice(k * pitch, k * pitch + high)
        share[rows_of] = mixture.share(_CHANNELS[colour])
        excesses[rows_of] = excess[part]
        near = cv2.dilate(cv2.compare(thin[part], _LEAST_NEAR, cv2.CMP_GT), _NEAR)
        mask[rows_of] = _bars(share[rows_of], near)
        broad[rows_of] = _broad(thin[part])
    return FilledPixels(tuple(coloured), (left, top), pitch, share, excesses, mask, broad)


def _grown(box: Sequence[int], shape: Sequence[int]) -> Box:
    """A box and some pixels around it, within an image."""
    column, row, columns, rows = box
    left, top = max(column - _MARGIN_PX, 0), max(row - _MARGIN_PX, 0)
    right, bottom = min(column + columns + _MARGIN_PX, shape[1]), min(row + rows + _MARGIN_PX, shape[0])
    return (left, top, right - left, bottom - top)


def _union(boxes: Sequence[Box]) -> Box:
    left, top = min(box[0] for box in boxes), min(box[1] for box in boxes)
    right, bottom = max(box[0] + box[2] for box in boxes), max(box[1] + box[3] for box in boxes)
    return (left, top, right - left, bottom - top)


def _excess(planes: Sequence[Plane], own: int) -> Plane:
    """How far a channel exceeds the larger of the others, plus `ZERO_EXCESS`, without the noise of pixels."""
    one, other = (plane for channel, plane in enumerate(planes) if channel != own)
    excess = cv2.addWeighted(planes[own], 1.0, cv2.max(one, other), -1.0, ZERO_EXCESS)
    return np.asarray(cv2.blur(excess, (3, 3)), np.uint8)


def _bars(share: Shares, coloured: Plane) -> Plane:
    """The pixels of lines: at least half as much filled as the most filled one beside them."""
    filled = cv2.min(share, coloured.astype(np.float32))
    limit = np.maximum(_HALF * cv2.dilate(filled, _BESIDE), _LEAST_SHARE)
    return np.asarray(cv2.compare(filled, limit, cv2.CMP_GT), np.uint8)


def _broad(thin: Plane) -> Plane:
    """The same by how far the channels exceed others alone."""
    limit = np.maximum(cv2.convertScaleAbs(cv2.dilate(thin, _BESIDE), alpha=_HALF), np.uint8(_LEAST_EXCESS))
    return np.asarray(cv2.compare(thin, limit, cv2.CMP_GT), np.uint8)


class _Mixture:
    """A part of an image, what is around each of its pixels, and what is the same for all colours.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        box: the part.
    """

    def __init__(self, image: Image, box: Box) -> None:
        column, row, columns, rows = box
        left, top = max(column - _AROUND_PX, 0), max(row - _AROUND_PX, 0)
        self._part = (slice(row - top, row - top + rows), slice(column - left, column - left + columns))
        seen = image[top : row + rows + _AROUND_PX, left : column + columns + _AROUND_PX]
        pixels = seen.astype(np.float32)
        self._around = cv2.blur(pixels, (_AROUND_PX, _AROUND_PX))
        self._beyond = pixels - self._around
        one = np.ones((1, 3), np.float32)
        self._along = cv2.transform(self._beyond * self._around, one)
        self._square = cv2.transform(self._around * self._around, one)
        brightness = np.percentile(image[::_GRID, ::_GRID].max(axis=2), _BRIGHT_PERCENT)
        self._bright = max(_LEAST_BRIGHT, _BRIGHT * float(brightness))

    def share(self, own: int) -> Shares:
        """How far the colour of a channel fills each pixel of the part."""
        part = self._part
        colour = np.full((1, 3), _DARK * self._bright, np.float32)
        colour[0, own] = self._bright
        above = cv2.transform(self._beyond[part], colour) - self._along[part]
        square = self._square[part] - 2.0 * cv2.transform(self._around[part], colour)
        square += float((colour * colour).sum())
        shares: Shares = above / np.maximum(square, _LEAST_SQUARE)
        return shares
