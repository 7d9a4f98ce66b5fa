"""Where the bars of a frame begin and end across, in the columns and rows of an image that they cross."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, hypot, sqrt

import numpy as np
import numpy.typing as npt

from vision.frame_model import BAR_M, FRAME_HEIGHT_M, FRAME_WIDTH_M, Floats, Point, Segment, Sides

Labels = npt.NDArray[np.uint8]
Flags = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.intp]

BACKGROUND, OWN, FOREIGN = 0, 1, 2
"""Values of pixels: neither, of the region, and what may hide a part of it (or is not in the image)."""

_OUTSIDE_PX = 3  # how far outside a first estimate of a side its outer edge is looked for
_MAX_SAMPLES = 40  # per side
_SLACK_PX = 2.5  # a bar may look wider than expected by this much


@dataclass(frozen=True, slots=True, eq=False)
class BarEdges:
    """The edges of a frame's bars, pixels of the labelled image; a row for each side.

    A side that is nearer to a column than to a row of the image is steep. It is measured in rows t, the
    others in columns t. What is measured there counts towards the opening: the column (row if not steep)
    times `inward`, half-way between pixel centres.

    Attributes:
        steep: per side.
        inward: per side, 1 if the opening is on the side of larger columns (rows), else -1.
        slope: per side, of the first estimate.
        t: rows or columns in which it is measured, in order, shape (4, n).
        used: where there is a measurement; a side has fewer than n, or none.
        outer: the outer edge.
        inner: the inner edge.
        outer_ok: where the outer edge is one, not hidden and not outside the image.
        inner_ok: the same for the inner edge.
        half_px: what half the bar's width should be there.
    """

    steep: tuple[bool, ...]
    inward: Floats
    slope: Floats
    t: Floats
    used: Flags
    outer: Floats
    inner: Floats
    outer_ok: Flags
    inner_ok: Flags
    half_px: Floats

    @property
    def spans(self) -> Floats:
        """The first and the last place of each side, shape (4, 2)."""
        last = np.maximum(self.used.sum(axis=1) - 1, 0)
        return np.array([self.t[:, 0], self.t[np.arange(4), last]]).T


def find_edges(labels: Labels, sides: Sides, spread_px: float) -> BarEdges:
    """Find the edges of all four bars.

    Args:
        labels: pixels, with a margin around the region in which the widest search ends.
        sides: first estimates of the outer edges, from pixel centre to pixel centre.
        spread_px: how much larger than its true outline a region is painted on each side.
    """
    half_px = _expected_half_px(sides, spread_px)
    corners = [_inner_corner(sides, half_px, k) for k in range(4)]
    plans = [
        _NOWHERE if side is None else _plan(side, half_px[k], corners[k], corners[(k + 1) % 4])
        for k, side in enumerate(sides)
    ]
    steep = tuple(plan.steep for plan in plans)
    inward, slope, first, step, count, u_first, half_first, half_slope = np.array(
        [plan.numbers for plan in plans]
    ).T[..., None]
    places = np.arange(int(count.max()))
    used = places < count
    t = first + step * places
    u = np.rint(u_first + slope * (t - first))
    half = half_first + half_slope * (t - first)

    stride = labels.strides[0]
    is_steep = np.array(steep)[:, None]
    base = np.where(is_steep, t * stride + u, u * stride + t).astype(np.intp)
    across = np.where(is_steep, inward, inward * stride).astype(np.intp)
    offsets = np.arange(-_OUTSIDE_PX, ceil(2.0 * float(half.max()) + _SLACK_PX) + 2)
    index = base[..., None] + across[..., None] * offsets
    around = labels.reshape(-1).take(index, mode="clip").reshape(-1, len(offsets))
    outer, outer_ok, inner, inner_ok = (
        run.reshape(t.shape) for run in _runs(around, (2.0 * half + _SLACK_PX).reshape(-1))
    )
    from_here = inward * u
    return BarEdges(
        steep, inward[:, 0], slope[:, 0], t, used,
        from_here + outer, from_here + inner, outer_ok & used, inner_ok & used, half,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Plan:
    """Where a side is looked for.

    Its numbers: inward, slope, first t, step of t, how many, outer edge at the first t, half the bar's width
    there and how that changes with t.
    """

    steep: bool
    numbers: tuple[float, ...]


_NOWHERE = _Plan(False, (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0))


def _expected_half_px(sides: Sides, spread_px: float) -> list[tuple[float, float]]:
    """Half the widths of the bars at the start and the end of each side, from the size of the outline.

    The upright sides tell the scale at their distance. A square bar that is turned looks wider.
    """
    top, right, bottom, left = (None if side is None else _length(side) for side in sides)
    height_right, height_left = right or left, left or right
    if height_right is None or height_left is None:  # as if seen from the front
        width = max(top or 0.0, bottom or 0.0)
        height_right = height_left = width * FRAME_HEIGHT_M / FRAME_WIDTH_M
    cosine = 0.7
    if top is not None and bottom is not None:
        seen = (top + bottom) / (height_right + height_left) * FRAME_HEIGHT_M / FRAME_WIDTH_M
        cosine = min(1.0, seen)
    turned = cosine + sqrt(1.0 - cosine * cosine)
    share = BAR_M / FRAME_HEIGHT_M / 2.0
    at_right, at_left = share * max(height_right, 2.0), share * max(height_left, 2.0)
    level = 1.15  # seen from somewhat above or below
    return [
        (level * at_left + spread_px, level * at_right + spread_px),
        (turned * at_right + spread_px,) * 2,
        (level * at_right + spread_px, level * at_left + spread_px),
        (turned * at_left + spread_px,) * 2,
    ]


def _length(side: Segment) -> float:
    (x0, y0), (x1, y1) = side
    return hypot(x1 - x0, y1 - y0)


def _inner_corner(sides: Sides, half_px: list[tuple[float, float]], k: int) -> Point:
    """Where the inner edges of the sides k - 1 and k meet, as seen from where their outer edges do."""
    before, after = sides[k - 1], sides[k]
    if before is None or after is None:
        return (0.0, 0.0)
    (ax, ay), (bx, by) = _direction(before), _direction(after)
    sine = max(ax * by - ay * bx, 0.3)
    one, other = 2.0 * half_px[k - 1][1] / sine, 2.0 * half_px[k][0] / sine
    return (one * bx - other * ax, one * by - other * ay)


def _direction(side: Segment) -> Point:
    (x0, y0), (x1, y1) = side
    length = max(hypot(x1 - x0, y1 - y0), 1e-9)
    return ((x1 - x0) / length, (y1 - y0) / length)


def _plan(side: Segment, half_px: tuple[float, float], start: Point, end: Point) -> _Plan:
    """The columns or rows of a side that are clear of its neighbours' bars.

    Args:
        side: first estimate of its outer edge.
        half_px: half the bar's width at its start and end.
        start: of the inner edge, as seen from the start of the outer one.
        end: the same for the end.
    """
    (x0, y0), (x1, y1) = side
    dx, dy = x1 - x0, y1 - y0
    steep = abs(dy) > abs(dx)
    # Going round clockwise, the opening is on the right: below the top side, left of the right one.
    inward = (-1.0 if dy > 0 else 1.0) if steep else (1.0 if dx > 0 else -1.0)
    (t0, u0, t1, u1) = (y0, x0, y1, x1) if steep else (x0, y0, x1, y1)
    from_start = max(start[steep] if t1 > t0 else -start[steep], 0.0)
    from_end = max(-end[steep] if t1 > t0 else end[steep], 0.0)
    half_start, half_end = half_px
    if t0 > t1:
        t0, u0, t1, u1 = t1, u1, t0, u0
        half_start, half_end, from_start, from_end = half_end, half_start, from_end, from_start
    length = t1 - t0
    if length < 1.0:
        return _NOWHERE
    first = ceil(t0 + min(max(from_start, 2.0 * half_start) + 0.5, 0.45 * length))
    last = floor(t1 - min(max(from_end, 2.0 * half_end) + 0.5, 0.45 * length))
    if first > last:
        first = last = round(0.5 * (t0 + t1))
    step = (last - first) // _MAX_SAMPLES + 1
    slope = (u1 - u0) / length
    slant = hypot(1.0, slope)  # across a slanted bar a row or column is longer than the bar is wide
    growth = (half_end - half_start) / length
    u_first, half_first = u0 + slope * (first - t0), half_start + growth * (first - t0)
    count = (last - first) // step + 1
    return _Plan(steep, (inward, slope, first, step, count, u_first, slant * half_first, slant * growth))


def _runs(around: Labels, longest: Floats) -> tuple[Floats, Flags, Floats, Flags]:
    """The run of own pixels that is met first from outside, in each row of samples.

    Returns:
        Outer edge, whether it is a real edge, inner edge, whether that is real; edges in pixels from the
        estimate, half-way between pixel centres.
    """
    inside = around == OWN
    rows = np.arange(len(around))
    first = inside.argmax(axis=1)
    hit = inside[rows, first] & (first > 0)
    outer_ok = hit & (around[rows, first - 1] == BACKGROUND)
    after = ~inside
    after &= np.arange(around.shape[1]) > first[:, None]
    end = after.argmax(axis=1)
    inner_ok = hit & after[rows, end] & (around[rows, end] == BACKGROUND) & (end - first <= longest)
    shift = -_OUTSIDE_PX - 0.5
    return first + shift, outer_ok, end + shift, inner_ok
