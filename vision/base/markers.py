"""Read the printed markers on the base: which are seen, and where their corners are.

OpenCV finds and decodes them. Where their corners are is then fitted by the brightness of all their pixels
(enhanced correlation coefficient: G. Evangelidis, E. Psarakis, "Parametric image alignment using enhanced
correlation coefficient maximization", 2008): a threshold moves edges by a third of a pixel, and this by a
twentieth.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.base_marker import BaseMarkers
from framerunner.geometry.marker_cells import marker_dictionary, white_cells
from vision.base.model import Floats
from vision.calibration.lens import Lens
from vision.types import BaseExpectation, BaseSighting, Image

_NARROW_PX: Final = 700  # images that are less wide are enlarged by two: small markers are decoded then
_WINDOWS_PX: Final = (5, 29, 8)  # of the adaptive threshold: least, greatest, step
_LEAST_PERIMETER: Final = 0.02  # of a marker, as a share of the image's width
_CELL_PX: Final = 3  # of the pattern that is fitted, at least
_STEPS: Final = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 1e-4)
_LEAST_CORRELATION: Final = 0.8
_MOST_MOVED_PX: Final = 2.0  # a fit that moves a corner farther was drawn to something else
_STD_PX: Final = 0.12  # of a corner's coordinates


class MarkerReader:
    """Reads the markers of a base.

    Args:
        markers: on it.
        edge_m: of the base's square top.
        top_m: its height above the floor.
        lens: of a camera that is not ideal.
    """

    def __init__(self, markers: BaseMarkers, edge_m: float, top_m: float, lens: Lens | None = None) -> None:
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        least, greatest, step = _WINDOWS_PX
        settings.adaptiveThreshWinSizeMin, settings.adaptiveThreshWinSizeMax = least, greatest
        settings.adaptiveThreshWinSizeStep = step
        settings.minMarkerPerimeterRate = _LEAST_PERIMETER
        self._detector = cv2.aruco.ArucoDetector(marker_dictionary(markers.family), settings)
        self._lens = lens
        half_m = markers.edge_m / 2
        self._corners_m: dict[int, Floats] = {}
        self._patterns: dict[int, npt.NDArray[np.float32]] = {}  # white 1, black 0, a white rim around
        for face in markers.faces(edge_m, top_m):
            self._corners_m[face.number] = np.array(face.rectangle(-half_m, half_m, -half_m, half_m))
            cells = white_cells(markers, face.number).astype(np.float32)
            self._patterns[face.number] = np.pad(cells, 1, constant_values=1.0)

    def find(self, image: Image, expected: BaseExpectation) -> BaseSighting | None:
        """The corners of all markers that can be read; None if there are none.

        Args:
            image: BGR, shape (height, width, 3), uint8.
            expected: where the camera may be; markers say which they are, so it does not matter.

        Raises:
            CalibrationError: the image has another size than those with which the camera was calibrated.
        """
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
        height, width = grey.shape
        if self._lens is not None:
            self._lens.check_size(width, height)
        factor = 2 if width < _NARROW_PX else 1
        size = (factor * width, factor * height)
        large = grey if factor == 1 else cv2.resize(grey, size, interpolation=cv2.INTER_CUBIC)
        found, numbers, _ = self._detector.detectMarkers(large)
        brightness = grey.astype(np.float32)
        points_m, places = [], []
        for corners, number in zip(found, [] if numbers is None else numbers.ravel().tolist(), strict=True):
            if number in self._corners_m:
                rough = (np.asarray(corners, np.float64).reshape(4, 2) + 0.5) / factor - 0.5
                fitted = _fitted(brightness, rough, self._patterns[number])
                if fitted is not None:
                    points_m.append(self._corners_m[number])
                    places.append(fitted)
        if not places:
            return None
        pixels = np.concatenate(places) - np.array([(width - 1) / 2, (height - 1) / 2])
        if self._lens is not None:
            pixels = self._lens.ideal(pixels)
        return BaseSighting(np.concatenate(points_m), pixels, _STD_PX**2 * np.eye(2 * len(pixels)), 1.0)


def _fitted(
    brightness: npt.NDArray[np.float32], corners: Floats, cells: npt.NDArray[np.float32]
) -> Floats | None:
    """Columns and rows of a marker's corners, from rough ones, shape (4, 2); None if it does not fit.

    Args:
        brightness: of an image, shape (height, width).
        corners: upper left, upper right, lower right, lower left.
        cells: of the marker and its rim.
    """
    count = len(cells) - 2
    sides_px = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    wide, high = (max(_CELL_PX, round(float(sides_px[k::2].mean()) / count)) for k in (0, 1))
    pattern = np.kron(cells, np.ones((high, wide), np.float32))
    left, top = wide - 0.5, high - 0.5
    right, bottom = left + wide * count, top + high * count
    in_pattern = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    start = cv2.getPerspectiveTransform(in_pattern.astype(np.float32), corners.astype(np.float32))
    try:
        correlation, warp = cv2.findTransformECC(
            pattern, brightness, start.astype(np.float32), cv2.MOTION_HOMOGRAPHY, _STEPS, None, 1
        )
    except cv2.error:  # it does not converge
        return None
    fitted = np.asarray(cv2.perspectiveTransform(in_pattern[None], warp.astype(np.float64))[0])
    moved_px = float(np.abs(fitted - corners).max())
    return fitted if correlation >= _LEAST_CORRELATION and moved_px < _MOST_MOVED_PX else None
