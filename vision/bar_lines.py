"""The axes of a gate's bars in an image, as straight lines fitted to the bars' edges.

The bars are square rods. Seen from anywhere, the middle of a rod's image is nearly the image of its axis, and
a blur or an image's brightness curve moves both its edges alike. So each side of a gate is
measured as the middle of its bar; the four axes are a rectangle in the gate's middle plane. Where only the
outer edge is seen (the opening is too small in the image, or hidden), half the bar's width is added to it.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from vision.bar_edges import BarEdges, Flags
from vision.gate_model import Floats, GateModel

_QUANTISATION = 1.0 / 12.0  # variance of a rounded number
_LEAST_VARIANCE = 4e-4
_WIDTH_VARIANCE = 0.02  # of half a bar's width where only its outer edge is seen ...
_WIDTH_SHARE = 0.06  # ... and its standard deviation as a share of it, in addition
_FEW_VARIANCE = 0.03  # of a line through one or two points, whose errors do not show


class BarLine(NamedTuple):
    """One bar's axis: `at + slope * (t - along)`, the row at column t, or the column at row t if steep."""

    steep: bool
    inward: float  # 1 if the opening is on the side of larger columns (rows if not steep), else -1
    along: float
    at: float
    slope: float
    var_at: float  # variance of `at`
    var_slope: float
    first: float  # the first t at which it was measured ...
    last: float  # ... and the last one
    half_px: float  # half the bar's width as it is in the image, measured as `at` is
    points: int  # of the fit
    seen: float  # share of the places at which its outer edge was found
    open: float  # share of the places at which both edges were found

    def normal_form(self) -> tuple[float, float, float]:
        """(a, b, c) of a x + b y = c, where c is measured as `at` is."""
        c = self.at - self.slope * self.along
        return (1.0, -self.slope, c) if self.steep else (-self.slope, 1.0, c)

    def variance(self, x: float, y: float) -> float:
        """Variance of where the line is, at a point of it."""
        lever = (y if self.steep else x) - self.along
        return self.var_at + self.var_slope * lever * lever


BarLines = list[BarLine | None]


class Meeting(NamedTuple):
    """Where two lines meet, and the standard deviations of that; pixels."""

    x: float
    y: float
    std_x: float
    std_y: float


def fit_lines(edges: BarEdges, model: GateModel, offsets: Floats | None = None) -> BarLines:
    """Fit the axes of a gate's bars; None where nothing of a bar is seen.

    Args:
        edges: of the bars.
        model: of the gate.
        offsets: what `GateModel.bar_offsets` says of these edges, at the first and last place of each
            side, if a pose is known; else the edges are taken to be symmetric.
    """
    both = edges.outer_ok & edges.inner_ok
    axis, half_px = _axis(edges, both, offsets)
    usable = edges.outer_ok | edges.inner_ok
    fit = _least_squares(edges, axis, usable)
    if bool((fit.residual > 1.0).any()):
        limit = np.maximum(1.0, 1.7 * np.sqrt(fit.mean_square))[:, None]
        usable &= fit.residual <= limit
        fit = _least_squares(edges, axis, usable)
    first = np.where(usable, edges.t, np.inf).min(axis=1)
    last = np.where(usable, edges.t, -np.inf).max(axis=1)
    numbers = np.array([*fit[:5], first, last, half_px, *(f.sum(axis=1) for f in (both, edges.outer_ok))])
    lines: BarLines = []
    for k, side in enumerate(numbers.T.tolist()):
        points, along, at, slope, square, start, end, half, boths, outers = side
        if points == 0.0:
            lines.append(None)
            continue
        planned = float(edges.used[k].sum())
        two_edges = 2.0 * boths > points
        var_at, var_slope = _variances(points, end - start, slope, 0.0 if two_edges else half, square)
        lines.append(
            BarLine(
                steep=edges.steep[k],
                inward=float(edges.inward[k]),
                along=along,
                at=at,
                slope=slope,
                var_at=var_at,
                var_slope=var_slope,
                first=start,
                last=end,
                half_px=half,
                points=int(points),
                seen=outers / planned,
                open=boths / planned,
            )
        )
    _balance(lines, model)
    return lines


class _Fit(NamedTuple):
    """Least squares, per side; and the distance of every point from its line."""

    points: Floats  # how many
    along: Floats
    at: Floats
    slope: Floats
    mean_square: Floats
    residual: Floats


def _axis(edges: BarEdges, both: Flags, offsets: Floats | None) -> tuple[Floats, Floats]:
    """Where the axis of each bar is by its edges, shape (4, n); half the width of each bar."""
    if offsets is None:
        to_outer, to_inner = -edges.half_px, edges.half_px
    else:
        spans = edges.spans
        share = (edges.t - spans[:, :1]) / np.maximum(spans[:, 1:] - spans[:, :1], 1.0)
        to_outer = offsets[:, 0, :1] + (offsets[:, 0, 1:] - offsets[:, 0, :1]) * share
        to_inner = offsets[:, 1, :1] + (offsets[:, 1, 1:] - offsets[:, 1, :1]) * share
    # What the width should be is less sure than what is seen.
    boths = both.sum(axis=1)
    half = 0.5 * (to_inner - to_outer)
    wider = (0.5 * (edges.inner - edges.outer) - half) * both
    enough = 4 * boths >= np.maximum(edges.used.sum(axis=1), 4)
    mean_wider = np.where(enough, wider.sum(axis=1) / np.maximum(boths, 1), 0.0)[:, None]
    by_outer, by_inner = edges.outer - to_outer + mean_wider, edges.inner - to_inner - mean_wider
    axis = np.where(both, 0.5 * (by_outer + by_inner), np.where(edges.outer_ok, by_outer, by_inner))
    return edges.inward[:, None] * axis, (half[:, :1] + mean_wider)[:, 0]


def _least_squares(edges: BarEdges, axis: Floats, usable: Flags) -> _Fit:
    count = usable.sum(axis=1).astype(np.float64)
    some = np.maximum(count, 1.0)
    along = (edges.t * usable).sum(axis=1) / some
    at = (axis * usable).sum(axis=1) / some
    centred = (edges.t - along[:, None]) * usable
    square = (centred * centred).sum(axis=1)
    slope = np.where(count >= 3.0, (centred * axis).sum(axis=1) / np.maximum(square, 1e-9), edges.slope)
    residual = np.abs(axis - at[:, None] - slope[:, None] * centred) * usable
    return _Fit(count, along, at, slope, (residual * residual).sum(axis=1) / some, residual)


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


def _variances(
    count: float, length: float, slope: float, guessed_half_px: float, mean_square: float
) -> tuple[float, float]:
    """Variances of a fitted line's middle and slope.

    The pixels' rounding errors along a line are independent only where the line changes rows: a level line is
    rounded alike everywhere. On a slanted line the painter rounds where it begins, too, which moves all of
    it. The numbers were fitted to some ten thousand painted bars.

    Args:
        count: points.
        length: from the first to the last one.
        slope: of the line.
        guessed_half_px: half the bar's width if that was added to one edge, 0 if both edges are seen.
        mean_square: of the points' distances from the line.
    """
    steps = abs(slope) * length
    edges = 1.0 if guessed_half_px > 0.0 else 2.0
    noise = max(_QUANTISATION / edges, mean_square)
    slanted = slope * slope * _QUANTISATION
    var_at = noise / min(count, 1.0 + 8.0 * steps * steps) + slanted / edges + _LEAST_VARIANCE
    if guessed_half_px > 0.0:
        var_at += _WIDTH_VARIANCE + (_WIDTH_SHARE * guessed_half_px) ** 2
    if count < 3.0:
        var_at += _FEW_VARIANCE
    lever = max(length, 2.0 if count >= 3.0 else 3.0)
    independent = min(count, 3.5 + 2.0 * steps * steps)
    return var_at, 12.0 * (noise + 1.5 * slanted) / (independent * lever * lever)


def _balance(lines: BarLines, model: GateModel) -> None:
    """Draw the slopes of opposite sides together as far as perspective cannot part them: far gates."""
    width_m, height_m = model.shape.outer_width_m, model.shape.outer_height_m
    for one, other in ((0, 2), (3, 1)):
        a, b = lines[one], lines[other]
        if a is None or b is None or a.steep != b.steep:
            continue
        between = 0.5 * (a.along - b.along)
        apart_px = abs(a.at - b.at - (a.slope + b.slope) * between)
        long_px = max(a.last - a.first, b.last - b.first) + 2.0
        # The gate's ends differ in depth by no more than its width (height for the upright bars), and its
        # distance is to the focal length as its size to its image.
        height_px, deep_m = (apart_px, width_m) if one == 0 else (long_px, 0.6 * height_m)
        parted_px = 0.5 * deep_m * apart_px * height_px / (height_m * model.focal_px)
        prior = (2.0 * parted_px / long_px) ** 2
        share = 1.0 / (prior + a.var_slope + b.var_slope)
        gain = (a.slope - b.slope) * share
        lines[one] = a._replace(
            slope=a.slope - a.var_slope * gain, var_slope=a.var_slope * (1.0 - a.var_slope * share)
        )
        lines[other] = b._replace(
            slope=b.slope + b.var_slope * gain, var_slope=b.var_slope * (1.0 - b.var_slope * share)
        )
