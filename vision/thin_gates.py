"""Where the bars of a proposed gate are, however thin they are, and which colour they have.

The sides of a proposed outline are moved to the ridges of the colour's share beside them, which are the axes
of the bars where the share is alike along all four sides, and less on both sides of them. The gate has the
colour whose channel exceeds the others most in its bars, compared with what is around them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np
import numpy.typing as npt

from vision.colour_regions import PRIMARIES
from vision.fill_shares import CHANNELS, FilledPixels, Shares
from vision.types import Image

Floats = npt.NDArray[np.float64]

MOST_PX = 60.0
"""Larger gates are fitted in a reduced image, in which their bars are thin."""
_PLACES = (0.08 + 0.84 * (np.arange(10.0) + 0.5) / 10.0)[:, None]  # along a side, shape (10, 1)
_REACHES = (3, 2, 2)  # pixels on both sides of an estimate in which a ridge is looked for
_ACROSS = np.arange(-8.0, 8.25, 0.5)  # places across a bar, pixels
_LEAST_PURER = 0.08  # of a colour in its bars than beside them
_DARK = 3.0  # of 255: less is noise
_LIKELY = np.array([1.0 if len(own) == 1 else 0.6 for own in CHANNELS.values()])  # compressed colours mix
_LEAST_CLEAR = 0.2  # else the outline that was proposed is better
_OUTLINE_STD_PX = 1.7
_AXES = 0.94  # of an outline's size, between the axes of its bars
_LEAST_STD_PX, _STD_SHARE = 0.2, 2.5  # of corners, by the ridges' distances from straight lines


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """Four bars of one colour.

    Attributes:
        colour: of its bars.
        corners: where the axes of its bars meet, columns and rows of the image, shape (4, 2), clockwise.
        std_px: standard deviation of the corners' coordinates.
        bar_px: width of its upper and lower bars, pixels of the image; blur adds to it.
    """

    colour: str
    corners: Floats
    std_px: float
    bar_px: float


def fit_ring(filled: FilledPixels, outline: Floats) -> Ring | None:
    """Fit the bars of a gate; None if it is not red, green or blue.

    Args:
        filled: the pixels around it.
        outline: its corners, clockwise, columns and rows of the image, shape (4, 2).
    """
    middle = outline.mean(axis=0)
    scale, origin = np.array(filled.scale), np.array(filled.origin)
    quad = (middle + _AXES * (outline - middle) - origin + 0.5) / scale - 0.5
    planes = np.array([(0.0, plane * filled.pitch) for plane in range(len(CHANNELS))])
    corners, deviations = _fitted(filled.share, quad + planes[:, None])
    purer = _purer(filled, corners - planes[:, None])
    k = int((purer * _LIKELY).argmax())
    colour = tuple(CHANNELS)[k]
    if purer[k] < _LEAST_PURER or colour not in PRIMARIES:
        return None
    if _clearness(filled.share, corners[k : k + 1])[0] > _LEAST_CLEAR:
        axes, std_px = corners[k] - planes[k], hypot(_LEAST_STD_PX, _STD_SHARE * deviations[k])
    else:
        axes, std_px = quad, _OUTLINE_STD_PX
    bar_px = _bar_width(filled.share, (axes + planes[k])[None]) * float(scale[1])
    return Ring(colour, (axes + 0.5) * scale - 0.5 + origin, std_px * max(filled.scale), bar_px)


def _fitted(share: Shares, corners: Floats) -> tuple[Floats, Floats]:
    """Move the sides of quadrilaterals to the ridges beside them.

    Args:
        share: how far each pixel is filled.
        corners: shape (n, 4, 2).

    Returns:
        The corners, and the root mean square of the ridges' distances from the sides, shape (n,).
    """
    deviations = np.zeros(len(corners))
    for reach in _REACHES:
        begin, along, across, _ = _sides(corners)
        steps = np.arange(-reach, reach + 1.0)
        places = begin + along * _PLACES
        values = _at(share, places[..., None, :] + steps[:, None] * across[..., None, :])
        weights = np.maximum(values - np.median(values, axis=-1, keepdims=True), 0.0) ** 2
        total = weights.sum(axis=-1)
        at = (weights * steps).sum(axis=-1) / np.maximum(total, 1e-9)
        trust = np.sqrt(total)
        trust = np.minimum(trust, np.median(trust, axis=2, keepdims=True)) + 1e-6
        t = np.broadcast_to(_PLACES[:, 0], at.shape)
        sum_w = trust.sum(axis=2, keepdims=True)
        mean_t = (trust * t).sum(axis=2, keepdims=True) / sum_w
        mean_at = (trust * at).sum(axis=2, keepdims=True) / sum_w
        centred = t - mean_t
        slope = (trust * centred * (at - mean_at)).sum(axis=2) / (trust * centred * centred).sum(axis=2)
        start = mean_at[..., 0] - slope * mean_t[..., 0]
        residual = at - start[..., None] - slope[..., None] * t
        deviations = np.sqrt(((trust * residual * residual).sum(axis=2) / sum_w[..., 0]).mean(axis=1))
        moved = begin[:, :, 0] + start[..., None] * across[:, :, 0]
        direction = along[:, :, 0] + slope[..., None] * across[:, :, 0]
        corners = _meetings(moved, direction, corners)
    return corners, deviations


def _meetings(points: Floats, directions: Floats, before: Floats) -> Floats:
    """Where side k - 1 meets side k, shape (n, 4, 2); `before` where they are parallel or that is far."""
    p, d = np.roll(points, 1, axis=1), np.roll(directions, 1, axis=1)
    det = d[..., 0] * directions[..., 1] - d[..., 1] * directions[..., 0]
    gap = points - p
    sizes = np.linalg.norm(d, axis=-1) * np.linalg.norm(directions, axis=-1)
    share = (gap[..., 0] * directions[..., 1] - gap[..., 1] * directions[..., 0]) / np.where(det == 0, 1, det)
    met = p + share[..., None] * d
    bad = (np.abs(det) < 0.15 * sizes) | (np.abs(met - before).max(axis=-1) > 6.0)
    return np.where(bad[..., None], before, met)


def _sides(corners: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Start, vector, inward unit vector and length of each side, shapes (n, 4, 1, 2) and (n, 4, 1, 1)."""
    begin = corners[:, :, None]
    along = np.roll(corners, -1, axis=1)[:, :, None] - begin
    length = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-6)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) / length
    return begin, along, across, length


def _clearness(share: Shares, corners: Floats) -> Floats:
    """How clearly the weakest side of each ring is a line: 1 if filled alike and nothing beside it is."""
    begin, along, across, length = _sides(corners)
    beyond = _beyond(length)
    inside = np.minimum(beyond, 0.5 * np.roll(length, 1, axis=1))
    places = begin + along * _PLACES
    filled = _at(share, places)
    ground = np.maximum(_at(share, places + inside * across), _at(share, places - beyond * across))
    mean = np.maximum(np.median(filled, axis=(1, 2), keepdims=True), 1e-3)
    parts = np.clip((filled - np.maximum(ground, 0.0)) / mean, -1.0, 1.0)
    clear: Floats = parts.mean(axis=2).min(axis=1)
    return clear


def _bar_width(share: Shares, corners: Floats) -> float:
    """Width of a ring's upper and lower bars where they are filled by half of what they are most."""
    begin, along, across, _ = _sides(corners)
    places = (begin + along * _PLACES)[..., None, :] + _ACROSS[:, None] * across[..., None, :]
    filled = _at(share, places)[0, ::2].reshape(-1, len(_ACROSS))
    middle = len(_ACROSS) // 2
    less = filled < 0.5 * filled[:, middle - 2 : middle + 3].max(axis=1, keepdims=True)
    before, after = less[:, middle::-1], less[:, middle:]
    runs = [np.where(each.any(axis=1), each.argmax(axis=1), middle) for each in (before, after)]
    return float(np.median(runs[0] + runs[1]) * (_ACROSS[1] - _ACROSS[0]))


def _purer(filled: FilledPixels, corners: Floats) -> Floats:
    """How much purer each colour is along its ring than outside of it.

    Args:
        filled: the pixels.
        corners: of the ring of each colour in the part, shape (n, 4, 2).

    Returns:
        By how much the logarithm of its channels' ratio to the others is larger, shape (n,). A shadow changes
        all channels by the same factor, so it does not change that.
    """
    begin, along, across, length = _sides(corners)
    places = begin + along * _PLACES
    inside, outside = (
        _at(filled.pixels, each) + _DARK for each in (places, places - _beyond(length) * across)
    )
    purer = np.zeros(len(corners))
    for k, own in enumerate(CHANNELS.values()):
        others = [channel for channel in range(3) if channel not in own]
        ratios = [
            each[k][..., own].min(axis=-1) / each[k][..., others].max(axis=-1) for each in (inside, outside)
        ]
        purer[k] = np.median(np.log(ratios[0] / ratios[1]))
    return purer


def _beyond(length: Floats) -> Floats:
    """How far from a bar's axis it has ended, pixels; the argument is that of `_sides`."""
    beyond: Floats = 2.0 + 0.15 * length.min(axis=1, keepdims=True)
    return beyond


def _at(share: Shares | Image, places: Floats) -> Floats:
    """Between the numbers of the four pixels around each place, shape (...) or (..., 3)."""
    x, y = places[..., 0].astype(np.float32), places[..., 1].astype(np.float32)
    flat = cv2.remap(
        share, x.reshape(len(x), -1), y.reshape(len(x), -1), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    values: Floats = flat.reshape(*x.shape, *share.shape[2:]).astype(np.float64)
    return values
