"""Words on pictures, in the typeface that comes with Matplotlib."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
import numpy.typing as npt
from PIL import Image as Pictures
from PIL import ImageDraw, ImageFont

from framerunner.film.colours import Bgr

Mask = npt.NDArray[np.uint8]

_FOLDER = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
_REMEMBERED = 400


class Letters:
    """Writes on images; what was written before is remembered."""

    def __init__(self) -> None:
        self._font = lru_cache(32)(_font)
        self._mask = lru_cache(_REMEMBERED)(self._draw)
        self._measured = lru_cache(_REMEMBERED)(self._measure)

    def width(self, text: str, size_px: float, bold: bool = False) -> int:
        """How wide a text will be, pixels."""
        return self._measured(text, round(size_px), bold)

    def write(
        self,
        image: Mask,
        at_px: tuple[float, float],
        text: str,
        size_px: float,
        colour: Bgr,
        *,
        bold: bool = False,
    ) -> int:
        """Write a text; what does not fit on the image is cut off.

        Args:
            image: BGR, is written on.
            at_px: left end of the line that the letters stand on.
            text: one line.
            size_px: of the letters.
            colour: of the letters.
            bold: or plain.

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
        """The text, or its beginning with "…", so that it is no wider than that."""
        if self.width(text, size_px, bold) <= width_px:
            return text
        while text and self.width(text + "…", size_px, bold) > width_px:
            text = text[:-1]
        return text + "…"

    def _measure(self, text: str, size_px: int, bold: bool) -> int:
        return round(self._font(size_px, bold).getlength(_printable(text)))

    def _draw(self, text: str, size_px: int, bold: bool) -> tuple[Mask, int, int]:
        font = self._font(size_px, bold)
        left, top, right, bottom = (round(edge) for edge in font.getbbox(text, anchor="ls"))
        picture = Pictures.new("L", (max(1, right - left), max(1, bottom - top)))
        ImageDraw.Draw(picture).text((-left, -top), text, 255, font, anchor="ls")
        return np.asarray(picture, np.uint8), left, top


def _font(size_px: int, bold: bool) -> ImageFont.FreeTypeFont:
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(_FOLDER / name), max(5, size_px))


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text[:200])
