"""Where a vehicle is in the arena, by the best source there is, and where it was during this flight."""

from __future__ import annotations

from collections import deque
from enum import IntEnum
from math import dist, hypot, isfinite
from typing import Any

from framerunner.geometry.axes import ORIGIN, ArenaAlignment, Pose
from framerunner.geometry.rotations import yaw_of
from framerunner.geometry.vectors import Vec3
from framerunner.wire.vehicle_telemetry import PositionReport, VehicleTelemetry

RECENT_S = 60.0  # the span of the plots; every sample of it is kept
MAX_OLDER = 2000  # samples before that, for the trail; when there are more, every second one is removed
_STEP_M = 0.05  # distance of older samples at least, unless the state changed
_STATE, _TIME, _POSITION = 14, 0, slice(1, 4)  # columns of a row
_STILL_M_S = 0.05
_CARRIED_M_S = 0.3

ArenaPose = tuple[float, float, float, float]  # x, y, z (m) and yaw (rad), arena axes
Row = list[Any]


class Source(IntEnum):
    """What a placement is based on; a higher one is better."""

    GUESS = 0  # north is x, and the origin is the arena's
    APP = 1  # the pose that the app estimates
    START = 2  # it stood on the scenario's start
    REFEREE = 3  # the referee's answer


class Placement:
    """The best alignment of the vehicle's local frame with the arena.

    Attributes:
        source: what the alignment is based on.
        alignment: from local NED to arena axes.
    """

    def __init__(self) -> None:
        self.source = Source.GUESS
        self.alignment = ArenaAlignment(ORIGIN, ORIGIN)
        self._slowest_m_s = 1e9

    def lay_by_frame(self, origin_arena_m: Vec3, yaw_rad: float) -> None:
        """Use a referee's answer: where the local origin is, and how far north is turned left from x."""
        if isfinite(sum(origin_arena_m) + yaw_rad):
            self.source = Source.REFEREE
            self.alignment = ArenaAlignment(Pose(origin_arena_m, yaw_rad), ORIGIN)

    def lay_by_start(self, start_arena: ArenaPose, telemetry: VehicleTelemetry) -> None:
        """Use that it stands on its start now; ignored while it moves, because then it is being carried."""
        position = telemetry.position
        if self.source > Source.START or position is None or telemetry.attitude is None:
            return
        if hypot(*position.velocity_ned_m_s) < _CARRIED_M_S:
            self.source = Source.START
            self._lay_by_pair(start_arena, position)

    def lay_by_app(self, pose_arena: ArenaPose, position: PositionReport) -> None:
        """Use the app's pose at the time of a position report; the pair with the lowest speed counts."""
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
        self.alignment = ArenaAlignment(Pose(pose_arena[:3], pose_arena[3]), here_ned)


class History:
    """Samples since the motors came on, or of the last minute before that: for a page that is opened late."""

    def __init__(self) -> None:
        self._older: list[Row] = []
        self._recent: deque[Row] = deque()
        self._step_m = _STEP_M
        self._was_on = False

    def add(self, pose: dict[str, Any]) -> None:
        """Add a pose as in the message "pose"; ignored if it is not newer than the last."""
        time_s, is_on = pose["t"], pose["on"]
        if self._recent and time_s <= self._recent[-1][_TIME]:
            return
        if is_on and not self._was_on:
            self.clear()
        self._was_on = is_on
        command = pose["c"] or [None] * 4
        row = [round(time_s, 3), *pose["p"], round(yaw_of(pose["q"]), 3), *pose["v"], pose["r"], *command]
        finite = [value if value is None or isfinite(value) else None for value in row]
        self._recent.append([*finite, 1 if is_on else 0, pose["s"]])
        while time_s - self._recent[0][_TIME] > RECENT_S:
            self._keep_for_trail(self._recent.popleft())

    def clear(self) -> None:
        """Remove all samples."""
        self._older.clear()
        self._recent.clear()
        self._step_m = _STEP_M

    def rows(self) -> list[Row]:
        """All samples, oldest first, columns as in `docs/monitor-channels.md`."""
        return [*self._older, *self._recent]

    def _keep_for_trail(self, row: Row) -> None:
        if self._older:
            last = self._older[-1]
            is_near = dist(last[_POSITION], row[_POSITION]) < self._step_m
            if is_near and last[_STATE] == row[_STATE]:
                return
        self._older.append(row)
        if len(self._older) > MAX_OLDER:
            del self._older[1::2]
            self._step_m *= 2
