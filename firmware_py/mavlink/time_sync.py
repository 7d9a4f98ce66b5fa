"""TIMESYNC, PING and SYSTEM_TIME.

Difference from PX4: an autopilot without a clock does not know the date; SYSTEM_TIME says 0 for it until
somebody tells it, at boot or by the same message.
"""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms
from wire.dialect import BROADCAST, Message, mavlink

_LEAST_UNIX_US = 1_234_567_890_000_000  # what is earlier is no date, in PX4's view
_MOST_UNIX_US = 1 << 62
_LATE_US = 60_000_000


def timesync_request(_autopilot: AutopilotPort, time_us: int) -> Message:
    """TIMESYNC request with our time in nanoseconds."""
    return mavlink.MAVLink_timesync_message(0, time_us * 1000)


def ping_request(_autopilot: AutopilotPort, time_us: int) -> Message:
    """PING request to everyone; its number is the second of vehicle time."""
    return mavlink.MAVLink_ping_message(time_us, time_us // 1_000_000 & 0xFFFFFFFF, BROADCAST, BROADCAST)


def system_time(exchange: Exchange) -> Message:
    """SYSTEM_TIME; 0 while the date is unknown."""
    unix_us = exchange.boot_unix_us + exchange.time_us if exchange.boot_unix_us else 0
    return mavlink.MAVLink_system_time_message(unix_us, boot_ms(exchange.time_us))


def _learn_date(exchange: Exchange, _link: Link, message: Message) -> None:
    """Take the date from whoever knows it, if it is later than ours by a minute, as PX4."""
    unix_us = message.time_unix_usec
    ours_us = exchange.boot_unix_us + exchange.time_us if exchange.boot_unix_us else 0
    if unix_us > _LEAST_UNIX_US and unix_us > ours_us + _LATE_US and unix_us < _MOST_UNIX_US:
        exchange.boot_unix_us = unix_us - exchange.time_us


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
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: _learn_date,
    mavlink.MAVLINK_MSG_ID_TIMESYNC: _answer_timesync,
    mavlink.MAVLINK_MSG_ID_PING: _answer_ping,
}
