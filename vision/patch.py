"""A part of an image in which the pixels of one region are marked, and what else may hide its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from vision.calibration.lens import Lens
from vision.colour_regions import ColourMask
from vision.gate_model import Point

Labels = npt.NDArray[np.uint8]
Box = tuple[int, int, int, int]  # column, row, columns, rows

BACKGROUND, OWN, FOREIGN, OUTSIDE = 0, 1, 2, 4
"""Values of pixels: none of the others, of the region, what may hide a part of it, and not in the image."""

_PLACES = (np.arange(16.0)[:, None] + 0.5) / 16.0  # along a bar, as shares of its length, shape (16, 1)
_ACROSS, _DOWN = (shares.ravel() for shares in np.meshgrid((0.25, 0.4, 0.6, 0.75), (0.3, 0.5, 0.7)))
_INNER = np.stack(
    [(1 - _ACROSS) * (1 - _DOWN), _ACROSS * (1 - _DOWN), _ACROSS * _DOWN, (1 - _ACROSS) * _DOWN], axis=1
)  # weights of a quadrilateral's corners, shape (12, 4)
_MUCH = 0.005  # share of an image
_OPENING_PX = 6.0  # between the axes of opposite bars: an opening of this size is seen
_AROUND = np.ones((5, 5), np.uint8)
# A pixel and its four neighbours, shape (5, 1, 1).
_BESIDE_ROWS = np.array([0, -1, 1, 0, 0])[:, None, None]
_BESIDE_COLUMNS = np.array([0, 0, 0, -1, 1])[:, None, None]


@dataclass(frozen=True, slots=True, eq=False)
class ImagePatch:
    """A part of an image around a region, with a margin.

    Attributes:
        labels: its pixels.
        excess: how far the region's colour exceeds the others in each of them, see `ColourMask.excess`.
        origin: column and row of it where the optical axis is; whole numbers are pixel centres.
        reach_px: from the optical axis to the right and to the lower edge of the whole image.
        lens: of a camera that is not ideal: then `origin` and `reach_px` are from the image's middle.
        among_others: the image has much else of the region's colour.
    """

    labels: Labels
    excess: npt.NDArray[np.int16]
    origin: Point
    reach_px: Point
    lens: Lens | None = None
    among_others: bool = False

    @property
    def has_foreign(self) -> bool:
        """Whether there is anything that could hide a part of the region."""
        return bool((self.labels == FOREIGN).any())

    @property
    def may_be_cut(self) -> bool:
        """Whether the region touches something that could hide a part of it, or the end of the image."""
        around = cv2.dilate(np.bitwise_and(self.labels, np.uint8(OWN)), _AROUND)
        return bool((around * (self.labels > OWN)).any())

    def is_filled(self, axes_corners: Sequence[Point]) -> bool:
        """Whether there is no opening between four bars although it is wide enough to be seen.

        Args:
            axes_corners: where the axes of the bars meet, pixels from the optical axis.
        """
        middle_x, middle_y = (sum(values) / 4.0 for values in zip(*axes_corners, strict=True))
        rows, columns = self.labels.shape
        before_x, before_y = axes_corners[-1]
        for x, y in axes_corners:
            if max(abs(x - before_x), abs(y - before_y)) < _OPENING_PX:
                return False
            before_x, before_y = x, y
            inside_x, inside_y = middle_x + 0.4 * (x - middle_x), middle_y + 0.4 * (y - middle_y)
            if self.lens is not None:
                inside_x, inside_y = self.lens.seen(inside_x, inside_y)
            column, row = round(inside_x + self.origin[0]), round(inside_y + self.origin[1])
            if not (0 <= column < columns and 0 <= row < rows and self.labels[row, column] == OWN):
                return False
        return True

    def own_share(self, corners: Sequence[Point]) -> float:
        """Share of the region's pixels in the inner part of a quadrilateral, pixels from the optical axis."""
        places = _INNER @ np.array(corners)
        if self.lens is not None:
            places = self.lens.all_seen(places)
        column, row = np.rint(places + self.origin).astype(np.intp).T
        rows, columns = self.labels.shape
        column, row = np.clip(column, 0, columns - 1), np.clip(row, 0, rows - 1)
        return float(np.mean(self.labels[row, column] == OWN))

    def in_front(self) -> ImagePatch:
        """The same as if the region were in front of all else."""
        return replace(self, labels=np.bitwise_and(self.labels, np.uint8(OWN | OUTSIDE)))

    def support(self, starts: Sequence[Point], ends: Sequence[Point]) -> Support:
        """Look along straight bars, given by the ends of their axes, pixels from the optical axis."""
        begin, end = np.array(starts)[:, None], np.array(ends)[:, None]
        places = begin + (end - begin) * _PLACES
        if self.lens is not None:
            places = self.lens.all_seen(places)
        rows, columns = self.labels.shape
        at = np.rint(places + self.origin)
        known = ((at >= 0.0) & (at < (columns, rows))).all(axis=-1)
        at[~known] = 0.0  # a place that a lens does not show is not a number
        column, row = np.moveaxis(at.astype(np.intp), -1, 0)
        # A thin bar may be a pixel beside its axis.
        beside_rows = np.minimum(np.maximum(row + _BESIDE_ROWS, 0), rows - 1)
        beside_columns = np.minimum(np.maximum(column + _BESIDE_COLUMNS, 0), columns - 1)
        around = self.labels[beside_rows, beside_columns]
        own = known & (around & OWN).any(axis=0)
        hidden = ~(np.abs(places) <= self.reach_px).all(axis=-1) | (known & (around > OWN).any(axis=0))
        empty = ~(own | hidden)
        return Support(own.mean(axis=1).tolist(), empty.mean(axis=1).tolist())


@dataclass(frozen=True, slots=True)
class Support:
    """What is seen along each bar, shares 0..1 of its length."""

    own: list[float]  # pixels of the region
    empty: list[float]  # pixels of nothing that could hide it; the rest is hidden or outside the image


def cut_patch(
    mask: ColourMask, others: Sequence[ColourMask], box: Box, lens: Lens | None = None
) -> ImagePatch:
    """Cut the part of an image around a box, for a region of one colour beside others."""
    height, width = mask.mask.shape
    column, row, columns, rows = box
    margin = 6 + max(columns, rows) // 4  # wider than any bar
    labels = np.full((rows + 2 * margin, columns + 2 * margin), OUTSIDE, np.uint8)
    x0, y0 = max(column - margin, 0), max(row - margin, 0)
    x1, y1 = min(column + columns + margin, width), min(row + rows + margin, height)
    inside = labels[y0 - row + margin : y1 - row + margin, x0 - column + margin : x1 - column + margin]
    np.bitwise_and(mask.mask[y0:y1, x0:x1], OWN, out=inside)
    excess = np.zeros(labels.shape, np.int16)
    excess[y0 - row + margin : y1 - row + margin, x0 - column + margin : x1 - column + margin] = mask.excess(
        (x0, y0, x1 - x0, y1 - y0)
    )
    for other in others:
        left, top, wide, high = other.box
        if left < x1 and top < y1 and left + wide > x0 and top + high > y0:
            inside |= other.mask[y0:y1, x0:x1] & FOREIGN
    origin = ((width - 1) / 2 - column + margin, (height - 1) / 2 - row + margin)
    own = cv2.countNonZero(mask.mask[row : row + rows, column : column + columns])
    among_others = cv2.countNonZero(mask.mask) - own > _MUCH * mask.mask.size
    return ImagePatch(labels, excess, origin, (width / 2, height / 2), lens, among_others)
