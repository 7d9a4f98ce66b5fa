"""Which proposals are gates, and where their corners are: a network that sees each of them enlarged.

The network is trained by `training/gates/judge.py` (`card.md`) and run by OpenCV.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from vision.learned.crops import AROUND, FAR_AROUND, GRID_COLUMNS, GRID_ROWS, Box, box_around, cut_out
from vision.learned.proposals import GateProposals, read_network, run_network
from vision.types import Image

Floats = npt.NDArray[np.float64]
Outline = Floats
"""Upper left, upper right, lower right and lower left corner, columns and rows of the image, shape (4, 2)."""
Outlines = Floats
"""Several of them, shape (n, 4, 2)."""

_LEAST_PROPOSED = 0.2  # chance by the other network of what is looked at
_LEAST_FIRST = 0.03  # at first sight
LEAST_CHANCE = 0.15
"""Something is no gate if its chance is smaller."""


def find_outlines(image: Image) -> tuple[Floats, Outlines]:
    """Find what may be gates.

    Args:
        image: BGR, shape (height, width, 3), uint8.

    Returns:
        The chance of each to be one, shape (n,), the largest first, and where it is.
    """
    chances, corners = judge(image, GateProposals(image, _LEAST_PROPOSED).corners, FAR_AROUND)
    # Looked at where it is, it is judged better.
    chances, corners = judge(image, corners[chances > _LEAST_FIRST])
    kept: list[int] = []
    for k in np.argsort(-chances, kind="stable").tolist():
        if chances[k] > LEAST_CHANCE and not any(_overlap(corners[k], corners[other]) for other in kept):
            kept.append(k)
    return chances[kept], corners[kept]


def judge(image: Image, outlines: Outlines, around: float = AROUND) -> tuple[Floats, Outlines]:
    """Look at proposals.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        outlines: where.
        around: size of what is looked at, by theirs.

    Returns:
        The chance of each to be a gate, shape (n,), and where it is.
    """
    if not len(outlines):
        return np.zeros(0), outlines
    boxes = [box_around(outline, around) for outline in outlines]
    network = _network()
    # One after the other: for another number of crops OpenCV would plan its memory anew.
    numbers = np.array([run_network(network, cut_out(image, box))[0] for box in boxes], np.float64)
    chances: Floats = 1.0 / (1.0 + np.exp(-numbers[:, 0]))
    return chances, _corners(numbers[:, 1:].reshape(-1, 4, GRID_ROWS * GRID_COLUMNS), boxes)


def _corners(logits: Floats, boxes: list[Box]) -> Outlines:
    """Corners in the image, by how likely each is in each cell of a crop: the means of these."""
    weights = np.exp(logits - logits.max(axis=2, keepdims=True))
    weights /= weights.sum(axis=2, keepdims=True)
    columns, rows = np.meshgrid(np.arange(GRID_COLUMNS), np.arange(GRID_ROWS))
    cells = np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=-1) / (GRID_COLUMNS, GRID_ROWS)
    of_image = np.array(boxes)[:, None]
    corners: Floats = of_image[..., :2] + weights @ cells * of_image[..., 2:]
    return corners


def _overlap(one: Floats, other: Floats) -> bool:
    """Whether the centre of one outline is inside another, or the other way round."""
    return any(
        cv2.pointPolygonTest(a.astype(np.float32), tuple(b.mean(axis=0).tolist()), False) >= 0
        for a, b in ((one, other), (other, one))
    )


@cache
def _network() -> cv2.dnn.Net:
    return read_network(Path(__file__).with_name("judge.onnx"))
