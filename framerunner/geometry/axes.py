"""Changes of axes: arena to NED, and a vehicle's local NED frame to the arena.

Arena: x forward, y left, z up, yaw counter-clockwise from x. World: NED; body: FRD. Arena x points north, so
arena axes are NED turned by half a turn about x; the same holds between a body's forward-left-up and
forward-right-down axes. Each `flip_` function is its own inverse.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, remainder, sin

from framerunner.geometry.vectors import Quaternion, Vec3


def flip_vector(vector: Vec3) -> Vec3:
    """Turn a vector of any unit from arena to NED axes or back (equally body FLU to FRD or back)."""
    return (vector[0], -vector[1], -vector[2])


def flip_yaw(yaw_rad: float) -> float:
    """Turn a yaw angle or yaw rate from counter-clockwise (arena) to clockwise (NED) or back."""
    return -yaw_rad


def flip_quaternion(quaternion: Quaternion) -> Quaternion:
    """Turn an attitude, body to world, from FRD→NED into FLU→arena or back.

    Conjugation by half a turn about x: R' = F R F with F = diag(1, -1, -1).
    """
    w, x, y, z = quaternion
    return (w, x, -y, -z)


@dataclass(frozen=True, slots=True)
class Pose:
    """Position (metres) and heading (radians), in the axes that the variable's name says."""

    position_m: Vec3
    yaw_rad: float


ORIGIN = Pose((0.0, 0.0, 0.0), 0.0)


class ArenaAlignment:
    """Transforms a vehicle's local NED frame into arena axes: a rotation about the vertical and a shift.

    One pose known in both axes gives both, such as that of a drone that stands on its start. Real hardware's
    north need not be the arena's x.

    Args:
        start_arena: the known pose, arena axes.
        start_ned: what the vehicle's telemetry reports there, local NED.
    """

    __slots__ = ("_cos", "_half_cos", "_half_sin", "_shift", "_sin", "_turn_rad")

    def __init__(self, start_arena: Pose, start_ned: Pose) -> None:
        self._turn_rad = turn_rad = start_arena.yaw_rad - flip_yaw(start_ned.yaw_rad)
        self._cos, self._sin = cos(turn_rad), sin(turn_rad)
        self._half_cos, self._half_sin = cos(turn_rad / 2), sin(turn_rad / 2)
        turned = self.vector(start_ned.position_m)
        x, y, z = start_arena.position_m
        self._shift = (x - turned[0], y - turned[1], z - turned[2])

    def pose(self, ned: Pose) -> Pose:
        """A local NED pose in arena axes, yaw in -pi..pi."""
        yaw_rad = remainder(flip_yaw(ned.yaw_rad) + self._turn_rad, 2 * pi)
        return Pose(self.position(ned.position_m), yaw_rad)

    def position(self, position_ned_m: Vec3) -> Vec3:
        """A local NED position in arena axes."""
        x, y, z = self.vector(position_ned_m)
        dx, dy, dz = self._shift
        return (x + dx, y + dy, z + dz)

    def to_ned(self, position_arena_m: Vec3) -> Vec3:
        """An arena position in the vehicle's local NED frame; the inverse of `position`."""
        x, y, z = (at - shift for at, shift in zip(position_arena_m, self._shift, strict=True))
        return flip_vector((self._cos * x + self._sin * y, self._cos * y - self._sin * x, z))

    def vector(self, vector_ned: Vec3) -> Vec3:
        """A local NED velocity in arena axes."""
        x, y, z = flip_vector(vector_ned)
        return (self._cos * x - self._sin * y, self._sin * x + self._cos * y, z)

    def attitude(self, attitude_ned: Quaternion) -> Quaternion:
        """An attitude, body FRD to NED, as body FLU to arena."""
        w, x, y, z = flip_quaternion(attitude_ned)
        c, s = self._half_cos, self._half_sin
        return (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)
