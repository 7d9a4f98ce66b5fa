"""Flight modes as ground stations list them: MAVLink's standard modes, PX4's names, what may be chosen."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from firmware_py.status import FlightMode
from wire.dialect import Message, mavlink

_ADVANCED = mavlink.MAV_MODE_PROPERTY_ADVANCED
_NOT_SELECTABLE = mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
_BASIC = (FlightMode.ALTITUDE, FlightMode.POSITION)
_NAME_BYTES = 35

STANDARD_MODES: Mapping[FlightMode, int] = MappingProxyType(
    {
        FlightMode.ALTITUDE: int(mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD),
        FlightMode.POSITION: int(mavlink.MAV_STANDARD_MODE_POSITION_HOLD),
        FlightMode.ORBIT: int(mavlink.MAV_STANDARD_MODE_ORBIT),
        FlightMode.MISSION: int(mavlink.MAV_STANDARD_MODE_MISSION),
        FlightMode.RETURN: int(mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY),
        FlightMode.LAND: int(mavlink.MAV_STANDARD_MODE_LAND),
        FlightMode.TAKEOFF: int(mavlink.MAV_STANDARD_MODE_TAKEOFF),
    }
)
"""Modes that mean the same on every autopilot; the others have a name."""

MODES_BY_STANDARD: Mapping[int, FlightMode] = MappingProxyType(
    {number: mode for mode, number in STANDARD_MODES.items()}
)

# In PX4's order. A standard mode goes without a name, as MAVLink wants it.
_LISTED: tuple[tuple[FlightMode, str], ...] = (
    (FlightMode.MANUAL, "Manual"),
    (FlightMode.ALTITUDE, ""),
    (FlightMode.POSITION, ""),
    (FlightMode.MISSION, ""),
    (FlightMode.HOLD, "Hold"),
    (FlightMode.RETURN, ""),
    (FlightMode.ACRO, "Acro"),
    (FlightMode.TERMINATION, "Termination"),
    (FlightMode.OFFBOARD, "Offboard"),
    (FlightMode.STABILIZED, "Stabilized"),
    (FlightMode.TAKEOFF, ""),
    (FlightMode.LAND, ""),
    (FlightMode.FOLLOW, "Follow Target"),
    (FlightMode.ORBIT, ""),
)


def standard_mode(mode: FlightMode) -> int:
    """MAV_STANDARD_MODE of a mode; 0 for one that is PX4's own."""
    return STANDARD_MODES.get(mode, 0)


def available_modes(index: int) -> list[Message]:
    """AVAILABLE_MODES.

    Args:
        index: of a mode from 1; 0: all.

    Returns:
        The messages; none for an index beyond.
    """
    if index == 0:
        return [_available(place) for place in range(len(_LISTED))]
    return [_available(index - 1)] if 0 < index <= len(_LISTED) else []


def _available(place: int) -> Message:
    mode, name = _LISTED[place]
    properties = 0 if mode in _BASIC else _ADVANCED
    if mode is FlightMode.TERMINATION:
        properties |= _NOT_SELECTABLE
    return mavlink.MAVLink_available_modes_message(
        len(_LISTED),
        place + 1,
        standard_mode(mode),
        mode.custom_mode,
        properties,
        name.encode().ljust(_NAME_BYTES, b"\0"),
    )
