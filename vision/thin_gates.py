"""Gates among thin lines of one colour, of which an image of anything has many.

A gate is a ring of four straight bars. Its opening is a hole in the pixels of the lines, and nearly a
quadrilateral; a photograph has few such holes. Each quadrilateral is fitted to the ridges of the colour's
share beside its sides, which are the axes of the bars; all of them at once. What is a gate then has all along
its four sides about the same share, and less on both sides of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np
import numpy.typing as npt

from vision.colour_regions import Plane
from vision.fill_shares import ZERO_EXCESS, FilledPixels, Shares

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.int32]

_JOINED = np.ones((3, 3), np.uint8)  # gaps in lines that are closed
_MIN_COLUMNS, _MIN_ROWS = 3, 3
_MAX_QUADS = 48
_LEAST_AREA = 4.0
_LEAST_QUAD = 0.7  # area of an opening over that of the quadrilateral around it
_PLACES = (0.08 + 0.84 * (np.arange(10.0) + 0.5) / 10.0)[:, None]  # along a side, shape (10, 1)
_REACHES = (3, 2, 2)  # pixels on both sides of an estimate in which a ridge is looked for
_LEAST_SHARE, _LEAST_EXCESS = 0.2, 2.0  # in the middle along a ring
_LEAST_CLEAR = 0.4
_LEAST_CLEAR_PROPOSED = 0.15  # of rings that a network proposes
_AXES = 0.94  # of an outline's size, between the axes of its bars
_FEW, _CLEAR_OF_MANY, _STD_OF_MANY_PX = 2, 0.5, 0.25  # an image with many rings has round ones, too
_LEAST_STD_PX, _STD_SHARE = 0.15, 0.7  # of corners, by the ridges' distances from straight lines


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """What may be a gate.

    Attributes:
        colour: of its bars.
        corners: where the axes of its bars meet, columns and rows of the image, shape (4, 2), clockwise.
        clear: how clearly the weakest side is a line, at most 1.
        std_px: standard deviation of the corners' coordinates.
    """

    colour: str
    corners: Floats
    clear: float
    std_px: float


def find_rings(filled: FilledPixels, proposed: Floats | None = None) -> list[Ring]:
    """Find candidates, the clearest first; each is somewhere else.

    Args:
        filled: the pixels.
        proposed: outlines of what probably is a gate, columns and rows of the image, shape (n, 4, 2).
    """
    quads = _quads(filled)
    holes = len(quads)
    if proposed is not None:
        quads += _proposed_quads(filled, proposed)
    if not quads:
        return []
    corners, deviations = _fitted(filled.share, np.array(quads))
    clear = np.where(_is_of_colour(filled, corners), _clearness(filled.share, corners), -1.0)
    rings: list[Ring] = []
    for k in np.argsort(-clear, kind="stable").tolist():
        if clear[k] < (_LEAST_CLEAR if k < holes else _LEAST_CLEAR_PROPOSED):
            continue
        plane = int(corners[k, :, 1].mean()) // filled.pitch
        offset = (filled.origin[0], filled.origin[1] - plane * filled.pitch)
        std_px = hypot(_LEAST_STD_PX, _STD_SHARE * deviations[k])
        ring = Ring(filled.colours[plane], corners[k] + offset, float(clear[k]), std_px)
        if not any(_overlap(ring, other) for other in rings):
            rings.append(ring)
    if proposed is None and len(rings) > _FEW:  # else the network judges
        rings = [ring for ring in rings if ring.clear > _CLEAR_OF_MANY and ring.std_px < _STD_OF_MANY_PX]
    return rings


def _proposed_quads(filled: FilledPixels, proposed: Floats) -> list[Floats]:
    """Between the axes of the bars of proposed gates, in the plane of each colour."""
    rows, columns = filled.share.shape
    rows //= len(filled.colours)
    middles = proposed.mean(axis=1, keepdims=True)
    quads = []
    for quad in middles + _AXES * (proposed - middles) - np.array(filled.origin):
        column, row = quad.mean(axis=0)
        if 0 <= column < columns and 0 <= row < rows:
            quads += [quad + np.array([0, plane * filled.pitch]) for plane in range(len(filled.colours))]
    return quads


def _quads(filled: FilledPixels) -> list[Floats]:
    """Quadrilaterals around the openings of lines, clockwise in the image, the largest first."""
    found: list[tuple[float, Floats]] = []
    joined = [cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _JOINED) for mask in (filled.mask, filled.broad)]
    for mask in joined:
        contours, hierarchy = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
        if hierarchy is None:
            continue
        for k in np.flatnonzero(hierarchy[0, :, 3] >= 0).tolist():
            quad = _quad(np.asarray(contours[k], np.int32))
            if quad is not None:
                found.append(quad)
    return [quad for _, quad in sorted(found, key=lambda one: -one[0])[:_MAX_QUADS]]


def _quad(hole: Points) -> tuple[float, Floats] | None:
    """The quadrilateral around an opening and its area; None if it is another shape."""
    _, _, wide, high = cv2.boundingRect(hole)
    if wide < _MIN_COLUMNS or high < _MIN_ROWS:
        return None
    hull = cv2.convexHull(hole, clockwise=False)
    filled = cv2.contourArea(hole) + 2.0
    if len(hull) < 4 or filled < _LEAST_QUAD * cv2.contourArea(hull):  # the quadrilateral is around the hull
        return None
    quad = cv2.approxPolyN(hull.astype(np.float32), 4).reshape(-1, 2).astype(np.float64)
    if len(quad) < 4:
        return None
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = quad.tolist()
    area = 0.5 * ((x2 - x0) * (y3 - y1) - (x3 - x1) * (y2 - y0))
    if abs(area) < _LEAST_AREA or filled < _LEAST_QUAD * abs(area):
        return None
    return abs(area), quad if area > 0.0 else quad[::-1]


def _fitted(share: Shares, corners: Floats) -> tuple[Floats, Floats]:
    """Move the sides of quadrilaterals to the ridges beside them.

    Args:
        share: how far each pixel is filled.
        corners: shape (n, 4, 2).

    Returns:
        The corners, and the root mean square of the ridges' distances from the sides, shape (n,).
    """
    deviations = np.zeros(len(corners))
    for reach in _REACHES:
        begin, along, across, _ = _sides(corners)
        steps = np.arange(-reach, reach + 1.0)
        places = begin + along * _PLACES
        values = _at(share, places[..., None, :] + steps[:, None] * across[..., None, :])
        weights = np.maximum(values - np.median(values, axis=-1, keepdims=True), 0.0) ** 2
        total = weights.sum(axis=-1)
        at = (weights * steps).sum(axis=-1) / np.maximum(total, 1e-9)
        trust = np.sqrt(total)
        trust = np.minimum(trust, np.median(trust, axis=2, keepdims=True)) + 1e-6
        t = np.broadcast_to(_PLACES[:, 0], at.shape)
        sum_w = trust.sum(axis=2, keepdims=True)
        mean_t = (trust * t).sum(axis=2, keepdims=True) / sum_w
        mean_at = (trust * at).sum(axis=2, keepdims=True) / sum_w
        centred = t - mean_t
        slope = (trust * centred * (at - mean_at)).sum(axis=2) / (trust * centred * centred).sum(axis=2)
        start = mean_at[..., 0] - slope * mean_t[..., 0]
        residual = at - start[..., None] - slope[..., None] * t
        deviations = np.sqrt(((trust * residual * residual).sum(axis=2) / sum_w[..., 0]).mean(axis=1))
        moved = begin[:, :, 0] + start[..., None] * across[:, :, 0]
        direction = along[:, :, 0] + slope[..., None] * across[:, :, 0]
        corners = _meetings(moved, direction, corners)
    return corners, deviations


def _meetings(points: Floats, directions: Floats, before: Floats) -> Floats:
    """Where side k - 1 meets side k, shape (n, 4, 2); `before` where they are parallel or that is far."""
    p, d = np.roll(points, 1, axis=1), np.roll(directions, 1, axis=1)
    det = d[..., 0] * directions[..., 1] - d[..., 1] * directions[..., 0]
    gap = points - p
    sizes = np.linalg.norm(d, axis=-1) * np.linalg.norm(directions, axis=-1)
    share = (gap[..., 0] * directions[..., 1] - gap[..., 1] * directions[..., 0]) / np.where(det == 0, 1, det)
    met = p + share[..., None] * d
    bad = (np.abs(det) < 0.15 * sizes) | (np.abs(met - before).max(axis=-1) > 6.0)
    return np.where(bad[..., None], before, met)


def _sides(corners: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Start, vector, inward unit vector and length of each side, shapes (n, 4, 1, 2) and (n, 4, 1, 1)."""
    begin = corners[:, :, None]
    along = np.roll(corners, -1, axis=1)[:, :, None] - begin
    length = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-6)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) / length
    return begin, along, across, length


def _clearness(share: Shares, corners: Floats) -> Floats:
    """How clearly the weakest side of each ring is a line: 1 if filled alike and nothing beside it is."""
    begin, along, across, length = _sides(corners)
    beyond = _beyond(length)
    inside = np.minimum(beyond, 0.5 * np.roll(length, 1, axis=1))
    places = begin + along * _PLACES
    filled = _at(share, places)
    ground = np.maximum(_at(share, places + inside * across), _at(share, places - beyond * across))
    mean = np.maximum(np.median(filled, axis=(1, 2), keepdims=True), 1e-3)
    parts = np.clip((filled - np.maximum(ground, 0.0)) / mean, -1.0, 1.0)
    clear: Floats = parts.mean(axis=2).min(axis=1)
    return clear


def _is_of_colour(filled: FilledPixels, corners: Floats) -> npt.NDArray[np.bool_]:
    """Whether rings are filled enough, and their channel exceeds the others, and more so than around them.

    A shadow on a coloured floor is a ring of the floor's colour, but of less of it.

    Args:
        filled: the pixels.
        corners: of rings, shape (n, 4, 2).

    Returns:
        Shape (n,).
    """
    begin, along, across, length = _sides(corners)
    places = begin + along * _PLACES
    outside = places - _beyond(length) * across
    share = np.median(_at(filled.share, places), axis=(1, 2))
    excess = _at(filled.excess, places)
    more = np.median(excess - _at(filled.excess, outside), axis=(1, 2))
    enough: npt.NDArray[np.bool_] = (
        (share > _LEAST_SHARE)
        & (np.median(excess, axis=(1, 2)) > ZERO_EXCESS + _LEAST_EXCESS)
        & (more > _LEAST_EXCESS)
    )
    return enough


def _beyond(length: Floats) -> Floats:
    """How far from a bar's axis it has ended, pixels; the argument is that of `_sides`."""
    beyond: Floats = 2.0 + 0.15 * length.min(axis=1, keepdims=True)
    return beyond


def _at(share: Shares | Plane, places: Floats) -> Floats:
    """Between the numbers of the four pixels around each place, shape (...)."""
    x, y = places[..., 0].astype(np.float32), places[..., 1].astype(np.float32)
    flat = cv2.remap(
        share, x.reshape(len(x), -1), y.reshape(len(x), -1), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    values: Floats = flat.reshape(x.shape).astype(np.float64)
    return values


def _overlap(one: Ring, other: Ring) -> bool:
    """Whether the centre of one is inside another, or the other way round."""
    return any(
        cv2.pointPolygonTest(a.corners.astype(np.float32), tuple(b.corners.mean(axis=0).tolist()), False) >= 0
        for a, b in ((one, other), (other, one))
    )
