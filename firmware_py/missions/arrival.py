"""When an item's place, height and heading are reached and its waiting time is over."""

from __future__ import annotations

from math import hypot, isfinite, isnan, nan, radians, remainder, tau

from firmware_py.missions.flight import Leg, View
from firmware_py.missions.items import Do, MissionItem
from firmware_py.parameters import Parameters
from framerunner.geometry.vectors import Vec3


class Arrival:
    """Acceptance limits by the parameters, and since when the present item's place is reached.

    Attributes:
        radius_m: horizontal distance within which a place counts as reached, if the item gives none.
        height_m: height difference within which it does.
        takeoff_m: climb of a take-off, if the item gives none.
    """

    __slots__ = (
        "_circle_m",
        "_heading_reached",
        "_since_us",
        "_version",
        "_yaw_error_rad",
        "_yaw_ignored",
        "height_m",
        "radius_m",
        "takeoff_m",
    )

    def __init__(self, parameters: Parameters) -> None:
        self._version = -1
        self.configure(parameters)
        self.begin()

    def configure(self, parameters: Parameters) -> None:
        """Apply the parameters if one has changed."""
        if parameters.version == self._version:
            return
        self._version = parameters.version
        value = parameters.value
        self.radius_m = value("NAV_ACC_RAD")
        self.height_m = value("NAV_MC_ALT_RAD")
        self.takeoff_m = value("MIS_TAKEOFF_ALT")
        self._circle_m = abs(value("NAV_LOITER_RAD"))
        self._yaw_error_rad = radians(value("MIS_YAW_ERR"))
        self._yaw_ignored = value("MIS_YAW_TMT") > 0.0  # as in PX4: with a time limit there is no wait

    def begin(self) -> None:
        """Begin a new item."""
        self._since_us = -1
        self._heading_reached = False

    def radius_of(self, item: MissionItem) -> float:
        """The horizontal distance within which the item's place is reached, m."""
        if item.command == Do.LOITER_TO_ALT:
            circle_m = abs(item.params[1])
            return self.radius_m + (circle_m if isfinite(circle_m) and circle_m > 0.0 else self._circle_m)
        own_m = item.params[1] if item.command == Do.WAYPOINT else nan
        return own_m if isfinite(own_m) and own_m > 0.0 else self.radius_m

    def has_climbed(self, leg: Leg, view: View) -> bool:
        """Whether the vehicle is high enough; for a very low climb, half of it must be done."""
        if view.landed:
            return False
        tolerance_m = self.height_m
        if view.home_ned_m is not None:
            above_home_m = view.home_ned_m[2] - leg.target_ned_m[2]
            if 0.0 < above_home_m < tolerance_m:
                tolerance_m = above_home_m / 2.0
        return view.position_ned_m[2] < leg.target_ned_m[2] + tolerance_m

    def is_there(self, leg: Leg, view: View) -> bool:
        """Whether the vehicle is at the leg's target."""
        north_m, east_m, down_m = leg.target_ned_m
        here_ned_m = view.position_ned_m
        return (
            abs(down_m - here_ned_m[2]) <= self.height_m
            and hypot(north_m - here_ned_m[0], east_m - here_ned_m[1]) <= leg.radius_m
        )

    def has_arrived(self, leg: Leg, view: View) -> bool:
        """Whether the vehicle was in the air at the target and has reached its heading."""
        if self._since_us < 0:
            if view.landed or not self.is_there(leg, view):
                return False
            self._since_us = view.time_us
        if not self._heading_reached:
            yaw_rad = leg.yaw_rad
            self._heading_reached = (
                isnan(yaw_rad)
                or self._yaw_ignored
                or abs(remainder(yaw_rad - view.yaw_rad, tau)) < self._yaw_error_rad
            )
        return self._heading_reached

    def has_waited(self, item: MissionItem, view: View) -> bool:
        """Whether the item's waiting time is over, since the arrival or else since the first call."""
        if self._since_us < 0:
            self._since_us = view.time_us
        return view.time_us - self._since_us >= item.hold_us


def is_behind(gate_ned_m: Vec3, leg: Leg, view: View) -> bool:
    """Whether the vehicle has passed a gate on its path to the leg's target."""
    along_north_m, along_east_m = leg.target_ned_m[0] - gate_ned_m[0], leg.target_ned_m[1] - gate_ned_m[1]
    north_m = view.position_ned_m[0] - gate_ned_m[0]
    east_m = view.position_ned_m[1] - gate_ned_m[1]
    return not view.landed and north_m * along_north_m + east_m * along_east_m >= 0.0
