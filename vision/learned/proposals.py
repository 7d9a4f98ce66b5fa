"""Where a network sees gates in an image: first estimates of their corners.

The network is trained by `training/gates` (`card.md`) and run by OpenCV. It does not know colours or sizes of
gates.
"""

from __future__ import annotations

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
_MOST = 5


class GateProposals:
    """What the network says of one image.

    Attributes:
        corners: upper left, upper right, lower right and lower left of the outlines of proposed gates,
            columns and rows of the image, shape (n, 4, 2), the likelier one first.
    """

    def __init__(self, image: Image, least: float, network: cv2.dnn.Net | None = None) -> None:
        height, width = image.shape[:2]
        scale = np.array([width / _COLUMNS, height / _ROWS])
        network = _network() if network is None else network
        maps: Floats = run_network(network, _resized(image))[0]
        chances: Floats = 1.0 / (1.0 + np.exp(-maps[0]))
        peaks = (chances > least) & (chances >= cv2.dilate(chances, _BESIDE))
        rows, columns = np.nonzero(peaks)
        order = np.argsort(-chances[rows, columns], kind="stable")[:_MOST]
        rows, columns = rows[order], columns[order]
        middles = np.stack([columns, rows], axis=-1) * _CELL_PX + 0.5 * (_CELL_PX - 1)
        offsets = _OFFSET_PX * maps[1:, rows, columns].T.reshape(-1, 4, 2)
        self.corners: npt.NDArray[np.float64] = (middles[:, None] + offsets + 0.5) * scale - 0.5


def _resized(image: Image) -> Image:
    """An image of the size for which the network was written."""
    if image.shape[:2] == (_ROWS, _COLUMNS):
        return image
    return np.asarray(cv2.resize(image, (_COLUMNS, _ROWS), interpolation=cv2.INTER_AREA), np.uint8)


def read_network(path: Path) -> cv2.dnn.Net:
    """A network of a file of ONNX."""
    return cv2.dnn.readNetFromONNX(str(path), cv2.dnn.ENGINE_CLASSIC)


def run_network(network: cv2.dnn.Net, image: Image) -> Floats:
    """What a network gives for an image of the size for which it was written; channels are 0..1 to it.

    `blobFromImage` does the same in almost the time that the larger network takes.
    """
    planes = np.empty((3, *image.shape[:2]), np.uint8)
    cv2.split(image, list(planes))
    network.setInput(np.multiply(planes, np.float32(1.0 / 255.0), dtype=np.float32)[None])
    return np.asarray(network.forward(), np.float32)


@cache
def _network() -> cv2.dnn.Net:
    return read_network(Path(__file__).with_name("gates.onnx"))
