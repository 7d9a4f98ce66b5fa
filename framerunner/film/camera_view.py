"""The camera's image with what was detected in it."""

from __future__ import annotations

from math import isfinite

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.film.colours import FAINT, INK, LINE, WHITE
from framerunner.film.layout import Box
from framerunner.film.letters import Letters
from framerunner.recording.messages import box_edges
from scenarios.models import COLOURS
from vision.types import Detection, Detections

Image = npt.NDArray[np.uint8]


class CameraView:
    """Paints the camera's image into a part of a picture, as large as it fits.

    Args:
        box: where.
        letters: to write with.
        unit: pixels for one of a picture of 960 × 540.
    """

    def __init__(self, box: Box, letters: Letters, unit: float) -> None:
        self._box = box
        self._letters = letters
        self._unit = unit

    def paint(self, image: Image, camera: Image | None, seen: Detections) -> None:
        """Paint an image and what was detected in it.

        Args:
            image: is painted on, BGR.
            camera: its image, BGR; None if there is none.
            seen: what was detected in it.
        """
        box = self._box
        if camera is None:
            self._say_none(image)
            return
        height, width = camera.shape[:2]
        scale = min(box.width / width, box.height / height)
        shown = (max(1, round(scale * width)), max(1, round(scale * height)))
        how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        part: Image = np.ascontiguousarray(cv2.resize(camera, shown, interpolation=how), np.uint8)
        for colour in COLOURS:
            detection: Detection = getattr(seen, colour)
            if all(map(isfinite, (detection.n, detection.s, detection.e, detection.w))):
                edges = box_edges(detection, (width, height))
                left, top, right, bottom = (edge * scale for edge in edges)
                self._mark(part, (left, top, right, bottom), detection)
        left_px, top_px = box.x + (box.width - shown[0]) // 2, box.y + (box.height - shown[1]) // 2
        image[top_px : top_px + shown[1], left_px : left_px + shown[0]] = part

    def _say_none(self, image: Image) -> None:
        box, size = self._box, 20 * self._unit
        image[box.y : box.bottom, box.x : box.right] = LINE
        words = "no image"
        x = box.x + (box.width - self._letters.width(words, size)) / 2
        self._letters.write(image, (x, box.y + box.height / 2 + 0.35 * size), words, size, FAINT)

    def _mark(self, part: Image, edges: tuple[float, float, float, float], detection: Detection) -> None:
        """Draw the box, and write distance and angle where they are known."""
        grow = 2.0 * self._unit
        left, top = edges[0] - grow, edges[1] - grow
        right, bottom = edges[2] + grow, edges[3] + grow
        corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
        outline = np.rint(16 * np.clip(corners, -1e4, 1e4)).astype(np.int32)
        for width, colour in ((3.6, INK), (1.8, WHITE)):
            thickness = max(1, round(width * self._unit))
            cv2.polylines(part, [outline], True, colour, thickness, cv2.LINE_AA, 4)
        if isfinite(detection.d):
            angle = f"  {detection.a:.0f}°" if isfinite(detection.a) else ""
            self._label(part, (left, top, bottom), f"{detection.d:.2f} m{angle}")

    def _label(self, part: Image, beside: tuple[float, float, float], text: str) -> None:
        """Write above a box, or below it where there is no room above."""
        left, top, bottom = beside
        size, pad = 18 * self._unit, 5 * self._unit
        width, height = self._letters.width(text, size) + 2 * pad, size + 1.2 * pad
        x = min(max(left, 0.0), max(0.0, part.shape[1] - width))
        y = top - height - pad
        if y < 0.0:
            y = min(bottom + pad, part.shape[0] - height)
        x0, y0 = round(x), max(0, round(y))
        under = part[y0 : round(y0 + height), x0 : round(x0 + width)]
        under[:] = under // 3 + np.array(INK, np.uint8) // 3 * 2
        self._letters.write(part, (x0 + pad, y0 + 0.4 * pad + 0.86 * size), text, size, WHITE)
