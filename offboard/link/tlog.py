"""Recording of all MAVLink traffic as a tlog: each packet after its time, 8 bytes, big-endian microseconds.

MAVSDK forwards between its connections what it receives, so a connection to the recorder gets all that the
vehicle sends. What MAVSDK sends to the vehicle is sent only on connections from which that system has been
received; so the recorder announces itself once as the vehicle's logger component. Only acknowledgements
addressed to MAVSDK itself are not forwarded.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import struct
import time
from pathlib import Path
from typing import BinaryIO, cast

from framerunner.wire.dialect import component_heartbeat, mavlink

LOGGER_COMPONENT = 155  # MAV_COMP_ID_LOG
RECEIVE_BUFFER_BYTES = 4 << 20


class TlogRecorder(asyncio.DatagramProtocol):
    """A local UDP port whose packets are written to a file, unbuffered, so that a crash loses none.

    A full disk ends the recording, after the last packet that fits.

    Attributes:
        packets: how many were written.
        problem: why recording ended before the flight did; empty if it did not.

    Raises:
        OSError: the file cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.problem = ""
        self.packets = 0
        self._file: BinaryIO = path.open("wb", buffering=0)
        self._transport: asyncio.DatagramTransport | None = None
        self._peer: tuple[str, int] | None = None
        self._system_id = 0

    async def listen(self) -> str:
        """Open the port; returns the URL for MAVSDK to forward to."""
        port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        port.setblocking(False)
        port.bind(("127.0.0.1", 0))
        await asyncio.get_running_loop().create_datagram_endpoint(lambda: self, sock=port)
        return f"udpout://127.0.0.1:{port.getsockname()[1]}"

    def announce(self, system_id: int) -> None:
        """Send that this is a component of the vehicle, to receive also what is sent to the vehicle."""
        self._system_id = system_id
        if self._peer is not None:
            self._send_heartbeat()

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
                self._send_heartbeat()
        if not self.problem and not self._file.closed:
            self._write(struct.pack(">Q", time.time_ns() // 1000) + data)

    def _write(self, record: bytes) -> None:
        """Write a packet whole or not at all: what follows half a packet could not be read."""
        whole = self._file.tell()
        try:
            written = self._file.write(record)
            if written < len(record):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            self.packets += 1
        except OSError as error:
            self.problem = f"recording of '{self._file.name}' stopped: {error.strerror or error}"
            with contextlib.suppress(OSError):
                self._file.truncate(whole)

    def _send_heartbeat(self) -> None:
        sender = mavlink.MAVLink(None, srcSystem=self._system_id, srcComponent=LOGGER_COMPONENT)
        if self._transport is not None:
            self._transport.sendto(component_heartbeat(mavlink.MAV_TYPE_LOG).pack(sender), self._peer)
