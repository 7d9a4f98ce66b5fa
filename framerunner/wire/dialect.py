"""MAVLink's message definitions, the messages that every listener of a vehicle sends, and field encodings.

pymavlink's `development` dialect is `common` and the few newer messages that PX4 sends, such as CURRENT_MODE
and AVAILABLE_MODES; it loads as quickly as `common`. No other module names a dialect. The messages of
`common` that pymavlink lacks are added to it here.
"""

from __future__ import annotations

from math import isnan
from typing import Any

from pymavlink.dialects.v20 import development

from framerunner.wire import extra_messages

mavlink = development
Message = Any  # a pymavlink message; its classes are made at run time and have no types

AUTOPILOT_COMPONENT_ID = 1
BROADCAST = 0
MAVSDK_SYSTEM_ID = 245  # of a ground station, as the app is one
_MAVLINK_VERSION = 3

extra_messages.add_to(mavlink)


def is_vehicle(message: Message) -> bool:
    """Whether this is the HEARTBEAT of an autopilot, not of a ground station, camera or companion."""
    return bool(
        message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT
        and message.get_srcComponent() == AUTOPILOT_COMPONENT_ID
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        and message.type != mavlink.MAV_TYPE_GCS
    )


def companion_heartbeat() -> Message:
    """The HEARTBEAT of a companion computer, which changes nothing at the vehicle."""
    return component_heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER)


def ground_station_heartbeat() -> Message:
    """The HEARTBEAT of a ground station.

    PX4 sends its texts (STATUSTEXT) only on links where it receives this, and its loss is a failsafe.
    """
    return component_heartbeat(mavlink.MAV_TYPE_GCS)


def component_heartbeat(kind: int) -> Message:
    """The HEARTBEAT of a component of some MAV_TYPE that is no autopilot."""
    return _heartbeat(kind)


def device_heartbeat(kind: int, custom_mode: int) -> Message:
    """The HEARTBEAT of a vehicle's camera or gimbal, with the vehicle's mode.

    MAVSDK's follow-me takes any component's heartbeat for the vehicle's, and would end with one without
    a mode.

    Args:
        kind: MAV_TYPE.
        custom_mode: of the vehicle's own heartbeat.
    """
    return _heartbeat(kind, mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, custom_mode)


def _heartbeat(kind: int, base_mode: int = 0, custom_mode: int = 0) -> Message:
    state = mavlink.MAV_STATE_ACTIVE
    return mavlink.MAVLink_heartbeat_message(
        kind, mavlink.MAV_AUTOPILOT_INVALID, base_mode, custom_mode, state, _MAVLINK_VERSION
    )


def command_long(
    system_id: int,
    number: int,
    *parameters: float,
    confirmation: int = 0,
    component_id: int = AUTOPILOT_COMPONENT_ID,
) -> Message:
    """A COMMAND_LONG, by default to a vehicle's autopilot.

    Args:
        system_id: of the vehicle.
        number: MAV_CMD.
        *parameters: the first ones of seven; the others are 0.
        confirmation: 0, and one more each time the same command is repeated.
        component_id: of the receiver.
    """
    rest = [0.0] * (7 - len(parameters))
    return mavlink.MAVLink_command_long_message(
        system_id, component_id, number, confirmation, *parameters, *rest
    )


def request_message(system_id: int, message_id: int, component_id: int = AUTOPILOT_COMPONENT_ID) -> Message:
    """Request a message once (REQUEST_MESSAGE)."""
    return command_long(system_id, mavlink.MAV_CMD_REQUEST_MESSAGE, message_id, component_id=component_id)


def request_parameter(system_id: int, name: str) -> Message:
    """Request a parameter by its name (PARAM_REQUEST_READ)."""
    return mavlink.MAVLink_param_request_read_message(system_id, AUTOPILOT_COMPONENT_ID, name.encode(), -1)


def message_name(message_id: int) -> str:
    """The name of a message that the dialect has, such as "ATTITUDE"."""
    return str(mavlink.mavlink_map[message_id].msgname)


def event_id(name: str) -> int:
    """Id of an autopilot's EVENT: its component, then 24 bits of its name's FNV-1a hash, as in PX4."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x01000193 & 0xFFFFFFFF
    return AUTOPILOT_COMPONENT_ID << 24 | number & 0xFFFFFF


def request_rate(system_id: int, message_id: int, rate_hz: float) -> Message:
    """Request that a message is streamed (SET_MESSAGE_INTERVAL)."""
    return command_long(system_id, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)


def whole(value: float, bits: int, *, signed: bool = True) -> int:
    """The nearest integer that fits a field of some bits; NaN becomes 0, so no value can end a flight."""
    high = (1 << (bits - 1 if signed else bits)) - 1
    low = -high - 1 if signed else 0
    if isnan(value):
        return 0
    if value <= low:
        return low
    return high if value >= high else round(value)


def boot_ms(time_us: int) -> int:
    """Milliseconds since boot in 32 bits; wraps after 49 days."""
    return time_us // 1000 & 0xFFFFFFFF


def degrees_e7(degrees: float) -> int:
    """Latitude or longitude in 1e-7 degrees."""
    return whole(degrees * 1e7, 32)


def millimetres(metres: float) -> int:
    """An altitude in millimetres."""
    return whole(metres * 1e3, 32)
