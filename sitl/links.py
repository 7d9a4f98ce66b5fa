"""A vehicle's links on the asyncio loop: they send to all who listen and tell who comes and goes.

Links carry bytes; what the bytes mean is the autopilot's business.
"""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Protocol

from wire.transports.sockets import (
    Address,
    Stream,
    TcpListener,
    UdpSocket,
    bind_udp,
    resolved_ipv4,
)
from wire.transports.urls import LinkError

Receive = Callable[[bytes], None]

SILENCE_S = 5.0  # after that, a peer who sent something unasked is forgotten
MAX_PEERS = 8
RETRY_S = 1.0  # before a lost connection or line is opened again
_MAX_CLIENTS = 16
_MAVLINK_MARKERS = (0xFD, 0xFE)  # who sends something else is no peer


class Carrier(Protocol):
    """What brings bytes to somebody."""

    def send(self, data: bytes) -> None:
        """Send whole packets; lost if nobody is there or too much waits."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class Closable(Protocol):
    """What a hub closes at the end."""

    def close(self) -> None:
        """Close it and all connections it made."""
        ...


Joined = Callable[[Carrier], Receive]  # told of a new connection; gives who takes its bytes
Left = Callable[[Carrier], None]


@dataclass(frozen=True, slots=True)
class UdpAddresses:
    """Where a link listens and to whom it speaks unasked.

    Attributes:
        bind: local address; port 0 lets the system choose one.
        remote: whom it always sends to; None: only to those who spoke.
    """

    bind: Address
    remote: Address | None


class UdpLink:
    """A UDP link: sends to its remote from the start, and to all who sent something within five seconds.

    PX4 locks to the first who speaks. Here QGroundControl, MAVProxy and a script may share a link: one at the
    remote address, others that send to this link's port from anywhere. They all hear the same.

    Args:
        transport: bound; closed at the end.
        remote: whom it always sends to; None: nobody.
        receive: called with each datagram.
        clock: monotonic seconds.
    """

    def __init__(
        self,
        transport: UdpSocket,
        remote: Address | None,
        receive: Receive,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._transport = transport
        self._remote = remote
        self._heard_s: dict[Address, float] = {}
        self._receive = receive
        self._clock = clock
        self._is_open = True
        asyncio.get_running_loop().add_reader(transport, self._read)

    def send(self, data: bytes) -> None:
        """Send a datagram to all peers; lost if nobody is there."""
        if not self._is_open:
            return
        if self._remote is not None:
            self._transport.write(data, self._remote)
        if self._heard_s:
            self._forget_the_silent(self._clock())
            for peer in self._heard_s:
                self._transport.write(data, peer)

    def close(self) -> None:
        """Close the socket."""
        if self._is_open:
            self._is_open = False
            asyncio.get_running_loop().remove_reader(self._transport)
            self._transport.close()

    def _read(self) -> None:
        try:
            data = self._transport.read()
        except OSError:
            return  # no way there now: go on sending, as a radio would
        peer = self._transport.peer
        if not data or peer is None:
            return
        if peer != self._remote and data[0] in _MAVLINK_MARKERS:
            now_s = self._clock()
            self._forget_the_silent(now_s)
            if peer in self._heard_s or len(self._heard_s) < MAX_PEERS:
                self._heard_s[peer] = now_s
        self._receive(data)

    def _forget_the_silent(self, now_s: float) -> None:
        for peer in [who for who, heard_s in self._heard_s.items() if now_s - heard_s > SILENCE_S]:
            del self._heard_s[peer]


async def open_udp(addresses: UdpAddresses, receive: Receive) -> UdpLink:
    """Open a link.

    Raises:
        LinkError: the local port is taken or an address is wrong.
    """
    remote = None
    if addresses.remote is not None:
        remote = await asyncio.to_thread(resolved_ipv4, addresses.remote)
    advice = "if another simulator runs, stop it or choose another --instance"
    return UdpLink(bind_udp(addresses.bind, advice), remote, receive)


class StreamLink:
    """One connection over TCP or a serial line.

    Args:
        stream: open; closed at the end.
        joined: called at once.
        left: called when it is over.

    Attributes:
        over: set when it is.
    """

    def __init__(self, stream: Stream, joined: Joined, left: Left) -> None:
        self._stream = stream
        self._left = left
        self._loop = asyncio.get_running_loop()
        self.over = asyncio.Event()
        self._receive = joined(self)
        self._loop.add_reader(stream, self._read)

    def send(self, data: bytes) -> None:
        """Send whole packets, or lose them when too many wait."""
        if self.over.is_set():
            return
        self._stream.write(data)
        if self._stream.has_unsent():
            self._loop.add_writer(self._stream, self._flush)

    def close(self) -> None:
        """Close the connection."""
        if self.over.is_set():
            return
        self.over.set()
        self._loop.remove_reader(self._stream)
        self._loop.remove_writer(self._stream)
        self._stream.close()
        self._left(self)

    def _read(self) -> None:
        try:
            data = self._stream.read()
        except OSError:
            self.close()
            return
        if data:
            self._receive(data)

    def _flush(self) -> None:
        self._stream.flush()
        if not self._stream.has_unsent():
            self._loop.remove_writer(self._stream)


class TcpServer:
    """Takes TCP clients; each is a connection of its own.

    Raises:
        LinkError: the port is taken or the address is not this machine's.
    """

    def __init__(self, place: Address, joined: Joined, left: Left) -> None:
        self._listener = TcpListener(place)
        self._joined, self._left = joined, left
        self._loop = asyncio.get_running_loop()
        self._links: set[Carrier] = set()
        self._pause: asyncio.TimerHandle | None = None
        self._listen()

    def close(self) -> None:
        """Listen no more and send all clients away."""
        self._loop.remove_reader(self._listener)
        if self._pause is not None:
            self._pause.cancel()
        self._listener.close()
        for link in list(self._links):
            link.close()

    def _listen(self) -> None:
        self._loop.add_reader(self._listener, self._accept)

    def _accept(self) -> None:
        try:
            stream = self._listener.accept()
        except OSError:  # no more files can be opened
            self._loop.remove_reader(self._listener)
            self._pause = self._loop.call_later(RETRY_S, self._listen)
            return
        if stream is None:
            return
        if len(self._links) >= _MAX_CLIENTS:
            stream.close()
            return
        self._links.add(StreamLink(stream, self._joined, self._leave))

    def _leave(self, link: Carrier) -> None:
        self._links.discard(link)
        self._left(link)


class LastingLink:
    """A TCP client or serial line that is opened again, a second after it was lost or could not be opened.

    Args:
        open_stream: opens it; raises `LinkError` or `OSError`.
        joined: called each time it is open.
        left: called each time it is over.
        opened: the first one, if it is open already.
    """

    def __init__(
        self,
        open_stream: Callable[[], Awaitable[Stream]],
        joined: Joined,
        left: Left,
        opened: Stream | None = None,
    ) -> None:
        self._open_stream = open_stream
        self._joined, self._left = joined, left
        self._link = None if opened is None else StreamLink(opened, joined, left)
        self._task = asyncio.create_task(self._run())

    def close(self) -> None:
        """Close it and try no more."""
        self._task.cancel()
        if self._link is not None:
            self._link.close()

    async def _run(self) -> None:
        while True:
            if self._link is not None:
                await self._link.over.wait()
                self._link = None
                await asyncio.sleep(RETRY_S)
            try:
                self._link = StreamLink(await self._open_stream(), self._joined, self._left)
            except (LinkError, OSError):
                await asyncio.sleep(RETRY_S)


async def connect_tcp(place: Address) -> Stream:
    """Connect to a TCP server. Raises `OSError` if nobody answers."""
    loop = asyncio.get_running_loop()
    failure = OSError()
    for family, kind, protocol, _, address in await loop.getaddrinfo(*place, type=socket.SOCK_STREAM):
        connection = socket.socket(family, kind, protocol)
        try:
            connection.setblocking(False)
            await loop.sock_connect(connection, address)
            return Stream.of(connection)
        except OSError as error:
            failure = error
        finally:
            connection.close()  # what `Stream.of` took over stays open
    raise failure
