"""First estimates of the four outer edges of a gate, from the outline of its pixels.

The convex hull of a gate's pixels is nearly a quadrilateral: rounding to pixels and the bars' thickness add
short edges. The edge whose removal, by prolonging its neighbours, adds the least area goes first, until four
are left. Edges along the image's border belong to no gate: what they cut off is not known.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShape
from vision.calibration.lens import Lens
from vision.gate_model import Point, Segment, Sides
from vision.patch import Box

_MIN_COLUMNS, _MIN_ROWS = 2, 4  # between the centres of the outermost pixels
_CLEAR = 0.3  # difference in steepness from which on it is clear which sides are upright
_LARGE_HOLE = 0.03  # of the box around a region: smaller ones are no part of an opening
_MAX_ADDED = 0.03  # of the area: less than this is rounding, more is a side


@dataclass(slots=True)
class _Edge:
    start: Point
    end: Point
    real: bool  # not along the image's border


def outer_sides(
    points: npt.NDArray[np.int32], width_px: int, height_px: int, lens: Lens | None = None
) -> list[Sides]:
    """Find the sides of the quadrilateral around a region.

    Args:
        points: pixels on its outline, shape (n, 1, 2), columns and rows of the image.
        width_px: of the image.
        height_px: of the image.
        lens: of a camera that is not ideal.

    Returns:
        Top, right, bottom and left side, clockwise, pixels from the optical axis in the image's middle; None
        for a side that is not seen. Several answers, the likelier one first, if it is not clear which pair of
        sides is upright; none if there is no such quadrilateral.
    """
    column, row = (width_px - 1) / 2, (height_px - 1) / 2
    # Clockwise to the eye, as OpenCV's axes have y upwards.
    if lens is None:
        hull = seen = cv2.convexHull(points)
    else:
        middle = np.array([column, row])
        straight = (lens.ideal(points - middle) + middle).astype(np.float32)
        index = cv2.convexHull(straight, returnPoints=False)
        hull, seen = (each[index.ravel()] for each in (straight, points))
    if len(hull) < 4:
        return []
    (left, top), (right, bottom) = seen.min(axis=(0, 1)).tolist(), seen.max(axis=(0, 1)).tolist()
    if right - left < _MIN_COLUMNS or bottom - top < _MIN_ROWS:
        return []
    cut = left <= 0 or top <= 0 or right >= width_px - 1 or bottom >= height_px - 1
    if cut:
        places, pixels = hull.reshape(-1, 2).tolist(), seen.reshape(-1, 2).tolist()
        edges = _reduced(_edges(places, pixels, width_px, height_px))
        # Begin after a gap, so that neighbours in the list are neighbours.
        begin = next((i for i, edge in enumerate(edges) if edge.real and not edges[i - 1].real), 0)
        segments = [(edge.start, edge.end) for edge in edges[begin:] + edges[:begin] if edge.real]
    else:
        corners = cv2.approxPolyN(hull.astype(np.float32), 4).reshape(-1, 2).tolist()
        segments = [(tuple(corners[i - 1]), tuple(corners[i])) for i in range(len(corners))]
    moved = [((x0 - column, y0 - row), (x1 - column, y1 - row)) for (x0, y0), (x1, y1) in segments]
    return named_sides(moved)


def named_sides(segments: list[Segment]) -> list[Sides]:
    """Say which segment, clockwise, is which side; several answers, the likelier one first, if not clear."""
    answers = (_named(segments, upright) for upright in _upright(segments))
    return [sides for sides in answers if sides is not None]


def sides_by_opening(
    mask: npt.NDArray[np.uint8], box: Box, shape: GateShape, lens: Lens | None = None
) -> list[Sides]:
    """First estimates of a gate's outer edges by its opening: the holes of a region together.

    Args:
        mask: pixels of its colour, of the whole image.
        box: column, row, columns and rows around the region.
        shape: of the gate.
        lens: of a camera that is not ideal.
    """
    column, row, columns, rows = box
    crop = mask[row : row + rows, column : column + columns]
    contours, hierarchy = cv2.findContours(
        crop, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(column, row)
    )
    if hierarchy is None:
        return []
    holes = [hole for hole, links in zip(contours, hierarchy[0], strict=True) if links[3] >= 0]
    large = [hole for hole in holes if cv2.contourArea(hole) > _LARGE_HOLE * columns * rows]
    if not large:
        return []
    hole = np.concatenate(large).astype(np.int32)
    height, width = mask.shape
    return [
        _around(sides, shape)
        for sides in outer_sides(hole, width, height, lens)
        if all(side is not None for side in sides)
    ]


def _around(opening: Sides, shape: GateShape) -> Sides:
    """The outer edges around an opening: its corners, moved by a bar's width along both its sides."""
    corners = [side[0] for side in opening if side is not None]
    across, down = (2.0 * shape.bar_m / size_m for size_m in shape.opening_m)
    moved: list[Point] = []
    for k, (x, y) in enumerate(corners):
        # Corner k is where side k - 1 ends and side k begins; 0 and 2 of the sides are the long ones.
        (bx, by), (nx, ny) = corners[k - 1], corners[(k + 1) % 4]
        back, on = (down, across) if k % 2 == 0 else (across, down)
        moved.append(
            (x + 0.5 * (back * (x - bx) + on * (x - nx)), y + 0.5 * (back * (y - by) + on * (y - ny)))
        )
    a, b, c, d = moved
    return ((a, b), (b, c), (c, d), (d, a))


def _upright(segments: list[Segment]) -> list[list[bool]]:
    """Which sides are upright: the steeper ones in the image; the other way round, too, if not clear."""
    if not 2 <= len(segments) <= 4:
        return []
    steepness = [_steepness(segment) for segment in segments]
    if len(segments) == 2:
        return [[value > 0.7 for value in steepness]]
    if len(segments) == 4:
        excess = (steepness[0] + steepness[2] - steepness[1] - steepness[3]) / 2.0
        one, other = [True, False, True, False], [False, True, False, True]
    else:
        excess = (steepness[0] + steepness[2]) / 2.0 - steepness[1]
        one, other = [True, False, True], [False, True, False]
    if abs(excess) > _CLEAR:
        return [one] if excess > 0.0 else [other]
    return [one, other] if excess > 0.0 else [other, one]


def _named(segments: list[Segment], upright: list[bool]) -> Sides | None:
    """Say which side is which; None if two would be the same."""
    sides: list[Segment | None] = [None, None, None, None]
    for segment, is_upright in zip(segments, upright, strict=True):
        (x0, y0), (x1, y1) = segment
        index = (1 if y1 > y0 else 3) if is_upright else (0 if x1 > x0 else 2)
        if sides[index] is not None:
            return None
        sides[index] = segment
    return (sides[0], sides[1], sides[2], sides[3])


def _steepness(segment: Segment) -> float:
    """Share of a segment's length that is upright in the image, 0..1."""
    (x0, y0), (x1, y1) = segment
    return abs(y1 - y0) / max(hypot(x1 - x0, y1 - y0), 1e-9)


def _edges(places: list[list[float]], pixels: list[list[int]], width_px: int, height_px: int) -> list[_Edge]:
    """The edges of a hull; those whose pixels are along one border of the image are not real."""
    edges: list[_Edge] = []
    for i, (x1, y1) in enumerate(pixels):
        x0, y0 = pixels[i - 1]
        border = (x0 == x1 and x0 in (0, width_px - 1)) or (y0 == y1 and y0 in (0, height_px - 1))
        (start_x, start_y), (end_x, end_y) = places[i - 1], places[i]
        edges.append(_Edge((float(start_x), float(start_y)), (float(end_x), float(end_y)), not border))
    return edges


def _reduced(edges: list[_Edge]) -> list[_Edge]:
    """Remove the shortest detours until four real edges are left, and further ones that are only rounding."""
    area = abs(sum(e.start[0] * e.end[1] - e.end[0] * e.start[1] for e in edges)) / 2.0
    while True:
        real = [i for i, edge in enumerate(edges) if edge.real]
        best: tuple[float, int, Point] | None = None
        for i in real:
            removal = _removal(edges[i - 1], edges[i], edges[(i + 1) % len(edges)])
            if removal is not None and (best is None or removal[0] < best[0]):
                best = (removal[0], i, removal[1])
        if best is None or (len(real) <= 4 and best[0] > max(1.0, _MAX_ADDED * area)):
            return edges
        _, i, meeting = best
        edges[i - 1].end = meeting
        edges[(i + 1) % len(edges)].start = meeting
        del edges[i]
        if len(edges) < 4:
            return edges


def _removal(before: _Edge, edge: _Edge, after: _Edge) -> tuple[float, Point] | None:
    """The area that is added when the neighbours of an edge are prolonged until they meet, and where."""
    (x0, y0), (x1, y1) = edge.start, edge.end
    ux, uy = x0 - before.start[0], y0 - before.start[1]
    vx, vy = after.end[0] - x1, after.end[1] - y1
    turn = ux * vy - uy * vx
    if turn <= 1e-9:  # they do not meet on this side
        return None
    t = ((x1 - x0) * vy - (y1 - y0) * vx) / turn
    if t < 0.0:
        return None
    x, y = x0 + t * ux, y0 + t * uy
    area = 0.5 * abs((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0))
    return area, (x, y)
