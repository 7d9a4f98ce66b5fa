"""Rotations as the per-tick path needs them: plain scalars."""

from __future__ import annotations

from math import atan2, pi, sqrt

from geometry.vectors import Quaternion, Vec3

Rotation = tuple[float, float, float, float, float, float, float, float, float]
"""Rows of the matrix from body FRD to world NED; its last row is world down seen in body axes."""


def rotation(attitude: Quaternion) -> Rotation:
    """The matrix of a unit quaternion (w, x, y, z), body FRD to world NED."""
    w, x, y, z = attitude
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        1.0 - 2.0 * (yy + zz),
        2.0 * (xy - wz),
        2.0 * (xz + wy),
        2.0 * (xy + wz),
        1.0 - 2.0 * (xx + zz),
        2.0 * (yz - wx),
        2.0 * (xz - wy),
        2.0 * (yz + wx),
        1.0 - 2.0 * (xx + yy),
    )


def to_body(m: Rotation, n: float, e: float, d: float) -> Vec3:
    """A vector in world NED, in body FRD."""
    return (
        m[0] * n + m[3] * e + m[6] * d,
        m[1] * n + m[4] * e + m[7] * d,
        m[2] * n + m[5] * e + m[8] * d,
    )


def to_world(m: Rotation, x: float, y: float, z: float) -> Vec3:
    """A vector in body FRD, in world NED."""
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[3] * x + m[4] * y + m[5] * z,
        m[6] * x + m[7] * y + m[8] * z,
    )


def tilt_error(m: Rotation, down_ned: Vec3) -> tuple[float, float]:
    """The shortest rotation that turns the body's down axis to where it should point.

    A reduced attitude error (Chaturvedi, Sanyal & McClamroch, "Rigid-Body Attitude Control", IEEE Control
    Systems Magazine, 2011): it leaves the rotation about that axis alone, and has no singularity but at the
    half turn, where any axis will do.

    Args:
        m: attitude now.
        down_ned: unit vector that body down should point along, world NED.

    Returns:
        Angles about body forward and right, rad; their length is the angle between the axes.
    """
    x, y, z = to_body(m, *down_ned)
    sine = sqrt(x * x + y * y)
    if sine < 1e-9:
        return (0.0, 0.0) if z > 0.0 else (pi, 0.0)
    scale = atan2(sine, z) / sine
    return (-y * scale, x * scale)
