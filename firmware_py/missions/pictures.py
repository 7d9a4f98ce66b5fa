"""What a mission has the camera do: commands to it, and pictures by distance flown."""

from __future__ import annotations

from math import dist, isfinite

from firmware_py.missions.flight import IssuedCommand
from firmware_py.missions.items import Do, MissionItem
from geometry.vectors import Vec3


class Pictures:
    """The mission's camera triggers.

    Attributes:
        commands: for the camera, oldest first; taken by who reads them.
    """

    __slots__ = ("_distance_m", "_last_ned_m", "_repeating", "_taken", "commands")

    def __init__(self) -> None:
        self.commands: list[IssuedCommand] = []
        self._distance_m = 0.0  # 0: off
        self._last_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self._taken = 0
        self._repeating = False

    def start_by_distance(self, item: MissionItem, position_ned_m: Vec3) -> None:
        """DO_SET_CAM_TRIGG_DIST: a picture each so many metres; zero or less ends it."""
        distance_m, at_once = item.params[0], item.params[2]
        self._distance_m = distance_m if isfinite(distance_m) and distance_m > 0.0 else 0.0
        self._last_ned_m = position_ned_m
        if self._distance_m and at_once == 1.0:
            self._take_one()

    def start_by_time(self, item: MissionItem) -> None:
        """DO_SET_CAM_TRIGG_INTERVAL: a picture each so many milliseconds; zero or less ends it."""
        interval_s = item.params[0] / 1e3
        if isfinite(interval_s) and interval_s > 0.0:
            self._command(Do.IMAGE_START_CAPTURE, (0.0, interval_s, 0.0, 0.0))
        else:
            self._command(Do.IMAGE_STOP_CAPTURE, (0.0, 0.0, 0.0, 0.0))
        self._repeating = interval_s > 0.0

    def pass_on(self, item: MissionItem) -> None:
        """Any other command for the camera."""
        if item.command == Do.IMAGE_START_CAPTURE:
            self._repeating = item.params[2] != 1.0
        elif item.command == Do.IMAGE_STOP_CAPTURE:
            self._repeating = False
        self.commands.append(IssuedCommand(item.command, (*item.params, item.x, item.y, item.z)))

    def move(self, position_ned_m: Vec3) -> None:
        """The vehicle is here now."""
        if self._distance_m and dist(position_ned_m, self._last_ned_m) >= self._distance_m:
            self._last_ned_m = position_ned_m
            self._take_one()

    def stop(self) -> None:
        """The mission is left: no more pictures."""
        self._distance_m = 0.0
        if self._repeating:
            self._repeating = False
            self._command(Do.IMAGE_STOP_CAPTURE, (0.0, 0.0, 0.0, 0.0))

    def _take_one(self) -> None:
        self._taken += 1
        self._command(Do.IMAGE_START_CAPTURE, (0.0, 0.0, 1.0, float(self._taken)))

    def _command(self, command: Do, params: tuple[float, float, float, float]) -> None:
        self.commands.append(IssuedCommand(command, (*params, 0.0, 0.0, 0.0)))
