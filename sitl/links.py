"""A vehicle's links on the asyncio loop: UDP with several peers, TCP and serial lines.

Links carry bytes; `link_hub` connects them to the vehicle's MAVLink node.
"""

from __future__ import annotations

import asyncio
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from framerunner.wire.framing import MARKERS
from framerunner.wire.transports.sockets import (
    Address,
    Stream,
    UdpSocket,
    bind_udp,
    listen_tcp,
    resolved_ipv4,
)
from framerunner.wire.transports.urls import LinkError

Receive = Callable[[bytes], None]
Joined = Callable[["StreamLink"], Receive]  # called with a new connection; returns the receiver of its bytes
Left = Callable[["StreamLink"], None]

SILENCE_S = 5.0  # after that, a peer that is not the remote is removed
MAX_PEERS = 8
RETRY_S = 1.0  # before a lost connection or line is opened again
_MAX_CLIENTS = 16


@dataclass(frozen=True, slots=True)
class UdpAddresses:
    """Addresses of a UDP link."""

    bind: Address  # local; port 0 lets the system choose one
    remote: Address | None  # is always sent to; None: only peers that sent something


class UdpLink:
    """A UDP link: sends to its remote from the start, and to peers that sent something within five seconds.

    PX4 locks to the first peer. Here QGroundControl, MAVProxy and a script may share a link: one at the
    remote address, others that send to this link's port from anywhere. They all receive the same.

    Args:
        transport: bound; closed at the end.
        remote: always sent to, if given.
        receive: called with each datagram.
        clock: monotonic seconds.
        accepts: whether a sender is listened to; by default all are.
    """

    def __init__(
        self,
        transport: UdpSocket,
        remote: Address | None,
        receive: Receive,
        clock: Callable[[], float] = time.monotonic,
        accepts: Callable[[Address], bool] = lambda sender: True,
    ) -> None:
        self._transport = transport
        self._remote = remote
        self._heard_s: dict[Address, float] = {}
        self._receive = receive
        self._clock = clock
        self._accepts = accepts
        self._is_open = True
        asyncio.get_running_loop().add_reader(transport, self._read)

    def send(self, data: bytes) -> None:
        """Send a datagram to all peers; lost if there are none."""
        if not self._is_open:
            return
        if self._remote is not None:
            self._transport.write(data, self._remote)
        if self._heard_s:
            self._remove_silent(self._clock())
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
            return  # no route now: go on sending, as a radio would
        peer = self._transport.peer
        if not data or peer is None or not self._accepts(peer):
            return
        if peer != self._remote and data[0] in MARKERS:  # a sender of anything else is no peer
            now_s = self._clock()
            self._remove_silent(now_s)
            if peer in self._heard_s or len(self._heard_s) < MAX_PEERS:
                self._heard_s[peer] = now_s
        self._receive(data)

    def _remove_silent(self, now_s: float) -> None:
        for peer in [peer for peer, heard_s in self._heard_s.items() if now_s - heard_s > SILENCE_S]:
            del self._heard_s[peer]


async def open_udp(addresses: UdpAddresses, receive: Receive) -> UdpLink:
    """Open a link.

    Raises:
        LinkError: the local port is in use or an address is wrong.
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
        left: called when the connection has ended; `ended` is set then.
    """

    def __init__(self, stream: Stream, joined: Joined, left: Left) -> None:
        self._stream = stream
        self._left = left
        self._loop = asyncio.get_running_loop()
        self.ended = asyncio.Event()
        self._receive = joined(self)
        self._loop.add_reader(stream, self._read)

    def send(self, data: bytes) -> None:
        """Send whole packets; they are lost when too many wait."""
        if self.ended.is_set():
            return
        self._stream.write(data)
        if self._stream.has_unsent():
            self._loop.add_writer(self._stream, self._flush)

    def close(self) -> None:
        """Close the connection."""
        if self.ended.is_set():
            return
        self.ended.set()
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
    """Links over streams that are opened and lost again; a failure is retried a second later.

    Args:
        joined: called with each open link.
        left: called with each link that has ended.
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
    """Accepts TCP clients; each is a link of its own.

    Raises:
        LinkError: the port is in use or the address is not this machine's.
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


class ReconnectingLink(StreamLinks):
    """A TCP connection or serial line that is opened again after it was lost.

    Args:
        open_stream: opens it; raises `LinkError` or `OSError`.
        joined: called each time it is open.
        left: called each time it has ended.
        opened: the first stream, if it is open already.
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
        await self._add(stream).ended.wait()
        await asyncio.sleep(RETRY_S)


async def connect_tcp_async(place: Address) -> Stream:
    """Connect to a TCP server; raises `OSError` if that fails."""
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
