"""TIMESYNC, PING and SYSTEM_TIME.

Difference from PX4: an autopilot without a clock does not know the date; SYSTEM_TIME says 0 for it unless the
node was told the time of boot.
"""

from __future__ import annotations

from firmware_py.mavlink.dialect import BROADCAST, Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms


def timesync_request(_autopilot: AutopilotPort, time_us: int) -> Message:
    """TIMESYNC request with our time in nanoseconds."""
    return mavlink.MAVLink_timesync_message(0, time_us * 1000)


def ping_request(_autopilot: AutopilotPort, time_us: int) -> Message:
    """PING request to everyone; its number is the second of vehicle time."""
    return mavlink.MAVLink_ping_message(time_us, time_us // 1_000_000 & 0xFFFFFFFF, BROADCAST, BROADCAST)


def system_time(boot_unix_us: int, time_us: int) -> Message:
    """SYSTEM_TIME; a time of boot of 0 means that the date is unknown."""
    unix_us = boot_unix_us + time_us if boot_unix_us else 0
    return mavlink.MAVLink_system_time_message(unix_us, boot_ms(time_us))


def _answer_timesync(exchange: Exchange, link: Link, message: Message) -> None:
    if message.tc1 == 0:
        exchange.send(link, mavlink.MAVLink_timesync_message(exchange.time_us * 1000, message.ts1))


def _answer_ping(exchange: Exchange, link: Link, message: Message) -> None:
    if message.target_system == BROADCAST and message.target_component == BROADCAST:
        answer = mavlink.MAVLink_ping_message(
            message.time_usec, message.seq, message.get_srcSystem(), message.get_srcComponent()
        )
        exchange.send(link, answer)


HANDLERS: dict[int, Handler] = {
    mavlink.MAVLINK_MSG_ID_TIMESYNC: _answer_timesync,
    mavlink.MAVLINK_MSG_ID_PING: _answer_ping,
}
