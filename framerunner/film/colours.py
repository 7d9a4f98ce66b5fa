"""Colours of a film, as OpenCV has them."""

from __future__ import annotations

Bgr = tuple[int, int, int]


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
FRAME: dict[str, Bgr] = {"red": bgr("#ee1c1c"), "green": bgr("#12b436"), "blue": bgr("#1f3df5")}
"""Of chips: a little calmer than the pure colours of the frames themselves, so that words on them show."""
