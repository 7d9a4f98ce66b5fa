"""Where the bars of a gate begin and end across, in the columns and rows of an image that they cross."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor, hypot, sqrt

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShape
from vision.calibration.lens import Lens
from vision.gate_model import Floats, Point, Segment, Sides
from vision.patch import BACKGROUND, OWN, ImagePatch, Labels

Flags = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]

_NO_SIDE = ((0.0, 0.0), (0.0, 0.0))

_OUTSIDE_PX, _INSIDE_PX = 3, 2  # how far from a first estimate of a side its outer edge is looked for
_OUTWARD = np.array([-2, -1, 0, 1])  # pixels looked at around the end of a bar, from outside
_MAX_SAMPLES = 40  # per side
_SLACK_PX, _SLACK_SHARE = 2.5, 1.5  # a bar may look wider than expected by this or this share of its half


@dataclass(frozen=True, slots=True, eq=False)
class BarEdges:
    """The edges of a gate's bars, pixels from the optical axis; a row for each side.

    A side that is nearer to a column than to a row of the image is steep. It is measured in rows t, the
    others in columns t. What is measured there counts towards the opening: the column (row if not steep)
    times `inward`.

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
    def forward(self) -> Flags:
        """Per side, whether t grows going clockwise."""
        steep = np.array(self.steep)
        return np.where(steep, self.inward < 0.0, self.inward > 0.0)

    @property
    def spans(self) -> Floats:
        """The first and the last place of each side, shape (4, 2)."""
        last = np.maximum(self.used.sum(axis=1) - 1, 0)
        return np.array([self.t[:, 0], self.t[np.arange(4), last]]).T


Widths = list[tuple[float, float]]
"""Half the width of each bar's image at the start and the end of its side, across the bar."""


def find_edges(patch: ImagePatch, sides: Sides, half_px: Widths) -> BarEdges:
    """Find the edges of all four bars.

    Args:
        patch: the region.
        sides: first estimates of the outer edges, pixels from the optical axis, from pixel centre to centre.
        half_px: what half the widths of the bars should be.

    Returns:
        The edges, for an ideal camera.
    """
    lens = patch.lens
    bows: list[float] = [0.0] * 4
    if lens is not None:
        sides, bows = _as_seen(sides, lens)
    corners = [_inner_corner(sides, half_px, k) for k in range(4)]
    plans = [
        _NOWHERE if side is None else _plan(side, half_px[k], corners[k], corners[(k + 1) % 4], patch.origin)
        for k, side in enumerate(sides)
    ]
    steep = tuple(plan.steep for plan in plans)
    inward, slope, first, step, count, u_first, half_first, half_slope = np.array(
        [plan.numbers for plan in plans]
    ).T[..., None]
    places = np.arange(max(int(count.max()), 1))
    used = places < count
    t = first + step * places
    u = u_first + slope * (t - first)
    if lens is not None:
        u += _bow(t, sides, bows, patch.origin, steep)
    u = np.rint(u)
    half = half_first + half_slope * (t - first)

    labels = patch.labels
    stride = labels.strides[0]
    is_steep = np.array(steep)[:, None]
    base = np.where(is_steep, t * stride + u, u * stride + t).astype(np.intp)
    across = np.where(is_steep, inward, inward * stride).astype(np.intp)
    slack = np.maximum(_SLACK_PX, _SLACK_SHARE * half)
    # A pose that brings a bar next to the camera expects it wider than any image.
    widest = min(float((2.0 * half + slack).max()), float(max(labels.shape)))
    offsets = np.arange(-_OUTSIDE_PX, ceil(widest) + 2)
    index = base[..., None] + across[..., None] * offsets
    around = labels.reshape(-1).take(index, mode="clip").reshape(-1, len(offsets))
    first, end, outer_ok, inner_ok = (
        run.reshape(t.shape) for run in _runs(around, half.reshape(-1), slack.reshape(-1))
    )
    outer, inner = _half_filled(patch.excess, base, across, first, end)
    column, row = patch.origin
    t -= np.where(is_steep, row, column)
    from_here = inward * (u - np.where(is_steep, column, row))
    edges = BarEdges(
        steep, inward[:, 0], slope[:, 0], t, used,
        from_here + outer, from_here + inner, outer_ok & used, inner_ok & used, half,
    )  # fmt: skip
    return edges if lens is None else _straightened(edges, lens)


def _as_seen(sides: Sides, lens: Lens) -> tuple[Sides, list[float]]:
    """The chords of sides in the image, and how far the middle of each is from its chord: columns or rows."""
    ends = [_NO_SIDE if side is None else side for side in sides]
    places = np.array(ends)
    places = lens.all_seen(np.concatenate([places, places.mean(axis=1, keepdims=True)], axis=1))
    chords: list[Segment | None] = []
    bows = []
    for side, ((x0, y0), (x1, y1), (x, y)) in zip(sides, places.tolist(), strict=True):
        dx, dy = x1 - x0, y1 - y0
        if side is None:
            bows.append(0.0)
        elif abs(dy) > abs(dx):  # where the chord is in the row (if it is steep) or column of the middle
            bows.append(x - x0 - dx * (y - y0) / dy)
        else:
            bows.append(y - y0 - dy * (x - x0) / dx if dx else 0.0)
        chords.append(None if side is None else ((x0, y0), (x1, y1)))
    return (chords[0], chords[1], chords[2], chords[3]), bows


def _bow(t: Floats, sides: Sides, bows: list[float], origin: Point, steep: tuple[bool, ...]) -> Floats:
    """How far each place of a side is from its chord, by a parabola, shape (4, n)."""
    spans = []
    for side, is_steep in zip(sides, steep, strict=True):
        ends = ((0.0, 0.0), (1.0, 1.0)) if side is None else side
        start, end = ends[0][is_steep] + origin[is_steep], ends[1][is_steep] + origin[is_steep]
        spans.append((start, end - start or 1.0))
    begin, length = np.array(spans).T[..., None]
    share = (t - begin) / length
    bow: Floats = 4.0 * np.array(bows)[:, None] * share * (1.0 - share)
    return bow


def _straightened(edges: BarEdges, lens: Lens) -> BarEdges:
    """The edges as an ideal camera would see them."""
    steep, inward = np.array(edges.steep)[:, None], edges.inward[:, None]
    both = np.stack([edges.outer, edges.inner, edges.outer + 2.0 * edges.half_px]) * inward
    t = np.broadcast_to(edges.t, both.shape)
    straight = lens.ideal(np.stack([np.where(steep, both, t), np.where(steep, t, both)], axis=-1))
    along = np.where(steep, straight[..., 1], straight[..., 0])
    across = np.where(steep, straight[..., 0], straight[..., 1])
    # Both edges in one column (or row) again: where the outer one is, if it is seen.
    t = np.where(edges.outer_ok, along[0], along[1])
    across += edges.slope[:, None] * (t - along)
    outer, inner, beside = across * inward
    return replace(edges, t=t, outer=outer, inner=inner, half_px=0.5 * (beside - outer))


@dataclass(frozen=True, slots=True)
class _Plan:
    """Where a side is looked for.

    Its numbers: inward, slope, first t, step of t, how many, outer edge at the first t, half the bar's width
    there and how that changes with t.
    """

    steep: bool
    numbers: tuple[float, ...]


_NOWHERE = _Plan(False, (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0))


def expected_widths(sides: Sides, shape: GateShape) -> Widths:
    """What half the widths of the bars should be, by the size of the outline.

    The upright sides tell the scale at their distance. A square bar that is turned looks wider.

    Args:
        sides: first estimates of the outer edges.
        shape: of the gate.
    """
    width_m, height_m = shape.outer_width_m, shape.outer_height_m
    top, right, bottom, left = (None if side is None else _length(side) for side in sides)
    height_right, height_left = right or left, left or right
    if height_right is None or height_left is None:  # as if seen from the front
        width = max(top or 0.0, bottom or 0.0)
        height_right = height_left = width * height_m / width_m
    cosine = 0.7
    if top is not None and bottom is not None:
        seen = (top + bottom) / (height_right + height_left) * height_m / width_m
        cosine = min(1.0, seen)
    turned = cosine + sqrt(1.0 - cosine * cosine)
    share = shape.bar_m / height_m / 2.0
    at_right, at_left = share * max(height_right, 2.0), share * max(height_left, 2.0)
    level = 1.15  # seen from somewhat above or below
    return [
        (level * at_left, level * at_right),
        (turned * at_right,) * 2,
        (level * at_right, level * at_left),
        (turned * at_left,) * 2,
    ]


def _length(side: Segment) -> float:
    (x0, y0), (x1, y1) = side
    return hypot(x1 - x0, y1 - y0)


def _inner_corner(sides: Sides, half_px: Widths, k: int) -> Point:
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


def _plan(side: Segment, half_px: tuple[float, float], start: Point, end: Point, origin: Point) -> _Plan:
    """The columns or rows of a side that are clear of its neighbours' bars.

    Args:
        side: first estimate of its outer edge.
        half_px: half the bar's width at its start and end.
        start: of the inner edge, as seen from the start of the outer one.
        end: the same for the end.
        origin: column and row of the patch where the optical axis is; what is planned is in its pixels.
    """
    column, row = origin
    x0, y0, x1, y1 = side[0][0] + column, side[0][1] + row, side[1][0] + column, side[1][1] + row
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


def _runs(around: Labels, half: Floats, slack: Floats) -> tuple[Places, Places, Flags, Flags]:
    """The run of own pixels that is met first from outside, in each row of samples.

    Returns:
        The first pixel of it and the first one after it, from the estimate; whether its outer edge is a real
        one, and its inner edge.
    """
    inside = around == OWN
    rows = np.arange(len(around))
    first = inside.argmax(axis=1)
    places = np.arange(around.shape[1])
    before = places < first[:, None]
    # A run that begins farther inside, or behind something else, is another bar: this one is hidden.
    hit = inside[rows, first] & (first > 0) & (first <= _OUTSIDE_PX + _INSIDE_PX + half / 2)
    hit &= around[rows, first - 1] == BACKGROUND
    other = around > OWN
    if other.any():
        hit &= ~(other & before & (places >= _OUTSIDE_PX - 1)).any(axis=1)
    after = ~(inside | before)
    end = after.argmax(axis=1)
    inner_ok = (
        hit & after[rows, end] & (around[rows, end] == BACKGROUND) & (end - first <= 2.0 * half + slack)
    )
    return first - _OUTSIDE_PX, end - _OUTSIDE_PX, hit, inner_ok


def _half_filled(
    excess: npt.NDArray[np.int16], base: Places, across: Places, first: Places, end: Places
) -> tuple[Floats, Floats]:
    """Outer and inner edges of runs of pixels, by how far the pixels at their ends are filled.

    A pixel whose excess is between that of the bar and that of what is beside it is filled by that share.
    """
    flat = excess.reshape(-1)
    last, stride = end - 1, across[..., None]
    at_first = flat.take((base + across * first)[..., None] + stride * _OUTWARD, mode="clip")
    at_last = flat.take((base + across * last)[..., None] - stride * _OUTWARD, mode="clip")
    is_wide = last > first
    return first + 0.5 - _filled(at_first, is_wide), last - 0.5 + _filled(at_last, is_wide)


def _filled(excess: npt.NDArray[np.int16], is_wide: Flags) -> Floats:
    """How many of the pixels before, at and after a run's end are filled, less the last of these.

    Args:
        excess: of two pixels beside the run and two of it, shape (..., 4).
        is_wide: the run has more than one pixel.
    """
    farther, beside, edge, within = np.moveaxis(excess.astype(np.float64), -1, 0)
    ground = np.minimum(farther, beside)
    full = np.where(is_wide, np.maximum(edge, within), edge)
    share: Floats = (beside + edge - 2.0 * ground) / np.maximum(full - ground, 1.0)
    return share
