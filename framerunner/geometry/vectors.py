"""Vectors and quaternions as plain tuples: the per-tick path makes many."""

from __future__ import annotations

from math import cos, nan, sin

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""(w, x, y, z), unit length."""

NAN3: Vec3 = (nan, nan, nan)
ZERO3: Vec3 = (0.0, 0.0, 0.0)


def plus(a: Vec3, b: Vec3) -> Vec3:
    """Their sum."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def minus(a: Vec3, b: Vec3) -> Vec3:
    """The vector from `b` to `a`."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def turned(x: float, y: float, angle_rad: float) -> tuple[float, float]:
    """A vector in plan, turned from its first axis towards the second one.

    By a heading, a vector of level axes becomes one of the axes that the heading is in; by the heading's
    negative, back.
    """
    c, s = cos(angle_rad), sin(angle_rad)
    return c * x - s * y, s * x + c * y
