"""UDP links of the vehicle. They carry bytes; what the bytes mean is the autopilot's business."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, cast

from sitl.link_urls import LinkError

Address = tuple[str, int]
Receive = Callable[[bytes], None]

SILENCE_S = 5.0  # after that, a partner who came by itself is forgotten
MAX_PARTNERS = 8
_MAVLINK_MARKERS = (0xFD, 0xFE)  # who sends something else is no partner


class Carrier(Protocol):
    """What brings bytes to somebody."""

    def send(self, data: bytes) -> None:
        """Send whole packets; lost without a word if nobody is there or the way is choked."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


@dataclass(frozen=True, slots=True)
class UdpAddresses:
    """Where a link listens and to whom it speaks unasked.

    Attributes:
        bind: local address; port 0 lets the system choose one.
        remote: whom it always sends to; None: only to those who spoke.
    """

    bind: Address
    remote: Address | None


class UdpLink(asyncio.DatagramProtocol):
    """A UDP link: speaks unasked to its remote from the start, and to all who spoke within five seconds.

    PX4 locks to the first who speaks. Here QGroundControl, MAVProxy and a script may share a link: one at the
    remote address, others that send to this link's port from anywhere. They all hear the same.

    Args:
        remote: whom it always sends to; None: nobody.
        receive: called with each datagram.
        clock: monotonic seconds.
    """

    def __init__(
        self, remote: Address | None, receive: Receive, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._remote = remote
        self._heard_s: dict[Address, float] = {}
        self._receive = receive
        self._clock = clock
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Remember the socket (asyncio calls this)."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: Address) -> None:
        """Take a datagram (asyncio calls this)."""
        if addr != self._remote and data[:1] and data[0] in _MAVLINK_MARKERS:
            now_s = self._clock()
            self._forget_the_silent(now_s)
            if addr in self._heard_s or len(self._heard_s) < MAX_PARTNERS:
                self._heard_s[addr] = now_s
        self._receive(data)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens there yet: go on sending, as a radio would."""

    def send(self, data: bytes) -> None:
        """Send a datagram to all partners; lost without a word if nobody is there."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if self._remote is not None:
            transport.sendto(data, self._remote)
        if self._heard_s:
            self._forget_the_silent(self._clock())
            for partner in self._heard_s:
                transport.sendto(data, partner)

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()

    def _forget_the_silent(self, now_s: float) -> None:
        for partner in [who for who, heard_s in self._heard_s.items() if now_s - heard_s > SILENCE_S]:
            del self._heard_s[partner]


async def open_udp(addresses: UdpAddresses, receive: Receive) -> UdpLink:
    """Open a link.

    Raises:
        LinkError: the local port is taken or an address is wrong.
    """
    loop = asyncio.get_running_loop()
    host, port = addresses.bind
    remote = None if addresses.remote is None else await _resolve(addresses.remote)
    try:
        _, link = await loop.create_datagram_endpoint(
            lambda: UdpLink(remote, receive), local_addr=addresses.bind
        )
    except OSError as error:
        raise LinkError(
            f"UDP {host}:{port} cannot be opened ({error.strerror or error}); "
            "if another simulator runs, stop it or choose another --instance"
        ) from error
    return link


async def _resolve(remote: Address) -> Address:
    """Look a host's name up once: a name in `sendto` is looked up, blocking, with every packet."""
    loop = asyncio.get_running_loop()
    host, port = remote
    try:
        found = await loop.getaddrinfo(host, port, family=socket.AF_INET, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise LinkError(
            f"UDP {host}:{port} cannot be sent to ({reason}); give a host's name or an IPv4 address"
        ) from error
    return cast(Address, found[0][4])
