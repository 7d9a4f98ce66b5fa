"""Where everything stands on a film's picture, for any size."""

from __future__ import annotations

from dataclasses import dataclass

_WIDE = 1.25  # from this ratio on, view and camera stand side by side


@dataclass(frozen=True, slots=True)
class Box:
    """A part of the picture, whole pixels.

    Attributes:
        x: left edge.
        y: upper edge.
        width: at least 1.
        height: at least 1.
    """

    x: int
    y: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """The first column to the right of it."""
        return self.x + self.width

    @property
    def bottom(self) -> int:
        """The first row below it."""
        return self.y + self.height


@dataclass(frozen=True, slots=True)
class Layout:
    """The parts of the picture.

    Attributes:
        unit: pixels for one of a picture of 960 × 540.
        view: the arena.
        camera: its image.
        state: words about the mission.
        figures: time and crossings.
        strip: the line of time at the bottom.
    """

    unit: float
    view: Box
    camera: Box
    state: Box
    figures: Box
    strip: Box


def lay_out(width_px: int, height_px: int, camera_ratio: float) -> Layout:
    """Divide a picture.

    Args:
        width_px: of the picture.
        height_px: of the picture.
        camera_ratio: width over height of the camera's images.
    """
    wide = width_px / height_px >= _WIDE
    unit = min(width_px / 960, height_px / 540) if wide else min(width_px / 600, height_px / 760)
    margin, strip = round(16 * unit), max(3, round(10 * unit))
    figures = round(76 * unit)
    body = height_px - strip - figures
    line = Box(0, height_px - strip, width_px, strip)
    below = Box(0, body, width_px, figures)
    if wide:
        side = round(0.405 * width_px)
        camera_width = side - margin
        camera_height = min(round(camera_width / camera_ratio), round(0.66 * body))
        camera = Box(width_px - side, margin, camera_width, camera_height)
        words = Box(camera.x, camera.bottom, camera_width, body - camera.bottom)
        return Layout(unit, Box(0, 0, width_px - side - margin, body), camera, words, below, line)
    view = Box(0, 0, width_px, round(0.6 * body))
    height = body - view.height - margin
    camera = Box(margin, view.bottom, min(round(height * camera_ratio), round(0.5 * width_px)), height)
    words = Box(camera.right + margin, view.bottom, width_px - camera.right - 2 * margin, height)
    return Layout(unit, view, camera, words, below, line)
