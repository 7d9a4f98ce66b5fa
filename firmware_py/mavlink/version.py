"""AUTOPILOT_VERSION and PROTOCOL_VERSION: what this vehicle is and can do.

The flight software version names the PX4 release whose behaviour on the wire is followed, because ground
stations switch features on by it; the middleware version is this project's own. Capabilities are PX4's, and
SET_POSITION_TARGET_GLOBAL_INT, which PX4 understands too without saying so.
"""

from __future__ import annotations

from wire.dialect import Message, mavlink

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
