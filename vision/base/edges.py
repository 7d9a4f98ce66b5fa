"""Where the edges of a base are in an image: profiles of colour across them, at places along them."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Final

import cv2
import numpy as np

from vision.base.model import CameraView, Flags, Floats, SeenEdges, projected
from vision.calibration.lens import Lens
from vision.types import Image

SAMPLES: Final = 12
"""Places on each edge."""
_SHARES = (np.arange(SAMPLES) + 0.5) / SAMPLES * 0.92 + 0.04
_WITHIN = (np.arange(11) + 0.5) / 11
_WINDOW_PX: Final = 3.0  # on either side of an edge, from which its place is computed
_SHORTEST_WINDOW_PX: Final = 1.5
_PLATEAU_PX: Final = 1.0  # beyond that, where a side's own colour is
_THIN_PX: Final = 2.6  # a strip narrower than this has no colour of its own to be seen
_WIDE_PX: Final = 4.5  # a strip wider than this has its colour seen whatever the blur
_THIN_SHARE: Final = 0.3  # standard deviation of where within a thin strip the edge is seen
_COMMON_PX: Final = 0.15  # standard deviation of what is common to an edge
_ROUNDED_PX: Final = 0.15  # standard deviation of a place without noise
_BEYOND: Final = 0.35  # share of the step by which a profile may go beyond both colours
_OF_NOISE: Final = 2.0  # standard deviations of noise by which it may do so more
_BROADER: Final = 1.5  # than usual: the step of more than one edge
_NO_NEIGHBOUR_PX: Final = 1e3


class Pixels:
    """The colours of an image at places of an ideal camera's image.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        lens: of a camera that is not ideal.
    """

    def __init__(self, image: Image, lens: Lens | None) -> None:
        self._image, self._lens = image, lens
        height, width = image.shape[:2]
        self._middle = np.array([(width - 1) / 2, (height - 1) / 2])

    def at(self, places_px: Floats) -> Floats:
        """Colours, shape (..., 3), at pixels right and down of the optical axis, shape (..., 2)."""
        shape = places_px.shape[:-1]
        seen = places_px.reshape(len(places_px), -1, 2)
        if self._lens is not None:
            seen = self._lens.all_seen(seen)
        maps = (seen + self._middle).astype(np.float32)
        colours: Floats = cv2.remap(
            self._image, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        ).astype(np.float64)
        return colours.reshape(*shape, 3)


@dataclass(frozen=True, slots=True, eq=False)
class EdgePlaces:
    """Places on the edges that are seen, where these are looked for.

    Attributes:
        points_m: in the base's axes, shape (k, m, 3).
        points_px: in the image, shape (k, m, 2).
        along: shares of the whole edges, shape (k, m).
    """

    points_m: Floats
    points_px: Floats
    along: Floats


def places_on(edges: SeenEdges, view: CameraView, focal_px: float) -> EdgePlaces:
    """Places spread over the parts of the edges that are in the image."""
    points_m, along = edges.samples(_SHARES)
    return EdgePlaces(points_m, projected((points_m - view.eye_m) @ view.turn, focal_px), along)


def steepest(
    pixels: Pixels, edges: SeenEdges, places: EdgePlaces, reach_px: int, least: float
) -> tuple[Floats, Flags]:
    """How far outwards from where it is expected each edge is seen: where colours change most.

    Args:
        pixels: of the image.
        edges: as expected.
        places: on them.
        reach_px: how far on either side it is looked for.
        least: change of colour over two pixels that counts.

    Returns:
        Pixels outwards, and where something was seen, both shape (k, m).
    """
    offsets = np.arange(-reach_px - 2.0, reach_px + 3.0)
    across = places.points_px[:, :, None] + offsets[:, None] * edges.normal[:, None, None]
    colours = pixels.at(across)
    change = np.abs(colours[:, :, 2:] - colours[:, :, :-2]).max(axis=-1)
    here = change[..., 1:-1]
    peak = (here >= change[..., :-2]) & (here >= change[..., 2:])
    wanted = peak * np.minimum(here, 3.0 * least) * (1.0 - 0.6 * np.abs(offsets[2:-2]) / (reach_px + 1.0))
    best = wanted.argmax(axis=-1)
    rows, columns = np.indices(best.shape)
    here = change[rows, columns, best + 1]
    before, after = change[rows, columns, best], change[rows, columns, best + 2]
    bend = before - 2.0 * here + after
    shift = np.where(bend < -1e-9, 0.5 * (before - after) / np.where(bend < -1e-9, bend, 1.0), 0.0)
    return best - reach_px + np.clip(shift, -0.5, 0.5), here >= least


@dataclass(frozen=True, slots=True, eq=False)
class EdgeMeasurements:
    """The edges as they are seen, all arrays of shape (k, m) or (k, m, 3).

    Attributes:
        off_px: how far outwards each is from where it was expected.
        noise_px: standard deviation of that, without what is common to an edge.
        common_px: standard deviation of what is common to an edge.
        contrast: between its sides, of 255, the largest of the three channels'.
        clear: where there is room for it to be measured apart from other edges.
        used: where it was measured.
        inner: colour of the inner side.
        outer: colour of the outer side.
        inner_clear: where the inner side is wide enough to have its colour seen.
        outer_clear: the same for the outer side.
    """

    off_px: Floats
    noise_px: Floats
    common_px: Floats
    contrast: Floats
    clear: Flags
    used: Flags
    inner: Floats
    outer: Floats
    inner_clear: Flags
    outer_clear: Flags


def measured(pixels: Pixels, edges: SeenEdges, places: EdgePlaces, noise: float) -> EdgeMeasurements:
    """Measure the edges near where they are expected.

    Between two plateaus of colour the edge is where a sharp step would have the same integral; so blur that
    is alike on both sides, and pixels that an edge covers in part, change nothing. A strip too thin to have a
    plateau is measured as a whole.

    Args:
        pixels: of the image.
        edges: as expected, within two pixels.
        places: on them.
        noise: standard deviation of a pixel's channel, of 255.
    """
    gap_in, gap_out, next_in, next_out = _gaps(edges, places)
    thin_in, thin_out = gap_in < _THIN_PX, gap_out < _THIN_PX
    # The window may begin beyond a thin strip.
    low = -_room(np.where(thin_in, next_in, gap_in), np.where(thin_in, gap_in, 0.0))
    high = _room(np.where(thin_out, next_out, gap_out), np.where(thin_out, gap_out, 0.0))
    clear = ~np.isnan(low) & ~np.isnan(high) & ~(thin_in & thin_out)
    low, high = np.where(clear, low, -_WINDOW_PX), np.where(clear, high, _WINDOW_PX)
    offsets = np.concatenate(
        [
            low[..., None] - _PLATEAU_PX * np.array([1.0, 0.4]),
            low[..., None] + (high - low)[..., None] * _WITHIN,
            high[..., None] + _PLATEAU_PX * np.array([0.4, 1.0]),
        ],
        axis=-1,
    )
    colours = pixels.at(places.points_px[:, :, None] + offsets[..., None] * edges.normal[:, None, None])
    colours = _mean_of_neighbours(colours, clear)
    inner, outer = colours[:, :, :2].mean(axis=2), colours[:, :, -2:].mean(axis=2)
    step = outer - inner
    square = np.maximum((step * step).sum(axis=-1), 1e-9)
    level = ((colours[:, :, 2:-2] - inner[:, :, None]) * step[:, :, None]).sum(axis=-1) / square[..., None]
    off = high - (high - low) * level.mean(axis=-1)
    # Within a thin strip it is not known which of its two edges is the stronger.
    off += np.where(thin_in, 0.5 * gap_in, 0.0) - np.where(thin_out, 0.5 * gap_out, 0.0)
    thin = np.where(thin_in, gap_in, 0.0) + np.where(thin_out, gap_out, 0.0)
    width = high - low
    of_noise = noise * np.sqrt(width) / np.sqrt(square)
    contrast = np.abs(step).max(axis=-1)
    # Of two edges close together the step is wider than where there is one.
    breadth = width * (4.0 * level * (1.0 - level)).mean(axis=-1)
    single = clear & (thin == 0.0) & (contrast >= noise * 4.0)
    usual = float(np.median(breadth[single])) if single.any() else 0.0
    # Noise bends a weak step's profile as other edges bend that of a strong one.
    of_level = noise / np.sqrt(square)
    beyond = (_BEYOND + _OF_NOISE * of_level)[..., None]
    straight = (np.abs(level - 0.5) < 0.5 + beyond).all(axis=-1)
    straight &= (breadth < _BROADER * usual + 0.2 + _OF_NOISE * of_level) | (thin > 0.0)
    common = np.hypot(_THIN_SHARE * thin, _COMMON_PX)
    return EdgeMeasurements(
        off, np.hypot(of_noise, _ROUNDED_PX), common, contrast, clear & (thin == 0.0), clear & straight,
        inner, outer, clear & (gap_in > _WIDE_PX), clear & (gap_out > _WIDE_PX),
    )  # fmt: skip


def _mean_of_neighbours(colours: Floats, clear: Flags) -> Floats:
    """Profiles along each edge, shape (k, m, n, 3), each averaged with those beside it that are clear.

    Noise and the floor's texture become less, and an edge, which is straight, stays where it is.
    """
    weights = np.pad(clear.astype(np.float64), ((0, 0), (1, 1)))[..., None, None]
    padded = np.pad(colours, ((0, 0), (1, 1), (0, 0), (0, 0))) * weights
    total = padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]
    count = weights[:, :-2] + weights[:, 1:-1] + weights[:, 2:]
    mean: Floats = np.where(clear[..., None, None], total / np.maximum(count, 1.0), colours)
    return mean


def _room(gap_px: Floats, beyond_px: Floats) -> Floats:
    """How far a window reaches towards the next edge; NaN if there is no room for it and a plateau."""
    reach = np.minimum(_WINDOW_PX + beyond_px, gap_px - _PLATEAU_PX - 0.3)
    return np.where(reach >= beyond_px + _SHORTEST_WINDOW_PX - 0.4, reach, np.nan)


def _gaps(edges: SeenEdges, places: EdgePlaces) -> tuple[Floats, Floats, Floats, Floats]:
    """From each place, how far inwards and outwards the nearest and the second other edge are, pixels."""
    start = edges.ends_px[:, 0]
    along = edges.ends_px[:, 1] - start
    at, normal = places.points_px[:, :, None], edges.normal[:, None, None]
    # at + s normal = start + t along
    determinant = normal[..., 0] * along[:, 1] - normal[..., 1] * along[:, 0]
    determinant = np.where(np.abs(determinant) < 1e-6, 1e-6, determinant)
    dx, dy = start[:, 0] - at[..., 0], start[:, 1] - at[..., 1]
    s = (dx * along[:, 1] - dy * along[:, 0]) / determinant
    t = (dx * normal[..., 1] - dy * normal[..., 0]) / determinant
    crossed = (t > -0.02) & (t < 1.02)
    own = np.arange(len(start))
    crossed[own, :, own] = False
    outwards = np.where(crossed & (s > 0.0), s, _NO_NEIGHBOUR_PX)
    inwards = np.where(crossed & (s <= 0.0), -s, _NO_NEIGHBOUR_PX)
    far = np.full((*s.shape[:2], 1), _NO_NEIGHBOUR_PX)
    nearest_out = np.sort(np.concatenate([outwards, far, far], axis=-1), axis=-1)
    nearest_in = np.sort(np.concatenate([inwards, far, far], axis=-1), axis=-1)
    return nearest_in[..., 0], nearest_out[..., 0], nearest_in[..., 1], nearest_out[..., 1]


def noise_of(image: Image) -> float:
    """Standard deviation of the noise of a pixel's channel, of 255, from differences of neighbours.

    Most of an image is smooth, so the median of the second differences is of noise only.
    """
    some = image[::7, ::2].astype(np.int16)
    twice = some[:, 1:-1] * 2 - some[:, :-2] - some[:, 2:]
    return float(np.median(np.abs(twice))) / (0.6745 * sqrt(6.0))
