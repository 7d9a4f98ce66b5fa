"""Between the pixels of a calibrated camera and those of an ideal one with the same focal length.

Points are corrected, not images. Pixels of the image count from its middle; ideal ones from the optical axis.
What is measured in an image lies on pixels or half-way between them, where the interpolated table is exact to
a thousandth of a pixel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from framerunner.geometry.lens import distorted, rays_of_pixels
from vision.calibration.model import Calibration, CalibrationError
from vision.types import Detection

Floats = npt.NDArray[np.float64]


class Lens:
    """The lens of a calibrated camera.

    Args:
        calibration: of images of one size.

    Attributes:
        size_px: columns and rows of these images.
        focal_px: of the ideal camera.
        readout_s: of its rolling shutter; 0: it has none.
    """

    def __init__(self, calibration: Calibration) -> None:
        self.size_px = (calibration.width_px, calibration.height_px)
        self.focal_px = calibration.fx_px
        self.readout_s = calibration.readout_s
        self._focals_px = (calibration.fx_px, calibration.fy_px)
        self._coefficients = calibration.distortion
        width, height = self.size_px
        self._middle = np.array([(width - 1) / 2, (height - 1) / 2])
        axis_px = (calibration.cx_px, calibration.cy_px)
        self._axis_from_middle = (axis_px[0] - (width - 1) / 2, axis_px[1] - (height - 1) / 2)
        rays = rays_of_pixels(self.size_px, self._focals_px, axis_px, calibration.distortion)
        # Complex numbers, right + i down, so that one look-up gives both.
        self._table = (self.focal_px * rays).view(np.complex128).reshape(-1)
        self._limits = np.array([width - 2, height - 2])

    def check_size(self, width_px: int, height_px: int) -> None:
        """Refuse images of another size with a `CalibrationError`."""
        if (width_px, height_px) != self.size_px:
            width, height = self.size_px
            raise CalibrationError(
                f"camera: its images have {width_px} x {height_px} pixels, but the calibration is of "
                f"{width} x {height}; calibrate it with images as it gives them in flight"
            )

    def ideal(self, places: Floats) -> Floats:
        """Pixels of an ideal camera, for pixels of the image; both shape (..., 2), right and down."""
        at = places + self._middle
        first = np.minimum(np.maximum(at.astype(np.intp), 0), self._limits)
        share = at - first
        right, down = share[..., 0], share[..., 1]
        columns = self.size_px[0]
        index = first[..., 1] * columns + first[..., 0]
        upper_left, upper_right, lower_left, lower_right = self._table.take(
            index + np.array([0, 1, columns, columns + 1]).reshape(-1, *[1] * index.ndim)
        )
        above = upper_left + (upper_right - upper_left) * right
        below = lower_left + (lower_right - lower_left) * right
        corrected: Floats = (above + (below - above) * down)[..., None].view(np.float64)
        return corrected

    def seen(self, right_px: float, down_px: float) -> tuple[float, float]:
        """The pixel of the image at which an ideal camera's pixel is seen."""
        x, y = distorted(right_px / self.focal_px, down_px / self.focal_px, self._coefficients)
        fx, fy = self._focals_px
        return (x * fx + self._axis_from_middle[0], y * fy + self._axis_from_middle[1])

    def all_seen(self, places: Floats) -> Floats:
        """As `seen`, for many places, shape (..., 2)."""
        rays = places / self.focal_px
        x, y = distorted(rays[..., 0], rays[..., 1], self._coefficients)
        (fx, fy), (right, down) = self._focals_px, self._axis_from_middle
        return np.stack([x * fx + right, y * fy + down], axis=-1)


def straight_box(box: Detection, lens: Lens) -> Detection:
    """The paper's numbers of a box as an ideal camera would see it: each side where its middle is.

    Distance and angle stay those of the box in the image; the paper's formulas know no lens.
    """
    middle_x, middle_y = (box.e + box.w) / 2.0, -(box.n + box.s) / 2.0
    places = np.array([(middle_x, -box.n), (middle_x, -box.s), (box.e, middle_y), (box.w, middle_y)])
    top, bottom, right, left = lens.ideal(places).tolist()
    return replace(box, n=-top[1], s=-bottom[1], e=right[0], w=left[0])
