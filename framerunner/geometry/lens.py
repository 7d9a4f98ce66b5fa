"""Lens distortion: the Brown-Conrady model with OpenCV's coefficients, and its inverse.

OpenCV has both, too; the inverse under different names and with different accuracy from version to version.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Coefficients = tuple[float, float, float, float, float]
"""k1, k2, p1, p2, k3."""

Number = TypeVar("Number", float, Floats)
NO_DISTORTION: Coefficients = (0.0, 0.0, 0.0, 0.0, 0.0)
_COARSE_PX = 8
_EXACT = 1e-12


def distorted(x: Number, y: Number, lens: Coefficients) -> tuple[Number, Number]:
    """Where a ray is seen, or many.

    Args:
        x: right of the optical axis, over the depth; a number or an array.
        y: below it, over the depth.
        lens: its coefficients.

    Returns:
        The place in the image, right and down, in focal lengths.
    """
    k1, k2, p1, p2, k3 = lens
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    both = 2.0 * x * y
    return (
        x * radial + p1 * both + p2 * (square + 2.0 * x * x),
        y * radial + p1 * (square + 2.0 * y * y) + p2 * both,
    )


@lru_cache(maxsize=4)
def rays_of_pixels(
    size_px: tuple[int, int],
    focal_px: tuple[float, float],
    centre_px: tuple[float, float],
    lens: Coefficients,
) -> Floats:
    """The rays of all pixels of an image.

    Args:
        size_px: columns and rows.
        focal_px: focal length in columns and in rows.
        centre_px: column and row of the optical axis; whole numbers are pixel centres.
        lens: its coefficients.

    Returns:
        Right and down over the depth, shape (rows, columns, 2). Do not write to it.
    """
    columns, rows = (np.arange(count, dtype=np.float64) for count in size_px)
    places = np.stack(np.meshgrid(columns, rows), axis=-1)
    places = (places - np.array(centre_px)) / np.array(focal_px)
    if lens == NO_DISTORTION:
        return np.asarray(places)
    # Between a few exact rays, interpolation comes so near that one step of Newton's method is enough.
    at_columns, at_rows = (
        np.unique(np.linspace(0, count - 1, max(count // _COARSE_PX, 2)).round().astype(int))
        for count in size_px
    )
    coarse = undistorted(places[np.ix_(at_rows, at_columns)], lens)
    along = np.stack(
        [[np.interp(columns, at_columns, line) for line in coarse[..., axis]] for axis in (0, 1)], axis=-1
    )
    share = np.interp(rows, at_rows, np.arange(len(at_rows)))
    first = np.minimum(share.astype(int), len(at_rows) - 2)
    share = (share - first)[:, None, None]
    guess = (1.0 - share) * along[first] + share * along[first + 1]
    return undistorted(places, lens, guess, max_steps=1)


def undistorted(
    places: Floats, lens: Coefficients, guess: Floats | None = None, max_steps: int = 50
) -> Floats:
    """Which rays are seen at places of an image, by Newton's method.

    Args:
        places: right and down, in focal lengths, shape (..., 2).
        lens: its coefficients; every place must belong to one ray.
        guess: rays to begin with, shape (..., 2).
        max_steps: of the method, which ends when steps are very small.

    Returns:
        Right and down over the depth, shape (..., 2).
    """
    k1, k2, p1, p2, k3 = lens
    u, v = places[..., 0], places[..., 1]
    x, y = (u, v) if guess is None else (guess[..., 0], guess[..., 1])
    for _ in range(max_steps):
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        slope = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3))  # of the radial factor, over r
        both = 2.0 * x * y
        error_x = x * radial + p1 * both + p2 * (square + 2.0 * x * x) - u
        error_y = y * radial + p1 * (square + 2.0 * y * y) + p2 * both - v
        xx = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        xy = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        yy = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        det = xx * yy - xy * xy
        step_x, step_y = (yy * error_x - xy * error_y) / det, (xx * error_y - xy * error_x) / det
        x, y = x - step_x, y - step_y
        if max(np.abs(step_x).max(initial=0.0), np.abs(step_y).max(initial=0.0)) < _EXACT:
            break
    return np.stack([x, y], axis=-1)
