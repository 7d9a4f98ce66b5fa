"""UDP, TCP and serial lines as transports of bytes that never block.

A thread waits for them with `select.poll`, an asyncio loop with `add_reader`. What cannot be sent is lost in
whole writes without an error, as on a radio; that the other end is gone shows in `read`.
"""

from __future__ import annotations

import errno
import os
import socket
import termios
import tty
from abc import ABC, abstractmethod
from contextlib import suppress
from pathlib import Path
from typing import cast

from wire.transports.urls import LinkError, LinkUrl

Address = tuple[str, int]

MAX_UNSENT_BYTES = 1 << 18  # of a stream; whoever reads slower loses packets
CONNECT_S = 5.0
_READ_BYTES = 1 << 16


class Transport(ABC):
    """A link's bytes.

    Attributes:
        peer: IP address and port of whoever sent what was read last; None before, and on a serial line.
    """

    peer: Address | None = None

    @abstractmethod
    def fileno(self) -> int:
        """The descriptor to wait for; after a `read` it may be another one."""

    @abstractmethod
    def read(self) -> bytes:
        """The next bytes; b"" if there are none now. Raises `OSError` when the link is gone."""

    @abstractmethod
    def write(self, data: bytes, to: Address | None = None) -> None:
        """Send whole packets.

        Args:
            data: the packets; they are lost if nobody can get them now.
            to: whom, at a UDP socket that listens; all others have one peer.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of the port, connection or device."""

    def has_unsent(self) -> bool:
        """Whether bytes wait for `flush`."""
        return False

    @abstractmethod
    def flush(self) -> None:
        """Send what waits, as far as the other end takes it."""


class UdpSocket(Transport):
    """A UDP socket, bound or connected."""

    def __init__(self, opened: socket.socket) -> None:
        opened.setblocking(False)
        self._socket = opened

    def fileno(self) -> int:
        """See `Transport`."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """The next datagram; see `Transport`."""
        try:
            data, self.peer = self._socket.recvfrom(_READ_BYTES)
        except (BlockingIOError, ConnectionRefusedError):  # refused: nobody listens there yet
            return b""
        return data

    def write(self, data: bytes, to: Address | None = None) -> None:
        """Send a datagram; see `Transport`."""
        with suppress(OSError):
            if to is None:
                self._socket.send(data)
            else:
                self._socket.sendto(data, to)

    def flush(self) -> None:
        """Nothing waits here."""

    def close(self) -> None:
        """See `Transport`."""
        self._socket.close()


class Stream(Transport):
    """A TCP connection or a serial line.

    Args:
        descriptor: of the open connection or device; this object closes it.
        peer: address of the other end.
    """

    def __init__(self, descriptor: int, peer: Address | None = None) -> None:
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor
        self.peer = peer
        self._unsent = bytearray()

    @classmethod
    def of(cls, connection: socket.socket) -> Stream:
        """Take over a TCP connection."""
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer = cast(Address, connection.getpeername()[:2])
        return cls(connection.detach(), peer)

    def has_unsent(self) -> bool:
        """See `Transport`."""
        return bool(self._unsent)

    def fileno(self) -> int:
        """See `Transport`."""
        return self._descriptor

    def read(self) -> bytes:
        """See `Transport`."""
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except BlockingIOError:
            return b""
        if not data:
            who = "the serial line has gone" if self.peer is None else "the other side closed the connection"
            raise ConnectionResetError(errno.ECONNRESET, who)
        return data

    def write(self, data: bytes, to: Address | None = None) -> None:
        """See `Transport`."""
        del to
        if len(self._unsent) + len(data) <= MAX_UNSENT_BYTES:
            self._unsent += data
            self.flush()

    def flush(self) -> None:
        """See `Transport`."""
        try:
            del self._unsent[: os.write(self._descriptor, self._unsent)]
        except BlockingIOError:
            return
        except OSError:
            self._unsent.clear()

    def close(self) -> None:
        """See `Transport`."""
        os.close(self._descriptor)


class TcpListener:
    """Takes TCP connections at a port."""

    def __init__(self, place: Address) -> None:
        """Listen.

        Raises:
            LinkError: the port is taken, or the address is not this machine's.
        """
        try:
            family, address = _resolved(place, socket.SOCK_STREAM)
            self._socket = socket.create_server(address, family=family)
        except (OSError, UnicodeError) as error:
            raise LinkError(
                f"TCP {_name(place)} cannot be listened on ({_reason(error)}); choose another port"
            ) from None
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """The descriptor to wait for."""
        return self._socket.fileno()

    def accept(self) -> Stream | None:
        """The next connection; None if there is none. Raises `OSError` if no more can be opened."""
        try:
            connection, _ = self._socket.accept()
            return Stream.of(connection)
        except (BlockingIOError, ConnectionError):
            return None
        except OSError as error:
            if error.errno in (errno.ENOTCONN, errno.EINVAL):  # it has gone already
                return None
            raise

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()


class _OneClient(Transport):
    """A TCP server that takes one client after the other."""

    def __init__(self, listener: TcpListener) -> None:
        self._listener = listener
        self._client: Stream | None = None

    def fileno(self) -> int:
        return (self._client or self._listener).fileno()

    def read(self) -> bytes:
        try:
            if self._client is not None:
                return self._client.read()
            self._client = self._listener.accept()
            self.peer = None if self._client is None else self._client.peer
        except ConnectionError:
            assert self._client is not None
            self._client.close()
            self._client = None
        return b""

    def write(self, data: bytes, to: Address | None = None) -> None:
        if self._client is not None:
            self._client.write(data, to)

    def has_unsent(self) -> bool:
        return self._client is not None and self._client.has_unsent()

    def flush(self) -> None:
        if self._client is not None:
            self._client.flush()

    def close(self) -> None:
        if self._client is not None:
            self._client.close()
        self._listener.close()


def bind_udp(place: Address, advice: str) -> UdpSocket:
    """A UDP socket that listens.

    Args:
        place: local address; port 0 lets the system choose one.
        advice: what people can do when the port is taken.

    Raises:
        LinkError: it is taken, or the address is not this machine's.
    """
    try:
        family, address = _resolved(place, socket.SOCK_DGRAM)
        opened = socket.socket(family, socket.SOCK_DGRAM)
        try:
            opened.bind(address)
        except OSError:
            opened.close()
            raise
    except (OSError, UnicodeError) as error:
        raise LinkError(f"UDP {_name(place)} cannot be opened ({_reason(error)}); {advice}") from None
    return UdpSocket(opened)


def connect_udp(place: Address) -> UdpSocket:
    """A UDP socket that sends to one address and hears only what comes from there.

    Raises:
        LinkError: there is no such host, or no way to it.
    """
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.connect(resolved_ipv4(place))
    except LinkError:
        opened.close()
        raise
    except OSError as error:
        opened.close()
        raise _cannot_send(place, error) from None
    return UdpSocket(opened)


def resolved_ipv4(place: Address, what: str = "UDP") -> Address:
    """Look up where UDP goes, once: with a name, `sendto` would look it up, blocking, for every packet.

    Args:
        place: host and port.
        what: is sent there, for the message.

    Raises:
        LinkError: no such host is known.
    """
    try:
        found = socket.getaddrinfo(*place, family=socket.AF_INET, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        raise _cannot_send(place, error, what) from None
    return cast(Address, found[0][4])


def connect_tcp(place: Address) -> Stream:
    """Connect to a TCP server, within five seconds.

    Raises:
        LinkError: nobody answers there.
    """
    try:
        return Stream.of(socket.create_connection(place, CONNECT_S))
    except (OSError, UnicodeError) as error:
        raise LinkError(
            f"TCP {_name(place)} cannot be connected to ({_reason(error)}); is the server running?"
        ) from None


def open_serial(path: str, baud: int) -> Stream:
    """A serial line: eight bits, no parity, no flow control.

    Raises:
        LinkError: there is no such device, it is no serial line, or the baud rate is unusual.
    """
    speed = getattr(termios, f"B{baud}", None)
    if not speed:
        raise LinkError(f"serial {path}:{baud}: {baud} is not a usual baud rate, such as 57600 or 921600")
    try:
        line = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise _no_device(path, _reason(error)) from None
    try:
        tty.setraw(line, termios.TCSANOW)
        settings = termios.tcgetattr(line)
        settings[2] = (settings[2] | termios.CLOCAL | termios.CREAD) & ~(termios.CSTOPB | termios.CRTSCTS)
        settings[4] = settings[5] = speed
        termios.tcsetattr(line, termios.TCSANOW, settings)
    except (termios.error, OSError):
        os.close(line)
        raise LinkError(f"serial {path}: this is not a serial line") from None
    return Stream(line)


def check_free(url: LinkUrl, advice: str = "give another address") -> None:
    """See that a drone's port or device can be had before MAVSDK is told to open it.

    MAVSDK binds a UDP port that another program holds without complaint, and the last binder gets all
    packets; so the port is bound here first, exclusively, and let go.

    Args:
        url: of the drone.
        advice: what people can do if the port is taken.

    Raises:
        LinkError: port taken, device missing.
    """
    if url.scheme == "udpin":
        bind_udp((url.address, url.number), _close_or(advice, url.number)).close()
    elif url.scheme == "serial" and url.address.startswith("/") and not Path(url.address).exists():
        raise _no_device(url.address, os.strerror(errno.ENOENT))


def open_drone(url: LinkUrl) -> Transport:
    """Open the link on which a drone is, as a ground station does.

    Raises:
        LinkError: port taken, nobody answers, no such host or device.
    """
    place = (url.address, url.number)
    if url.scheme == "udpin":
        return bind_udp(place, _close_or("give another address", url.number))
    if url.scheme == "udpout":
        return connect_udp(place)
    if url.scheme == "tcpin":
        return _OneClient(TcpListener(place))
    if url.scheme == "tcpout":
        return connect_tcp(place)
    return open_serial(*place)


def _resolved(place: Address, kind: socket.SocketKind) -> tuple[socket.AddressFamily, Address]:
    """Look a local address up, IPv4 first: a name may stand for both."""
    found = socket.getaddrinfo(*place, type=kind, flags=socket.AI_PASSIVE)
    family, _, _, _, address = min(found, key=lambda each: each[0] != socket.AF_INET)
    return family, cast(Address, address)


def _cannot_send(place: Address, error: OSError | UnicodeError, what: str = "UDP") -> LinkError:
    return LinkError(
        f"{what} {_name(place)} cannot be sent to ({_reason(error)}); give a host's name or an IPv4 address"
    )


def _no_device(path: str, reason: str) -> LinkError:
    return LinkError(f"serial {path} cannot be opened ({reason}); is it plugged in, and may you use it?")


def _close_or(advice: str, port: int) -> str:
    return f"is another flight or ground station on UDP port {port}? Close it or {advice}"


def _name(place: Address) -> str:
    return f"{place[0]}:{place[1]}"


def _reason(error: OSError | UnicodeError) -> str:
    """Why, in few words."""
    return (isinstance(error, OSError) and error.strerror) or str(error)
