"""Origin and home: how the local frame lies on Earth."""

from __future__ import annotations

from math import isfinite

from firmware_py.geodesy import LocalProjection
from firmware_py.status import VehicleStatus
from firmware_py.types import GeodeticPoint, VehicleState
from geometry.vectors import Vec3

_LATITUDE_DEG, _LONGITUDE_DEG, _ALTITUDE_M = 90.0, 180.0, 100_000.0


class Places:
    """Keeps the projection between the local frame and Earth, and home.

    Args:
        status: told of origin and home.
        sensor_origin: where on Earth the sensors' positions count from.
    """

    __slots__ = ("_sensor_projection", "_status", "projection")

    def __init__(self, status: VehicleStatus, sensor_origin: GeodeticPoint) -> None:
        self._status = status
        self._sensor_projection = LocalProjection(sensor_origin)
        self.projection: LocalProjection | None = None

    def fix_origin(self, origin_ned_m: Vec3, state: VehicleState) -> None:
        """Take the local frame's origin, given in the sensors' frame; home is where it is now."""
        self._status.origin = self._sensor_projection.to_geodetic(origin_ned_m)
        self.projection = LocalProjection(self._status.origin)
        self.set_home_here(state)

    def set_home_here(self, state: VehicleState) -> None:
        """Home is where the vehicle is."""
        self._status.home = self.to_geodetic(state.position_ned_m)
        self._status.home_ned_m = state.position_ned_m

    def set_home(self, point: GeodeticPoint) -> bool:
        """Home is a given place; False if that cannot be."""
        local = self.to_local(point)
        if local is None:
            return False
        self._status.home, self._status.home_ned_m = point, local
        return True

    def move_origin(self, point: GeodeticPoint) -> bool:
        """Say where on Earth the local frame's origin is; False before there is one."""
        if self.projection is None or not is_on_earth(point):
            return False
        self._status.origin = point
        self.projection = LocalProjection(point)
        self._status.home = self.to_geodetic(self._status.home_ned_m)
        return True

    def to_geodetic(self, position_ned_m: Vec3) -> GeodeticPoint | None:
        """A local place on Earth; None before the origin is known."""
        return None if self.projection is None else self.projection.to_geodetic(position_ned_m)

    def to_local(self, point: GeodeticPoint) -> Vec3 | None:
        """A place on Earth in the local frame; None before the origin is known or for no place on Earth."""
        if self.projection is None or not is_on_earth(point):
            return None
        return self.projection.to_local(point)


def is_on_earth(point: GeodeticPoint) -> bool:
    """Whether the numbers can be a place: finite and in range."""
    return (
        isfinite(point.latitude_deg + point.longitude_deg + point.altitude_m)
        and abs(point.latitude_deg) <= _LATITUDE_DEG
        and abs(point.longitude_deg) <= _LONGITUDE_DEG
        and abs(point.altitude_m) <= _ALTITUDE_M
    )
