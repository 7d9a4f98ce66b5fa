"""Where the vehicle's local axes lie in the arena, from the best that is known."""

from __future__ import annotations

from enum import IntEnum
from math import hypot, isfinite

from geometry.axes import ORIGIN, Alignment, Pose
from geometry.vectors import Vec3
from wire.vehicle_telemetry import PositionReport, VehicleTelemetry

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
    """Chooses the best alignment that is known.

    Attributes:
        source: what the alignment rests on.
        alignment: from local NED to arena axes.
    """

    def __init__(self) -> None:
        self.source = Source.GUESS
        self._slowest_m_s = 1e9
        self.alignment = Alignment(ORIGIN, ORIGIN)

    def lay_by_frame(self, origin_arena_m: Vec3, yaw_rad: float) -> None:
        """The referee says where the local origin is, and how much north is turned from x (to the left)."""
        if isfinite(sum(origin_arena_m) + yaw_rad):
            self.source = Source.REFEREE
            self.alignment = Alignment(Pose(origin_arena_m, yaw_rad), ORIGIN)

    def lay_by_start(self, start_arena: ArenaPose, telemetry: VehicleTelemetry) -> None:
        """It stands on its start: there is where it says to be now. One that moves is being carried."""
        position = telemetry.position
        if self.source > Source.START or position is None or telemetry.attitude is None:
            return
        if hypot(*position.velocity_ned_m_s) < _CARRIED_M_S:
            self.source = Source.START
            self._lay_by_pair(start_arena, position)

    def lay_by_app(self, pose_arena: ArenaPose, position: PositionReport) -> None:
        """The app says where it was when the vehicle was here; the pair from the stillest moment counts."""
        if self.source > Source.APP or not isfinite(sum(pose_arena)):
            return
        speed_m_s = hypot(*position.velocity_ned_m_s)
        if speed_m_s > max(self._slowest_m_s, _STILL_M_S):
            return
        self._slowest_m_s = speed_m_s
        self.source = Source.APP
        self._lay_by_pair(pose_arena, position)

    def _lay_by_pair(self, pose_arena: ArenaPose, position: PositionReport) -> None:
        here_ned = Pose(position.position_ned_m, position.yaw_ned_rad)
        self.alignment = Alignment(Pose(pose_arena[:3], pose_arena[3]), here_ned)
