"""The International Standard Atmosphere below 11 km (ISO 2533)."""

from __future__ import annotations

_SEA_LEVEL_HPA = 1013.25
_SEA_LEVEL_K = 288.15
_LAPSE_K_M = 0.0065
_EXPONENT = 5.25588  # g M / (R L)


def temperature_k(altitude_m: float) -> float:
    """Air temperature at an altitude above mean sea level."""
    return _SEA_LEVEL_K - _LAPSE_K_M * min(max(altitude_m, -5000.0), 11000.0)


def pressure_hpa(altitude_m: float) -> float:
    """Static pressure at an altitude above mean sea level: p0 (T / T0)^5.256."""
    return float(_SEA_LEVEL_HPA * (temperature_k(altitude_m) / _SEA_LEVEL_K) ** _EXPONENT)


def pressure_pa(altitude_m: float) -> float:
    """Static pressure at an altitude above mean sea level, pascal."""
    return 100.0 * pressure_hpa(altitude_m)


def pressure_altitude_m(static_pressure_pa: float) -> float:
    """Altitude above mean sea level with this static pressure, which must be above zero."""
    share = static_pressure_pa / (100.0 * _SEA_LEVEL_HPA)
    return float(_SEA_LEVEL_K / _LAPSE_K_M * (1.0 - share ** (1.0 / _EXPONENT)))


def metres_per_pascal(static_pressure_pa: float) -> float:
    """How much higher it is where the pressure is lower by a pascal: 1 / (density times gravity)."""
    altitude_m = pressure_altitude_m(static_pressure_pa)
    return temperature_k(altitude_m) / (_LAPSE_K_M * _EXPONENT * static_pressure_pa)
