"""Where a mission has the vehicle look: regions of interest (ROI)."""

from __future__ import annotations

from math import atan2, hypot, isfinite, nan, radians, remainder, tau

from firmware_py.missions.flight import View
from firmware_py.missions.items import ROI_LOCATION, ROI_WPNEXT, Do, MissionItem
from geometry.vectors import Vec3


class Gaze:
    """The region looked at, by yawing the whole vehicle: there is no gimbal."""

    __slots__ = ("_offset_rad", "_place_ned_m", "_to_target")

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Look where the way leads."""
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

    def yaw_rad(self, view: View, target_ned_m: Vec3, nearest_m: float) -> float:
        """The yaw that looks there; NaN: nowhere in particular, or too near to say."""
        place_ned_m = target_ned_m if self._to_target else self._place_ned_m
        if place_ned_m is None:
            return nan
        north_m = place_ned_m[0] - view.position_ned_m[0]
        east_m = place_ned_m[1] - view.position_ned_m[1]
        if hypot(north_m, east_m) <= nearest_m:
            return nan
        return remainder(atan2(east_m, north_m) + self._offset_rad, tau)

    def _look_at(self, item: MissionItem, view: View) -> None:
        place_ned_m = view.place_of(item)
        if isfinite(place_ned_m[0]):
            self._place_ned_m = place_ned_m
