"""Earth's magnetic field, by the World Magnetic Model 2025 (NOAA and BGS), which holds from 2025 to 2030."""

from __future__ import annotations

from functools import lru_cache

from framerunner.geometry.vectors import Vec3

FIELD_YEAR = 2026.0  # the autopilot's and the simulation's date; the field turns by 0.2 degrees a year
_GAUSS_PER_NANOTESLA = 1e-5
_PLACES_KEPT = 64


@lru_cache(_PLACES_KEPT)
def earth_field_ned_gauss(latitude_deg: float, longitude_deg: float, altitude_m: float) -> Vec3:
    """The field at a place, at `FIELD_YEAR`.

    Args:
        latitude_deg: WGS 84, north positive.
        longitude_deg: WGS 84, east positive.
        altitude_m: above the ellipsoid; 50 m, as between it and the sea level, change the field by 0.003 %.

    Returns:
        North, east, down, shape (3,), gauss.
    """
    from pygeomag import GeoMag

    model = GeoMag(coefficients_file="wmm/WMM_2025.COF")
    field = model.calculate(glat=latitude_deg, glon=longitude_deg, alt=altitude_m / 1000.0, time=FIELD_YEAR)
    north_nt, east_nt, down_nt = float(field.x), float(field.y), float(field.z)
    return (
        north_nt * _GAUSS_PER_NANOTESLA,
        east_nt * _GAUSS_PER_NANOTESLA,
        down_nt * _GAUSS_PER_NANOTESLA,
    )
