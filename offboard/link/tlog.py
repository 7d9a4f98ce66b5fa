"""Recording of all MAVLink traffic as a tlog: each packet after its time, 8 bytes, big-endian microseconds.

MAVSDK forwards between its connections what it receives. A connection to the recorder therefore gets all
that the vehicle says. What MAVSDK sends to the vehicle goes only to connections on which that system has
been heard; so the recorder says once that it is the vehicle's logger component, and gets those as well.
Acknowledgements addressed to MAVSDK itself are the one thing that is not forwarded.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import time
from pathlib import Path
from typing import BinaryIO, cast

from pymavlink.dialects.v20 import common as mavlink

LOGGER_COMPONENT = 155  # MAV_COMP_ID_LOG
RECEIVE_BUFFER_BYTES = 4 << 20


class TlogRecorder(asyncio.DatagramProtocol):
    """A local UDP port whose packets are written to a file, unbuffered: what was received is kept."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            OSError: it cannot be written.
        """
        self._file: BinaryIO = path.open("wb", buffering=0)
        self._transport: asyncio.DatagramTransport | None = None
        self._peer: tuple[str, int] | None = None
        self._system_id = 0
        self.packets = 0

    async def listen(self) -> str:
        """Open the port.

        Returns:
            The URL for MAVSDK to forward to.
        """
        port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        port.setblocking(False)
        port.bind(("127.0.0.1", 0))
        await asyncio.get_running_loop().create_datagram_endpoint(lambda: self, sock=port)
        return f"udpout://127.0.0.1:{port.getsockname()[1]}"

    def announce(self, system_id: int) -> None:
        """Say that this is a component of the vehicle, so that what is sent to the vehicle comes here too."""
        self._system_id = system_id
        if self._peer is not None:
            self._send_announcement()

    def close(self) -> None:
        """Close port and file."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None
        self._file.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport (called by asyncio)."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Write one packet (called by asyncio; MAVSDK sends one a datagram)."""
        if self._peer is None:
            self._peer = addr
            if self._system_id:
                self._send_announcement()
        stamp = struct.pack(">Q", time.time_ns() // 1000)
        with contextlib.suppress(OSError, ValueError):  # a full disk must not end a flight
            self._file.write(stamp + data)
            self.packets += 1

    def _send_announcement(self) -> None:
        sender = mavlink.MAVLink(None, srcSystem=self._system_id, srcComponent=LOGGER_COMPONENT)
        heartbeat = sender.heartbeat_encode(
            mavlink.MAV_TYPE_LOG, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE
        )
        if self._transport is not None:
            self._transport.sendto(heartbeat.pack(sender), self._peer)
