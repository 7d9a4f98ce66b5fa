"""Patterns of floors and walls, drawn from a seed: seamless tiles of eight by eight metres.

All noise is that of a periodic lattice of random numbers with cubic interpolation (value noise: D. Ebert et
al., "Texturing and Modeling", 2003, section 2.8), so that a tile continues itself at its edges.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt

from scenarios.imaging.textures import Pattern
from scenarios.random_numbers import random_stream

if TYPE_CHECKING:
    from numpy.random import Generator

Image = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.floating]
Bgr = tuple[float, float, float]

TILE_M = 8.0
TILE_PX = 1024

_WOODS_BGR: tuple[Bgr, ...] = ((92, 142, 186), (120, 166, 200), (58, 88, 126), (104, 150, 178))
_CARPETS_BGR: tuple[Bgr, ...] = ((116, 98, 84), (82, 82, 84), (88, 104, 92), (78, 84, 118), (120, 132, 140))
_BRICKS_BGR: tuple[Bgr, ...] = ((92, 108, 164), (150, 170, 182), (188, 196, 200))
_CONCRETE_BGR: Bgr = (150, 154, 156)
_MORTAR_BGR: Bgr = (172, 176, 178)
_PLANK_ROWS, _PLANKS_A_ROW = 64, 6
_CARPET_TILES = 16
_BRICK_ROWS, _BRICKS_A_ROW = 96, 32


def pattern_tile(pattern: Pattern, seed: int) -> Image:
    """Draw a tile: BGR, shape (TILE_PX, TILE_PX, 3)."""
    stream = random_stream(seed, f"texture.{pattern}")
    colour = _DRAWN[pattern](stream)
    return np.clip(np.rint(colour), 0.0, 255.0).astype(np.uint8)


def _wood(stream: Generator) -> Floats:
    """Planks along the first axis, with the grain along them."""
    row_px = TILE_PX // _PLANK_ROWS
    base = _chosen(_WOODS_BGR, stream)
    tone = np.empty((TILE_PX, TILE_PX), np.float32)
    ends = np.zeros((TILE_PX, TILE_PX), np.bool_)
    length_px = TILE_PX / _PLANKS_A_ROW
    for row in range(_PLANK_ROWS):
        band = slice(row * row_px, (row + 1) * row_px)
        shift = stream.random() * TILE_PX
        along = ((np.arange(TILE_PX) + shift) % TILE_PX) / length_px
        tones = stream.random(_PLANKS_A_ROW).astype(np.float32)
        tone[band] = tones[along.astype(np.int64) % _PLANKS_A_ROW]
        ends[band, along * length_px % length_px < 1.0] = True
    grain = _noise(stream, (512, 24)) + 0.7 * _noise(stream, (512, 96))
    share = 0.86 + 0.22 * tone + 0.05 * grain
    share[np.arange(TILE_PX) % row_px < 1] *= 0.72
    share[ends] *= 0.72
    colour: Floats = share[..., None] * base
    return colour


def _concrete(stream: Generator) -> Floats:
    """Stains of all sizes, pores, and a joint every two metres."""
    stains = sum(
        weight * _noise(stream, (cells, cells)) for cells, weight in ((8, 1.0), (24, 0.7), (80, 0.5))
    )
    share = 0.94 + 0.055 * stains + 0.025 * _noise(stream, (512, 512))
    pores = _noise(stream, (512, 512)) > 2.1
    share[pores] *= 0.8
    joint = np.arange(TILE_PX) % (TILE_PX // 4) < 2
    share[joint] *= 0.7
    share[:, joint] *= 0.7
    tint = 1.0 + 0.08 * (stream.random(3).astype(np.float32) - 0.5)
    colour: Floats = share[..., None] * (np.array(_CONCRETE_BGR, np.float32) * tint)
    return colour


def _carpet(stream: Generator) -> Floats:
    """Tiles of half a metre whose pile lies one way or the other."""
    base = _chosen(_CARPETS_BGR, stream)
    tiles = stream.random((_CARPET_TILES, _CARPET_TILES)).astype(np.float32)
    checked = np.add.outer(np.arange(_CARPET_TILES), np.arange(_CARPET_TILES)) % 2
    tone = np.kron(0.9 + 0.1 * checked + 0.08 * tiles, np.ones((TILE_PX // _CARPET_TILES,) * 2))
    pile = (
        0.09 * _noise(stream, (512, 512))
        + 0.06 * _noise(stream, (256, 256))
        + 0.04 * _noise(stream, (48, 48))
    )
    colour: Floats = (tone.astype(np.float32) + pile)[..., None] * base
    return colour


def _brick(stream: Generator) -> Floats:
    """Bricks in mortar, each row half a brick beside the next one."""
    rows = np.arange(TILE_PX) * _BRICK_ROWS / TILE_PX
    columns = np.arange(TILE_PX) * _BRICKS_A_ROW / TILE_PX
    row = rows.astype(np.int64)
    place = (columns[None, :] + 0.5 * (row[:, None] % 2)) % _BRICKS_A_ROW
    tones = stream.random((_BRICK_ROWS, _BRICKS_A_ROW)).astype(np.float32)
    share = 0.85 + 0.25 * tones[row[:, None], place.astype(np.int64)]
    share += 0.05 * _noise(stream, (192, 192)) + 0.03 * _noise(stream, (512, 512))
    joints = ((rows % 1.0) < 0.13)[:, None] | ((place % 1.0) < 0.04)
    colour = share[..., None] * _chosen(_BRICKS_BGR, stream)
    mortar = (1.0 + 0.04 * _noise(stream, (256, 256)))[..., None] * np.array(_MORTAR_BGR, np.float32)
    return np.where(joints[..., None], mortar, colour)


def _chosen(colours: tuple[Bgr, ...], stream: Generator) -> Floats:
    return np.array(colours[int(stream.random() * len(colours))], np.float32)


def _noise(stream: Generator, cells: tuple[int, int]) -> Floats:
    """Periodic noise with the mean 0 and the standard deviation 1, shape (TILE_PX, TILE_PX).

    Args:
        stream: of random numbers.
        cells: of the lattice, rows and columns.
    """
    lattice = stream.random(cells).astype(np.float32)
    spare = 2  # cells that the interpolation looks at beyond the edges
    around = np.pad(lattice, spare, mode="wrap")
    scale_y, scale_x = TILE_PX / cells[0], TILE_PX / cells[1]
    size = (round(around.shape[1] * scale_x), round(around.shape[0] * scale_y))
    wide = cv2.resize(around, size, interpolation=cv2.INTER_CUBIC)
    top, left = round(spare * scale_y), round(spare * scale_x)
    noise: Floats = wide[top : top + TILE_PX, left : left + TILE_PX]
    normal: Floats = (noise - noise.mean()) / noise.std()
    return normal


_DRAWN: dict[Pattern, Callable[[Generator], Floats]] = {
    "wood": _wood,
    "concrete": _concrete,
    "carpet": _carpet,
    "brick": _brick,
}
