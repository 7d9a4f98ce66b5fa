"""The mission protocol of a vehicle that flies no missions: empty lists, and a clear no to an upload.

Without an answer QGroundControl waits 7.5 s for each of mission, fence and rally points.
"""

from __future__ import annotations

from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link

_TYPES = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)


def _acknowledge(exchange: Exchange, link: Link, message: Message, result: int) -> None:
    answer = mavlink.MAVLink_mission_ack_message(
        message.get_srcSystem(), message.get_srcComponent(), result, message.mission_type
    )
    exchange.send(link, answer)


def _list(exchange: Exchange, link: Link, message: Message) -> None:
    if not exchange.is_for_us(message):
        return
    if message.mission_type not in _TYPES:
        _acknowledge(exchange, link, message, mavlink.MAV_MISSION_UNSUPPORTED)
        return
    answer = mavlink.MAVLink_mission_count_message(
        message.get_srcSystem(), message.get_srcComponent(), 0, message.mission_type
    )
    exchange.send(link, answer)


def _upload(exchange: Exchange, link: Link, message: Message) -> None:
    if exchange.is_for_us(message):
        empty = message.count == 0 and message.mission_type in _TYPES
        result = mavlink.MAV_MISSION_ACCEPTED if empty else mavlink.MAV_MISSION_UNSUPPORTED
        _acknowledge(exchange, link, message, result)


def _clear(exchange: Exchange, link: Link, message: Message) -> None:
    if exchange.is_for_us(message):
        _acknowledge(exchange, link, message, mavlink.MAV_MISSION_ACCEPTED)


HANDLERS: dict[int, Handler] = {
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: _list,
    mavlink.MAVLINK_MSG_ID_MISSION_COUNT: _upload,
    mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: _clear,
}
