"""The pinhole model: OpenCV's camera matrix from the angle of view."""

from __future__ import annotations

from math import tan

import numpy as np
import numpy.typing as npt


def camera_matrix(width_px: int, height_px: int, horizontal_fov_rad: float) -> npt.NDArray[np.float64]:
    """Camera matrix of an ideal pinhole camera: [[f, 0, cx], [0, f, cy], [0, 0, 1]], pixels.

    OpenCV counts pixels from 0 and puts whole numbers on pixel *centres*, so the middle of an image of w
    columns is (w - 1) / 2.
    """
    focal_px = width_px / 2 / tan(horizontal_fov_rad / 2)
    cx, cy = (width_px - 1) / 2, (height_px - 1) / 2
    return np.array([[focal_px, 0.0, cx], [0.0, focal_px, cy], [0.0, 0.0, 1.0]])
