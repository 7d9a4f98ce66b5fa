"""The axes of a frame's bars in an image, as straight lines fitted to the bars' edges.

The bars are square rods. Seen from anywhere, the middle of a rod's image is nearly the image of its axis, and
a blur, a threshold or pixels painted too large widen both its edges alike. So each side of a frame is
measured as the middle of its bar; the four axes are a rectangle in the frame's middle plane. Where only the
outer edge is seen (the opening is too small in the image, or hidden), half the bar's width is added to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from vision.bar_edges import BarEdges
from vision.frame_model import FRAME_HEIGHT_M, FRAME_WIDTH_M, Floats

_QUANTISATION = 1.0 / 12.0  # variance of a rounded number
_LEAST_VARIANCE = 4e-4
_WIDTH_VARIANCE = 0.02  # of half a bar's width where only its outer edge is seen
_FEW_VARIANCE = 0.03  # of a line through one or two points, whose errors do not show


@dataclass(frozen=True, slots=True)
class BarLine:
    """One bar's axis: `at + slope * (t - along)`, the row at column t, or the column at row t if steep."""

    steep: bool
    inward: int
    along: float
    at: float
    slope: float
    var_at: float  # variance of `at`
    var_slope: float
    half_px: float  # half the bar's width as it is in the image, measured as `at` is
    first: float  # the first t at which it was measured ...
    last: float  # ... and the last one
    seen: float  # share of the places at which its outer edge was found
    open: float  # share of the places at which its inner edge was found

    def normal_form(self) -> tuple[float, float, float]:
        """(a, b, c) of a x + b y = c, where c is measured as `at` is."""
        c = self.at - self.slope * self.along
        return (1.0, -self.slope, c) if self.steep else (-self.slope, 1.0, c)

    def variance(self, x: float, y: float) -> float:
        """Variance of where the line is, at a point of it."""
        lever = (y if self.steep else x) - self.along
        return self.var_at + self.var_slope * lever * lever


BarLines = list[BarLine | None]


@dataclass(frozen=True, slots=True)
class Meeting:
    """Where two lines meet, and the standard deviations of that; pixels."""

    x: float
    y: float
    std_x: float
    std_y: float


def fit_lines(edges: Sequence[BarEdges | None], focal_px: float, offsets: Floats | None = None) -> BarLines:
    """Fit the axes of a frame's bars.

    Args:
        edges: of the bars.
        focal_px: focal length.
        offsets: what `frame_model.bar_offsets` says of these edges, at the first and last place of each side
            and with the spread of the pixels, if a pose is known; else the edges are taken to be symmetric.
    """
    lines: BarLines = [
        None if bar is None else _fitted(bar, None if offsets is None else offsets[k])
        for k, bar in enumerate(edges)
    ]
    _balance(lines, focal_px)
    return lines


def meeting(one: BarLine | None, other: BarLine | None) -> Meeting | None:
    """Where two lines meet; None if one is missing or they are (nearly) parallel."""
    if one is None or other is None:
        return None
    a, b, c = one.normal_form()
    d, e, f = other.normal_form()
    det = a * e - b * d
    if abs(det) < 0.05:
        return None
    x, y = (c * e - b * f) / det, (a * f - c * d) / det
    var_one, var_other = one.variance(x, y), other.variance(x, y)
    std_x = sqrt(e * e * var_one + b * b * var_other) / abs(det)
    std_y = sqrt(d * d * var_one + a * a * var_other) / abs(det)
    return Meeting(x, y, std_x, std_y)


def _fitted(bar: BarEdges, offsets: Floats | None) -> BarLine | None:
    outer_ok, inner_ok = bar.outer_ok, bar.inner_ok
    both = outer_ok & inner_ok
    usable = outer_ok | inner_ok
    count, boths, used = len(both), int(both.sum()), int(usable.sum())
    if used == 0:
        return None
    # From here on pixels count towards the opening.
    outer, inner = bar.inward * bar.outer, bar.inward * bar.inner
    if offsets is None:
        to_outer, to_inner = -bar.half_px, bar.half_px
    else:
        share = (bar.t - bar.t[0]) / max(float(bar.t[-1] - bar.t[0]), 1.0)
        to_outer = offsets[0, 0] + (offsets[0, 1] - offsets[0, 0]) * share
        to_inner = offsets[1, 0] + (offsets[1, 1] - offsets[1, 0]) * share
    half = 0.5 * (to_inner - to_outer)
    if boths >= max(1, count // 4):  # what it should be is less sure than what is seen
        wider = 0.5 * float((inner - outer)[both].mean()) - float(half[both].mean())
        to_outer, to_inner, half = to_outer - wider, to_inner + wider, half + wider
    by_outer, by_inner = outer - to_outer, inner - to_inner
    axis = np.where(both, 0.5 * (by_outer + by_inner), np.where(outer_ok, by_outer, by_inner))
    t, u = bar.t, bar.inward * axis
    if used < count:
        t, u = t[usable], u[usable]
    fit, residual = _line(t, u, bar.slope)
    good = residual <= max(1.0, 2.5 * float(np.median(residual)))
    if not good.all():
        t, u = t[good], u[good]
        fit, residual = _line(t, u, bar.slope)
    edges = 2.0 if 2 * boths > count else 1.0
    first, last = float(t[0]), float(t[-1])
    var_at, var_slope = _variances(len(t), last - first, fit[2], edges, float(residual @ residual) / len(t))
    return BarLine(
        bar.steep, bar.inward, *fit, var_at, var_slope, float(half.mean()), first, last,
        float(outer_ok.sum()) / count, float(inner_ok.sum()) / count,
    )  # fmt: skip


def _line(t: Floats, u: Floats, slope: float) -> tuple[tuple[float, float, float], Floats]:
    """Least squares: mean of t, value there and slope (the given one if there are few points); residuals."""
    mean, at = float(t.sum()) / len(t), float(u.sum()) / len(t)
    centred = t - mean
    if len(t) >= 3:
        slope = float(centred @ u) / float(centred @ centred)
    return (mean, at, slope), np.abs(u - at - slope * centred)


def _variances(
    count: int, length: float, slope: float, edges: float, mean_square: float
) -> tuple[float, float]:
    """Variances of a fitted line's middle and slope.

    The pixels' rounding errors along a line are independent only where the line changes rows: a level line is
    rounded alike everywhere. On a slanted line the painter also rounds where it begins, which moves all of it.
    The numbers were fitted to some ten thousand painted bars.
    """
    steps = abs(slope) * length
    noise = max(_QUANTISATION / edges, mean_square)
    slanted = slope * slope * _QUANTISATION
    var_at = noise / min(float(count), 1.0 + 8.0 * steps * steps) + slanted / edges + _LEAST_VARIANCE
    if edges == 1.0:
        var_at += _WIDTH_VARIANCE
    if count < 3:
        var_at += _FEW_VARIANCE
    lever = max(length, 2.0 if count > 2 else 3.0)
    independent = min(float(count), 3.5 + 2.0 * steps * steps)
    var_slope = 12.0 * (noise + 1.5 * slanted) / (independent * lever * lever)
    return var_at, var_slope


def _balance(lines: BarLines, focal_px: float) -> None:
    """Draw the slopes of opposite sides together as far as perspective cannot part them: far frames."""
    for one, other in ((0, 2), (3, 1)):
        a, b = lines[one], lines[other]
        if a is None or b is None or a.steep != b.steep:
            continue
        apart_px = abs(a.at - b.at)
        long_px = max(a.last - a.first, b.last - b.first) + 2.0
        # The frame's ends differ in depth by no more than its width (height for the upright bars), and its
        # distance is to the focal length as its size to its image.
        height_px, deep_m = (apart_px, FRAME_WIDTH_M) if one == 0 else (long_px, 0.6 * FRAME_HEIGHT_M)
        parted_px = 0.5 * deep_m * apart_px * height_px / (FRAME_HEIGHT_M * focal_px)
        prior = (2.0 * parted_px / long_px) ** 2
        share = 1.0 / (prior + a.var_slope + b.var_slope)
        gain = (a.slope - b.slope) * share
        lines[one] = replace(
            a, slope=a.slope - a.var_slope * gain, var_slope=a.var_slope * (1.0 - a.var_slope * share)
        )
        lines[other] = replace(
            b, slope=b.slope + b.var_slope * gain, var_slope=b.var_slope * (1.0 - b.var_slope * share)
        )
