"""The one place where arena axes and world/body axes meet.

Arena (the paper's, seen by people and missions): x forward, y left, z up, yaw counter-clockwise from x.
World (inside): NED; body: FRD. Arena x points north, so arena axes are NED turned by half a turn about
x, and the same holds between a body's forward-left-up and forward-right-down axes. All functions here are
their own inverses.
"""

from __future__ import annotations

from geometry.vectors import Quaternion, Vec3


def flip_vector(vector: Vec3) -> Vec3:
    """Turn a vector from arena to NED axes or back (equally body FLU to FRD or back).

    Args:
        vector: three components, any unit.

    Returns:
        The same vector in the other axes.
    """
    return (vector[0], -vector[1], -vector[2])


def flip_yaw(yaw_rad: float) -> float:
    """Turn a heading (or yaw rate) from arena sense (counter-clockwise) to NED sense (clockwise) or back."""
    return -yaw_rad


def flip_quaternion(quaternion: Quaternion) -> Quaternion:
    """Turn an attitude FRD→NED into FLU→arena or back.

    Conjugation by half a turn about x: R' = F R F with F = diag(1, -1, -1).

    Args:
        quaternion: (w, x, y, z), unit length, body to world.
    """
    w, x, y, z = quaternion
    return (w, x, -y, -z)
