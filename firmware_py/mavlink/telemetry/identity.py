"""What this vehicle is and can do: AUTOPILOT_VERSION, PROTOCOL_VERSION and AVAILABLE_MODES.

The flight software version names the PX4 release whose behaviour on the wire is followed, because ground
stations switch features on by it; the middleware version is this project's own. Capabilities are PX4's, and
SET_POSITION_TARGET_GLOBAL_INT, which PX4 understands too without saying so.
"""

from __future__ import annotations

from firmware_py.mavlink.service import Service
from firmware_py.status import NAVIGATION_STATES, FlightMode
from wire.dialect import Message, mavlink
from wire.exchange import Exchange

FOLLOWED_PX4_VERSION = (1, 17, 0)
OWN_VERSION = (0, 1, 0)
_RELEASE = 0xFF  # FIRMWARE_VERSION_TYPE_OFFICIAL
_UID_PREFIX = 0x66726D72  # "frmr"; the system id follows

CAPABILITIES = (
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
    | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
)

_ADVANCED = mavlink.MAV_MODE_PROPERTY_ADVANCED
_NOT_SELECTABLE = mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
_BASIC = (FlightMode.ALTITUDE, FlightMode.POSITION)
_NAME_BYTES = 35

_LISTED = tuple(NAVIGATION_STATES)
_PX4_NAMES = {FlightMode.FOLLOW: "Follow Target"}  # where PX4's differs from the ground stations'


def packed_version(version: tuple[int, int, int]) -> int:
    """A release's version as AUTOPILOT_VERSION packs it."""
    major, minor, patch = version
    return major << 24 | minor << 16 | patch << 8 | _RELEASE


def autopilot_version(system_id: int) -> Message:
    """AUTOPILOT_VERSION."""
    no_hash = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(
        CAPABILITIES,
        packed_version(FOLLOWED_PX4_VERSION),
        packed_version(OWN_VERSION),
        0,
        0,
        no_hash,
        no_hash,
        no_hash,
        0,
        0,
        _UID_PREFIX << 32 | system_id,
    )


def protocol_version() -> Message:
    """PROTOCOL_VERSION with PX4's figures."""
    no_hash = [0] * 8
    return mavlink.MAVLink_protocol_version_message(200, 100, 203, no_hash, no_hash)


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


class IdentityService(Service):
    """Answers who we are."""

    def __init__(self, exchange: Exchange) -> None:
        self.replies = {
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: lambda _, __: [autopilot_version(exchange.system_id)],
            mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION: lambda _, __: [protocol_version()],
            mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES: lambda _, index: available_modes(index),
        }
