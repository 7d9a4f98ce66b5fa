"""Which heartbeat is a vehicle's, and the few messages with which its listeners speak to it."""

from __future__ import annotations

from wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink

_MAVLINK_VERSION = 3


def is_vehicle(message: Message) -> bool:
    """Whether this is the HEARTBEAT of an autopilot, not of a ground station, camera or companion."""
    return bool(
        message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT
        and message.get_srcComponent() == AUTOPILOT_COMPONENT_ID
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        and message.type != mavlink.MAV_TYPE_GCS
    )


def heartbeat(kind: int) -> Message:
    """The HEARTBEAT of a component that is no autopilot.

    Args:
        kind: MAV_TYPE. PX4 says its reasons (STATUSTEXT) only where it hears a ground station, and takes the
            loss of one as a failsafe; a companion computer of another system changes nothing there.
    """
    return mavlink.MAVLink_heartbeat_message(
        kind, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, _MAVLINK_VERSION
    )


def companion_heartbeat() -> Message:
    """The HEARTBEAT of a companion computer."""
    return heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER)


def ground_station_heartbeat() -> Message:
    """The HEARTBEAT of a ground station."""
    return heartbeat(mavlink.MAV_TYPE_GCS)


def command_long(system_id: int, number: int, *parameters: float, confirmation: int = 0) -> Message:
    """A COMMAND_LONG to a vehicle's autopilot.

    Args:
        system_id: of the vehicle.
        number: MAV_CMD.
        *parameters: the first ones of seven; the others are 0.
        confirmation: 0, and one more each time the same command is sent again.
    """
    filled = (*parameters, *([0.0] * (7 - len(parameters))))
    return mavlink.MAVLink_command_long_message(
        system_id, AUTOPILOT_COMPONENT_ID, number, confirmation, *filled
    )


def request_message(system_id: int, message_id: int, component_id: int = AUTOPILOT_COMPONENT_ID) -> Message:
    """Ask for a message once (REQUEST_MESSAGE)."""
    return mavlink.MAVLink_command_long_message(
        system_id, component_id, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, message_id, 0, 0, 0, 0, 0, 0
    )


def request_rate(system_id: int, message_id: int, rate_hz: float) -> Message:
    """Ask for a message again and again (SET_MESSAGE_INTERVAL)."""
    return command_long(system_id, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)
