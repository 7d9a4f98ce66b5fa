"""Polygons cut to what a camera can see.

Works on projected points before the division by depth, (u w, v w, w), where every cut is a straight line
between neighbours (Sutherland & Hodgman, "Reentrant polygon clipping", 1974). Plain scalars: few polygons need
it, those that reach beside or behind the camera.
"""

from __future__ import annotations

from collections.abc import Iterable

Homogeneous = tuple[float, float, float]
Point = tuple[float, float]


def clip_to_view(points: Iterable[Homogeneous], near_m: float, limit: float) -> list[Point]:
    """Cut a convex polygon at the near plane and far outside the image, and project it.

    Args:
        points: corners (u w, v w, w); w is the depth in metres, u and v are image coordinates.
        near_m: depth of the near plane.
        limit: the polygon is cut so that no coordinate exceeds this (in units of u and v).

    Returns:
        Corners (u, v); fewer than three if nothing is left.
    """
    corners = _cut(list(points), 0.0, 0.0, 1.0, -near_m)
    projected = [(u / w, v / w) for u, v, w in corners]
    if all(-limit <= u <= limit and -limit <= v <= limit for u, v in projected):
        return projected
    for u_sign, v_sign in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        corners = _cut(corners, u_sign, v_sign, limit, 0.0)
    return [(u / w, v / w) for u, v, w in corners]


def clip_half_plane(points: list[Point], a: float, b: float, c: float) -> list[Point]:
    """Keep the part of a convex polygon where a u + b v + c >= 0."""
    return [(u, v) for u, v, _ in _cut([(u, v, 1.0) for u, v in points], a, b, c, 0.0)]


def _cut(points: list[Homogeneous], a: float, b: float, c: float, d: float) -> list[Homogeneous]:
    """Keep the part of a convex polygon where a x + b y + c z + d >= 0."""
    kept: list[Homogeneous] = []
    if not points:
        return kept
    x0, y0, z0 = points[-1]
    before = a * x0 + b * y0 + c * z0 + d
    for x1, y1, z1 in points:
        now = a * x1 + b * y1 + c * z1 + d
        if (before < 0.0) != (now < 0.0):
            t = before / (before - now)
            kept.append((x0 + t * (x1 - x0), y0 + t * (y1 - y0), z0 + t * (z1 - z0)))
        if now >= 0.0:
            kept.append((x1, y1, z1))
        x0, y0, z0, before = x1, y1, z1, now
    return kept
