"""The look of a film: its colours, its layout for any image size, and its lettering."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
import numpy.typing as npt
from PIL import Image as PilImage
from PIL import ImageDraw, ImageFont

from vision.types import Image

Bgr = tuple[int, int, int]
"""As OpenCV has colours."""

SUBPIXEL_BITS = 4
"""OpenCV draws at sixteenths of a pixel; see `fixed_point`."""
_FONTS = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
_CACHED_TEXTS = 400
_WIDE = 1.25  # from this ratio on, view and camera are side by side


def bgr(text: str) -> Bgr:
    """A colour from "#rrggbb"."""
    red, green, blue = (int(text[i : i + 2], 16) for i in (1, 3, 5))
    return (blue, green, red)


def mixed(one: Bgr, other: Bgr, share: float) -> Bgr:
    """A colour between two; a share of 0 is the first."""
    blue, green, red = (round(a + share * (b - a)) for a, b in zip(one, other, strict=True))
    return (blue, green, red)


PAPER = bgr("#f6f5f1")
INK = bgr("#22252b")
FAINT = bgr("#6d7278")
LINE = bgr("#d5d3cb")
TATAMI = bgr("#efdca4")
MAT = bgr("#e8d293")
RIM = bgr("#b39b5e")
SHADOW = bgr("#cdb878")
STEM = bgr("#a5997a")
WHITE: Bgr = (255, 255, 255)
GOOD = bgr("#1d7f4e")
BAD = bgr("#b3372f")
GATE: dict[str, Bgr] = {"red": bgr("#ee1c1c"), "green": bgr("#12b436"), "blue": bgr("#1f3df5")}
"""Of chips: a little less saturated than the gates themselves, so that text on them is legible."""


def fixed_point(pixels: npt.NDArray[np.float64]) -> npt.NDArray[np.int32]:
    """Pixels as OpenCV draws them with a shift of `SUBPIXEL_BITS`; those far outside are kept finite."""
    far = 20_000.0
    kept = np.clip(pixels, -far, far)
    kept[np.isnan(kept)] = -far
    return np.rint(kept * (1 << SUBPIXEL_BITS)).astype(np.int32)


@dataclass(frozen=True, slots=True)
class PixelBox:
    """A part of the image, whole pixels; width and height are at least 1."""

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
class ImageLayout:
    """The parts of the image.

    Attributes:
        unit: pixels for one pixel of an image of 960 × 540.
        view: the arena.
        camera: the camera's image.
        state: the mission's state and the drone's position.
        figures: time and crossings.
        strip: the time line at the bottom.
    """

    unit: float
    view: PixelBox
    camera: PixelBox
    state: PixelBox
    figures: PixelBox
    strip: PixelBox


def lay_out(width_px: int, height_px: int, camera_ratio: float) -> ImageLayout:
    """Divide an image; `camera_ratio` is width over height of the camera's images."""
    wide = width_px / height_px >= _WIDE
    unit = min(width_px / 960, height_px / 540) if wide else min(width_px / 600, height_px / 760)
    margin, strip_height, figures_height = round(16 * unit), max(3, round(10 * unit)), round(76 * unit)
    body = height_px - strip_height - figures_height
    strip = PixelBox(0, height_px - strip_height, width_px, strip_height)
    figures = PixelBox(0, body, width_px, figures_height)
    if wide:
        side = round(0.405 * width_px)
        camera_width = side - margin
        camera_height = min(round(camera_width / camera_ratio), round(0.66 * body))
        camera = PixelBox(width_px - side, margin, camera_width, camera_height)
        state = PixelBox(camera.x, camera.bottom, camera_width, body - camera.bottom)
        return ImageLayout(
            unit, PixelBox(0, 0, width_px - side - margin, body), camera, state, figures, strip
        )
    view = PixelBox(0, 0, width_px, round(0.6 * body))
    height = body - view.height - margin
    camera = PixelBox(margin, view.bottom, min(round(height * camera_ratio), round(0.5 * width_px)), height)
    state = PixelBox(camera.right + margin, view.bottom, width_px - camera.right - 2 * margin, height)
    return ImageLayout(unit, view, camera, state, figures, strip)


class Letters:
    """Writes text on images, in the typeface that is installed with Matplotlib; caches what it has drawn."""

    def __init__(self) -> None:
        self._font = lru_cache(32)(_font)
        self._mask = lru_cache(_CACHED_TEXTS)(self._draw)
        self._measured = lru_cache(_CACHED_TEXTS)(self._measure)

    def width(self, text: str, size_px: float, bold: bool = False) -> int:
        """Width of a text, pixels."""
        return self._measured(text, round(size_px), bold)

    def write(
        self,
        image: Image,
        at_px: tuple[float, float],
        text: str,
        size_px: float,
        colour: Bgr,
        *,
        bold: bool = False,
    ) -> int:
        """Write a line from the left end of its baseline; what is outside the image is cut off.

        Returns:
            Its width, pixels.
        """
        text = _printable(text)
        mask, left, top = self._mask(text, round(size_px), bold)
        x, y = round(at_px[0]) + left, round(at_px[1]) + top
        height, width = mask.shape
        x0, y0 = max(x, 0), max(y, 0)
        x1, y1 = min(x + width, image.shape[1]), min(y + height, image.shape[0])
        if x1 > x0 and y1 > y0:
            share = mask[y0 - y : y1 - y, x0 - x : x1 - x, None].astype(np.float32) / 255.0
            under = image[y0:y1, x0:x1]
            under[:] = np.rint(under + share * (np.array(colour, np.float32) - under)).astype(np.uint8)
        return self.width(text, size_px, bold)

    def shortened(self, text: str, size_px: float, width_px: float, bold: bool = False) -> str:
        """The text, or its beginning with "…", so that it is no wider than `width_px`."""
        if self.width(text, size_px, bold) <= width_px:
            return text
        while text and self.width(text + "…", size_px, bold) > width_px:
            text = text[:-1]
        return text + "…"

    def _measure(self, text: str, size_px: int, bold: bool) -> int:
        return round(self._font(size_px, bold).getlength(_printable(text)))

    def _draw(self, text: str, size_px: int, bold: bool) -> tuple[Image, int, int]:
        font = self._font(size_px, bold)
        left, top, right, bottom = (round(edge) for edge in font.getbbox(text, anchor="ls"))
        drawn = PilImage.new("L", (max(1, right - left), max(1, bottom - top)))
        ImageDraw.Draw(drawn).text((-left, -top), text, 255, font, anchor="ls")
        return np.asarray(drawn, np.uint8), left, top


def _font(size_px: int, bold: bool) -> ImageFont.FreeTypeFont:
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(_FONTS / name), max(5, size_px))


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text[:200])
