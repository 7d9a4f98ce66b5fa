"""A MAVLink link to a vehicle for programs that mostly receive, such as monitor and doctor.

`fly` commands through MAVSDK. A program that measures a link must see every packet with its sequence number
and send nothing unrequested, so it reads the link itself.
"""

from __future__ import annotations

import select

from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.framing import PacketReader, packed
from framerunner.wire.transports.sockets import Address, UdpSocket, open_drone
from framerunner.wire.transports.urls import LinkError, in_url, parse_url


class VehicleLink:
    """One link, used by one thread. Several vehicles may be heard on it.

    Args:
        url: as `fly --drone` takes it.
        system_id: own MAVLink system id; no vehicle should have it.
        component_id: own component id.

    Raises:
        LinkError: bad address, port taken, no connection, no such device.
    """

    def __init__(self, url: str, *, system_id: int, component_id: int) -> None:
        parsed = parse_url(url)
        self._transport = open_drone(parsed)
        # Several vehicles may send to a UDP port; other transports have one peer for all.
        self._udp_port = self._transport if parsed.scheme == "udpin" else None
        self._peers: dict[int, Address] = {}  # by system id
        self._sources: dict[tuple[int, int], set[Address]] = {}  # by system and component id
        self.url = parsed.text
        self._codec = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._reader = PacketReader()

    def receive(self, timeout_s: float) -> list[Message]:
        """Wait for messages, for a maximum of wall time; bytes that are no message are skipped.

        Raises:
            LinkError: the link has failed.
        """
        transport = self._transport
        waiting = select.poll()
        waiting.register(transport, select.POLLIN)
        waiting.poll(timeout_s * 1000)
        try:
            data = transport.read()
        except OSError as error:
            raise LinkError(f"{self.url} failed: {error.strerror or error}") from None
        messages = self._reader.feed(data) if data else []
        if transport.peer is not None:
            for message in messages:
                self._peers[message.get_srcSystem()] = transport.peer
                sender = (message.get_srcSystem(), message.get_srcComponent())
                self._sources.setdefault(sender, set()).add(transport.peer)
        return messages

    def send(self, message: Message) -> None:
        """Send a message to its target system, or to all; lost before anything was received."""
        data = packed(message, self._codec)
        if not isinstance(self._udp_port, UdpSocket):
            self._transport.write(data)
            return
        peer = self._peers.get(getattr(message, "target_system", getattr(message, "target", 0)))
        for address in set(self._peers.values()) if peer is None else (peer,):
            self._udp_port.write(data, address)

    def send_to_all(self, message: Message) -> None:
        """Send a message to every address from which something was received; on other links as `send`."""
        if not isinstance(self._udp_port, UdpSocket):
            self.send(message)
            return
        data = packed(message, self._codec)
        for address in set().union(*self._sources.values()):
            self._udp_port.write(data, address)

    def addresses(self, system_id: int, component_id: int) -> tuple[str, ...]:
        """HOST:PORT of all senders of a component's packets, sorted; empty on a link without addresses."""
        found = self._sources.get((system_id, component_id), ())
        return tuple(in_url(host, port) for host, port in sorted((each[0], each[1]) for each in found))

    @property
    def host(self) -> str:
        """IP address of the latest sender; "" before the first, and on a serial line."""
        peer = self._transport.peer
        return "" if peer is None else peer[0]

    def close(self) -> None:
        """Close the port or device."""
        self._transport.close()
