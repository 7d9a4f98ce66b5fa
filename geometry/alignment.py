"""Between a vehicle's local axes and the arena's: a turn about the vertical and a shift."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, remainder, sin

from geometry.axes import flip_quaternion, flip_vector, flip_yaw
from geometry.vectors import Quaternion, Vec3


@dataclass(frozen=True, slots=True)
class Pose:
    """A place and a heading.

    Attributes:
        position_m: in whatever axes the name of the variable says, shape (3,).
        yaw_rad: heading in the same axes.
    """

    position_m: Vec3
    yaw_rad: float


ORIGIN = Pose((0.0, 0.0, 0.0), 0.0)


class Alignment:
    """Turns the vehicle's local NED into arena axes.

    One pose known in both axes gives the turn and the shift, such as that of a drone that stands on its
    start; roll and pitch need none, as both axes are upright. The same holds for real hardware, whose north
    is not the arena's x: put it on the start, looking the known way.

    Args:
        start_arena: where the drone stands, arena axes.
        start_ned: what its telemetry says there, local NED.
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

    def vector(self, vector_ned: Vec3) -> Vec3:
        """A local NED velocity in arena axes."""
        x, y, z = flip_vector(vector_ned)
        return (self._cos * x - self._sin * y, self._sin * x + self._cos * y, z)

    def attitude(self, attitude_ned: Quaternion) -> Quaternion:
        """An attitude, body FRD to NED, as body FLU to arena: quaternions (w, x, y, z)."""
        w, x, y, z = flip_quaternion(attitude_ned)
        c, s = self._half_cos, self._half_sin
        return (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)
