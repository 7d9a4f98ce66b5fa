"""Parts of an image around proposed gates, all of one size, as the network that judges them sees them."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from vision.types import Image

COLUMNS, ROWS = 48, 32
GRID_COLUMNS, GRID_ROWS = 12, 8  # cells of a crop in which the network looks for corners
AROUND, FAR_AROUND = 1.9, 2.3
"""Sizes of a crop by that of the gate in it; the larger one if it is not known well where that is."""
_LEAST_PX = 12.0

Box = tuple[float, float, float, float]
"""Column and row of the upper left corner, columns, rows; pixel centres are whole numbers."""


def box_around(corners: npt.NDArray[np.floating], share: float = AROUND) -> Box:
    """The box of an outline, shape (4, 2), with what is around it."""
    (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    columns, rows = max(share * (right - left), _LEAST_PX), max(share * (bottom - top), _LEAST_PX)
    return ((left + right - columns) / 2, (top + bottom - rows) / 2, columns, rows)


def cut_out(image: Image, box: Box) -> Image:
    """The pixels of a box, shape (ROWS, COLUMNS, 3); beside the image its border goes on."""
    column, row, columns, rows = box
    # Larger boxes are reduced before, or pixels between those that are looked at would be lost.
    shrink = int(max(columns / COLUMNS, rows / ROWS))
    if shrink > 1:
        height, width = image.shape[:2]
        left, top = max(int(column), 0), max(int(row), 0)
        right, bottom = min(int(column + columns) + 2, width), min(int(row + rows) + 2, height)
        part = image[top:bottom, left:right]
        size = (max((right - left) // shrink, 1), max((bottom - top) // shrink, 1))
        if part.size == 0:
            return np.zeros((ROWS, COLUMNS, 3), np.uint8)
        across, down = (right - left) / size[0], (bottom - top) / size[1]
        image = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), np.uint8)
        column, columns = (column - left + 0.5) / across - 0.5, columns / across
        row, rows = (row - top + 0.5) / down - 0.5, rows / down
    # From pixels of the crop to those of the image; a corner of the box is at -0.5 of the crop.
    across, down = columns / COLUMNS, rows / ROWS
    matrix = np.array([[across, 0.0, column + 0.5 * across], [0.0, down, row + 0.5 * down]])
    return np.asarray(
        cv2.warpAffine(
            image, matrix, (COLUMNS, ROWS),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
        ),
        np.uint8,
    )  # fmt: skip
