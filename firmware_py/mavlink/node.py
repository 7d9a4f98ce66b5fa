"""The MAVLink node of one vehicle: received bytes to services, and their messages to bytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.camera.component import CameraComponent, Streaming
from firmware_py.mavlink.camera.model import CAMERA_COMPONENT_ID, CaptureSink, FixedCamera, VideoStream
from firmware_py.mavlink.commands.flight import FlightCommands
from firmware_py.mavlink.commands.gripper import GripperService
from firmware_py.mavlink.commands.maintenance import FailureSink, MaintenanceCommands
from firmware_py.mavlink.commands.protocol import CommandService
from firmware_py.mavlink.external_pose import ExternalPoseService
from firmware_py.mavlink.gimbal.device import GimbalComponent
from firmware_py.mavlink.gimbal.manager import GimbalManager
from firmware_py.mavlink.gimbal.model import GIMBAL_COMPONENT_ID, GimbalDevice
from firmware_py.mavlink.ground_station.events import EventService
from firmware_py.mavlink.ground_station.file_transfer import FileTransferService
from firmware_py.mavlink.ground_station.log_transfer import LogTransferService
from firmware_py.mavlink.ground_station.metadata import ExtraFiles, MetadataService
from firmware_py.mavlink.ground_station.remote_id import RemoteIdService
from firmware_py.mavlink.ground_station.shell import ShellService
from firmware_py.mavlink.manual_control import ManualControlService
from firmware_py.mavlink.missions.execution import MissionExecution
from firmware_py.mavlink.missions.protocol import MissionService
from firmware_py.mavlink.offboard import OffboardService
from firmware_py.mavlink.parameters import ExtendedParameterService, ParameterService
from firmware_py.mavlink.service import Handler, Service, merged
from firmware_py.mavlink.telemetry.condition import CONDITION, esc_info
from firmware_py.mavlink.telemetry.connection import ConnectionService
from firmware_py.mavlink.telemetry.health import HEALTH
from firmware_py.mavlink.telemetry.motion import (
    MOTION,
    HomeAndOriginService,
    Truth,
    hil_state_quaternion,
)
from firmware_py.mavlink.telemetry.sensing import SENSORS
from firmware_py.mavlink.telemetry.status_texts import StatusTextService
from firmware_py.mavlink.telemetry.streams import (
    AutopilotSource,
    AutopilotTelemetry,
    RequestService,
    StreamService,
)
from firmware_py.mavlink.time_sync import Clocks
from firmware_py.storage import Storage
from firmware_py.types import StatusText
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link, LinkProfile
from framerunner.wire.signing import Signing, SigningKey


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """What a vehicle offers over MAVLink beside its autopilot; None: it does not have that."""

    system_id: int = 1  # 1 to 250; written to MAV_SYS_ID
    boot_unix_us: int = 0  # time of boot, microseconds since 1970; 0: not known
    signing_key: SigningKey | None = None  # signs all packets
    video: Sequence[VideoStream] = ()  # the camera's streams, the preferred one first
    storage: Storage | None = None  # of the vehicle's files and logs
    # Read-only files, content by path, for `mftp://` addresses; by default the component metadata.
    firmware_files: Mapping[str, bytes] | None = None
    shell: bool = False  # whether SERIAL_CONTROL is answered
    log_text: Callable[[int, StatusText], None] | None = None  # called with vehicle time and each text
    camera: FixedCamera | None = None
    captures: CaptureSink | None = None  # keeps pictures and records video; by default they are only counted
    switch_video: Callable[[bool], None] | None = None  # starts and stops the streams in RTP
    gimbal: GimbalDevice | None = None  # carries the camera
    gripper: bool = False
    failures: FailureSink | None = None  # breaks parts on purpose
    truth: Truth | None = None  # the true state, of a simulated vehicle whose sensors have errors


def _devices(autopilot: Autopilot, exchange: Exchange, options: NodeOptions) -> list[Service]:
    """The services of what the vehicle carries."""
    devices: list[Service] = []
    if options.camera is not None:
        streaming = Streaming(tuple(options.video), options.switch_video)
        devices.append(CameraComponent(autopilot, exchange, options.camera, streaming, options.captures))
    if options.gimbal is not None:
        devices.append(GimbalManager(autopilot, exchange, options.gimbal))
        devices.append(GimbalComponent(autopilot, exchange, options.gimbal))
    if options.gripper:
        devices.append(GripperService(autopilot))
    return devices


def _services(autopilot: Autopilot, exchange: Exchange, options: NodeOptions) -> tuple[Service, ...]:
    """All services of the vehicle, in the order in which they are updated."""
    devices = _devices(autopilot, exchange, options)
    gimbals = [device.look_at for device in devices if isinstance(device, GimbalManager)]
    look_at = gimbals[0] if gimbals else lambda point_ned_m: None
    files = options.firmware_files
    if files is None:
        files = ExtraFiles(autopilot.parameters)
    events = EventService(autopilot, exchange)
    clocks = Clocks()
    device_commands = merged(device.mission_commands for device in devices)
    mission = MissionExecution(autopilot, exchange, device_commands, look_at)
    others: dict[int, AutopilotSource] = {
        mavlink.MAVLINK_MSG_ID_ESC_INFO: lambda autopilot: esc_info(autopilot, exchange.time_us),
        mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION: lambda autopilot: hil_state_quaternion(
            autopilot, options.truth
        ),
    }
    state_messages = merged((MOTION, SENSORS, CONDITION, HEALTH, others))
    services: tuple[Service, ...] = (
        HomeAndOriginService(autopilot, exchange),
        StatusTextService(autopilot, exchange, events.send_text, options.log_text),
        events,
        ParameterService(autopilot, exchange),
        ExtendedParameterService(autopilot, exchange),
        FileTransferService(exchange, options.storage, files),
        LogTransferService(exchange, options.storage),
        MissionService(autopilot, exchange, mission),
        mission,
        *((ShellService(autopilot, exchange),) if options.shell else ()),
        *devices,
        # The others have no `update`.
        ConnectionService(autopilot, exchange, clocks),
        ExternalPoseService(autopilot, exchange, clocks),
        AutopilotTelemetry(autopilot, state_messages),
        OffboardService(autopilot, exchange),
        ManualControlService(autopilot, exchange),
        FlightCommands(autopilot, look_at),
        MaintenanceCommands(autopilot, options.failures),
        MetadataService(autopilot, exchange),
        RemoteIdService(autopilot, exchange),
    )
    own = [service for service in services if service.component_id == AUTOPILOT_COMPONENT_ID]
    streams = StreamService(
        exchange,
        merged(service.sources for service in own),
        merged(service.replies for service in own),
    )
    requests = (
        RequestService(exchange, each.component_id, each.replies, each.older_requests)
        for each in devices
        if each.component_id != AUTOPILOT_COMPONENT_ID
    )
    services = (streams, *services, *requests)
    return (*services, *_command_services(exchange, services))


def _command_services(exchange: Exchange, services: Sequence[Service]) -> list[CommandService]:
    """The commands of each component; those to all components are the camera's, or else the autopilot's."""
    tables = {
        component_id: merged(each.commands for each in services if each.component_id == component_id)
        for component_id in {service.component_id for service in services}
    }
    to_camera = tables.get(CAMERA_COMPONENT_ID, {}).keys() - {mavlink.MAV_CMD_REQUEST_MESSAGE}

    def owner(command: int) -> int:
        return CAMERA_COMPONENT_ID if command in to_camera else AUTOPILOT_COMPONENT_ID

    return [CommandService(exchange, component_id, table, owner) for component_id, table in tables.items()]


class MavlinkNode:
    """Connects an autopilot to MAVLink links. As PX4, it streams from the first update, heard or not.

    Args:
        autopilot: of the vehicle.
        links: with different names.
        options: what else the vehicle offers.

    Raises:
        ParameterError: the system id is out of range.

    Attributes:
        services: in the order of their updates.
        failed_messages: messages whose handler raised an exception; a status text reports each.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        links: Sequence[LinkProfile] = (),
        options: NodeOptions = NodeOptions(),  # frozen
    ) -> None:
        autopilot.parameters.set("MAV_SYS_ID", options.system_id)
        component_ids = {AUTOPILOT_COMPONENT_ID}
        if options.camera is not None:
            component_ids.add(CAMERA_COMPONENT_ID)
        if options.gimbal is not None:
            component_ids.add(GIMBAL_COMPONENT_ID)
        signing = Signing(options.signing_key, options.boot_unix_us)
        self._autopilot = autopilot
        self._exchange = Exchange(options.system_id, frozenset(component_ids), signing, options.boot_unix_us)
        for profile in links:
            self._exchange.add_link(profile)
        self.services = _services(autopilot, self._exchange, options)
        self.failed_messages = 0
        self._handlers: dict[int, Mapping[int, Handler]] = {
            component_id: merged(
                service.handlers for service in self.services if service.component_id == component_id
            )
            for component_id in sorted(component_ids)
        }
        self._updates = tuple(
            service.update for service in self.services if type(service).update is not Service.update
        )

    def add_link(self, profile: LinkProfile) -> None:
        """Use one more link, with a name that no other has, from the next update on."""
        self._exchange.add_link(profile)

    def remove_link(self, name: str) -> None:
        """Stop using a link; what a service still sends there is lost."""
        self._exchange.remove_link(name)

    def add_input(self, link: str, data: bytes) -> int:
        """Keep bytes received on a link for `process_input`; the number of bytes dropped for lack of room."""
        source = self._exchange.links.get(link)
        return 0 if source is None else source.reader.add(data)

    def process_input(self, link: str, max_steps: int) -> bool:
        """Read some of the bytes that `add_input` kept and handle their messages. It never raises.

        Args:
            link: name of the link's profile.
            max_steps: bounds the work: a step is one message or some noise, see `PacketReader`.

        Returns:
            Whether more can be read now.
        """
        source = self._exchange.links.get(link)
        if source is None:
            return False
        for message in self._exchange.receive(source, max_steps):
            self._dispatch(source, message)
        return source.reader.behind

    def _dispatch(self, link: Link, message: Message) -> None:
        """Call the handlers: the autopilot's always, as PX4 checks few targets; others' as targets only."""
        message_id = message.get_msgId()
        target = getattr(message, "target_component", BROADCAST)
        for component_id, handlers in self._handlers.items():
            handler = handlers.get(message_id)
            is_target = component_id == AUTOPILOT_COMPONENT_ID or target in (component_id, BROADCAST)
            if handler is None or not is_target:
                continue
            try:
                handler(link, message)
            except Exception as error:  # a packet must never end a flight
                self.failed_messages += 1
                text = f"Internal error on {message.get_type()}: {error!r}"
                self._autopilot.say(mavlink.MAV_SEVERITY_ERROR, text)

    def update(self, time_us: int) -> None:
        """Send what is due at a vehicle time, microseconds since boot, which never decreases."""
        self._exchange.advance(time_us)
        for update in self._updates:
            update()

    def repeat(self) -> None:
        """Send all streams again, for who listens only now; ten times a second while vehicle time stands."""
        for service in self.services:
            service.repeat()

    def take_output(self) -> list[tuple[str, bytes]]:
        """The datagrams to send, each with its link's name; a datagram has one or more whole packets."""
        return self._exchange.take_output()
