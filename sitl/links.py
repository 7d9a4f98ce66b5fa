"""UDP links of the vehicle. They carry bytes; what the bytes mean is the autopilot's business."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

Address = tuple[str, int]
_SILENCE_S = 5.0  # after that, another partner may take the link over


class LinkError(OSError):
    """A link that cannot be opened; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class UdpAddresses:
    """Where a link listens and where it speaks first.

    Attributes:
        bind: local address.
        remote: whom it sends to until somebody answers.
    """

    bind: Address
    remote: Address


class UdpLink(asyncio.DatagramProtocol):
    """A UDP link as PX4 has it: speaks unasked from the start, then keeps to the first partner it hears.

    A partner that has been silent for five seconds loses the link to the next one who speaks.

    Args:
        remote: whom it sends to until somebody answers.
        receive: called with each datagram.
        clock: monotonic seconds.
    """

    def __init__(
        self, remote: Address, receive: Callable[[bytes], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._partner = remote
        self._heard_s: float | None = None
        self._receive = receive
        self._clock = clock
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Remember the socket (asyncio calls this)."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: Address) -> None:
        """Take a datagram (asyncio calls this)."""
        now_s = self._clock()
        if addr == self._partner:
            self._heard_s = now_s
        elif self._heard_s is None or now_s - self._heard_s > _SILENCE_S:
            self._partner, self._heard_s = addr, now_s
        self._receive(data)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens there yet: go on sending, as a radio would."""

    def send(self, data: bytes) -> None:
        """Send a datagram to the partner; lost without a word if nobody is there."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(data, self._partner)

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()


async def open_udp(addresses: UdpAddresses, receive: Callable[[bytes], None]) -> UdpLink:
    """Open a link.

    Raises:
        LinkError: the local port is taken or an address is wrong.
    """
    loop = asyncio.get_running_loop()
    host, port = addresses.bind
    remote = await _resolve(addresses.remote)
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
