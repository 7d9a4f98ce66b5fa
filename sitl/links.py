"""A vehicle's links on the asyncio loop: they send to all who listen and tell who comes and goes.

Links carry bytes; what the bytes mean is the autopilot's business.
"""

from __future__ import annotations

import asyncio
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from wire.framing import MARKERS
from wire.transports.sockets import (
    Address,
    Stream,
    UdpSocket,
    bind_udp,
    listen_tcp,
    resolved_ipv4,
)
from wire.transports.urls import LinkError

Receive = Callable[[bytes], None]

SILENCE_S = 5.0  # after that, a peer who sent something unasked is forgotten
MAX_PEERS = 8
RETRY_S = 1.0  # before a lost connection or line is opened again
_MAX_CLIENTS = 16

Joined = Callable[["StreamLink"], Receive]  # told of a new connection; gives who takes its bytes
Left = Callable[["StreamLink"], None]


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
        if peer != self._remote and data[0] in MARKERS:  # who sends something else is no peer
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


class StreamLinks(ABC):
    """Links over streams, as they come and go; after a failure it is tried again, a second later.

    Args:
        joined: called with each that is open.
        left: called with each that is over.
    """

    def __init__(self, joined: Joined, left: Left) -> None:
        self._joined, self._left = joined, left
        self._links: set[StreamLink] = set()
        self._task = asyncio.create_task(self._run())

    def close(self) -> None:
        """Close all and open no more."""
        self._task.cancel()
        for link in list(self._links):
            link.close()

    async def _run(self) -> None:
        while True:
            try:
                await self._serve_next()
            except (LinkError, OSError):
                await asyncio.sleep(RETRY_S)

    @abstractmethod
    async def _serve_next(self) -> None: ...

    def _add(self, stream: Stream) -> StreamLink:
        link = StreamLink(stream, self._joined, self._leave)
        self._links.add(link)
        return link

    def _leave(self, link: StreamLink) -> None:
        self._links.discard(link)
        self._left(link)


class TcpServer(StreamLinks):
    """Takes TCP clients; each is a link of its own.

    Raises:
        LinkError: the port is taken or the address is not this machine's.
    """

    def __init__(self, place: Address, joined: Joined, left: Left) -> None:
        self._listener = listen_tcp(place)
        super().__init__(joined, left)

    async def _run(self) -> None:
        with self._listener:
            await super()._run()

    async def _serve_next(self) -> None:
        stream = Stream.of(*await asyncio.get_running_loop().sock_accept(self._listener))
        if len(self._links) < _MAX_CLIENTS:
            self._add(stream)
        else:
            stream.close()


class LastingLink(StreamLinks):
    """A TCP connection or serial line that is opened again when it was lost.

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
        self._opened = opened
        super().__init__(joined, left)

    async def _serve_next(self) -> None:
        stream, self._opened = self._opened or await self._open_stream(), None
        await self._add(stream).over.wait()
        await asyncio.sleep(RETRY_S)


async def connect_tcp_async(place: Address) -> Stream:
    """Connect to a TCP server. Raises `OSError` if nobody answers."""
    loop = asyncio.get_running_loop()
    failure = OSError()
    for family, kind, protocol, _, address in await loop.getaddrinfo(*place, type=socket.SOCK_STREAM):
        with socket.socket(family, kind, protocol) as connection:  # empty when `Stream.of` took it over
            connection.setblocking(False)
            try:
                await loop.sock_connect(connection, address)
                return Stream.of(connection, place)
            except OSError as error:
                failure = error
    raise failure
