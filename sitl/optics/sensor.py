"""From a painted canvas to an image: lens, vignetting, noise, gain and white balance.

A pixel with the value x (0 to 255, linear) has noise of variance read² + shot x. In the variable

    y = 2 / shot (sqrt(shot x + read²) - read)

its standard deviation is 1 for all x (variance-stabilising transform: F. Anscombe, "The transformation of
Poisson, binomial and negative-binomial data", Biometrika, 1948). So noise is added with two tables of 256
numbers and one addition of whole images. It is taken from one pool of normal numbers, from a place that
follows from the time of the exposure: images share numbers, rarely at the same pixels.

The lens is one table for all images. The canvas is painted at twice the image's resolution. Where the lens
does not distort, a pixel of the image lies on the corner of four pixels of the canvas, and linear
interpolation gives their mean: edges are smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.lens import NO_DISTORTION, rays_of_pixels
from scenarios.imaging.effects import CameraEffects
from scenarios.models import Camera
from scenarios.random_numbers import random_stream

Image = npt.NDArray[np.uint8]

SCALE = 2
"""Pixels of the canvas to one of the image, in both directions."""

_SPARE_PX = 4  # of canvas around what is used: OpenCV is not exact at the border of its canvas


class LensMap:
    """The table of a camera's lens.

    Args:
        camera: its size, angle of view and distortion.

    Attributes:
        width_px: of the canvas.
        height_px: of the canvas; the optical axis is in its middle.
        focal_px: of the canvas.
    """

    def __init__(self, camera: Camera) -> None:
        width, height = camera.width_px, camera.height_px
        effects = camera.effects
        coefficients = NO_DISTORTION if effects is None else effects.lens.coefficients
        self.focal_px = SCALE * camera.focal_px
        centre_px = ((width - 1) / 2, (height - 1) / 2)
        rays = rays_of_pixels((width, height), (camera.focal_px,) * 2, centre_px, coefficients)
        places = self.focal_px * rays
        half_x, half_y = np.abs(places).reshape(-1, 2).max(axis=0)
        self.width_px, self.height_px = 2 * (ceil(half_x) + _SPARE_PX), 2 * (ceil(half_y) + _SPARE_PX)
        middle = np.array([(self.width_px - 1) / 2, (self.height_px - 1) / 2])
        at = (places + middle).astype(np.float32)
        self._whole, self._fraction = cv2.convertMaps(at[..., 0], at[..., 1], cv2.CV_16SC2)

    def image(self, canvas: Image) -> Image:
        """What is seen of a canvas, a new image: BGR, shape (height, width, 3)."""
        return np.asarray(cv2.remap(canvas, self._whole, self._fraction, cv2.INTER_LINEAR), np.uint8)


Floats = npt.NDArray[np.float64]
Rgb = tuple[float, float, float]

_MIDDLE = 32  # of the pool's numbers
_SIGNAL = 190.0  # largest number of a signal in the variable y; with noise it fits 8 bits
_FINEST = 20.0  # numbers to one standard deviation; more are of no use
_SPARE = 1 << 17  # different places in the pool
_GOLDEN = 0x9E3779B97F4A7C15
_GRID = 8  # every eighth pixel is metered
_LEVELS = np.arange(256.0)


class SensorChain:
    """The chain of one camera.

    Args:
        camera: with effects.
        seed: of the noise.
    """

    def __init__(self, camera: Camera, seed: int) -> None:
        self._effects = effects = camera.effects or CameraEffects()
        shape = (camera.height_px, camera.width_px, 3)
        self._light = _light_map(shape, effects)
        self._noise = None
        if effects.read_noise > 0.0 or effects.shot_noise > 0.0:
            self._noise = _Noise(effects, shape, seed)
        self._fixed: Image | None = None
        if effects.gain == "fixed" and effects.white_balance == "fixed":
            red, green, blue = (effects.fixed_gain * share for share in effects.balance_rgb)
            self._fixed = self._table(np.array([blue, green, red]))

    def develop(self, light: Image, time_us: int) -> Image:
        """The image of one exposure.

        Args:
            light: behind the lens, BGR, shape (height, width, 3); it may be overwritten.
            time_us: of the exposure, which chooses the noise.
        """
        if self._light is not None:
            cv2.multiply(light, self._light, dst=light, scale=1.0 / 255.0)
        table = self._fixed
        if table is None:
            table = self._table(self._regulated(light))
        if self._noise is not None:
            self._noise.add_to(light, time_us)
        elif table is _IDENTITY:
            return light
        return np.asarray(cv2.LUT(light, table, dst=light), np.uint8)

    def _regulated(self, light: Image) -> Floats:
        """Gains of blue, green and red by the image's own brightness and colour."""
        effects = self._effects
        red, green, blue = effects.balance_rgb
        gains = np.array([blue, green, red])
        means = light[_GRID // 2 :: _GRID, _GRID // 2 :: _GRID].mean(axis=(0, 1)) + 1.0
        if effects.white_balance == "auto":
            gains = (means[1] / means) ** effects.auto_balance
        brightness = float((gains * means).mean())
        if effects.gain == "auto":
            return gains * min(effects.max_gain, effects.auto_mean / brightness)
        return gains * effects.fixed_gain

    def _table(self, gains_bgr: Floats) -> Image:
        """From what is in an image after noise was added to what it shows."""
        if self._noise is None and np.all(gains_bgr == 1.0):
            return _IDENTITY
        levels = _LEVELS if self._noise is None else self._noise.levels
        table = np.rint(levels[:, None] * gains_bgr)
        return np.clip(table, 0.0, 255.0).astype(np.uint8).reshape(256, 1, 3)


_IDENTITY: Image = np.empty(0, np.uint8)


@dataclass(frozen=True, slots=True)
class _Tables:
    """The transform, scaled, and back."""

    forward: Image
    levels: Floats  # of the values of transform and noise
    step: float  # how much one standard deviation is


class _Noise:
    """Noise of one sensor."""

    def __init__(self, effects: CameraEffects, shape: tuple[int, int, int], seed: int) -> None:
        self._tables = tables = _stabilising(effects)
        self.levels = tables.levels
        self._shape, self._size = shape, shape[0] * shape[1] * shape[2]
        numbers = random_stream(seed, "camera.noise").standard_normal(self._size + _SPARE, np.float32)
        numbers *= np.float32(tables.step)
        numbers += np.float32(_MIDDLE)
        self._pool = np.clip(np.rint(numbers), 0, 2 * _MIDDLE).astype(np.uint8)

    def add_to(self, light: Image, time_us: int) -> None:
        """Transform an image in place and add noise."""
        cv2.LUT(light, self._tables.forward, dst=light)
        # Multiplicative hashing: neighbouring times are far apart in the pool.
        start = ((time_us * _GOLDEN) & (2**64 - 1)) >> 47
        noise = self._pool[start : start + self._size].reshape(self._shape)
        cv2.add(light, noise, dst=light)


def _stabilising(effects: CameraEffects) -> _Tables:
    read = effects.read_noise
    shot = effects.shot_noise**2 / 255.0
    stable = _LEVELS / read if shot == 0.0 else 2.0 / shot * (np.sqrt(shot * _LEVELS + read * read) - read)
    step = min(_FINEST, _SIGNAL / stable[-1])
    forward = np.rint(step * stable).astype(np.uint8)
    back = (_LEVELS - _MIDDLE) / step
    # Below black the curve goes on as a straight line, and is cut off when it becomes a number of an image.
    bent = np.maximum(back, 0.0)
    levels = read * back + shot * bent * bent / 4.0
    return _Tables(forward, levels, step)


def _light_map(shape: tuple[int, int, int], effects: CameraEffects) -> Image | None:
    """The light at each pixel, of 255; None if it is all of it everywhere."""
    if effects.vignetting == 0.0 and effects.illumination == 1.0 and effects.light_rgb == (1.0, 1.0, 1.0):
        return None
    height, width, _ = shape
    rows, columns = np.mgrid[0:height, 0:width]
    right, down = columns - (width - 1) / 2, rows - (height - 1) / 2
    corner = ((width - 1) / 2) ** 2 + ((height - 1) / 2) ** 2
    share = 1.0 - effects.vignetting * (right * right + down * down) / corner
    red, green, blue = effects.light_rgb
    colours = effects.illumination * np.array([blue, green, red]) / max(effects.light_rgb)
    light: Image = np.rint(255.0 * share[..., None] * colours).astype(np.uint8)
    return light
