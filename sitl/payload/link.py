"""The payload link: where PX4 sends to a camera's program, and where MAVSDK's camera clients look.

PX4's simulation sends from UDP 14280 to 14030, where a camera's program listens; MAVSDK's camera client
sends to 14030. Here the camera is in the simulator. So this link does both: it sends from 14280 to 14030, and
listens on 14030 as well unless another program does. One that binds it later, as MAVSDK does, receives
instead.
"""

from __future__ import annotations

import asyncio

from framerunner.wire.transports.sockets import Address, bind_udp, resolved_ipv4
from framerunner.wire.transports.urls import LinkError, is_loopback
from sitl.links import Receive, UdpAddresses, UdpLink

_EVERYWHERE = "0.0.0.0"  # where MAVSDK binds: a more specific address would receive before it


class PayloadLink:
    """The two sockets of the payload link; what is sent goes to the peers of both."""

    def __init__(self, parts: tuple[UdpLink, ...]) -> None:
        self._parts = parts

    def send(self, data: bytes) -> None:
        """Send a datagram to all peers."""
        for part in self._parts:
            part.send(data)

    def close(self) -> None:
        """Close the sockets."""
        for part in self._parts:
            part.close()


async def open_payload(addresses: UdpAddresses, receive: Receive) -> PayloadLink:
    """Open the link.

    Args:
        addresses: PX4's; the remote's port is listened on too if the remote is this machine.
        receive: called with each datagram.

    Raises:
        LinkError: the local port is in use or an address is wrong.
    """
    assert addresses.remote is not None
    host, port = addresses.bind
    remote = await asyncio.to_thread(resolved_ipv4, addresses.remote)
    advice = "if another simulator runs, stop it or choose another --instance"
    sender = UdpLink(bind_udp(addresses.bind, advice), remote, receive)
    if not is_loopback(remote[0]):
        return PayloadLink((sender,))
    local = is_loopback(host)

    def accepts(peer: Address) -> bool:
        return peer[1] != port and (not local or is_loopback(peer[0]))

    try:
        listener = bind_udp((_EVERYWHERE, remote[1]), advice, gives_way=True)
    except LinkError:
        return PayloadLink((sender,))
    return PayloadLink((sender, UdpLink(listener, None, receive, accepts=accepts)))
