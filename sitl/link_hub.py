"""Joins a vehicle's MAVLink node to what carries its bytes; links come and go with who connects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from firmware_py.mavlink.node import MavlinkNode
from sitl.link_input import LinkInput
from sitl.link_urls import LinkUrl, is_loopback
from sitl.links import Carrier, Receive, UdpAddresses, open_udp
from sitl.stream_links import Closable, Joined, SerialLine, TcpClient, TcpServer
from wire.link import LinkProfile


class LinkHub:
    """All links of one vehicle.

    Args:
        node: whose bytes they carry; it begins without links.
        notice: called with lines for people.
    """

    def __init__(self, node: MavlinkNode, notice: Callable[[str], None] = lambda line: None) -> None:
        self._node = node
        self._input = LinkInput(node, notice)
        self._carriers: dict[str, Carrier] = {}
        self._opened: list[Closable] = []
        self._joined = 0

    async def open_udp(self, profile: LinkProfile, addresses: UdpAddresses) -> None:
        """Open a UDP link and speak on it from now on.

        Raises:
            LinkError: the local port is taken or an address is wrong.
        """
        link = await open_udp(addresses, self._receiver(profile.name))
        self._opened.append(link)
        self._node.add_link(profile)
        self._carriers[profile.name] = link

    async def open(self, url: LinkUrl) -> None:
        """Open a link that a person asked for.

        Raises:
            LinkError: it cannot be opened.
        """
        there = (url.address, url.number)
        if url.scheme == "udpout":
            here = "127.0.0.1" if is_loopback(url.address) else "0.0.0.0"
            await self.open_udp(url.profile, UdpAddresses((here, 0), there))
        elif url.scheme == "udpin":
            await self.open_udp(url.profile, UdpAddresses(there, None))
        elif url.scheme == "tcpin":
            server = TcpServer(self._joiner(url.profile), self._leave)
            self._opened.append(server)
            await server.open(*there)
        elif url.scheme == "tcpout":
            self._opened.append(TcpClient(*there, self._joiner(url.profile), self._leave))
        else:
            line = SerialLine()
            self._opened.append(line)
            await line.open(*there, self._joiner(url.profile), self._leave)

    async def open_all(self, urls: Sequence[LinkUrl]) -> None:
        """Open links that a person asked for.

        Raises:
            LinkError: one cannot be opened.
        """
        for url in urls:
            await self.open(url)

    def read(self) -> None:
        """Read input that waits, as far as there is time, and send the answers."""
        self._input.work()
        self.flush()

    def update(self, time_us: int) -> None:
        """Read input that waits, then send what is due at a vehicle time."""
        self._input.work()
        self._node.update(time_us)
        self.flush()

    def flush(self) -> None:
        """Send what the node has to say."""
        for name, data in self._node.take_output():
            self._carriers[name].send(data)

    def close(self) -> None:
        """Close all links."""
        for opened in self._opened:
            opened.close()

    def _receiver(self, name: str) -> Receive:
        def receive(data: bytes) -> None:
            self._input.take(name, data)
            self.flush()  # answers do not wait for the next tick

        return receive

    def _joiner(self, profile: LinkProfile) -> Joined:
        def join(carrier: Carrier) -> Receive:
            self._joined += 1
            name = f"{profile.name}#{self._joined}"
            self._node.add_link(replace(profile, name=name))
            self._carriers[name] = carrier
            return self._receiver(name)

        return join

    def _leave(self, carrier: Carrier) -> None:
        for name, known in list(self._carriers.items()):
            if known is carrier:
                self._node.remove_link(name)
                del self._carriers[name]
