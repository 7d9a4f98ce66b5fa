"""A photograph behind everything, so far away that it turns with the camera but does not move.

Whatever the camera's attitude, each of its rays meets one place of the photograph: two images of the same
camera centre differ by a homography (R. Hartley, A. Zisserman, "Multiple View Geometry", 2004, section 8.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import RotationRows
from sitl.camera_projection import Pinhole

Image = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Backdrop:
    """A photograph, and the camera that took it.

    Attributes:
        photograph: BGR, shape (height, width, 3); beyond its border it is mirrored.
        focal_px: focal length; its optical axis is in the middle.
        rotation: rows of the matrix from forward, left, up of that camera to arena axes.
    """

    photograph: Image
    focal_px: float
    rotation: RotationRows

    def paint(self, canvas: Image, rotation: RotationRows, pinhole: Pinhole) -> None:
        """Fill a canvas with what another camera at the same place sees of it.

        Args:
            canvas: BGR, shape (height, width, 3).
            rotation: rows of the matrix from forward, left, up of that camera to arena axes.
            pinhole: of the canvas.
        """
        height, width = self.photograph.shape[:2]
        own = _rays_to_pixels(self.focal_px, ((width - 1) / 2, (height - 1) / 2))
        other = _rays_to_pixels(pinhole.focal_px, pinhole.centre_px)
        homography = own @ np.array(self.rotation).T @ np.array(rotation) @ np.linalg.inv(other)
        rows, columns = canvas.shape[:2]
        cv2.warpPerspective(
            self.photograph,
            homography,
            (columns, rows),
            dst=canvas,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REFLECT_101,
        )


def _rays_to_pixels(focal_px: float, centre_px: tuple[float, float]) -> Floats:
    """From a ray, forward, left, up, to a column and a row, homogeneous."""
    column, row = centre_px
    return np.array([[column, -focal_px, 0.0], [row, 0.0, -focal_px], [1.0, 0.0, 0.0]])
