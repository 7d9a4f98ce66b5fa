"""One MAVLink system on its links: what comes in and is believed, what is forwarded, what is sent."""

from __future__ import annotations

from collections.abc import Iterator

from wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message, mavlink
from wire.forwarding import Router
from wire.framing import Packet, source_of
from wire.link import Link, LinkProfile
from wire.signing import Signing


class Exchange:
    """Joins one system's components to its links.

    Args:
        system_id: of this system.
        component_ids: of its components that are not elsewhere on the links.
        signing: of all links; by default nothing is signed.
        boot_unix_us: see below.

    Attributes:
        links: by name; they come and go, so keep a `Link`, or look a name up each time and expect it gone.
        system_id: of this system.
        time_us: vehicle time of the last update.
        boot_unix_us: time of boot, microseconds since 1970; 0: not known. Whoever learns it sets it.
        signing: of all links.
        refused_packets: sound packets that were not believed for want of a signature.
    """

    __slots__ = (
        "_component_ids",
        "_link_number",
        "_router",
        "boot_unix_us",
        "links",
        "refused_packets",
        "signing",
        "system_id",
        "time_us",
    )

    def __init__(
        self,
        system_id: int,
        component_ids: frozenset[int] = frozenset({AUTOPILOT_COMPONENT_ID}),
        signing: Signing | None = None,
        boot_unix_us: int = 0,
    ) -> None:
        self.links: dict[str, Link] = {}
        self.system_id = system_id
        self.time_us = 0
        self.boot_unix_us = boot_unix_us
        self.signing = Signing(None, boot_unix_us) if signing is None else signing
        self.refused_packets = 0
        self._component_ids = component_ids
        self._link_number = 0
        self._router = Router(self._is_own)

    @property
    def unix_us(self) -> int:
        """The time now, microseconds since 1970; 0: not known."""
        return self.boot_unix_us + self.time_us if self.boot_unix_us else 0

    def add_link(self, profile: LinkProfile) -> None:
        """Speak on one more link, from the next update on.

        Args:
            profile: with a name that no other link has.
        """
        self.links[profile.name] = Link(profile, self.signing, self._link_number)
        self._link_number = (self._link_number + 1) % 256

    def remove_link(self, name: str) -> None:
        """Speak no more on a link; what somebody still sends there is lost."""
        link = self.links.pop(name, None)
        if link is not None:
            link.open = False
            self._router.forget_link(name)

    def advance(self, time_us: int) -> None:
        """Set vehicle time, microseconds since boot; it never goes back."""
        self.time_us = time_us
        if self.signing.active:
            self.signing.advance(time_us)

    def receive(self, link: Link, max_steps: int) -> Iterator[Message]:
        """Messages that came in on a link and are believed, each forwarded where it is also meant to go.

        Args:
            link: whose reader has the bytes.
            max_steps: bounds the work, see `PacketReader.read`.
        """
        name = link.profile.name
        for message in link.reader.read(max_steps):
            packet = message.get_msgbuf()
            sender = source_of(packet)
            if self._is_own(*sender):  # our own packet has come back, or somebody uses our ids
                continue
            if not self.signing.accepts(packet, trusted=link.profile.trusted):
                self.refused_packets += 1
                continue
            sequence = packet[2 if packet[0] == mavlink.PROTOCOL_MARKER_V1 else 4]
            link.traffic.hear(sender, sequence, len(packet))
            self._router.hear(name, sender, self.time_us)
            for other in self._router.destinations(name, sender, message, self.time_us):
                self.links[other].forward(packet)
            yield message

    def take_output(self) -> list[tuple[str, bytes]]:
        """What is to be sent, as (link name, datagram); a datagram holds one or more whole packets."""
        return [(name, data) for name, link in self.links.items() for data in link.take()]

    def packet(self, message: Message, component_id: int = AUTOPILOT_COMPONENT_ID) -> Packet:
        """Pack a message as one of our components."""
        return Packet(message, self.system_id, component_id)

    def send(self, link: Link, message: Message, component_id: int = AUTOPILOT_COMPONENT_ID) -> None:
        """Send on one link."""
        link.send(self.packet(message, component_id))

    def broadcast(self, message: Message, component_id: int = AUTOPILOT_COMPONENT_ID) -> None:
        """Send on all links."""
        packet = self.packet(message, component_id)
        for link in self.links.values():
            link.send(packet)

    def is_for_us(
        self, message: Message, *, or_everyone: bool = False, component_id: int = AUTOPILOT_COMPONENT_ID
    ) -> bool:
        """Whether a message names one of our components as its target.

        Args:
            message: with target_system and target_component.
            or_everyone: whether target system 0 counts too; PX4 takes that for few messages only.
            component_id: which component asks.
        """
        system_fits = message.target_system == self.system_id or (
            or_everyone and message.target_system == BROADCAST
        )
        return system_fits and message.target_component in (component_id, BROADCAST)

    def _is_own(self, system_id: int, component_id: int) -> bool:
        return system_id == self.system_id and component_id in self._component_ids
