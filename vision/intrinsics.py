"""The pinhole model: focal length and camera matrix from the angle of view."""

from __future__ import annotations

from math import tan

import numpy as np
import numpy.typing as npt


def focal_length_px(width_px: int, horizontal_fov_rad: float) -> float:
    """Focal length of an ideal pinhole camera, pixels.

    Args:
        width_px: width of the image.
        horizontal_fov_rad: angle between its left and right border, 0..pi.
    """
    return width_px / 2 / tan(horizontal_fov_rad / 2)


def camera_matrix(width_px: int, height_px: int, horizontal_fov_rad: float) -> npt.NDArray[np.float64]:
    """OpenCV's camera matrix of an ideal pinhole camera with square pixels.

    OpenCV counts pixels from 0 and puts whole numbers on pixel *centres*, so the middle of an image of w
    columns is (w - 1) / 2.

    Returns:
        [[f, 0, cx], [0, f, cy], [0, 0, 1]], shape (3, 3), pixels.
    """
    focal_px = focal_length_px(width_px, horizontal_fov_rad)
    return np.array(
        [[focal_px, 0.0, (width_px - 1) / 2], [0.0, focal_px, (height_px - 1) / 2], [0.0, 0.0, 1.0]]
    )
