"""Vectors and quaternions as plain tuples: the per-tick path makes many."""

from __future__ import annotations

from math import nan

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""(w, x, y, z), unit length."""

NAN3: Vec3 = (nan, nan, nan)
ZERO3: Vec3 = (0.0, 0.0, 0.0)
