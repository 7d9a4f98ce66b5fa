"""Points that are followed from image to image: corners of whatever is seen, by Lucas and Kanade's method.

J. Shi, C. Tomasi, "Good features to track", CVPR 1994; J.-Y. Bouguet, "Pyramidal implementation of the
Lucas-Kanade feature tracker", 2001.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt

from vision.calibration.lens import Lens
from vision.detectors import Detector
from vision.types import Detections, Image, PointTracks

MOST = 48
CELL_PX = 40  # one point in each square of this size
BORDER_PX = 6
LEAST_RESPONSE = 1e-6  # smaller eigenvalue of the gradients' covariance
ABOVE_NOISE = 6.0  # times the response in the middle of all pixels
LEAST_FOLLOWED = 1e-6
BLUR = (3, 3)
_WINDOW = (13, 13)
_LEVELS = 3
_CRITERIA = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 0.02)
MOST_BACK_PX = 0.5  # followed there and back, a point is so near to where it was
NEAR_PX = 12.0  # of two points
LONGEST_US = 400_000  # between two images; after longer all begin anew

_Points = npt.NDArray[np.float32]


class PointTracker:
    """Follows points from image to image.

    Args:
        lens: of a camera that is not ideal; points are then in pixels of an ideal one.
    """

    def __init__(self, lens: Lens | None = None) -> None:
        self._lens = lens
        self._before: npt.NDArray[np.uint8] | None = None
        self._points: _Points = np.empty((0, 2), np.float32)
        self._numbers: npt.NDArray[np.int64] = np.empty(0, np.int64)
        self._next = 0
        self._time_us: int | None = None

    def track(self, image: Image, time_us: int) -> PointTracks:
        """The points in the next image.

        Args:
            image: BGR, shape (height, width, 3), uint8.
            time_us: vehicle time of its exposure.
        """
        grey = cv2.GaussianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), BLUR, 0)
        late = self._time_us is None or not 0 < time_us - self._time_us <= LONGEST_US
        if late or self._before is None:
            self._points, self._numbers = self._points[:0], self._numbers[:0]
        elif len(self._points):
            self._follow(self._before, grey)
        self._begin(grey)
        self._before, self._time_us = grey, time_us
        height, width = grey.shape
        pixels = self._points.astype(np.float64) - ((width - 1) / 2, (height - 1) / 2)
        rows_px = pixels[:, 1]
        if self._lens is not None and len(pixels):
            pixels = self._lens.ideal(pixels)
        return PointTracks(self._numbers, pixels, rows_px)

    def _follow(self, before: npt.NDArray[np.uint8], now: npt.NDArray[np.uint8]) -> None:
        """Follow the points of the image before, and forget those that are lost."""
        old = self._points[:, None]
        new, found, _ = cv2.calcOpticalFlowPyrLK(
            before, now, old, None, winSize=_WINDOW, maxLevel=_LEVELS, criteria=_CRITERIA,
            minEigThreshold=LEAST_FOLLOWED,
        )  # fmt: skip
        back, returned, _ = cv2.calcOpticalFlowPyrLK(
            now, before, new, old.copy(), winSize=_WINDOW, maxLevel=1, criteria=_CRITERIA,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW, minEigThreshold=LEAST_FOLLOWED,
        )  # fmt: skip
        height, width = now.shape
        x, y = new[:, 0, 0], new[:, 0, 1]
        kept = (found[:, 0] == 1) & (returned[:, 0] == 1)
        kept &= np.abs(back - old).max(axis=(1, 2)) < MOST_BACK_PX
        kept &= (x > BORDER_PX) & (x < width - 1 - BORDER_PX) & (y > BORDER_PX) & (y < height - 1 - BORDER_PX)
        self._points, self._numbers = new[kept, 0], self._numbers[kept]

    def _begin(self, grey: npt.NDArray[np.uint8]) -> None:
        """Begin to follow the best corner of each square in which no point is."""
        height, width = grey.shape
        rows, columns = height // CELL_PX, width // CELL_PX
        taken = np.zeros((rows, columns), bool)
        if len(self._points):
            cells = np.minimum(self._points // CELL_PX, (columns - 1, rows - 1)).astype(int)
            taken[cells[:, 1], cells[:, 0]] = True
        if taken.all() or len(self._points) >= MOST:
            return
        response = cv2.cornerMinEigenVal(grey, 5)
        response[:BORDER_PX], response[-BORDER_PX:] = 0.0, 0.0
        response[:, :BORDER_PX], response[:, -BORDER_PX:] = 0.0, 0.0
        of_cells = response[: rows * CELL_PX, : columns * CELL_PX]
        of_cells = of_cells.reshape(rows, CELL_PX, columns, CELL_PX).transpose(0, 2, 1, 3)
        of_cells = of_cells.reshape(rows, columns, CELL_PX * CELL_PX)
        best = of_cells.argmax(axis=2)
        strength = np.take_along_axis(of_cells, best[:, :, None], axis=2)[:, :, 0]
        strength[taken] = 0.0
        noise = float(np.median(response[::4, ::4]))
        row, column = np.nonzero(strength > max(LEAST_RESPONSE, ABOVE_NOISE * noise))
        order = np.argsort(-strength[row, column], kind="stable")[: MOST - len(self._points)]
        row, column = row[order], column[order]
        y, x = np.divmod(best[row, column], CELL_PX)
        new = np.stack([column * CELL_PX + x, row * CELL_PX + y], axis=1).astype(np.float32)
        kept = [index for index, point in enumerate(new) if self._is_free(point, new[:index])]
        new = new[kept]
        self._points = np.concatenate((self._points, new))
        numbers = np.arange(self._next, self._next + len(new))
        self._numbers, self._next = np.concatenate((self._numbers, numbers)), self._next + len(new)

    def _is_free(self, point: _Points, others: _Points) -> bool:
        """Whether no other point is near."""
        near = np.concatenate((self._points, others))
        return not len(near) or float(np.abs(near - point).max(axis=1).min()) > NEAR_PX


class DetectorWithTracks:
    """Adds points that are followed to what another detector gives, in images that have a time."""

    def __init__(self, detect: Detector, tracker: PointTracker) -> None:
        self._detect, self._tracker = detect, tracker

    def __call__(self, image: Image, time_us: int | None) -> Detections:
        """What an image shows."""
        detections = self._detect(image, time_us)
        if time_us is None:
            return detections
        return replace(detections, tracks=self._tracker.track(image, time_us))
