"""Random parts of images of a data set, changed as cameras do, and what the network is to say of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np
import numpy.typing as npt

CELL_PX, OFFSET_PX = 4, 16.0
"""Pixels of a cell of the maps, and the unit of the corners' offsets."""
_MIRRORED = [1, 0, 3, 2]  # corners after left and right are exchanged

Image = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Images, shape (n, 3, rows, columns), 0..1, and the targets of `network.loss_of`."""

    images: Floats
    heat: Floats
    weight: Floats
    offsets: Floats
    size: Floats


def draw_batch(
    images: Image, gates: Floats, count: int, size: tuple[int, int], stream: np.random.Generator
) -> Batch:
    """Draw parts of images.

    Args:
        images: shape (n, rows, columns, 3).
        gates: of each, as `scenes.rows_of` gives them, shape (n, k, 9).
        count: how many.
        size: rows and columns of the parts.
        stream: of random numbers.
    """
    rows, columns = size[0] // CELL_PX, size[1] // CELL_PX
    batch = Batch(
        np.zeros((count, 3, *size), np.float32),
        np.zeros((count, rows, columns), np.float32),
        np.ones((count, rows, columns), np.float32),
        np.zeros((count, 8, rows, columns), np.float32),
        np.zeros((count, rows, columns), np.float32),
    )
    for k in range(count):
        n = int(stream.integers(len(images)))
        part, seen = _part(images[n], gates[n], size, stream)
        part, seen = _changed(part, seen, stream)
        batch.images[k] = part.transpose(2, 0, 1) / np.float32(255.0)
        for gate in seen:
            _mark(batch, k, gate)
    return batch


def _part(
    image: Image, gates: Floats, size: tuple[int, int], stream: np.random.Generator
) -> tuple[Image, Floats]:
    """A part of an image, often around a gate, perhaps stretched; the gates move with it."""
    height, width = image.shape[:2]
    gates = gates[gates[:, 0] != 0.0].copy()
    scale = np.exp(stream.uniform(0.0, 0.25, 2)) if stream.random() < 0.5 else np.ones(2)
    columns, rows = min(width, size[1] / scale[0]), min(height, size[0] / scale[1])
    left, top = stream.uniform(0, width - columns), stream.uniform(0, height - rows)
    if len(gates) and stream.random() < 0.75:
        centre = gates[int(stream.integers(len(gates))), 1:].reshape(4, 2).mean(axis=0)
        left, top = centre - stream.uniform(0.1, 0.9, 2) * (columns, rows)
    left, top = float(np.clip(left, 0, width - columns)), float(np.clip(top, 0, height - rows))
    if columns != size[1] or rows != size[0]:
        across, down = size[1] / columns, size[0] / rows
        matrix = np.array([[across, 0, -left * across], [0, down, -top * down]])
        part = cv2.warpAffine(image, matrix, size[::-1], flags=cv2.INTER_LINEAR)
    else:
        left, top = round(left), round(top)
        across = down = 1.0
        part = image[top : top + size[0], left : left + size[1]]
    gates[:, 1::2] = (gates[:, 1::2] - left) * across
    gates[:, 2::2] = (gates[:, 2::2] - top) * down
    return np.asarray(part, np.uint8), gates


def _changed(part: Image, gates: Floats, stream: np.random.Generator) -> tuple[Image, Floats]:
    """Mirrored, channels exchanged, lighter or darker, with noise and compressed: each sometimes."""
    if stream.random() < 0.5:
        part = part[:, ::-1]
        gates = gates.copy()
        gates[:, 1::2] = part.shape[1] - 1 - gates[:, 1::2]
        gates[:, 1:] = gates[:, 1:].reshape(-1, 4, 2)[:, _MIRRORED].reshape(-1, 8)
    if stream.random() < 0.3:
        part = part[:, :, stream.permutation(3)]
    part = np.ascontiguousarray(part)
    if stream.random() < 0.5:
        part = cv2.convertScaleAbs(part, alpha=stream.uniform(0.6, 1.3))
    if stream.random() < 0.4:
        noise = stream.normal(0.0, stream.uniform(0.5, 4.0), part.shape).astype(np.float32)
        part = np.clip(part + noise, 0, 255).astype(np.uint8)
    if stream.random() < 0.5:
        chroma = [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
        quality = int(stream.integers(65, 97))
        _, data = cv2.imencode(".jpg", part, [cv2.IMWRITE_JPEG_QUALITY, quality, *chroma])
        part = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return np.asarray(part, np.uint8), gates


def _mark(batch: Batch, k: int, gate: Floats) -> None:
    """Mark one gate in the targets of an image."""
    rows, columns = batch.heat.shape[1:]
    corners = gate[1:].reshape(4, 2)
    centre = corners.mean(axis=0)
    column, row = int(centre[0] // CELL_PX), int(centre[1] // CELL_PX)
    spans = corners.max(axis=0) - corners.min(axis=0)
    reach = np.maximum(0.16 * spans / CELL_PX, 0.7)  # standard deviations in cells
    if not (0 <= column < columns and 0 <= row < rows):
        return
    x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
    heat = np.exp(-0.5 * (((x - column) / reach[0]) ** 2 + ((y - row) / reach[1]) ** 2))
    if gate[0] < 0.0:
        batch.weight[k][heat > 0.05] = 0.0
        return
    nearer = (heat > 0.1) & (heat > batch.heat[k])
    batch.heat[k] = np.maximum(batch.heat[k], heat)
    batch.weight[k, row, column] = 1.0
    middles = np.stack(np.broadcast_arrays(x, y), axis=-1)[None] * CELL_PX + 0.5 * (CELL_PX - 1)
    offsets = (corners[:, None, None] - middles) / OFFSET_PX  # (4, rows, columns, 2)
    moved = offsets.transpose(0, 3, 1, 2).reshape(8, rows, columns)
    batch.offsets[k][:, nearer] = moved[:, nearer]
    batch.size[k][nearer] = hypot(*spans.tolist()) / OFFSET_PX
