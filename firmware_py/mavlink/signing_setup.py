"""SETUP_SIGNING: a new key, taken only on a link that nobody outside can listen to."""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from wire.dialect import Message, mavlink


def _set_up(exchange: Exchange, link: Link, message: Message) -> None:
    if not exchange.is_for_us(message):
        return
    say = exchange.autopilot.say
    if not link.profile.trusted:
        say(mavlink.MAV_SEVERITY_WARNING, "SETUP_SIGNING refused: send it on a loopback or serial link")
    elif exchange.signing.set_up(message):
        say(mavlink.MAV_SEVERITY_NOTICE, f"Signing {'on' if exchange.signing.active else 'off'}")
    else:
        say(mavlink.MAV_SEVERITY_WARNING, "SETUP_SIGNING refused: its initial_timestamp is in the far future")


HANDLERS: dict[int, Handler] = {mavlink.MAVLINK_MSG_ID_SETUP_SIGNING: _set_up}
