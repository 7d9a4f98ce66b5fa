"""What the vehicle is and which link this is: HEARTBEAT, versions, modes, time, PING and SETUP_SIGNING.

The flight software version names the PX4 release whose behaviour on the wire is followed, because ground
stations enable features by it; the middleware version is this project's own. Capabilities are PX4's, and
SET_POSITION_TARGET_GLOBAL_INT, which PX4 understands without reporting it.

Difference from PX4: an autopilot without a clock does not have the date; SYSTEM_TIME contains 0 for it until
it is set at boot or by the same message.
"""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.mavlink.time_sync import Clocks
from firmware_py.status import NAVIGATION_STATES, FlightMode, VehicleStatus
from framerunner.wire.dialect import BROADCAST, Message, boot_ms, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link
from framerunner.wire.vehicle_identity import simulator_uid

FOLLOWED_PX4_VERSION = (1, 17, 0)
OWN_VERSION = (0, 1, 0)
_RELEASE = 0xFF  # FIRMWARE_VERSION_TYPE_OFFICIAL
_CAPABILITIES = (
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
_LISTED_MODES = tuple(NAVIGATION_STATES)
_BASIC_MODES = (FlightMode.ALTITUDE, FlightMode.POSITION)
_PX4_NAMES = {FlightMode.FOLLOW: "Follow Target"}  # where PX4's differs from the ground stations'
_NAME_BYTES = 35
_MIN_UNIX_US = 1_234_567_890_000_000  # PX4 takes nothing earlier as a date
_MAX_UNIX_US = 1 << 62
_DATE_DIFFERENCE_US = 60_000_000  # by which a received date must be later than ours
_CUSTOM = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def packed_version(version: tuple[int, int, int]) -> int:
    """A release's version as AUTOPILOT_VERSION packs it."""
    major, minor, patch = version
    return major << 24 | minor << 16 | patch << 8 | _RELEASE


def _system_status(status: VehicleStatus) -> int:
    """HEARTBEAT.system_status (MAV_STATE)."""
    if status.armed and status.mode is FlightMode.TERMINATION:
        return int(mavlink.MAV_STATE_FLIGHT_TERMINATION)
    if status.failsafe:
        return int(mavlink.MAV_STATE_CRITICAL)
    if status.armed:
        return int(mavlink.MAV_STATE_ACTIVE)
    return int(mavlink.MAV_STATE_STANDBY if status.ready else mavlink.MAV_STATE_UNINIT)


def _autopilot_version(system_id: int) -> Message:
    no_hash = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(
        capabilities=_CAPABILITIES,
        flight_sw_version=packed_version(FOLLOWED_PX4_VERSION),
        middleware_sw_version=packed_version(OWN_VERSION),
        os_sw_version=0,
        board_version=0,
        flight_custom_version=no_hash,
        middleware_custom_version=no_hash,
        os_custom_version=no_hash,
        vendor_id=0,
        product_id=0,
        uid=simulator_uid(system_id),
    )


def _protocol_version() -> Message:
    """PROTOCOL_VERSION with PX4's values."""
    no_hash = [0] * 8
    return mavlink.MAVLink_protocol_version_message(200, 100, 203, no_hash, no_hash)


def _available_modes(index: int) -> list[Message]:
    """AVAILABLE_MODES of the mode with an index from 1; 0: of all; none for an index beyond."""
    modes = enumerate(_LISTED_MODES, start=1)
    return [_available_mode(number, mode) for number, mode in modes if index in (0, number)]


def _available_mode(number: int, mode: FlightMode) -> Message:
    # MAVLink requires a standard mode to have no name.
    name = "" if mode.value.standard else _PX4_NAMES.get(mode, mode.value.title)
    properties = 0 if mode in _BASIC_MODES else mavlink.MAV_MODE_PROPERTY_ADVANCED
    if mode is FlightMode.TERMINATION:
        properties |= mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
    return mavlink.MAVLink_available_modes_message(
        len(_LISTED_MODES),
        number,
        mode.value.standard,
        mode.custom_mode,
        properties,
        name.encode().ljust(_NAME_BYTES, b"\0"),
    )


class ConnectionService(AutopilotService):
    """Sends what the vehicle is and its state, notes ground stations, and answers about time and signing."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange, clocks: Clocks) -> None:
        super().__init__(autopilot, exchange)
        self._clocks = clocks
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._receive_heartbeat,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self._receive_date,
            mavlink.MAVLINK_MSG_ID_TIMESYNC: self._take_timesync,
            mavlink.MAVLINK_MSG_ID_PING: self._answer_ping,
            mavlink.MAVLINK_MSG_ID_SETUP_SIGNING: self._set_up_signing,
        }
        self.sources = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._heartbeat,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self._system_time,
            mavlink.MAVLINK_MSG_ID_TIMESYNC: self._timesync_request,
            mavlink.MAVLINK_MSG_ID_PING: self._ping_request,
            mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION: _protocol_version,
        }
        self.replies = {
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: lambda _, __: [_autopilot_version(exchange.system_id)],
            mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES: lambda _, index: _available_modes(index),
        }

    def _heartbeat(self) -> Message:
        status, mode = self._autopilot.status, self._autopilot.status.mode
        # As in PX4: 29 disarmed and 157 armed in auto modes, 17 and 145 in offboard.
        base_mode = _CUSTOM | mode.value.flags | (_ARMED if status.armed else 0)
        return mavlink.MAVLink_heartbeat_message(
            type=mavlink.MAV_TYPE_QUADROTOR,
            autopilot=mavlink.MAV_AUTOPILOT_PX4,
            base_mode=base_mode,
            custom_mode=mode.custom_mode,
            system_status=_system_status(status),
            mavlink_version=3,
        )

    def _receive_heartbeat(self, link: Link, message: Message) -> None:
        if message.type == mavlink.MAV_TYPE_GCS:
            link.gcs_heard = True
            self._autopilot.ground_station_heard()

    def _system_time(self) -> Message:
        exchange = self._exchange
        return mavlink.MAVLink_system_time_message(exchange.unix_us, boot_ms(exchange.time_us))

    def _receive_date(self, _link: Link, message: Message) -> None:
        """Take the date of SYSTEM_TIME if it is later than ours by a minute, as PX4."""
        exchange, unix_us = self._exchange, message.time_unix_usec
        later = unix_us > exchange.unix_us + _DATE_DIFFERENCE_US
        if later and _MIN_UNIX_US < unix_us < _MAX_UNIX_US:
            exchange.boot_unix_us = unix_us - exchange.time_us

    def _timesync_request(self) -> Message:
        """TIMESYNC with our time in nanoseconds."""
        return mavlink.MAVLink_timesync_message(0, self._exchange.time_us * 1000)

    def _take_timesync(self, link: Link, message: Message) -> None:
        """Answer a request; an answer tells the other system's clock."""
        now_us = self._exchange.time_us
        if message.tc1 == 0:
            self._exchange.send(link, mavlink.MAVLink_timesync_message(now_us * 1000, message.ts1))
        elif message.tc1 > 0:
            self._clocks.on(link.profile.name).take(now_us, message.tc1, message.ts1)

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
        """Take a new key, but only on a link that cannot be reached from outside."""
        if not self._exchange.is_for_us(message):
            return
        signing, say = self._exchange.signing, self._autopilot.say
        refused = mavlink.MAV_SEVERITY_WARNING
        if not link.profile.trusted:
            say(refused, "SETUP_SIGNING refused: send it on a loopback or serial link")
        elif signing.set_up(message):
            say(mavlink.MAV_SEVERITY_NOTICE, f"Signing {'on' if signing.active else 'off'}")
        else:
            say(refused, "SETUP_SIGNING refused: its initial_timestamp is in the far future")
