"""Into MAVLink's whole numbers, whatever the value: a state that is not finite must not end the flight."""

from __future__ import annotations

from math import isnan


def whole(value: float, bits: int, *, signed: bool = True) -> int:
    """The nearest integer that fits; NaN becomes 0.

    Args:
        value: any float.
        bits: of the field.
        signed: whether the field is signed.
    """
    high = (1 << (bits - 1 if signed else bits)) - 1
    low = -high - 1 if signed else 0
    if isnan(value):
        return 0
    if value <= low:
        return low
    return high if value >= high else round(value)


def boot_ms(time_us: int) -> int:
    """Milliseconds since boot in 32 bits; starts again after 49 days."""
    return time_us // 1000 & 0xFFFFFFFF


def degrees_e7(degrees: float) -> int:
    """Latitude or longitude as MAVLink packs it."""
    return whole(degrees * 1e7, 32)


def millimetres(metres: float) -> int:
    """An altitude as MAVLink packs it."""
    return whole(metres * 1e3, 32)
