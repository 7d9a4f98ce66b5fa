"""The recent past of a vehicle's flight, so that a page opened late has trail and plots at once."""

from __future__ import annotations

from collections import deque
from math import dist, isfinite
from typing import Any

from geometry.rotations import yaw_of

RECENT_S = 60.0  # what the plots show; every sample of it is kept
MAX_OLDER = 2000  # samples before that, for the trail; when it is full every second one goes
_STEP_M = 0.05  # older samples lie no nearer together than this, unless the state changed
_STATE, _TIME, _PLACE = 14, 0, slice(1, 4)

Row = list[Any]


class History:
    """Samples of one flight: from the last time the motors came on, or of the last minute before that."""

    def __init__(self) -> None:
        self._older: list[Row] = []
        self._recent: deque[Row] = deque()
        self._step_m = _STEP_M
        self._was_on = False

    def add(self, pose: dict[str, Any]) -> None:
        """Take a pose as the message "pose" has it; one that is no newer than the last is passed over."""
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
            self._retire(self._recent.popleft())

    def clear(self) -> None:
        """Forget everything."""
        self._older.clear()
        self._recent.clear()
        self._step_m = _STEP_M

    def rows(self) -> list[Row]:
        """All samples, oldest first, fields as `docs/monitor-channels.md` says."""
        return [*self._older, *self._recent]

    def _retire(self, row: Row) -> None:
        """Keep a sample that the plots no longer show, if the trail needs it."""
        if self._older:
            last = self._older[-1]
            is_near = dist(last[_PLACE], row[_PLACE]) < self._step_m
            if is_near and last[_STATE] == row[_STATE]:
                return
        self._older.append(row)
        if len(self._older) > MAX_OLDER:
            del self._older[1::2]
            self._step_m *= 2
