"""UDP, TCP and serial lines as transports of bytes that never block.

A thread waits for them with `select.poll`, an asyncio loop with `add_reader`; both by `fileno`, which may
change with each `read`. `read` returns None when nothing was received, which an empty datagram (b"") is not,
and raises `OSError` when the link is closed. A write that cannot be sent is dropped as a whole without an
error, as on a radio. Functions that open something raise `LinkError`: one line with what cannot be opened,
why, and what to do.
"""

from __future__ import annotations

import errno
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar, cast

from serial import Serial

from framerunner.wire.transports.urls import LinkError, LinkUrl, in_url

Address = tuple[str, int]
_Opened = TypeVar("_Opened")

MAX_UNSENT_BYTES = 1 << 18  # of a stream; a slower reader loses packets
MAX_DATAGRAMS_AT_ONCE = 200  # so that a flood does not keep the reader from all else
_CONNECT_S = 5.0
_PROBE_S = 0.5  # another program that only looks whether a port is free has it for less
_READ_BYTES = 1 << 16


class UdpSocket:
    """A UDP socket, bound or connected."""

    def __init__(self, opened: socket.socket) -> None:
        opened.setblocking(False)
        self._socket = opened
        self.peer: Address | None = None  # sender of the datagram that was read last

    def fileno(self) -> int:
        """The descriptor to wait for."""
        return self._socket.fileno()

    def read(self) -> bytes | None:
        """The next datagram, which may be empty."""
        for _ in range(MAX_DATAGRAMS_AT_ONCE):
            try:
                data, self.peer = self._socket.recvfrom(_READ_BYTES)
            except BlockingIOError:
                return None
            except ConnectionRefusedError:  # of something that was sent; datagrams may wait behind it
                continue
            return data
        return None

    def read_all(self) -> list[tuple[bytes, Address]]:
        """The datagrams that wait, with their senders, the oldest first; `MAX_DATAGRAMS_AT_ONCE` at most."""
        found: list[tuple[bytes, Address]] = []
        while len(found) < MAX_DATAGRAMS_AT_ONCE and (data := self.read()) is not None:
            assert self.peer is not None, "it has sent the datagram"
            found.append((data, self.peer))
        return found

    def write(self, data: bytes, to: Address | None = None) -> None:
        """Send a datagram to the peer that it is connected to, or to another address."""
        with suppress(OSError):
            if to is None:
                self._socket.send(data)
            else:
                self._socket.sendto(data, to)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


class Stream:
    """A TCP connection or a serial line.

    Args:
        descriptor: of the open connection or device; this object closes it.
        peer: address of the other end; None on a serial line.
    """

    def __init__(self, descriptor: int, peer: Address | None = None) -> None:
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor
        self.peer = peer
        self._unsent = bytearray()

    @classmethod
    def of(cls, connection: socket.socket, peer: Address) -> Stream:
        """Take over a TCP connection."""
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return cls(connection.detach(), peer)

    def fileno(self) -> int:
        """The descriptor to wait for."""
        return self._descriptor

    def read(self) -> bytes | None:
        """The next bytes; unsent bytes are sent first."""
        if self._unsent:
            self.flush()
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except BlockingIOError:
            return None
        if not data:
            why = "the serial line is gone" if self.peer is None else "the other side closed the connection"
            raise ConnectionResetError(errno.ECONNRESET, why)
        return data

    def write(self, data: bytes) -> None:
        """Send bytes, or keep them for `flush` while there is room for them."""
        if len(self._unsent) + len(data) <= MAX_UNSENT_BYTES:
            self._unsent += data
            self.flush()

    def has_unsent(self) -> bool:
        """Whether bytes wait to be sent."""
        return bool(self._unsent)

    def flush(self) -> None:
        """Send the waiting bytes, as many as the other end takes."""
        try:
            del self._unsent[: os.write(self._descriptor, self._unsent)]
        except BlockingIOError:
            return
        except OSError:
            self._unsent.clear()  # `read` raises the error

    def close(self) -> None:
        """Close the connection or device."""
        os.close(self._descriptor)


class OneClient:
    """A TCP server that takes one client after the other, and drops writes while there is none."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self._client: Stream | None = None
        self.peer: Address | None = None

    def fileno(self) -> int:
        """The descriptor to wait for: the client's or, without one, the listener's."""
        return (self._client or self._listener).fileno()

    def read(self) -> bytes | None:
        """The client's next bytes; accepts the next client when that has closed the connection."""
        try:
            if self._client is not None:
                return self._client.read()
            self._client = Stream.of(*self._listener.accept())
            self.peer = self._client.peer
        except BlockingIOError:
            pass
        except ConnectionError:
            if self._client is not None:
                self._client.close()
            self._client = None
        return None

    def write(self, data: bytes) -> None:
        """Send bytes to the client."""
        if self._client is not None:
            self._client.write(data)

    def close(self) -> None:
        """Close client and port."""
        if self._client is not None:
            self._client.close()
        self._listener.close()


def bind_udp(
    place: Address, advice: str, *, gives_way: bool = False, patience_s: float = _PROBE_S
) -> UdpSocket:
    """A UDP socket that listens.

    Args:
        place: the local address.
        advice: what to do when the port is taken.
        gives_way: whether a program that binds the same address later, as MAVSDK does (SO_REUSEADDR),
            receives instead of this one.
        patience_s: for how long a port that is in use is tried again.
    """
    with _explained(f"UDP {in_url(*place)} cannot be opened", advice):
        family, address = _local(place, socket.SOCK_DGRAM)
        opened = socket.socket(family, socket.SOCK_DGRAM)
        try:
            _patiently(lambda: opened.bind(address), patience_s)
        except OSError:
            opened.close()
            raise
        if gives_way:  # after binding, so that a port that is in use already is refused
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    return UdpSocket(opened)


def connect_udp(place: Address) -> UdpSocket:
    """A UDP socket that sends to one address and receives only from there."""
    address = resolved_ipv4(place)
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with _explained(f"UDP {in_url(*place)} cannot be sent to", "check host and network"):
        try:
            opened.connect(address)
        except OSError:
            opened.close()
            raise
    return UdpSocket(opened)


def resolved_ipv4(place: Address, what: str = "UDP") -> Address:
    """Look up the address of a name once: `sendto` would look it up, blocking, for every packet."""
    with _explained(f"{what} {in_url(*place)} cannot be sent to", "give a host's name or an IPv4 address"):
        found = socket.getaddrinfo(*place, family=socket.AF_INET, type=socket.SOCK_DGRAM)
    return cast(Address, found[0][4])


def listen_tcp(
    place: Address, advice: str = "choose another port", *, patience_s: float = _PROBE_S
) -> socket.socket:
    """A socket that takes TCP connections and does not block.

    Args:
        place: the local address.
        advice: what to do when the port is taken.
        patience_s: for how long a port that is in use is tried again.
    """
    with _explained(f"TCP {in_url(*place)} cannot be listened on", advice):
        family, address = _local(place, socket.SOCK_STREAM)
        listener = _patiently(lambda: socket.create_server(address, family=family), patience_s)
    listener.setblocking(False)
    return listener


def connect_tcp(place: Address) -> Stream:
    """Connect to a TCP server; waits five seconds at most."""
    with _explained(f"TCP {in_url(*place)} cannot be connected to", "is the server running?"):
        connection = socket.create_connection(place, _CONNECT_S)
        return Stream.of(connection, connection.getpeername())


def open_serial(path: str, baud: int) -> Stream:
    """A serial line: eight bits, no parity, no flow control."""
    if baud not in Serial.BAUDRATES:
        raise LinkError(f"serial {path}:{baud}: {baud} is not a usual baud rate, such as 57600 or 921600")
    with _explained(f"serial {path} cannot be opened", "is it plugged in, and may you use it?"):
        try:  # a time-out between bytes sets VMIN to 1: with 0 a silent line would look like one that is gone
            line = Serial(path, baud, inter_byte_timeout=0)
        except Exception as error:  # pyserial passes on termios.error, too
            if getattr(error, "errno", None):
                raise
            raise LinkError(f"serial {path}: this is not a serial line") from None
        with line:
            return Stream(os.dup(line.fileno()))


def open_drone(url: LinkUrl) -> UdpSocket | Stream | OneClient:
    """Open the link on which a drone is, as a ground station does."""
    if url.scheme == "udpin":
        return bind_udp(url.place, _advice(url, "give another address"))
    if url.scheme == "udpout":
        return connect_udp(url.place)
    if url.scheme == "tcpin":
        return OneClient(listen_tcp(url.place))
    if url.scheme == "tcpout":
        return connect_tcp(url.place)
    return open_serial(*url.place)


def check_free(url: LinkUrl, advice: str) -> None:
    """Check that a drone's port or device is free before MAVSDK opens it.

    MAVSDK binds a UDP port that another program has bound without an error, and the last one receives all
    packets; so the port is bound here first, exclusively, and closed. `advice` is for a port that is taken.
    """
    if url.scheme == "udpin":
        bind_udp(url.place, _advice(url, advice)).close()
    elif url.scheme == "serial" and url.address.startswith("/"):
        with _explained(f"serial {url.address} cannot be opened", "is it plugged in?"):
            Path(url.address).stat()


def _advice(url: LinkUrl, otherwise: str) -> str:
    return f"is another flight or ground station on UDP port {url.number}? Close it or {otherwise}"


def _patiently(opens: Callable[[], _Opened], patience_s: float) -> _Opened:
    """Call what opens a port until it is not in use; programs try by binding whether one is free."""
    end_s = time.monotonic() + patience_s
    while True:
        try:
            return opens()
        except OSError as error:
            if error.errno != errno.EADDRINUSE or time.monotonic() >= end_s:
                raise
        time.sleep(0.02)


def _local(place: Address, kind: socket.SocketKind) -> tuple[socket.AddressFamily, Address]:
    """Look a local address up, IPv4 first: a name may stand for both."""
    found = socket.getaddrinfo(*place, type=kind, flags=socket.AI_PASSIVE)
    family, _, _, _, address = min(found, key=lambda each: each[0] != socket.AF_INET)
    return family, cast(Address, address)


@contextmanager
def _explained(problem: str, advice: str) -> Iterator[None]:
    """Raise an operating system's error as one line: the problem, its cause, and what to do."""
    try:
        yield
    except (OSError, UnicodeError) as error:
        reason: object = error
        if isinstance(error, OSError):  # some texts of Python repeat the address
            number = error.errno or 0
            reason = os.strerror(number) if number > 0 else error.strerror or error
        raise LinkError(f"{problem} ({reason}); {advice}") from None
