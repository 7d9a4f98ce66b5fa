"""What missions and the fence get of the vehicle, and what the mission executor requests of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import isfinite, nan

from firmware_py.missions.items import MissionItem
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection

SevenParams = tuple[float, float, float, float, float, float, float]


@dataclass(slots=True)
class VehicleView:
    """The vehicle's state for missions; one object, updated in place.

    Attributes:
        time_us: vehicle time.
        position_ned_m: in the local frame, shape (3,).
        velocity_ned_m_s: shape (3,).
        yaw_rad: clockwise from north.
        landed: on the ground.
        projection: of the local frame; None before the first position.
        home_ned_m: home in the local frame, shape (3,); None before it is known.
    """

    time_us: int = 0
    position_ned_m: Vec3 = (0.0, 0.0, 0.0)
    velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0
    landed: bool = True
    projection: LocalProjection | None = None
    home_ned_m: Vec3 | None = None

    def place_of(self, item: MissionItem) -> Vec3:
        """Where a global item is, NED metres; components that it does not give are NaN.

        Without a projection all are NaN; so is the height of a relative altitude without home.
        """
        if self.projection is None:
            return (nan, nan, nan)
        north_m = east_m = nan
        if isfinite(item.x) and isfinite(item.y):
            north_m, east_m, _ = self.projection.to_local(GeodeticPoint(item.x, item.y, 0.0))
        if not item.is_relative:
            return (north_m, east_m, self.projection.origin.altitude_m - item.z)
        return (north_m, east_m, nan if self.home_ned_m is None else self.home_ned_m[2] - item.z)


class LegKind(Enum):
    """How to fly a leg.

    TAKEOFF: climb vertically to the target's height. FLY: to the target; stop there unless there is a next
    place. LAND: land at the target. RETURN: switch to return mode. HOLD: stay at the target. DONE: the
    mission is over; stay at the target, or on the ground.
    """

    TAKEOFF = "takeoff"
    FLY = "fly"
    LAND = "land"
    RETURN = "return"
    HOLD = "hold"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class MissionLeg:
    """What to fly now; the same object until something changes.

    Attributes:
        kind: see `LegKind`.
        target_ned_m: shape (3,), always finite.
        yaw_rad: NaN: by MPC_YAW_MODE.
        speed_m_s: horizontal; NaN: MPC_XY_CRUISE.
        radius_m: the target counts as reached within this horizontal distance.
        next_ned_m: where to fly next without a stop, shape (3,); None: stop at the target.
    """

    kind: LegKind
    target_ned_m: Vec3
    yaw_rad: float = nan
    speed_m_s: float = nan
    radius_m: float = nan
    next_ned_m: Vec3 | None = None


@dataclass(frozen=True, slots=True)
class IssuedCommand:
    """A command of the mission to another component: the camera, or the commander (home, arming).

    Attributes:
        command: MAV_CMD.
        params: params 1 to 7.
        place_ned_m: of a region of interest.
    """

    command: int
    params: SevenParams
    place_ned_m: Vec3 | None = None
