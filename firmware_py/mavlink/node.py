"""The node: one vehicle's MAVLink, from bytes to services and from telemetry to bytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from firmware_py.mavlink import commands, heartbeat, places, signing_setup, sticks, time_sync
from firmware_py.mavlink.camera_component import CameraComponent
from firmware_py.mavlink.camera_model import CAMERA_COMPONENT_ID, CameraModel, CaptureSink
from firmware_py.mavlink.component_metadata import ExtraFiles
from firmware_py.mavlink.events import EventService
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.failure_sink import FailureSink
from firmware_py.mavlink.file_transfer import FileTransferService
from firmware_py.mavlink.links import Link, LinkProfile
from firmware_py.mavlink.log_transfer import LogTransferService
from firmware_py.mavlink.mission_orders import MissionOrders
from firmware_py.mavlink.missions import MissionService
from firmware_py.mavlink.offboard_setpoints import SetpointService
from firmware_py.mavlink.parameter_extended import ExtendedParameterService
from firmware_py.mavlink.parameter_protocol import ParameterService
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.rc_channels import RcChannels
from firmware_py.mavlink.shell import ShellService
from firmware_py.mavlink.status_texts import StatusTextService
from firmware_py.mavlink.streams import is_shared, stream_message
from firmware_py.mavlink.video_links import VideoStream
from firmware_py.storage import Storage
from firmware_py.types import GeodeticPoint, StatusText
from wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message, mavlink
from wire.forwarding import Router
from wire.framing import Packet, source_of
from wire.signing import Signing, SigningKey

HandlerTable = dict[int, tuple[Handler, ...]]  # by message id; one message may have several


class Service(Protocol):
    """What sends something by itself."""

    def update(self) -> None:
        """Send what is due; called at every update of the node, after the streams."""
        ...


class MavlinkNode:
    """Speaks MAVLink for an autopilot on some links. Streams from the first update, heard or not, as PX4.

    Attributes:
        failed_messages: messages whose handling failed inside; it should stay 0, and the texts say why not.
        refused_packets: sound packets that were not believed for want of a signature.
    """

    def __init__(
        self,
        autopilot: AutopilotPort,
        links: Sequence[LinkProfile],
        system_id: int = 1,
        *,
        boot_unix_us: int = 0,
        signing_key: SigningKey | None = None,
        video: Sequence[VideoStream] = (),
        storage: Storage | None = None,
        firmware_files: Mapping[str, bytes] | None = None,
        shell: bool = False,
        log_text: Callable[[int, StatusText], None] | None = None,
        camera: CameraModel | None = None,
        captures: CaptureSink | None = None,
        failures: FailureSink | None = None,
    ) -> None:
        """Join an autopilot and its links.

        Args:
            autopilot: for whom to speak.
            links: with different names.
            system_id: MAVLink system id, 1 to 250; written to MAV_SYS_ID.
            boot_unix_us: time of boot in microseconds since 1970, for SYSTEM_TIME; 0: not known.
            signing_key: with which all is signed; None: nothing is.
            video: the camera's streams, the one to be preferred first.
            storage: the vehicle's files and logs; None: it keeps none.
            firmware_files: path to content of files that can only be read, for `mftp://` addresses; by
                default those that explain this vehicle's parameters and events.
            shell: whether SERIAL_CONTROL is answered.
            log_text: called with vehicle time and all that is said to people.
            camera: on the vehicle, a component of its own; None: there is none.
            captures: takes and keeps its pictures; by default they are only counted.
            failures: breaks parts on purpose; None: nothing can be broken.

        Raises:
            ParameterError: the system id is out of range.
        """
        autopilot.parameters.set("MAV_SYS_ID", system_id)
        self._links: dict[str, Link] = {}
        self._link_number = 0
        signing = Signing(signing_key, boot_unix_us)
        self._exchange = Exchange(
            autopilot, self._links, system_id, boot_unix_us, signing=signing, video=video
        )
        for profile in links:
            self.add_link(profile)
        self._services, self._handlers = _services(
            self._exchange, storage, firmware_files, log_text, shell=shell
        )
        self._exchange.failures = failures
        if camera is not None:
            self._add_camera(CameraComponent(self._exchange, camera, captures))
        self._router = Router(self._is_own)
        self._origin: GeodeticPoint | None = None
        self._home: GeodeticPoint | None = None
        self.failed_messages = 0
        self.refused_packets = 0

    def _add_camera(self, component: CameraComponent) -> None:
        self._services = (*self._services, component)
        self._handlers[CAMERA_COMPONENT_ID] = _joined(component.handlers)
        self._exchange.camera, self._exchange.claimed = component, component.claimed

    def add_link(self, profile: LinkProfile) -> None:
        """Speak on one more link, from the next update on.

        Args:
            profile: with a name that no other link has.
        """
        self._links[profile.name] = Link(profile, self._exchange.signing, self._link_number)
        self._link_number = (self._link_number + 1) % 256

    def remove_link(self, name: str) -> None:
        """Speak no more on a link; what a service still sends there is lost."""
        link = self._links.pop(name, None)
        if link is not None:
            link.open = False
            self._router.forget_link(name)

    def receive(self, link: str, data: bytes) -> None:
        """Take bytes that came in; never raises, whatever they are.

        Args:
            link: name of the link's profile.
            data: any piece of the stream.
        """
        source = self._links.get(link)
        if source is None:
            return
        for message in source.reader.feed(data):
            self._take(source, message)

    def add_input(self, link: str, data: bytes) -> int:
        """Keep bytes that came in for `process_input`; how many found no room and are lost.

        Args:
            link: name of the link's profile.
            data: any piece of the stream.
        """
        source = self._links.get(link)
        if source is None:
            return 0
        dropped_bytes = source.reader.dropped_bytes
        source.reader.add(data)
        return source.reader.dropped_bytes - dropped_bytes

    def process_input(self, link: str, most_steps: int) -> bool:
        """Read some of what `add_input` kept and act on it; whether some is left that can be read now.

        Args:
            link: name of the link's profile.
            most_steps: bounds the work: a step is one message or some noise, see `PacketReader`.
        """
        source = self._links.get(link)
        if source is None:
            return False
        for message in source.reader.read(most_steps):
            self._take(source, message)
        return source.reader.behind

    def _take(self, link: Link, message: Message) -> None:
        exchange = self._exchange
        packet = message.get_msgbuf()
        sender = source_of(packet)
        if self._is_own(*sender):  # an echo, or a lie
            return
        if not exchange.signing.accepts(packet, trusted=link.profile.trusted):
            self.refused_packets += 1
            return
        link.traffic.hear(sender, packet[2 if packet[0] == mavlink.PROTOCOL_MARKER_V1 else 4], len(packet))
        name = link.profile.name
        self._router.hear(name, sender, exchange.time_us)
        for other in self._router.destinations(name, sender, message, exchange.time_us):
            self._links[other].forward(packet)
        self._dispatch(link, message)

    def _dispatch(self, link: Link, message: Message) -> None:
        """Ask the handlers: the autopilot's always, as PX4 checks few targets; others' if meant."""
        message_id = message.get_msgId()
        target = getattr(message, "target_component", BROADCAST)
        for component_id, handlers in self._handlers.items():
            if component_id != AUTOPILOT_COMPONENT_ID and target not in (component_id, BROADCAST):
                continue
            for handler in handlers.get(message_id, ()):
                self._handle(handler, link, message)

    def _handle(self, handler: Handler, link: Link, message: Message) -> None:
        try:
            handler(self._exchange, link, message)
        except Exception as error:  # the last boundary: a packet must never end a flight
            self.failed_messages += 1
            self._exchange.autopilot.say(
                mavlink.MAV_SEVERITY_ERROR, f"Internal error on {message.get_type()}: {error!r}"
            )

    def _is_own(self, system_id: int, component_id: int) -> bool:
        """Whether ids are those of one of our components."""
        return system_id == self._exchange.system_id and component_id in self._handlers

    def update(self, time_us: int) -> None:
        """Send what is due.

        Args:
            time_us: vehicle time, microseconds since boot; never goes back.
        """
        exchange = self._exchange
        exchange.time_us = time_us
        if exchange.signing.active:
            exchange.signing.advance(time_us)
        packets: dict[int, Packet | None] = {}
        for link in self._links.values():
            link.advance(time_us)
            for message_id in link.schedule.due(time_us):
                if message_id not in packets or not is_shared(message_id):
                    message = stream_message(exchange, message_id, link)
                    packets[message_id] = None if message is None else exchange.packet(message)
                packet = packets[message_id]
                if packet is not None:
                    link.send_stream(packet)
        self._tell_places()
        for service in self._services:
            service.update()

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
        return [(name, data) for name, link in self._links.items() for data in link.take()]


def _services(
    exchange: Exchange,
    storage: Storage | None,
    firmware_files: Mapping[str, bytes] | None,
    log_text: Callable[[int, StatusText], None] | None,
    *,
    shell: bool,
) -> tuple[tuple[Service, ...], dict[int, HandlerTable]]:
    """What sends by itself, in the order in which it is asked, and who is told of what, by component id."""
    events = EventService(exchange)
    texts = StatusTextService(exchange, events.tell, log_text)
    parameters = ParameterService(exchange)
    extended = ExtendedParameterService(exchange)
    if firmware_files is None:
        firmware_files = ExtraFiles(exchange.autopilot.parameters)
    files = FileTransferService(exchange, storage, firmware_files)
    logs = LogTransferService(exchange, storage)
    missions = MissionService(exchange)
    shells = ShellService(exchange, enabled=shell)
    services: tuple[Service, ...] = (
        texts,
        events,
        parameters,
        extended,
        files,
        logs,
        missions,
        MissionOrders(exchange),
        shells,
    )
    handlers = {
        AUTOPILOT_COMPONENT_ID: _joined(
            heartbeat.HANDLERS,
            commands.HANDLERS,
            places.HANDLERS,
            sticks.HANDLERS,
            files.handlers,
            logs.handlers,
            shells.handlers,
            missions.handlers,
            time_sync.HANDLERS,
            signing_setup.HANDLERS,
            parameters.handlers,
            extended.handlers,
            events.handlers,
            SetpointService().handlers,
            RcChannels(exchange).handlers,
        ),
    }
    return services, handlers


def _joined(*tables: Mapping[int, Handler]) -> HandlerTable:
    """One table of all, in this order."""
    joined: HandlerTable = {}
    for table in tables:
        for message_id, handler in table.items():
            joined[message_id] = (*joined.get(message_id, ()), handler)
    return joined
