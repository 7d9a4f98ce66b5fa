"""Polygons cut to what a camera can see.

The cut goes from corner to corner and keeps what lies on the good side (Sutherland & Hodgman, "Reentrant
polygon clipping", 1974). Plain scalars: few polygons need it, those that reach beside or behind the camera.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

Point = tuple[float, float]


def clip_near(corners: Sequence[Sequence[float]], near_m: float) -> list[Point]:
    """Cut a convex polygon at the near plane and project what is left of it.

    Args:
        corners: (u w, v w, w, ...) each; w is the depth in metres, u and v are image coordinates. Before the
            division by w, straight lines in space are straight lines here too.
        near_m: depth of the near plane, above zero.

    Returns:
        Corners (u, v); none if it is all behind the plane.
    """
    kept: list[Point] = []
    x0, y0, w0 = corners[-1][:3]
    for corner in corners:
        x1, y1, w1 = corner[:3]
        if (w0 < near_m) != (w1 < near_m):
            t = (near_m - w0) / (w1 - w0)
            kept.append(((x0 + t * (x1 - x0)) / near_m, (y0 + t * (y1 - y0)) / near_m))
        if w1 >= near_m:
            kept.append((x1 / w1, y1 / w1))
        x0, y0, w0 = x1, y1, w1
    return kept


def clip_window(points: list[Point], left: float, top: float, right: float, bottom: float) -> list[Point]:
    """Cut a convex polygon to a window of the image plane; fewer than three corners if nothing is left.

    OpenCV's drawing takes whole numbers of 32 bits and walks row by row from a polygon's topmost corner, be
    it ever so far above the image: this keeps it right and quick.
    """
    for u, v in points:
        if not (left <= u <= right and top <= v <= bottom):
            break
    else:
        return points
    for a, b, c in ((1.0, 0.0, -left), (-1.0, 0.0, right), (0.0, 1.0, -top), (0.0, -1.0, bottom)):
        points = clip_half_plane(points, a, b, c)
    return points


def clip_half_plane(points: Iterable[Point], a: float, b: float, c: float) -> list[Point]:
    """Keep the part of a convex polygon where a u + b v + c >= 0."""
    corners = points if isinstance(points, Sequence) else list(points)
    heights = [a * u + b * v + c for u, v in corners]
    if not heights or min(heights) >= 0.0:
        return list(corners)
    kept: list[Point] = []
    if max(heights) < 0.0:
        return kept
    (u0, v0), before = corners[-1], heights[-1]
    for (u1, v1), now in zip(corners, heights, strict=True):
        if (before < 0.0) != (now < 0.0):
            t = before / (before - now)
            kept.append((u0 + t * (u1 - u0), v0 + t * (v1 - v0)))
        if now >= 0.0:
            kept.append((u1, v1))
        u0, v0, before = u1, v1, now
    return kept
