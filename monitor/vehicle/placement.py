"""Where the vehicle's local axes lie in the arena, from the best that is known."""

from __future__ import annotations

from enum import IntEnum
from math import cos, hypot, isfinite, sin

from geometry.axes import flip_quaternion, flip_vector, flip_yaw
from geometry.vectors import Quaternion, Vec3
from monitor.vehicle.motion import Motion, Position

ArenaPose = tuple[float, float, float, float]  # x, y, z (m) and yaw (rad), arena axes

_STILL_M_S = 0.05
_CARRIED_M_S = 0.3


class Source(IntEnum):
    """What a placement rests on, the better the higher."""

    GUESS = 0  # north is x, and the origin is the arena's
    APP = 1  # the app says where it believes to be
    START = 2  # it stood on the scenario's start
    REFEREE = 3  # whoever judges it says so


class Placement:
    """A turn about the vertical and a shift, from local NED to arena axes.

    Attributes:
        source: what it rests on.
    """

    def __init__(self) -> None:
        self.source = Source.GUESS
        self._slowest_m_s = 1e9
        self._lay(0.0, (0.0, 0.0, 0.0))

    def lay_by_frame(self, origin_arena_m: Vec3, yaw_rad: float) -> None:
        """The referee says where the local origin is, and how much north is turned from x (to the left)."""
        if isfinite(sum(origin_arena_m) + yaw_rad):
            self.source = Source.REFEREE
            self._lay(yaw_rad, origin_arena_m)

    def lay_by_start(self, start_arena: ArenaPose, motion: Motion) -> None:
        """It stands on its start: there is where it says to be now. One that moves is being carried."""
        position = motion.position
        if self.source > Source.START or position is None or motion.attitude_ned is None:
            return
        if hypot(*position.velocity_ned_m_s) < _CARRIED_M_S:
            self.source = Source.START
            self._lay_by_pair(start_arena, position)

    def lay_by_app(self, pose_arena: ArenaPose, position: Position) -> None:
        """The app says where it was when the vehicle was here; the pair from the stillest moment counts."""
        if self.source > Source.APP or not isfinite(sum(pose_arena)):
            return
        speed_m_s = hypot(*position.velocity_ned_m_s)
        if speed_m_s > max(self._slowest_m_s, _STILL_M_S):
            return
        self._slowest_m_s = speed_m_s
        self.source = Source.APP
        self._lay_by_pair(pose_arena, position)

    def position(self, position_ned_m: Vec3) -> Vec3:
        """A local NED position in arena axes."""
        x, y, z = self._turned(flip_vector(position_ned_m))
        dx, dy, dz = self._shift
        return (x + dx, y + dy, z + dz)

    def vector(self, vector_ned: Vec3) -> Vec3:
        """A local NED velocity in arena axes."""
        return self._turned(flip_vector(vector_ned))

    def attitude(self, attitude_ned: Quaternion) -> Quaternion:
        """An attitude, body FRD to NED, as body FLU to arena: quaternions (w, x, y, z)."""
        w, x, y, z = flip_quaternion(attitude_ned)
        c, s = self._half_cos, self._half_sin
        return (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)

    def _lay_by_pair(self, pose_arena: ArenaPose, position: Position) -> None:
        x, y, z, yaw_rad = pose_arena
        self._lay(yaw_rad - flip_yaw(position.yaw_ned_rad), (0.0, 0.0, 0.0))
        here_x, here_y, here_z = self._turned(flip_vector(position.position_ned_m))
        self._shift = (x - here_x, y - here_y, z - here_z)

    def _lay(self, turn_rad: float, shift: Vec3) -> None:
        self._cos, self._sin = cos(turn_rad), sin(turn_rad)
        self._half_cos, self._half_sin = cos(turn_rad / 2), sin(turn_rad / 2)
        self._shift = shift

    def _turned(self, vector: Vec3) -> Vec3:
        x, y, z = vector
        return (self._cos * x - self._sin * y, self._sin * x + self._cos * y, z)
