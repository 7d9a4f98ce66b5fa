"""Paints textured faces: each in bands of similar depth, for each band the level of the pyramid that fits.

A plane's points and a canvas's pixels correspond by a homography, and one divided by the depth is linear on
the canvas (R. Hartley, A. Zisserman, "Multiple View Geometry", 2004, section 8.1), so bands end at lines.
A pixel of the canvas gets the nearest pixel of the level; the camera takes means of four of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, sqrt

import cv2
import numpy as np
import numpy.typing as npt

from sitl.camera_projection import (
    SHIFT,
    SUBPIXELS,
    MeshFace,
    Pinhole,
    Point,
    Projection,
    clip_half_plane,
)
from sitl.optics.texture import FaceTexture

Image = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.floating]

_LONGER = 1.2  # of a ray to a pixel than its depth, for most of the pixels of a wide view
_LEAST_HEIGHT_M = 1e-4  # of an eye above a face that is painted
_OVERLAP_PX = 2.0  # of a band into the nearer one, which is painted after it
_PX_A_PART = 10_000.0  # to paint so many pixels takes as long as to begin one more part of a band
_MAX_PARTS = 6
_FROM_SUBPIXELS = np.diag((1.0 / SUBPIXELS, 1.0 / SUBPIXELS, 1.0))


class TexturePainter:
    """Paints on canvases of one size.

    Args:
        pinhole: of the canvas.
    """

    def __init__(self, pinhole: Pinhole) -> None:
        self._pinhole = pinhole
        shape = (pinhole.height_px, pinhole.width_px)
        self._seen = np.empty((*shape, 3), np.uint8)
        self._mask, self._band_mask = np.empty(shape, np.uint8), np.empty(shape, np.uint8)

    def paint(self, canvas: Image, projection: Projection, face: MeshFace, texture: FaceTexture) -> None:
        """Paint a face that is seen.

        Args:
            canvas: BGR, shape (height, width, 3).
            projection: of all faces.
            face: one of them.
            texture: on it.
        """
        outline = projection.outline(face)
        height_m = _height_m(texture, projection)
        if outline is None or height_m < _LEAST_HEIGHT_M:
            return
        points = self._on_canvas((outline / SUBPIXELS).tolist())
        if len(points) < 3:
            return
        homography = self._homography(projection, texture, points)
        one_by_depth = homography[2].tolist()
        nearness = [_at(one_by_depth, u, v) for u, v in points]
        nearest_m = 1.0 / max(*nearness, 1e-9)
        farthest_m = 1.0 / min(nearness) if min(nearness) > 1e-9 else inf
        self._fill(outline, points)
        a, b, c = one_by_depth
        overlap = _OVERLAP_PX * hypot(a, b)
        levels = texture.pyramid.levels
        reaches_m = self._reaches_m(texture, projection, height_m, len(levels))
        for level in range(len(levels) - 1, -1, -1):
            begin_m = reaches_m[level - 1] if level else 0.0
            if begin_m >= farthest_m or reaches_m[level] <= nearest_m:
                continue
            band = points
            if level and begin_m > nearest_m:
                band = clip_half_plane(band, -a, -b, 1.0 / begin_m - c + overlap)
            if reaches_m[level] < farthest_m:
                band = clip_half_plane(band, a, b, c - 1.0 / reaches_m[level])
            for part in _columns(band, a, b):
                self._paint_band(canvas, part, homography, levels[level])

    def darken(self, canvas: Image, outlines: Sequence[npt.NDArray[np.int32]], share: float) -> None:
        """Paint shadows; where several of them lie, it is no darker than in one.

        Args:
            canvas: BGR, shape (height, width, 3).
            outlines: of the shadows, as `Projection.outline` gives them.
            share: of the light that is left.
        """
        points = [self._on_canvas((outline / SUBPIXELS).tolist()) for outline in outlines]
        corners = [corner for polygon in points for corner in polygon]
        if not corners:
            return
        left, top, right, bottom = self._window(corners)
        self._mask[top:bottom, left:right] = 0
        for outline in outlines:
            cv2.fillConvexPoly(self._mask, outline, 255, cv2.LINE_8, SHIFT)
        part = canvas[top:bottom, left:right]
        cv2.copyTo(cv2.convertScaleAbs(part, alpha=share), self._mask[top:bottom, left:right], part)

    def _on_canvas(self, points: list[Point]) -> list[Point]:
        """Cut a convex polygon to the canvas."""
        right, bottom = self._pinhole.width_px, self._pinhole.height_px
        for a, b, c in ((1.0, 0.0, 0.0), (-1.0, 0.0, right), (0.0, 1.0, 0.0), (0.0, -1.0, bottom)):
            points = clip_half_plane(points, a, b, c)
        return points

    def _homography(self, projection: Projection, texture: FaceTexture, points: list[Point]) -> Floats:
        """From a pixel of the canvas to a place on the picture; its last row gives one by the depth.

        With a rolling shutter the matrix of a pixel depends on its row, to the first order. A homography is
        linear in column and row; what is not is taken at the middle of the polygon.
        """
        plane = _FROM_SUBPIXELS @ projection.matrix @ texture.to_arena
        homography: Floats = np.linalg.inv(plane)
        if projection.drift is not None:
            drift = _FROM_SUBPIXELS @ projection.drift @ texture.to_arena
            change = -homography @ drift @ homography
            columns, rows = zip(*points, strict=True)
            column, row = (min(columns) + max(columns)) / 2, (min(rows) + max(rows)) / 2
            late, centre_px = self._pinhole.height_px, self._pinhole.centre_px[1]
            share = (row - centre_px) / late
            # (row - centre) / late times (column, row, 1), linear about (column, row).
            linear = share * np.eye(3)
            linear[:, 1] += np.array([column, row, 1.0]) / late
            linear[:, 2] -= np.array([column, row, 1.0]) * row / late
            homography += change @ linear
        return homography

    def _reaches_m(
        self, texture: FaceTexture, projection: Projection, height_m: float, count: int
    ) -> list[float]:
        """Depths up to which each level is painted, in ascending order; the last one reaches everywhere.

        At the depth d a pixel covers d / f across, and d² / (f h) along a plane at the height h that is seen
        edge on.
        """
        ahead = projection.matrix[2, :3]
        tilt = sqrt(max(0.0, 1.0 - float(np.dot(texture.normal_arena, ahead)) ** 2))
        focal = self._pinhole.focal_px
        reaches = []
        for level in range(count - 1):
            size_m = (
                2.0 * 4.0**level / texture.px_m
            )  # of a canvas's pixel: two of the level's, half of the next
            reach_m = focal * size_m
            if tilt > 0.0:
                reach_m = min(reach_m, sqrt(size_m * focal * height_m / (_LONGER * tilt)))
            reaches.append(reach_m)
        return [*reaches, inf]

    def _fill(self, outline: npt.NDArray[np.int32], points: list[Point]) -> None:
        """Mark the face's pixels."""
        left, top, right, bottom = self._window(points)
        self._mask[top:bottom, left:right] = 0
        cv2.fillConvexPoly(self._mask, outline, 255, cv2.LINE_8, SHIFT)

    def _window(self, points: list[Point]) -> tuple[int, int, int, int]:
        """The pixels around a polygon: left, top, and those after the last ones."""
        columns, rows = zip(*points, strict=True)
        right, bottom = self._pinhole.width_px, self._pinhole.height_px
        return (
            max(0, int(min(columns)) - 1),
            max(0, int(min(rows)) - 1),
            min(right, int(max(columns)) + 2),
            min(bottom, int(max(rows)) + 2),
        )

    def _paint_band(self, canvas: Image, band: list[Point], homography: Floats, picture: Image) -> None:
        height, width = picture.shape[:2]
        to_picture = homography * ((width,), (height,), (1.0,))
        to_picture[:2] -= 0.5 * to_picture[2]  # whole numbers at the middle of a pixel
        left, top, right, bottom = self._window(band)
        to_picture[:, 2] += to_picture[:, :2] @ (left, top)
        mask, seen = self._band_mask[top:bottom, left:right], self._seen[top:bottom, left:right]
        mask[...] = 0
        corners = [(round(SUBPIXELS * (u - left)), round(SUBPIXELS * (v - top))) for u, v in band]
        cv2.fillConvexPoly(mask, np.array(corners, np.int32), 255, cv2.LINE_8, SHIFT)
        cv2.bitwise_and(mask, self._mask[top:bottom, left:right], dst=mask)
        flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        size = (right - left, bottom - top)
        cv2.warpPerspective(picture, to_picture, size, dst=seen, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        cv2.copyTo(seen, mask, canvas[top:bottom, left:right])


def _height_m(texture: FaceTexture, projection: Projection) -> float:
    """Of the eye above a face's plane."""
    offset = np.array(projection.eye_arena_m) - texture.to_arena[:3, 2]
    return float(np.dot(texture.normal_arena, offset))


def _at(row: list[float], u: float, v: float) -> float:
    return row[0] * u + row[1] * v + row[2]


def _columns(band: list[Point], a: float, b: float) -> list[list[Point]]:
    """Cut a band between parallels of a u + b v = 0 so that few pixels around its parts are not in them."""
    if len(band) < 3:
        return []
    along = 1 if abs(a) > abs(b) else 0  # cut across the axis that is nearer to the band's direction
    places = [point[along] for point in band]
    low, extent = min(places), max(places) - min(places)
    slope = min(abs(a), abs(b)) / max(abs(a), abs(b), 1e-12)
    count = min(_MAX_PARTS, round(extent * sqrt(slope / _PX_A_PART)))
    if count < 2:
        return [band]
    parts = []
    for index in range(count):
        begin, end = (low + extent * (index + side) / count for side in (0, 1))
        sides = ((1.0, -begin), (-1.0, end))
        part = band
        for sign, offset in sides:
            part = clip_half_plane(part, sign * (1 - along), sign * along, offset)
        if len(part) > 2:
            parts.append(part)
    return parts
