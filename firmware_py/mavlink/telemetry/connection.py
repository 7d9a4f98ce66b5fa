"""The connection itself: HEARTBEAT, TIMESYNC, PING, SYSTEM_TIME and SETUP_SIGNING.

Difference from PX4: an autopilot without a clock does not know the date; SYSTEM_TIME says 0 for it until
somebody tells it, at boot or by the same message.
"""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.scaling import boot_ms
from firmware_py.mavlink.service import Service
from firmware_py.status import FlightMode, VehicleStatus
from wire.dialect import BROADCAST, Message, mavlink
from wire.exchange import Exchange
from wire.link import Link

_MIN_UNIX_US = 1_234_567_890_000_000  # what is earlier is no date, in PX4's view
_MAX_UNIX_US = 1 << 62
_DATE_DIFFERENCE_US = 60_000_000  # by which a date must be later than ours
_CUSTOM = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def base_mode(status: VehicleStatus) -> int:
    """HEARTBEAT.base_mode as PX4 sets it: 29 disarmed and 157 armed in auto modes, 17 and 145 in offboard."""
    return int(_CUSTOM | status.mode.value.flags | (_ARMED if status.armed else 0))


def system_status(status: VehicleStatus) -> int:
    """HEARTBEAT.system_status (MAV_STATE)."""
    if status.armed and status.mode is FlightMode.TERMINATION:
        return int(mavlink.MAV_STATE_FLIGHT_TERMINATION)
    if status.failsafe:
        return int(mavlink.MAV_STATE_CRITICAL)
    if status.armed:
        return int(mavlink.MAV_STATE_ACTIVE)
    return int(mavlink.MAV_STATE_STANDBY if status.ready else mavlink.MAV_STATE_UNINIT)


class ConnectionService(Service):
    """Tells who we are and how we are, hears ground stations, and answers about time and signing."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._hear_heartbeat,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self._learn_date,
            mavlink.MAVLINK_MSG_ID_TIMESYNC: self._answer_timesync,
            mavlink.MAVLINK_MSG_ID_PING: self._answer_ping,
            mavlink.MAVLINK_MSG_ID_SETUP_SIGNING: self._set_up_signing,
        }
        self.sources = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._heartbeat,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self._system_time,
            mavlink.MAVLINK_MSG_ID_TIMESYNC: self._timesync_request,
            mavlink.MAVLINK_MSG_ID_PING: self._ping_request,
        }

    def _heartbeat(self) -> Message:
        status = self._autopilot.status
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR,
            mavlink.MAV_AUTOPILOT_PX4,
            base_mode(status),
            status.mode.custom_mode,
            system_status(status),
            3,
        )

    def _hear_heartbeat(self, link: Link, message: Message) -> None:
        if message.type == mavlink.MAV_TYPE_GCS:
            link.gcs_heard = True
            self._autopilot.ground_station_heard()

    def _system_time(self) -> Message:
        """SYSTEM_TIME; 0 while the date is not known."""
        exchange = self._exchange
        return mavlink.MAVLink_system_time_message(exchange.unix_us, boot_ms(exchange.time_us))

    def _learn_date(self, _link: Link, message: Message) -> None:
        """Take the date from whoever knows it, if it is later than ours by a minute, as PX4."""
        exchange, unix_us = self._exchange, message.time_unix_usec
        later = unix_us > exchange.unix_us + _DATE_DIFFERENCE_US
        if later and _MIN_UNIX_US < unix_us < _MAX_UNIX_US:
            exchange.boot_unix_us = unix_us - exchange.time_us

    def _timesync_request(self) -> Message:
        """TIMESYNC with our time in nanoseconds."""
        return mavlink.MAVLink_timesync_message(0, self._exchange.time_us * 1000)

    def _answer_timesync(self, link: Link, message: Message) -> None:
        if message.tc1 == 0:
            answer = mavlink.MAVLink_timesync_message(self._exchange.time_us * 1000, message.ts1)
            self._exchange.send(link, answer)

    def _ping_request(self) -> Message:
        """PING to everyone; its number is the second of vehicle time."""
        time_us = self._exchange.time_us
        return mavlink.MAVLink_ping_message(time_us, time_us // 1_000_000 & 0xFFFFFFFF, BROADCAST, BROADCAST)

    def _answer_ping(self, link: Link, message: Message) -> None:
        if message.target_system == BROADCAST and message.target_component == BROADCAST:
            answer = mavlink.MAVLink_ping_message(
                message.time_usec, message.seq, message.get_srcSystem(), message.get_srcComponent()
            )
            self._exchange.send(link, answer)

    def _set_up_signing(self, link: Link, message: Message) -> None:
        """Take a new key, but only on a link that nobody outside can listen to."""
        if not self._exchange.is_for_us(message):
            return
        signing, say = self._exchange.signing, self._autopilot.say
        if not link.profile.trusted:
            say(mavlink.MAV_SEVERITY_WARNING, "SETUP_SIGNING refused: send it on a loopback or serial link")
        elif signing.set_up(message):
            say(mavlink.MAV_SEVERITY_NOTICE, f"Signing {'on' if signing.active else 'off'}")
        else:
            say(
                mavlink.MAV_SEVERITY_WARNING,
                "SETUP_SIGNING refused: its initial_timestamp is in the far future",
            )
