"""The colours of real gates, learnt from swatches: a matrix that makes them as pure as the detector wants.

The detector of gates knows red, green and blue by comparing channels, whatever the brightness. Paint, lamps
and a camera's own processing mix the channels. A linear map of them undoes most of that, as the colour
correction of any camera does; it keeps grey grey, so that walls and floor do not take on colour.
"""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
import numpy.typing as npt

from vision.calibration.model import CalibrationError, ColourMatrix
from vision.colour_regions import PRIMARIES, find_colours
from vision.types import Image

_CHANNEL = {"blue": 0, "green": 1, "red": 2}
_MIN_SEEN = 0.98
_TOO_DARK, _TOO_BRIGHT = 40.0, 250.0
_MAX_GAIN = 6.0
_STEPS, _MARGIN = 20, 2
_MIDDLE = 0.2  # of width and height

Matrix = npt.NDArray[np.float64]


def swatch_of(image: Image) -> Image:
    """The middle of an image, a fifth of its width and height, which the swatch must fill."""
    height, width = image.shape[:2]
    rows, columns = (min(size, max(8, round(_MIDDLE * size))) for size in (height, width))
    top, left = (height - rows) // 2, (width - columns) // 2
    return image[top : top + rows, left : left + columns]


def learn_colours(swatches: Mapping[str, Image]) -> ColourMatrix:
    """Find the matrix.

    Args:
        swatches: an image of nothing but the colour for each of red, green and blue, BGR.

    Returns:
        Three rows of three, by which BGR is multiplied; each row's sum is one.

    Raises:
        CalibrationError: a swatch is missing, too dark or too bright, the colours are too much alike, or a
            swatch would not be seen as its colour.
    """
    missing = [colour for colour in PRIMARIES if colour not in swatches]
    if missing:
        raise CalibrationError(f"{missing[0]}: no swatch; give one each of {', '.join(PRIMARIES)}")
    seen = np.array([np.median(swatches[colour].reshape(-1, 3), axis=0) for colour in PRIMARIES])
    for colour, values in zip(PRIMARIES, seen, strict=True):
        brightest = float(values.max())
        if not _TOO_DARK <= brightest <= _TOO_BRIGHT:
            how = "dark; give it more light" if brightest < _TOO_DARK else "bright; give it less light"
            raise CalibrationError(
                f"{colour}: the swatch's brightest channel is {brightest:.0f} of 255, too {how}"
            )
    matrix = _fitted(seen)
    if np.abs(matrix).max() > _MAX_GAIN:
        raise CalibrationError(
            "the swatches' colours are too much alike; is each one in the middle of its image?"
        )
    shares: dict[str, float] = {}
    for step in range(_STEPS + 1):  # the weakest correction that does amplifies the noise least
        mixed = np.eye(3) + min(1.0, (step + _MARGIN) / _STEPS) * (matrix - np.eye(3))
        rows: ColourMatrix = tuple(map(tuple, np.round(mixed, 4).tolist()))  # type: ignore[assignment]
        shares = {colour: share_seen(correct_colours(swatches[colour], rows), colour) for colour in PRIMARIES}
        if min(shares.values()) >= _MIN_SEEN:
            return rows
    colour = min(shares, key=lambda each: shares[each])
    raise CalibrationError(
        f"{colour}: only {shares[colour]:.0%} of the swatch would be seen as {colour}; "
        "use purer paint or whiter light"
    )


def share_seen(swatch: Image, colour: str) -> float:
    """What part of a swatch the detector takes for a colour, 0 to 1."""
    for found in find_colours(np.ascontiguousarray(swatch)):
        if found.colour == colour:
            return float(np.count_nonzero(found.mask)) / found.mask.size
    return 0.0


def correct_colours(image: Image, matrix: ColourMatrix) -> Image:
    """Apply a matrix to an image, BGR."""
    return np.asarray(cv2.transform(image, np.asarray(matrix)), np.uint8)


def _fitted(seen: Matrix) -> Matrix:
    """Least squares of rows (a, b, c) with a + b + c = 1: of each channel less one of the others."""
    rows = np.empty((3, 3))
    for channel in range(3):
        others = [index for index in range(3) if index != channel]
        wanted = np.array(
            [
                values.max() if _CHANNEL[colour] == channel else 0.0
                for colour, values in zip(PRIMARIES, seen, strict=True)
            ]
        )
        differences = seen[:, others] - seen[:, [channel]]
        weights, *_ = np.linalg.lstsq(differences, wanted - seen[:, channel], rcond=None)
        rows[channel, others] = weights
        rows[channel, channel] = 1.0 - weights.sum()
    return rows
