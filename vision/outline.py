"""The four bars of a frame in an image, as straight lines fitted to all their pixels.

A frame's bars are square rods. Seen from anywhere, the middle of a rod's image is the image of the rod's axis
(to second order of thickness over distance), and a blur, a threshold or pixels painted too large widen both
its edges alike. So each side of a frame is measured as the middle of its bar: across the bar, in every column
or row of the image that it crosses, the run of pixels is found, and a line is fitted to the middles of the
runs. The four axes of a frame's bars are a rectangle in its middle plane.

Where the inner edge of a bar cannot be seen (the opening is too small in the image, or hidden), half the
bar's expected width is added to its outer edge; only this depends on how much larger than true the pixels
are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor, hypot, sqrt

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Labels = npt.NDArray[np.uint8]
Point = tuple[float, float]
Segment = tuple[Point, Point]
Sides = tuple[Segment | None, Segment | None, Segment | None, Segment | None]

BACKGROUND, OWN, FOREIGN = 0, 1, 2
"""Values of pixels: neither, of the region, and what may hide a part of it (or is not in the image)."""

FRAME_WIDTH_M, FRAME_HEIGHT_M, BAR_M = 0.42, 0.22, 0.02

_OUTSIDE_PX = 3  # how far outside a first estimate of a side its outer edge is looked for
_MAX_SAMPLES = 40  # per side
_QUANTISATION = 1.0 / 12.0  # variance of a rounded number


@dataclass(frozen=True, slots=True)
class Line:
    """One bar's axis: `at + slope * (t - along)`, the row at column t, or the column at row t if steep."""

    steep: bool
    along: float
    at: float
    slope: float
    var_at: float  # variance of `at`
    var_slope: float
    half_px: float  # half the bar's width as it is in the image, measured as `at` is
    inward: int  # 1 if the frame's opening is on the side of larger rows (columns), else -1
    outer_share: float  # share of the samples in which the outer edge was found
    inner_share: float
    count: int  # samples
    length: float  # along the line's axis, from the first to the last sample

    def normal_form(self) -> tuple[float, float, float]:
        """(a, b, c) of a x + b y = c, where c is measured as `at` is."""
        c = self.at - self.slope * self.along
        return (1.0, -self.slope, c) if self.steep else (-self.slope, 1.0, c)

    def variance(self, x: float, y: float) -> float:
        """Variance of where the line is, at a point of it."""
        lever = (y if self.steep else x) - self.along
        return self.var_at + self.var_slope * lever * lever

    def moved_outward(self, distance_px: float) -> tuple[float, float, float]:
        """Normal form of the line after a move away from the opening."""
        a, b, c = self.normal_form()
        return (a, b, c - self.inward * distance_px)


Lines = tuple[Line | None, Line | None, Line | None, Line | None]


def fit_lines(labels: Labels, sides: Sides, focal_px: float, spread_px: float) -> Lines:
    """Fit the axes of a frame's bars.

    Args:
        labels: pixels, with a margin around the region in which the widest search ends.
        sides: first estimates of the outer edges: top, right, bottom, left, clockwise, from pixel centre to
            pixel centre; None where there is none.
        focal_px: focal length.
        spread_px: how much larger than its true outline a region is painted on each side.

    Returns:
        The lines of those sides that could be fitted.
    """
    half_px = _expected_half_px(sides, focal_px, spread_px)
    widest = max(half_px)
    samples = [_sample(side, widest) for side in sides]
    used = [sample for sample in samples if sample is not None]
    if not used:
        return (None, None, None, None)
    reach = ceil(2.0 * widest + 3.0)
    stride = labels.strides[0]
    base = np.concatenate(
        [s.along * (stride if s.steep else 1) + s.start * (1 if s.steep else stride) for s in used]
    )
    step = np.repeat([s.inward * (1 if s.steep else stride) for s in used], [len(s.along) for s in used])
    offsets = np.arange(-_OUTSIDE_PX, reach + 1)
    index = base[:, None] + step[:, None] * offsets
    around = labels.reshape(-1).take(index, mode="clip")
    runs = _runs(around, 2.0 * widest + 2.5)
    lines: list[Line | None] = []
    start = 0
    for sample, half in zip(samples, half_px, strict=True):
        if sample is None:
            lines.append(None)
            continue
        stop = start + len(sample.along)
        lines.append(_fitted(sample, runs[:, start:stop], half))
        start = stop
    _balance(lines, focal_px)
    return (lines[0], lines[1], lines[2], lines[3])


def expected_bar_px(height_px: float) -> float:
    """Widest that a bar looks beside the height of its frame: seen at 45 degrees."""
    return height_px * BAR_M / FRAME_HEIGHT_M * sqrt(2.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """Where a side is looked for: columns (rows if steep) and the row (column) of its outer edge there."""

    steep: bool
    along: npt.NDArray[np.int64]
    start: npt.NDArray[np.int64]
    inward: int
    slope: float


def _expected_half_px(sides: Sides, focal_px: float, spread_px: float) -> tuple[float, float, float, float]:
    """Half the widths of the bars' images, top, right, bottom, left, from the size of the outline."""
    lengths = [None if side is None else _length(side) + 1.0 - 2.0 * spread_px for side in sides]
    heights = [length for length in (lengths[1], lengths[3]) if length is not None]
    widths = [length for length in (lengths[0], lengths[2]) if length is not None]
    height = max(sum(heights) / len(heights) if heights else 0.0, 1.0)
    if not heights:
        height = max(max(widths) * FRAME_HEIGHT_M / FRAME_WIDTH_M, 1.0)
    width = sum(widths) / len(widths) if len(widths) == 2 and len(heights) == 2 else 2.0 * height
    metre_px = height / FRAME_HEIGHT_M
    cosine = min(1.0, max(width, 0.0) / metre_px / FRAME_WIDTH_M)
    upright = 0.5 * BAR_M * metre_px * (cosine + sqrt(1.0 - cosine * cosine)) + spread_px
    level = 0.5 * BAR_M * metre_px * 1.1 + spread_px
    return (level, upright, level, upright)


def _length(side: Segment) -> float:
    (x0, y0), (x1, y1) = side
    return hypot(x1 - x0, y1 - y0)


def _sample(side: Segment | None, widest: float) -> _Sample | None:
    """The columns or rows of a side that are clear of its neighbours' bars."""
    if side is None:
        return None
    (x0, y0), (x1, y1) = side
    dx, dy = x1 - x0, y1 - y0
    steep = abs(dy) > abs(dx)
    # Going round clockwise, the opening is on the right: below the top side, left of the right one.
    inward = (-1 if dy > 0 else 1) if steep else (1 if dx > 0 else -1)
    (t0, u0, t1, u1) = (y0, x0, y1, x1) if steep else (x0, y0, x1, y1)
    if t0 > t1:
        t0, u0, t1, u1 = t1, u1, t0, u0
    if t1 - t0 < 1.0:
        return None
    margin = min(2.0 * widest + 0.5, 0.45 * (t1 - t0))
    first, last = ceil(t0 + margin), floor(t1 - margin)
    if first > last:
        first = last = round(0.5 * (t0 + t1))
    along = np.arange(first, last + 1, (last - first) // _MAX_SAMPLES + 1)
    slope = (u1 - u0) / (t1 - t0)
    start = np.rint(u0 + slope * (along - t0)).astype(np.int64)
    return _Sample(steep, along, start, inward, slope)


def _runs(around: Labels, longest: float) -> Floats:
    """The run of own pixels that is met first from outside in each row of samples.

    Returns:
        Rows: outer edge, whether it is a real edge, inner edge, whether that is real; edges as offsets in
        pixels from the estimate, half-way between pixel centres.
    """
    inside = around == OWN
    lines = np.arange(len(around))
    first = inside.argmax(axis=1)
    hit = inside[lines, first] & (first > 0)
    outer_ok = hit & (around[lines, first - 1] == BACKGROUND)
    after = ~inside
    after &= np.arange(around.shape[1]) > first[:, None]
    end = after.argmax(axis=1)
    inner_ok = hit & after[lines, end] & (around[lines, end] == BACKGROUND) & (end - first <= longest)
    shift = -_OUTSIDE_PX - 0.5
    return np.array([first + shift, outer_ok, end + shift, inner_ok])


def _fitted(sample: _Sample, runs: Floats, expected_half_px: float) -> Line | None:
    outer_ok, inner_ok = runs[1] > 0.0, runs[3] > 0.0
    count = len(outer_ok)
    both = outer_ok & inner_ok
    outers, boths = int(outer_ok.sum()), int(both.sum())
    # The bar's width where it is seen; else what it should be.
    half = expected_half_px
    if boths >= max(1, count // 4):
        half = 0.5 * float((runs[2] - runs[0])[both].mean())
    middle = np.where(both, 0.5 * (runs[0] + runs[2]), np.where(outer_ok, runs[0] + half, runs[2] - half))
    usable = outer_ok | inner_ok
    if not usable.any():
        return None
    t = sample.along[usable].astype(np.float64)
    u = sample.start[usable] + sample.inward * middle[usable]
    fit = _line(t, u, sample.slope)
    residual = np.abs(u - (fit[1] + fit[2] * (t - fit[0])))
    good = residual <= max(1.0, 2.5 * float(np.median(residual)))
    if not good.all():
        t, u = t[good], u[good]
        fit = _line(t, u, sample.slope)
        residual = np.abs(u - (fit[1] + fit[2] * (t - fit[0])))
    mean, at, slope = fit
    length = float(t[-1] - t[0]) if len(t) > 1 else 0.0
    edges = 2.0 if boths > 0.5 * count else 1.0
    var_at, var_slope = _variances(len(t), length, slope, edges, float((residual * residual).mean()))
    if edges == 1.0:
        var_at += 0.02
    return Line(
        sample.steep, mean, at, slope, var_at, var_slope, half, sample.inward,
        outers / count, float(inner_ok.sum()) / count, len(t), length,
    )  # fmt: skip


def _line(t: Floats, u: Floats, slope: float) -> tuple[float, float, float]:
    """Least squares: mean of t, value there and slope; the given slope if there are too few points."""
    mean, at = float(t.mean()), float(u.mean())
    if len(t) < 3:
        return mean, at, slope
    centred = t - mean
    return mean, at, float(centred @ u) / float(centred @ centred)


def _variances(
    count: int, length: float, slope: float, edges: float, mean_square: float
) -> tuple[float, float]:
    """Variances of a fitted line's middle and slope.

    The pixels' rounding errors along a line are independent only where the line changes rows: a level line is
    rounded alike everywhere.
    """
    steps = abs(slope) * length
    independent = min(float(count), 1.0 + steps * steps)
    noise = max(_QUANTISATION / edges, mean_square)
    var_at = noise / independent + 4e-4
    lever = max(length, 2.0)
    var_slope = 12.0 * noise / (min(float(count), 3.0 + 3.0 * steps) * lever * lever)
    return var_at, var_slope


def _balance(lines: list[Line | None], focal_px: float) -> None:
    """Draw the slopes of opposite sides together as far as perspective cannot part them: far frames."""
    for one, other in ((0, 2), (3, 1)):
        a, b = lines[one], lines[other]
        if a is None or b is None or a.steep != b.steep:
            continue
        apart_px = abs(a.at - b.at)
        long_px = max(a.length, b.length) + 2.0
        # The frame's ends differ in depth by no more than its width (height for the upright bars), and its
        # distance is to the focal length as its size to its image.
        height_px, deep_m = (apart_px, FRAME_WIDTH_M) if one == 0 else (long_px, 0.6 * FRAME_HEIGHT_M)
        parted_px = 0.5 * deep_m * apart_px * height_px / (FRAME_HEIGHT_M * focal_px)
        prior = (2.0 * parted_px / long_px) ** 2
        gain = (a.slope - b.slope) / (prior + a.var_slope + b.var_slope)
        share = 1.0 / (prior + a.var_slope + b.var_slope)
        lines[one] = replace(
            a, slope=a.slope - a.var_slope * gain, var_slope=a.var_slope * (1.0 - a.var_slope * share)
        )
        lines[other] = replace(
            b, slope=b.slope + b.var_slope * gain, var_slope=b.var_slope * (1.0 - b.var_slope * share)
        )
