"""From a painted canvas to the image behind a distorting lens, by one table for all images.

The canvas is painted at twice the image's resolution. Where the lens does not distort, a pixel of the image
lies on the corner of four pixels of the canvas, and linear interpolation gives their mean: edges are smooth.
"""

from __future__ import annotations

from math import ceil

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.lens import NO_DISTORTION, rays_of_pixels
from scenarios.models import Camera

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
