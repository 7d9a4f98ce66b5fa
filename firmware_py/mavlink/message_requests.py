"""Messages on request and their intervals: REQUEST_MESSAGE, SET_ and GET_MESSAGE_INTERVAL and their elders.

Difference from PX4: CURRENT_MODE, which PX4 denies on request, is sent.
"""

from __future__ import annotations

from math import isfinite

from firmware_py.mavlink import component_information, version
from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.standard_modes import available_modes
from firmware_py.mavlink.streams import can_stream, stream_message
from firmware_py.status import CommandResult
from wire.dialect import Message, mavlink

_LARGEST_ID = 0xFFFFFF
_LONGEST_US = 0x7FFFFFFF


def request_message(exchange: Exchange, link: Link, message_id: float, argument: float) -> CommandResult:
    """REQUEST_MESSAGE: send one message on this link.

    Args:
        exchange: who we are.
        link: who asks.
        message_id: which; anything that is no message of ours is denied.
        argument: the index or id that some messages need.
    """
    wanted = _message_id(message_id)
    messages = [] if wanted is None else _requested(exchange, link, wanted, argument)
    for message in messages:
        exchange.send(link, message)
    return CommandResult.ACCEPTED if messages else CommandResult.DENIED


def set_interval(link: Link, message_id: float, interval_us: float, time_us: int) -> CommandResult:
    """SET_MESSAGE_INTERVAL on this link: 0 default, -1 off. HEARTBEAT and what is unknown fail, as in PX4."""
    wanted = _message_id(message_id)
    if wanted is None or not can_stream(wanted) or wanted == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
        return CommandResult.FAILED
    if not isfinite(interval_us):
        return CommandResult.FAILED
    kept_us = -1 if interval_us < 0 else min(round(interval_us), _LONGEST_US)
    link.schedule.set_interval(wanted, kept_us, time_us)
    return CommandResult.ACCEPTED


def _message_id(number: float) -> int | None:
    if not isfinite(number) or number % 1 or not 0 <= number <= _LARGEST_ID:
        return None
    return int(number)


def _requested(exchange: Exchange, link: Link, message_id: int, argument: float) -> list[Message]:
    if message_id == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
        return [version.autopilot_version(exchange.system_id)]
    if message_id == mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION:
        return [version.protocol_version()]
    if message_id in component_information.MESSAGE_IDS:
        autopilot, time_us = exchange.autopilot, exchange.time_us
        return [component_information.component_message(autopilot, message_id, time_us)]
    number = _message_id(argument)
    if message_id == mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES:
        return available_modes(number or 0)
    if message_id == mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
        return [_interval(link, number or 0)]
    message = stream_message(exchange, message_id, link)
    return [] if message is None else [message]


def _interval(link: Link, message_id: int) -> Message:
    """MESSAGE_INTERVAL: 0 for a message that does not exist, -1 for one that is off."""
    interval_us = link.schedule.interval_us(message_id) if can_stream(message_id) else 0
    return mavlink.MAVLink_message_interval_message(message_id & 0xFFFF, interval_us)
