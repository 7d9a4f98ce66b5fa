"""The cells of markers, as OpenCV has them; scenarios are read without it."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.base_marker import BaseMarkers, MarkerFamily

_DICTIONARIES: dict[MarkerFamily, int] = {
    "aruco_4x4": cv2.aruco.DICT_4X4_50,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36h11,
}


def marker_dictionary(family: MarkerFamily) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of a family."""
    return cv2.aruco.getPredefinedDictionary(_DICTIONARIES[family])


def white_cells(markers: BaseMarkers, number: int) -> npt.NDArray[np.bool_]:
    """Which cells of a marker are white, rows from above, shape (cells, cells)."""
    image = cv2.aruco.generateImageMarker(marker_dictionary(markers.family), number, markers.cells)
    return np.asarray(image) > 0


def white_parts(markers: BaseMarkers, number: int) -> tuple[tuple[float, float, float, float], ...]:
    """The same as rectangles: left, right, lower, upper, metres from the marker's centre."""
    cell_m, half_m = markers.edge_m / markers.cells, markers.edge_m / 2
    parts = []
    for row, cells in enumerate(white_cells(markers, number)):
        changes = np.flatnonzero(np.diff(np.concatenate(([False], cells, [False])))).tolist()
        for begin, end in zip(changes[::2], changes[1::2], strict=True):
            upper_m = half_m - row * cell_m
            parts.append((begin * cell_m - half_m, end * cell_m - half_m, upper_m - cell_m, upper_m))
    return tuple(parts)
