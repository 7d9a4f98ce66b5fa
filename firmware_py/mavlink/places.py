"""Places that are told: the local frame's origin, and a target to follow."""

from __future__ import annotations

from math import isfinite

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.types import GeodeticPoint
from wire.dialect import Message, mavlink

_HAS_VELOCITY = 1 << 1  # est_capabilities of FOLLOW_TARGET


def _set_origin(exchange: Exchange, _link: Link, message: Message) -> None:
    if message.target_system == exchange.system_id:
        exchange.autopilot.set_origin(
            GeodeticPoint(message.latitude / 1e7, message.longitude / 1e7, message.altitude / 1e3)
        )


def _follow_target(exchange: Exchange, _link: Link, message: Message) -> None:
    """A report of the target; one that is no place on Earth, or not finite, is dropped."""
    place = exchange.autopilot.local_position(
        GeodeticPoint(message.lat / 1e7, message.lon / 1e7, message.alt)
    )
    if place is None:
        return
    north_m_s, east_m_s, down_m_s = (float(component) for component in message.vel)
    moves = message.est_capabilities & _HAS_VELOCITY and isfinite(north_m_s + east_m_s + down_m_s)
    exchange.autopilot.follow_target(place, (north_m_s, east_m_s, down_m_s) if moves else (0.0, 0.0, 0.0))


HANDLERS: dict[int, Handler] = {
    mavlink.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: _set_origin,
    mavlink.MAVLINK_MSG_ID_FOLLOW_TARGET: _follow_target,
}
