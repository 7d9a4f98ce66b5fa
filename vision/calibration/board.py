"""The calibration board, and the camera's calibration from images of it.

The board is a ChArUco board: a chessboard with a marker in every white square, so that each corner is known
by its number even if only a part of the board is seen (S. Garrido-Jurado et al., "Automatic generation and
detection of highly reliable fiducial markers under occlusion", Pattern Recognition, 2014). Camera matrix and
distortion follow from several views by least squares (Z. Zhang, "A flexible new technique for camera
calibration", IEEE Transactions on Pattern Analysis and Machine Intelligence, 2000). OpenCV does both.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt

from vision.calibration.model import Calibration, CalibrationError
from vision.types import Image

Floats = npt.NDArray[np.float32]

MIN_CORNERS = 12
"""Of a view; with fewer its pose is poorly known."""
MIN_VIEWS = 8
MIN_COVERAGE = 0.5
"""Share of the image's cells in which corners were seen."""
MIN_TILT_DEG = 10.0
"""Of the board in some view, against the mean of all."""
MAX_FOCAL_ERROR = 0.01
"""Standard deviation of the focal length, as a share of it."""
SAME_VIEW = 0.03
"""Two views are one if their corners are nearer to each other than this share of the image's width."""
MAX_RMS_PX = 2.0
CELLS = (8, 6)
"""Columns and rows of cells."""

_DPI = 300
_MM_PER_INCH = 25.4
_TEXT_MM = 4.0


@dataclass(frozen=True, slots=True)
class BoardView:
    """The board in one image."""

    name: str
    corners_px: Floats  # shape (n, 2)
    ids: npt.NDArray[np.int32]  # numbers of the corners, shape (n,)
    size_px: tuple[int, int]  # of the image

    def distance(self, other: BoardView) -> float:
        """Mean distance of the corners that both have, as a share of the image's width; 1 if too few."""
        _, mine, others = np.intersect1d(self.ids, other.ids, return_indices=True)
        if len(mine) < MIN_CORNERS // 2:
            return 1.0
        away = self.corners_px[mine] - other.corners_px[others]
        return float(np.linalg.norm(away, axis=1).mean()) / self.size_px[0]


@dataclass(frozen=True, slots=True)
class CalibrationReport:
    """A calibration, and how good it is."""

    calibration: Calibration
    errors_px: tuple[tuple[str, float], ...]  # root mean square of each view
    coverage: float  # share of the image's cells
    cells: npt.NDArray[np.int64]  # corners in each cell, shape (rows, columns)
    focal_std_px: float


@dataclass(frozen=True)
class CharucoBoard:
    """A ChArUco board; by default it fits on A4 and on US letter, landscape.

    The size of a square has no effect on a calibration; that all are squares has.
    """

    columns: int = 8
    rows: int = 5
    square_mm: float = 30.0
    marker_mm: float = 22.0

    @cached_property
    def _board(self) -> cv2.aruco.CharucoBoard:
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
        return cv2.aruco.CharucoBoard(
            (self.columns, self.rows), self.square_mm / 1000.0, self.marker_mm / 1000.0, markers
        )

    @cached_property
    def _detector(self) -> cv2.aruco.CharucoDetector:
        return cv2.aruco.CharucoDetector(self._board)

    @property
    def text(self) -> str:
        """What it is, for people."""
        width, height = self.columns * self.square_mm, self.rows * self.square_mm
        return (
            f"ChArUco board of {self.columns} x {self.rows} squares of {self.square_mm:g} mm, markers of "
            f"{self.marker_mm:g} mm (DICT_5X5_100): {width:g} x {height:g} mm"
        )

    def picture(self, margin_mm: float = 0.0) -> Image:
        """The board at 300 pixels an inch, grey, without text.

        Args:
            margin_mm: white around it.
        """
        size = [round(n * self.square_mm * _DPI / _MM_PER_INCH) for n in (self.columns, self.rows)]
        margin = round(margin_mm * _DPI / _MM_PER_INCH)
        picture = self._board.generateImage((size[0] + 2 * margin, size[1] + 2 * margin), None, margin, 1)
        return np.asarray(picture, np.uint8)

    def page(self) -> bytes:
        """The board as a PNG file that prints in true size, with its measures below it."""
        picture = self.picture(margin_mm=8.0)
        below = np.full((round(2.5 * _TEXT_MM * _DPI / _MM_PER_INCH), picture.shape[1]), 255, np.uint8)
        text = f"{self.text}. Print at 100 %, measure it, glue it to something flat."
        scale = 1.0
        (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 2)
        scale *= 0.9 * picture.shape[1] / width
        at = (picture.shape[1] // 20, below.shape[0] // 2)
        cv2.putText(below, text, at, cv2.FONT_HERSHEY_SIMPLEX, scale, 0, 2, cv2.LINE_AA)
        _, data = cv2.imencode(".png", np.vstack([picture, below]))
        return _with_resolution(data.tobytes())

    def find(self, image: Image, name: str) -> BoardView | None:
        """The board's corners in an image, BGR or grey; None if fewer than `MIN_CORNERS` are seen."""
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
        corners, ids, _, _ = self._detector.detectBoard(grey)
        if corners is None or ids is None or len(corners) < MIN_CORNERS:
            return None
        height, width = grey.shape
        places = np.asarray(corners, np.float32).reshape(-1, 2)
        return BoardView(name, places, np.asarray(ids, np.int32).ravel(), (width, height))

    def calibrate(self, views: Sequence[BoardView]) -> CalibrationReport:
        """Calibrate the camera that took views.

        Raises:
            CalibrationError: there are too few, or they do not tell enough of the camera.
        """
        if len(views) < MIN_VIEWS:
            raise CalibrationError(
                f"calibration: {len(views)} different views of the board; {MIN_VIEWS} or more are needed, "
                "near and far, in the middle and in the corners, tilted to all sides"
            )
        size_px = views[0].size_px
        other = next((view for view in views if view.size_px != size_px), None)
        if other is not None:
            raise CalibrationError(
                f"calibration: {other.name} has {_size(other.size_px)} pixels and {views[0].name} "
                f"{_size(size_px)}; use images of one size"
            )
        cells = _cells(views, size_px)
        coverage = float(np.count_nonzero(cells)) / cells.size
        if coverage < MIN_COVERAGE:
            raise CalibrationError(
                f"calibration: the board was seen in {100 * coverage:.0f} % of the image; show it in its "
                f"corners and along its borders, too, so that it is {100 * MIN_COVERAGE:.0f} % or more"
            )
        return self._solved(views, size_px, cells, coverage)

    def _solved(
        self,
        views: Sequence[BoardView],
        size_px: tuple[int, int],
        cells: npt.NDArray[np.int64],
        coverage: float,
    ) -> CalibrationReport:
        places = np.asarray(self._board.getChessboardCorners(), np.float32)
        objects = [places[view.ids].reshape(-1, 1, 3) for view in views]
        images = [view.corners_px.reshape(-1, 1, 2) for view in views]
        rms, matrix, distortion, turns, _, deviations, _, errors = cv2.calibrateCameraExtended(
            objects, images, size_px, cameraMatrix=np.eye(3), distCoeffs=np.zeros(5)
        )
        focal_std_px = float(np.asarray(deviations).ravel()[:2].max())
        tilt_deg = _tilt_deg(turns)
        if tilt_deg < MIN_TILT_DEG:
            raise CalibrationError(
                f"calibration: the board was tilted by {tilt_deg:.0f} degrees at most; tilt it by 20 to "
                "45 degrees to all sides: views from the front do not tell the focal length"
            )
        if focal_std_px > MAX_FOCAL_ERROR * matrix[0, 0]:
            raise CalibrationError(
                f"calibration: the focal length is uncertain by {100 * focal_std_px / matrix[0, 0]:.1f} %: "
                "the views are too similar; tilt the board by 20 to 45 degrees to all sides, near the camera"
            )
        if rms > MAX_RMS_PX:
            raise CalibrationError(
                f"calibration: an error of {rms:.1f} pixels is left; use a flat board, sharp images, and one "
                "camera without zoom"
            )
        k1, k2, p1, p2, k3 = (float(number) for number in np.asarray(distortion).ravel()[:5])
        calibration = Calibration(
            width_px=size_px[0],
            height_px=size_px[1],
            fx_px=float(matrix[0, 0]),
            fy_px=float(matrix[1, 1]),
            cx_px=float(matrix[0, 2]),
            cy_px=float(matrix[1, 2]),
            distortion=(k1, k2, p1, p2, k3),
            rms_px=float(rms),
            images=len(views),
        )
        names = (view.name for view in views)
        by_view = zip(names, np.asarray(errors).ravel().tolist(), strict=True)
        return CalibrationReport(calibration, tuple(by_view), coverage, cells, focal_std_px)


def _tilt_deg(turns: Sequence[npt.NDArray[np.float64]]) -> float:
    """Half of the largest angle between the board's normals in two views."""
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    return float(np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1.0, 1.0)))) / 2.0


def coverage_of(views: Sequence[BoardView]) -> float:
    """Share of the image's cells in which corners were seen."""
    return float(np.count_nonzero(_cells(views, views[0].size_px))) / (CELLS[0] * CELLS[1]) if views else 0.0


def _cells(views: Sequence[BoardView], size_px: tuple[int, int]) -> npt.NDArray[np.int64]:
    """Corners in each cell of the image, shape (rows, columns)."""
    corners = np.concatenate([view.corners_px for view in views])
    reach = ((-0.5, size_px[1] - 0.5), (-0.5, size_px[0] - 0.5))
    counts, _, _ = np.histogram2d(corners[:, 1], corners[:, 0], bins=(CELLS[1], CELLS[0]), range=reach)
    cells: npt.NDArray[np.int64] = counts.astype(np.int64)
    return cells


def _size(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]}"


def _with_resolution(png: bytes) -> bytes:
    """A PNG file with a chunk pHYs after its header, which says how large it is on paper."""
    per_metre = round(_DPI / _MM_PER_INCH * 1000.0)
    content = b"pHYs" + struct.pack(">IIB", per_metre, per_metre, 1)
    chunk = struct.pack(">I", 9) + content + struct.pack(">I", zlib.crc32(content))
    header = 8 + 25  # the signature and the chunk IHDR
    return png[:header] + chunk + png[header:]
