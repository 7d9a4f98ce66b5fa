"""What a mission has the camera do: where to look (regions of interest, ROI), and when to take pictures."""

from __future__ import annotations

from math import atan2, dist, hypot, isfinite, nan, radians, remainder, tau

from firmware_py.missions.flight import IssuedCommand, View
from firmware_py.missions.items import ROI_LOCATION, ROI_WPNEXT, Do, MissionItem
from geometry.vectors import Vec3


class RegionOfInterest:
    """The region looked at, by yawing the whole vehicle: there is no gimbal."""

    __slots__ = ("_offset_rad", "_place_ned_m", "_to_target")

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Look along the way."""
        self._place_ned_m: Vec3 | None = None
        self._to_target = False
        self._offset_rad = 0.0

    def turn(self, item: MissionItem, view: View) -> None:
        """Do what a region item says."""
        self.release()
        match item.command:
            case Do.SET_ROI_LOCATION:
                self._look_at(item, view)
            case Do.SET_ROI_WPNEXT_OFFSET:
                self._to_target = True
                self._offset_rad = radians(item.z) if isfinite(item.z) else 0.0
            case Do.SET_ROI | Do.NAV_ROI if item.params[0] == ROI_LOCATION:
                self._look_at(item, view)
            case Do.SET_ROI | Do.NAV_ROI if item.params[0] == ROI_WPNEXT:
                self._to_target = True

    def yaw_rad(self, view: View, target_ned_m: Vec3, min_distance_m: float) -> float:
        """The yaw that looks there; NaN: nowhere in particular, or too near to say."""
        place_ned_m = target_ned_m if self._to_target else self._place_ned_m
        if place_ned_m is None:
            return nan
        north_m = place_ned_m[0] - view.position_ned_m[0]
        east_m = place_ned_m[1] - view.position_ned_m[1]
        if hypot(north_m, east_m) <= min_distance_m:
            return nan
        return remainder(atan2(east_m, north_m) + self._offset_rad, tau)

    def _look_at(self, item: MissionItem, view: View) -> None:
        place_ned_m = view.place_of(item)
        if isfinite(place_ned_m[0]):
            self._place_ned_m = place_ned_m


class CameraTriggers:
    """Commands to the camera, and pictures by distance flown.

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
