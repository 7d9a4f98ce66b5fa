"""What goes between simulator and PX4 beside the simulator interface: the battery to it, its words from it.

PX4 takes a battery from a component of its own MAVLink system, and without GPS the place on Earth of its
local frame, which its mode hold needs. Its link to a camera is used, UDP 14280 plus the instance: nobody else
is its partner there, and that to a gimbal takes few messages. The camera is on it, too; PX4
forwards what it and ground stations send to each other.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from firmware_py.mavlink.camera.camera_messages import stream_information
from framerunner.vehicle.measurements import BatteryState
from framerunner.wire.dialect import Message, degrees_e7, device_heartbeat, mavlink, whole
from framerunner.wire.framing import PacketReader, packed
from framerunner.wire.px4_modes import px4_name
from framerunner.wire.transports.sockets import connect_udp
from scenarios.models import Camera
from sitl.px4.simulation import Px4Simulation
from sitl.px4.simulator_messages import SIMULATOR_COMPONENT_ID, SIMULATOR_SYSTEM_ID
from sitl.server_settings import ServerSettings
from sitl.streaming.streams import video_streams

PERIOD_US = 100_000
CAMERA_PORT = 14280  # of PX4's instance 0
_UNKNOWN_CELL = 0xFFFF
_UNKNOWN_TEMPERATURE = 0x7FFF
_MAX_CELLS = 10
_SECOND = 10  # periods


class SideLink:
    """The link beside the simulator interface; lost packets do no harm.

    Args:
        settings: of the drone; its instance is PX4's.
        camera: of the scenario.
        output: file to which PX4's output goes; None: it is not known.
    """

    def __init__(self, settings: ServerSettings, camera: Camera, output: Path | None) -> None:
        self._system_id = system_id = settings.instance + 1
        self._streams = video_streams(settings, camera)
        self._mode = 0
        self._battery = mavlink.MAVLink(None, system_id, mavlink.MAV_COMP_ID_BATTERY)
        self._camera = mavlink.MAVLink(None, system_id, mavlink.MAV_COMP_ID_CAMERA)
        self._simulator = mavlink.MAVLink(None, SIMULATOR_SYSTEM_ID, SIMULATOR_COMPONENT_ID)
        self._placed: Px4Simulation | None = None  # the one whose PX4 knows the place of its local frame
        self._socket = connect_udp(("127.0.0.1", CAMERA_PORT + settings.instance))  # nobody else is heard
        self._reader = PacketReader()
        self._output = None if output is None else _Output(output)

    def step(self, simulation: Px4Simulation) -> None:
        """Send the battery's state, and take what PX4 has said; to be called each `PERIOD_US`."""
        battery = simulation.measured_battery()
        if battery is not None:
            self._send(_battery_status(battery), self._battery)
        time_us = simulation.time_us
        if time_us // PERIOD_US % _SECOND == 0:
            self._send(device_heartbeat(mavlink.MAV_TYPE_CAMERA, self._mode), self._camera)
            if self._lacks_origin(simulation):
                self._send(_origin(simulation, self._system_id), self._simulator)
        if self._output is not None:
            for line in self._output.new_lines():
                simulation.words.printed(time_us, line)
        for packet, _ in self._socket.read_all():
            for message in self._reader.feed(packet):
                self._take(message, simulation)

    def close(self) -> None:
        """Close the socket and the file."""
        self._socket.close()
        if self._output is not None:
            self._output.close()

    def _take(self, message: Message, simulation: Px4Simulation) -> None:
        kind, sender = message.get_msgId(), (message.get_srcSystem(), message.get_srcComponent())
        if kind == mavlink.MAVLINK_MSG_ID_COMMAND_LONG:
            if (message.target_system, message.target_component) == (
                self._system_id,
                mavlink.MAV_COMP_ID_CAMERA,
            ):
                self._answer(message, sender)
        elif sender != (self._system_id, 1):
            return
        elif kind == mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN:
            self._placed = simulation
        elif kind == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._mode = message.custom_mode
            critical = message.system_status >= mavlink.MAV_STATE_CRITICAL
            simulation.words.heartbeat(simulation.time_us, px4_name(self._mode), critical=critical)

    def _answer(self, command: Message, sender: tuple[int, int]) -> None:
        """As a camera: it answers requests for its video streams, and nothing else."""
        asked = command.command == mavlink.MAV_CMD_REQUEST_MESSAGE
        asked &= command.param1 == mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
        result = mavlink.MAV_RESULT_ACCEPTED if asked else mavlink.MAV_RESULT_UNSUPPORTED
        self._send(mavlink.MAVLink_command_ack_message(command.command, result, 0, 0, *sender), self._camera)
        for number, stream in enumerate(self._streams if asked else (), 1):
            information = stream_information(stream, number, len(self._streams), running=True)
            self._send(information, self._camera)

    def _lacks_origin(self, simulation: Px4Simulation) -> bool:
        """Whether PX4 must be told where on Earth it is, and has not said that it was told."""
        return simulation.needs_place_on_earth and not simulation.armed and self._placed is not simulation

    def _send(self, message: Message, sender: mavlink.MAVLink) -> None:
        self._socket.write(packed(message, sender))


def _origin(simulation: Px4Simulation, system_id: int) -> Message:
    origin = simulation.scenario.origin
    return mavlink.MAVLink_set_gps_global_origin_message(
        target_system=system_id,
        latitude=degrees_e7(origin.latitude_deg),
        longitude=degrees_e7(origin.longitude_deg),
        altitude=0,  # another one would not fit the barometer's offset
    )


def _battery_status(battery: BatteryState) -> Message:
    cells = min(max(battery.cells, 1), _MAX_CELLS)
    cell_mv = whole(battery.voltage_v * 1e3 / cells, 16, signed=False)
    return mavlink.MAVLink_battery_status_message(
        0,  # battery's id
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        _UNKNOWN_TEMPERATURE,
        [cell_mv] * cells + [_UNKNOWN_CELL] * (_MAX_CELLS - cells),
        whole(battery.current_a * 100, 16),
        round(battery.used_mah),
        -1,  # no energy consumed is measured
        round(battery.remaining * 100),
        charge_state=battery.warning,
    )


class _Output:
    """Lines of a file that another process writes, and may begin again."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: BinaryIO | None = None
        self._rest = b""

    def new_lines(self) -> list[str]:
        """Complete lines since the last call."""
        try:
            if self._file is None:
                self._file = self._path.open("rb")
            if self._file.tell() > self._path.stat().st_size:
                self._file.seek(0)
            data = self._file.read()
        except OSError:
            return []
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [line.decode(errors="replace") for line in lines]

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
