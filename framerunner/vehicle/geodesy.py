"""Between the local NED frame and latitude, longitude, altitude.

Azimuthal equidistant projection on a sphere, as PX4's `MapProjection`, so that both give the same
coordinates. Source: Snyder, "Map Projections - A Working Manual", USGS PP 1395,
equations 20-14, 20-15, 22-4, 22-5 and 25-2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2, cos, degrees, hypot, isfinite, radians, remainder, sin

from framerunner.geometry.vectors import ZERO3, Vec3

EARTH_RADIUS_M = 6_371_000.0
_LATITUDE_DEG, _LONGITUDE_DEG, _ALTITUDE_M = 90.0, 180.0, 100_000.0


@dataclass(frozen=True, slots=True)
class GeodeticPoint:
    """A place on Earth: degrees (WGS 84) and metres above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float


class LocalProjection:
    """A local NED frame on Earth; distances and bearings from its origin are exact."""

    __slots__ = ("_cos_latitude", "_latitude_rad", "_sin_latitude", "origin")

    def __init__(self, origin: GeodeticPoint) -> None:
        self.origin = origin
        self._latitude_rad = radians(origin.latitude_deg)
        self._sin_latitude = sin(self._latitude_rad)
        self._cos_latitude = cos(self._latitude_rad)

    def to_geodetic(self, position_ned_m: Vec3) -> GeodeticPoint:
        """Where on Earth a local position is.

        Args:
            position_ned_m: north, east, down from the origin, shape (3,), metres.
        """
        north_m, east_m, down_m = position_ned_m
        altitude_m = self.origin.altitude_m - down_m
        distance_m = hypot(north_m, east_m)
        if distance_m == 0.0:
            return GeodeticPoint(self.origin.latitude_deg, self.origin.longitude_deg, altitude_m)
        north, east = north_m / distance_m, east_m / distance_m
        angle = distance_m / EARTH_RADIUS_M
        sin_angle, cos_angle = sin(angle), cos(angle)
        sin_latitude = cos_angle * self._sin_latitude + north * sin_angle * self._cos_latitude
        turn_rad = atan2(
            east * sin_angle,
            self._cos_latitude * cos_angle - north * self._sin_latitude * sin_angle,
        )
        longitude_deg = remainder(self.origin.longitude_deg + degrees(turn_rad), 360.0)
        return GeodeticPoint(degrees(asin(max(-1.0, min(1.0, sin_latitude)))), longitude_deg, altitude_m)

    def to_local(self, point: GeodeticPoint) -> Vec3:
        """Where a point is in the local frame.

        Returns:
            North, east, down from the origin, shape (3,), metres. Not defined for the origin's antipode.
        """
        latitude_rad = radians(point.latitude_deg)
        turn_rad = radians(point.longitude_deg - self.origin.longitude_deg)
        sin_latitude, cos_latitude = sin(latitude_rad), cos(latitude_rad)
        north = self._cos_latitude * sin_latitude - self._sin_latitude * cos_latitude * cos(turn_rad)
        east = cos_latitude * sin(turn_rad)
        down_m = self.origin.altitude_m - point.altitude_m
        sin_angle = hypot(north, east)
        if sin_angle == 0.0:
            return (0.0, 0.0, down_m)
        # atan2 and not acos: near the origin the cosine alone has no precision.
        cos_angle = self._sin_latitude * sin_latitude + self._cos_latitude * cos_latitude * cos(turn_rad)
        scale_m = EARTH_RADIUS_M * atan2(sin_angle, cos_angle) / sin_angle
        return (north * scale_m, east * scale_m, down_m)


class GeoReference:
    """Where on Earth the local frame and home are.

    Attributes:
        projection: of the local frame; None before its origin is known.
        home: None before the origin is known.
        home_ned_m: the same in the local frame, shape (3,).
    """

    __slots__ = ("home", "home_ned_m", "projection")

    def __init__(self) -> None:
        self.projection: LocalProjection | None = None
        self.home: GeodeticPoint | None = None
        self.home_ned_m: Vec3 = ZERO3

    @property
    def origin(self) -> GeodeticPoint | None:
        """Where on Earth the local frame's origin is; None before it is known."""
        return None if self.projection is None else self.projection.origin

    def fix_origin(self, origin: GeodeticPoint) -> None:
        """Set where the local frame's origin is."""
        self.projection = LocalProjection(origin)

    def move_origin(self, point: GeodeticPoint) -> bool:
        """Set where on Earth the local frame's origin is; False before there is one, or if not on Earth."""
        if self.projection is None or not is_on_earth(point):
            return False
        self.projection = LocalProjection(point)
        self.home = self.to_geodetic(self.home_ned_m)
        return True

    def set_home_at(self, position_ned_m: Vec3) -> None:
        """Set home to a place in the local frame, shape (3,)."""
        self.home, self.home_ned_m = self.to_geodetic(position_ned_m), position_ned_m

    def set_home(self, point: GeodeticPoint) -> bool:
        """Set home to a place on Earth; False before the origin is known or for no place on Earth."""
        local = self.to_local(point)
        if local is None:
            return False
        self.home, self.home_ned_m = point, local
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
    """Whether the coordinates are finite and in range."""
    return (
        isfinite(point.latitude_deg + point.longitude_deg + point.altitude_m)
        and abs(point.latitude_deg) <= _LATITUDE_DEG
        and abs(point.longitude_deg) <= _LONGITUDE_DEG
        and abs(point.altitude_m) <= _ALTITUDE_M
    )
