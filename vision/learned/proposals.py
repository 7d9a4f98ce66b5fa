"""Where a network sees gates in an image: first estimates of their corners.

The network is trained by `training/gates` (`card.md`) and run by OpenCV. It does not know colours or sizes of
gates.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from vision.types import Image

Floats = npt.NDArray[np.float32]

_COLUMNS, _ROWS = 320, 240
_CELL_PX, _OFFSET_PX = 4, 16.0  # as in `training/gates/samples.py`
_BESIDE = np.ones((3, 3), np.uint8)
_MOST = 8


class GateProposals:
    """What the network says of one image.

    Attributes:
        chances: of a gate's centre in each cell of `cell_px`, shape (rows, columns).
        corners: upper left, upper right, lower right and lower left of the outlines of proposed gates,
            columns and rows of the image, shape (n, 4, 2), the likelier one first.
        cell_px: columns and rows of a cell.
    """

    def __init__(self, image: Image, least: float) -> None:
        height, width = image.shape[:2]
        scale = np.array([width / _COLUMNS, height / _ROWS])
        network = _network()
        network.setInput(cv2.dnn.blobFromImage(_resized(image), 1.0 / 255.0))
        maps: Floats = network.forward()[0]
        self.chances: Floats = 1.0 / (1.0 + np.exp(-maps[0]))
        self.cell_px = scale * _CELL_PX
        peaks = (self.chances > least) & (self.chances >= cv2.dilate(self.chances, _BESIDE))
        rows, columns = np.nonzero(peaks)
        order = np.argsort(-self.chances[rows, columns], kind="stable")[:_MOST]
        rows, columns = rows[order], columns[order]
        middles = np.stack([columns, rows], axis=-1) * _CELL_PX + 0.5 * (_CELL_PX - 1)
        offsets = _OFFSET_PX * maps[1:, rows, columns].T.reshape(-1, 4, 2)
        self.corners: npt.NDArray[np.float64] = (middles[:, None] + offsets + 0.5) * scale - 0.5

    def outside(self, boxes: Sequence[tuple[int, int, int, int]]) -> npt.NDArray[np.float64]:
        """The corners of those whose middle is in no box (column, row, columns, rows), shape (n, 4, 2)."""
        middles = self.corners.mean(axis=1)
        free = np.ones(len(middles), bool)
        for column, row, columns, rows in boxes:
            inside = (middles >= (column, row)) & (middles < (column + columns, row + rows))
            free &= ~inside.all(axis=1)
        kept: npt.NDArray[np.float64] = self.corners[free]
        return kept

    def chance_near(self, column: float, row: float) -> float:
        """The largest chance in the cell of a pixel and those beside it; 1 outside the image."""
        x, y = int(column // self.cell_px[0]), int(row // self.cell_px[1])
        rows, columns = self.chances.shape
        if not (0 <= x < columns and 0 <= y < rows):
            return 1.0
        return float(self.chances[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].max())


def _resized(image: Image) -> Image:
    """An image of the size for which the network was written."""
    if image.shape[:2] == (_ROWS, _COLUMNS):
        return image
    return np.asarray(cv2.resize(image, (_COLUMNS, _ROWS), interpolation=cv2.INTER_AREA), np.uint8)


@cache
def _network() -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(str(Path(__file__).with_name("gates.onnx")))
