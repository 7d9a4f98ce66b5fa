"""What goes between simulator and PX4 beside the simulator interface: the battery to it, its words from it.

PX4 takes a battery from a component of its own MAVLink system. Its link to a camera is used, UDP 14280 plus
the instance: nobody else is its partner there, and that to a gimbal takes few messages.
"""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import BinaryIO

from firmware_py.types import BatteryState
from sitl.px4.messages import Packer
from sitl.px4.simulation import Px4Simulation
from wire.dialect import mavlink, whole
from wire.framing import HEADER_BYTES_V2, MARKER_V2
from wire.px4_modes import px4_name

PERIOD_US = 100_000
CAMERA_PORT = 14280  # of PX4's instance 0
_HEARTBEAT = Struct("<IBBBBB")  # custom mode, type, autopilot, base mode, system status, version
_UNKNOWN_CELL = 0xFFFF
_UNKNOWN_TEMPERATURE = 0x7FFF
_MAX_CELLS = 10
_BATTERY = int(mavlink.MAV_COMP_ID_BATTERY)
_CRITICAL = int(mavlink.MAV_STATE_CRITICAL)
_PACKETS_AT_ONCE = 200


class SideLink:
    """The link beside the simulator interface; lost packets do no harm.

    Args:
        instance: of PX4.
        output: file to which PX4's output goes; None: it is not known.
    """

    def __init__(self, instance: int, output: Path | None) -> None:
        self._system_id = instance + 1
        self._packer = Packer(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, self._system_id, _BATTERY)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._px4 = ("127.0.0.1", CAMERA_PORT + instance)
        self._output = None if output is None else _Output(output)

    def step(self, simulation: Px4Simulation) -> None:
        """Send the battery's state, and take what PX4 has said; to be called each `PERIOD_US`."""
        battery = simulation.measured_battery()
        if battery is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(self._pack(battery), self._px4)
        time_us, words = simulation.time_us, simulation.words
        if self._output is not None:
            for line in self._output.new_lines():
                words.printed(time_us, line)
        for custom_mode, status in self._heartbeats():
            words.heartbeat(time_us, px4_name(custom_mode), critical=status >= _CRITICAL)

    def close(self) -> None:
        """Close the socket and the file."""
        self._socket.close()
        if self._output is not None:
            self._output.close()

    def _pack(self, battery: BatteryState) -> bytes:
        cells = min(max(battery.cells, 1), _MAX_CELLS)
        cell_mv = whole(battery.voltage_v * 1e3 / cells, 16, signed=False)
        return self._packer.pack(
            *(round(battery.used_mah), -1, _UNKNOWN_TEMPERATURE),
            *[cell_mv] * cells,
            *[_UNKNOWN_CELL] * (_MAX_CELLS - cells),
            whole(battery.current_a * 100, 16),
            *(0, mavlink.MAV_BATTERY_FUNCTION_ALL, mavlink.MAV_BATTERY_TYPE_LIPO),
            round(battery.remaining * 100),
            *(0, battery.warning, 0, 0, 0, 0, 0, 0),
        )

    def _heartbeats(self) -> Iterator[tuple[int, int]]:
        """Custom mode and system status of PX4's heartbeats that have arrived."""
        for _ in range(_PACKETS_AT_ONCE):
            try:
                packet = self._socket.recv(2048)
            except OSError:
                return
            if len(packet) < HEADER_BYTES_V2 + _HEARTBEAT.size or packet[0] != MARKER_V2:
                continue
            if packet[7:10] != b"\0\0\0" or packet[5:7] != bytes((self._system_id, 1)):
                continue
            mode, *_, status, _ = _HEARTBEAT.unpack_from(packet, HEADER_BYTES_V2)
            yield mode, status


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
