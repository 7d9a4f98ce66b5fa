"""Flight modes as ground stations list them: MAVLink's standard modes, PX4's names, what may be chosen."""

from __future__ import annotations

from firmware_py.status import NAVIGATION_STATES, FlightMode
from wire.dialect import Message, mavlink

_ADVANCED = mavlink.MAV_MODE_PROPERTY_ADVANCED
_NOT_SELECTABLE = mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
_BASIC = (FlightMode.ALTITUDE, FlightMode.POSITION)
_NAME_BYTES = 35

_LISTED = tuple(NAVIGATION_STATES)
_PX4_NAMES = {FlightMode.FOLLOW: "Follow Target"}  # where PX4's differs from the ground stations'


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
    mode = _LISTED[place]
    # A standard mode goes without a name, as MAVLink wants it.
    name = "" if mode.value.standard else _PX4_NAMES.get(mode, mode.value.title)
    properties = 0 if mode in _BASIC else _ADVANCED
    if mode is FlightMode.TERMINATION:
        properties |= _NOT_SELECTABLE
    return mavlink.MAVLink_available_modes_message(
        len(_LISTED),
        place + 1,
        mode.value.standard,
        mode.custom_mode,
        properties,
        name.encode().ljust(_NAME_BYTES, b"\0"),
    )
