"""A MAVLink link to a vehicle for tools that listen more than they speak: plain sockets, no discovery.

`fly` commands through MAVSDK. A tool that measures a link must see every packet with its sequence number,
and must send nothing of its own accord, so it reads the wire itself.
"""

from __future__ import annotations

import os
import select
import socket
import termios
import tty
from collections.abc import Callable
from typing import Any, Protocol

from offboard.drone import DroneError
from offboard.link.url import VehicleUrl, check_free, parse_url
from wire.dialect import mavlink
from wire.framing import PacketReader

Message = Any  # pymavlink's classes are made by a generator and carry no types

_DATAGRAM_BYTES = 65_536
_CHUNK_BYTES = 4096
_CONNECT_S = 5.0


class _Line(Protocol):
    """Bytes in and out."""

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes; empty if none came in time. Raises `OSError` when the line is gone."""
        ...

    def write(self, data: bytes, system_id: int) -> None:
        """Send to a system or, with 0, to all; drops the bytes if nobody can get them."""

    def heard(self, system_id: int) -> None:
        """What was read last came from this system."""

    @property
    def host(self) -> str:
        """In numbers, from which came what was read last; "" over a wire."""
        ...

    def close(self) -> None:
        """Let go."""


class VehicleLink:
    """One link, read and written by whoever opened it. Several vehicles may speak on it.

    Args:
        url: as `fly --drone` takes it.
        system_id: own MAVLink system id; no vehicle should have it.
        component_id: own component id.

    Raises:
        DroneError: bad address, port taken, nobody answers, no such device.
    """

    def __init__(self, url: str, *, system_id: int, component_id: int) -> None:
        parsed = parse_url(url)
        check_free(parsed)
        try:
            self._line = _OPENERS[parsed.scheme](parsed)
        except OSError as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise DroneError(f"cannot open {parsed.text}: {reason}") from None
        self.url = parsed.text
        self._codec = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._reader = PacketReader()

    def receive(self, timeout_s: float) -> list[Message]:
        """Wait for messages; what cannot be understood is passed over.

        Args:
            timeout_s: how long at most, wall time.

        Raises:
            DroneError: the line is gone.
        """
        try:
            data = self._line.read(timeout_s)
        except OSError as error:
            raise DroneError(f"{self.url} failed: {error.strerror or error}") from None
        messages = self._reader.feed(data)
        for message in messages:
            self._line.heard(message.get_srcSystem())
        return messages

    def send(self, message: Message) -> None:
        """Send a message to the system it is for, or to all; lost without a word if nobody is there yet."""
        system_id = getattr(message, "target_system", getattr(message, "target", 0))
        try:
            self._line.write(message.pack(self._codec), system_id)
        except OSError:
            return  # a vehicle that is gone shows in what is received
        self._codec.seq = (self._codec.seq + 1) % 256

    @property
    def host(self) -> str:
        """The host in numbers from which came what was received last; "" over a wire."""
        return self._line.host

    def close(self) -> None:
        """Let go of the port or device."""
        self._line.close()


class _UdpIn:
    """Listens; answers go to where a system spoke from last."""

    def __init__(self, url: VehicleUrl) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((url.address, url.number))
        self._speaker: tuple[str, int] | None = None
        self._peers: dict[int, tuple[str, int]] = {}

    def read(self, timeout_s: float) -> bytes:
        self._socket.settimeout(timeout_s)
        try:
            data, self._speaker = self._socket.recvfrom(_DATAGRAM_BYTES)
        except TimeoutError:
            return b""
        return data

    @property
    def host(self) -> str:
        return self._speaker[0] if self._speaker is not None else ""

    def heard(self, system_id: int) -> None:
        if self._speaker is not None:
            self._peers[system_id] = self._speaker

    def write(self, data: bytes, system_id: int) -> None:
        peer = self._peers.get(system_id)
        for address in set(self._peers.values()) if peer is None else (peer,):
            self._socket.sendto(data, address)

    def close(self) -> None:
        self._socket.close()


class _OnePeer:
    """A line on which all systems are behind the same other end."""

    host = ""

    def heard(self, system_id: int) -> None:
        """It makes no difference here."""


class _UdpOut(_OnePeer):
    """Speaks to one address and listens to it."""

    def __init__(self, url: VehicleUrl) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((url.address, url.number))
        self.host = str(self._socket.getpeername()[0])

    def read(self, timeout_s: float) -> bytes:
        self._socket.settimeout(timeout_s)
        try:
            return self._socket.recv(_DATAGRAM_BYTES)
        except (TimeoutError, ConnectionRefusedError):  # refused: nobody listens there yet
            return b""

    def write(self, data: bytes, system_id: int) -> None:
        self._socket.send(data)

    def close(self) -> None:
        self._socket.close()


class _Stream(_OnePeer):
    """A TCP connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        self.host = str(connection.getpeername()[0])
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, timeout_s: float) -> bytes:
        self._socket.settimeout(timeout_s)
        try:
            data = self._socket.recv(_CHUNK_BYTES)
        except TimeoutError:
            return b""
        if not data:
            raise ConnectionResetError(0, "the other side closed the connection")
        return data

    def write(self, data: bytes, system_id: int) -> None:
        self._socket.settimeout(_CONNECT_S)
        self._socket.sendall(data)

    def close(self) -> None:
        self._socket.close()


def _tcp_out(url: VehicleUrl) -> _Stream:
    return _Stream(socket.create_connection((url.address, url.number), _CONNECT_S))


class _TcpIn(_OnePeer):
    """Waits for a vehicle that calls, one after the other."""

    def __init__(self, url: VehicleUrl) -> None:
        self._listener = socket.create_server((url.address, url.number), backlog=1)
        self._stream: _Stream | None = None

    def read(self, timeout_s: float) -> bytes:
        if self._stream is None:
            self._listener.settimeout(timeout_s)
            try:
                self._stream = _Stream(self._listener.accept()[0])
                self.host = self._stream.host
            except TimeoutError:
                return b""
        try:
            return self._stream.read(timeout_s)
        except ConnectionError:
            self._stream.close()
            self._stream = None
            return b""

    def write(self, data: bytes, system_id: int) -> None:
        if self._stream is not None:
            self._stream.write(data, system_id)

    def close(self) -> None:
        if self._stream is not None:
            self._stream.close()
        self._listener.close()


class _Serial(_OnePeer):
    """A serial device, eight bits, no parity, no flow control."""

    def __init__(self, url: VehicleUrl) -> None:
        speed = getattr(termios, f"B{url.number}", None)
        if speed is None:
            raise OSError(0, f"{url.number} is no usual baud rate, such as 57600 or 921600")
        self._device = os.open(url.address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            tty.setraw(self._device)
            settings = termios.tcgetattr(self._device)
            settings[2] |= termios.CLOCAL | termios.CREAD
            settings[2] &= ~getattr(termios, "CRTSCTS", 0)
            settings[4] = settings[5] = speed
            termios.tcsetattr(self._device, termios.TCSANOW, settings)
        except termios.error:
            os.close(self._device)
            raise OSError(0, "this is not a serial line") from None

    def read(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._device], [], [], timeout_s)
        if not ready:
            return b""
        data = os.read(self._device, _CHUNK_BYTES)
        if not data:
            raise ConnectionResetError(0, "the serial line has gone")
        return data

    def write(self, data: bytes, system_id: int) -> None:
        os.write(self._device, data)

    def close(self) -> None:
        os.close(self._device)


_OPENERS: dict[str, Callable[[VehicleUrl], _Line]] = {
    "udpin": _UdpIn,
    "udpout": _UdpOut,
    "tcpout": _tcp_out,
    "tcpin": _TcpIn,
    "serial": _Serial,
}
