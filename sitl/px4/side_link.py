"""What goes between simulator and PX4 beside the simulator interface: the battery to it, its words from it.

PX4 takes a battery from a component of its own MAVLink system, and without GPS the place on Earth of its
local frame, which its mode hold needs. Its link to a camera is used, UDP 14280 plus the instance: nobody else
is its partner there, and that to a gimbal takes few messages. The camera is on it, too; PX4
forwards what it and ground stations send to each other.
"""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import BinaryIO

from framerunner.vehicle.measurements import BatteryState
from framerunner.wire.dialect import degrees_e7, mavlink, whole
from framerunner.wire.framing import HEADER_BYTES_V2, MARKER_V2
from framerunner.wire.px4_modes import px4_name
from scenarios.models import Camera
from sitl.px4.camera_component import CameraComponent
from sitl.px4.messages import Packer
from sitl.px4.simulation import Px4Simulation
from sitl.server_settings import ServerSettings
from sitl.streaming.streams import video_streams

PERIOD_US = 100_000
CAMERA_PORT = 14280  # of PX4's instance 0
_HEARTBEAT = Struct("<IBBBBB")  # custom mode, type, autopilot, base mode, system status, version
_UNKNOWN_CELL = 0xFFFF
_UNKNOWN_TEMPERATURE = 0x7FFF
_MAX_CELLS = 10
_BATTERY = int(mavlink.MAV_COMP_ID_BATTERY)
_SECOND = 10  # periods
_COMMAND_ID = int(mavlink.MAVLINK_MSG_ID_COMMAND_LONG)
_HEARTBEAT_ID = int(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
_ORIGIN_ID = int(mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
_CRITICAL = int(mavlink.MAV_STATE_CRITICAL)
_PACKETS_AT_ONCE = 200


class SideLink:
    """The link beside the simulator interface; lost packets do no harm.

    Args:
        settings: of the drone; its instance is PX4's.
        camera: of the scenario.
        output: file to which PX4's output goes; None: it is not known.
    """

    def __init__(self, settings: ServerSettings, camera: Camera, output: Path | None) -> None:
        instance = settings.instance
        self._system_id = instance + 1
        self._camera = CameraComponent(self._system_id, video_streams(settings, camera))
        self._mode = 0
        self._packer = Packer(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, self._system_id, _BATTERY)
        self._origin_packer = Packer(mavlink.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN)
        self._placed: Px4Simulation | None = None  # the one whose PX4 knows the place of its local frame
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect(("127.0.0.1", CAMERA_PORT + instance))  # nobody else is heard
        self._output = None if output is None else _Output(output)

    def step(self, simulation: Px4Simulation) -> None:
        """Send the battery's state, and take what PX4 has said; to be called each `PERIOD_US`."""
        battery = simulation.measured_battery()
        if battery is not None:
            self._send(self._pack(battery))
        time_us, words = simulation.time_us, simulation.words
        if time_us // PERIOD_US % _SECOND == 0:
            self._send(self._camera.heartbeat(self._mode))
            if self._lacks_origin(simulation):
                self._send_origin(simulation)
        if self._output is not None:
            for line in self._output.new_lines():
                words.printed(time_us, line)
        for message_id, sender, payload in self._received():
            if message_id == _COMMAND_ID:
                for packet in self._camera.answers(payload, sender):
                    self._send(packet)
            elif sender != (self._system_id, 1):
                continue
            elif message_id == _ORIGIN_ID:
                self._placed = simulation
            elif message_id == _HEARTBEAT_ID and len(payload) >= _HEARTBEAT.size:
                self._mode, *_, status, _ = _HEARTBEAT.unpack_from(payload)
                words.heartbeat(time_us, px4_name(self._mode), critical=status >= _CRITICAL)

    def close(self) -> None:
        """Close the socket and the file."""
        self._socket.close()
        if self._output is not None:
            self._output.close()

    def _lacks_origin(self, simulation: Px4Simulation) -> bool:
        """Whether PX4 must be told where on Earth it is, and has not said that it was told."""
        return simulation.needs_place_on_earth and not simulation.armed and self._placed is not simulation

    def _send_origin(self, simulation: Px4Simulation) -> None:
        origin = simulation.scenario.origin
        self._send(
            self._origin_packer.pack(
                degrees_e7(origin.latitude_deg),
                degrees_e7(origin.longitude_deg),
                0,  # altitude: another one would not fit the barometer's offset
                self._system_id,
                0,  # time
            )
        )

    def _send(self, packet: bytes) -> None:
        with contextlib.suppress(OSError):  # PX4 has not started
            self._socket.send(packet)

    def _pack(self, battery: BatteryState) -> bytes:
        cells = min(max(battery.cells, 1), _MAX_CELLS)
        cell_mv = whole(battery.voltage_v * 1e3 / cells, 16, signed=False)
        return self._packer.pack(
            round(battery.used_mah),
            -1,  # no energy consumed is measured
            _UNKNOWN_TEMPERATURE,
            *[cell_mv] * cells,
            *[_UNKNOWN_CELL] * (_MAX_CELLS - cells),
            whole(battery.current_a * 100, 16),
            0,  # battery's id
            mavlink.MAV_BATTERY_FUNCTION_ALL,
            mavlink.MAV_BATTERY_TYPE_LIPO,
            round(battery.remaining * 100),
            0,  # no time remaining is known
            battery.warning,
            *[0] * 4,  # voltages of cells 11 to 14
            0,  # mode
            0,  # faults
        )

    def _received(self) -> Iterator[tuple[int, tuple[int, int], bytes]]:
        """Number, system and component id of the sender, and payload of what has arrived."""
        for _ in range(_PACKETS_AT_ONCE):
            try:
                packet = self._socket.recv(2048)
            except OSError:
                return
            if len(packet) >= HEADER_BYTES_V2 and packet[0] == MARKER_V2:
                number, end = int.from_bytes(packet[7:10], "little"), HEADER_BYTES_V2 + packet[1]
                yield number, (packet[5], packet[6]), packet[HEADER_BYTES_V2:end]


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
