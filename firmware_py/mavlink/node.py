"""The node: one vehicle's MAVLink, from bytes to services and from telemetry to bytes."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_py.mavlink import commands, file_transfer, heartbeat, missions, time_sync
from firmware_py.mavlink.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.framing import Packet
from firmware_py.mavlink.links import Link, LinkProfile
from firmware_py.mavlink.offboard_setpoints import SetpointService
from firmware_py.mavlink.parameter_protocol import ParameterService
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.status_texts import StatusTextService
from firmware_py.mavlink.streams import stream_message
from firmware_py.types import GeodeticPoint


class MavlinkNode:
    """Speaks MAVLink for an autopilot on some links. Streams from the first update, heard or not, as PX4.

    Attributes:
        failed_messages: messages whose handling failed inside; it should stay 0, and the texts say why not.
    """

    def __init__(
        self,
        autopilot: AutopilotPort,
        links: Sequence[LinkProfile],
        system_id: int = 1,
        *,
        boot_unix_us: int = 0,
    ) -> None:
        """Join an autopilot and its links.

        Args:
            autopilot: for whom to speak.
            links: with different names.
            system_id: MAVLink system id, 1 to 250; written to MAV_SYS_ID.
            boot_unix_us: time of boot in microseconds since 1970, for SYSTEM_TIME; 0: not known.

        Raises:
            ParameterError: the system id is out of range.
        """
        autopilot.parameters.set("MAV_SYS_ID", system_id)
        self._exchange = Exchange(
            autopilot, {profile.name: Link(profile) for profile in links}, system_id, boot_unix_us
        )
        self._texts = StatusTextService(self._exchange)
        self._parameters = ParameterService(self._exchange)
        self._handlers: dict[int, Handler] = {
            **heartbeat.HANDLERS,
            **commands.HANDLERS,
            **file_transfer.HANDLERS,
            **missions.HANDLERS,
            **time_sync.HANDLERS,
            **self._parameters.handlers,
            **SetpointService().handlers,
        }
        self._origin: GeodeticPoint | None = None
        self._home: GeodeticPoint | None = None
        self.failed_messages = 0

    def receive(self, link: str, data: bytes) -> None:
        """Take bytes that came in; never raises, whatever they are.

        Args:
            link: name of the link's profile.
            data: any piece of the stream.
        """
        source = self._exchange.links[link]
        for message in source.reader.feed(data):
            self._dispatch(source, message)

    def _dispatch(self, link: Link, message: Message) -> None:
        handler = self._handlers.get(message.get_msgId())
        if handler is None or self._is_own(message):
            return
        try:
            handler(self._exchange, link, message)
        except Exception as error:  # the last boundary: a packet must never end a flight
            self.failed_messages += 1
            self._exchange.autopilot.say(
                mavlink.MAV_SEVERITY_ERROR, f"Internal error on {message.get_type()}: {error!r}"
            )

    def _is_own(self, message: Message) -> bool:
        """Whether a packet claims to come from ourselves: an echo, or a lie."""
        source = (message.get_srcSystem(), message.get_srcComponent())
        return source == (self._exchange.system_id, AUTOPILOT_COMPONENT_ID)

    def update(self, time_us: int) -> None:
        """Send what is due.

        Args:
            time_us: vehicle time, microseconds since boot; never goes back.
        """
        exchange = self._exchange
        exchange.time_us = time_us
        packets: dict[int, Packet | None] = {}
        for link in exchange.links.values():
            for message_id in link.schedule.due(time_us):
                if message_id not in packets:
                    message = stream_message(exchange, message_id)
                    packets[message_id] = None if message is None else exchange.packet(message)
                packet = packets[message_id]
                if packet is not None:
                    link.send(packet)
        self._tell_places()
        self._texts.update()
        self._parameters.update()

    def _tell_places(self) -> None:
        """GPS_GLOBAL_ORIGIN and HOME_POSITION whenever they change; nobody waits two seconds for home."""
        status = self._exchange.autopilot.status
        if status.origin is not self._origin:
            self._origin = status.origin
            self._broadcast(mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
        if status.home is not self._home:
            self._home = status.home
            self._broadcast(mavlink.MAVLINK_MSG_ID_HOME_POSITION)

    def _broadcast(self, message_id: int) -> None:
        message = stream_message(self._exchange, message_id)
        if message is not None:
            self._exchange.broadcast(message)

    def take_output(self) -> list[tuple[str, bytes]]:
        """What is to be sent, as (link name, datagram); a datagram holds one or more whole packets."""
        return [(name, data) for name, link in self._exchange.links.items() for data in link.take()]
