"""One MAVLink system on its links: it receives, authenticates, forwards and sends packets.

Forwarding is PX4's, as its SITL has it on both links: a packet to everyone is forwarded to all other links
where a component was heard, one to a system or component to the links where that was heard. What is for this
vehicle alone is not forwarded. Different from PX4: a packet is not forwarded to a link on which its sender
was heard too, so that a router on two links makes no endless loop, and a component that is silent for a
minute is forgotten.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message, mavlink
from framerunner.wire.framing import Packet, source_of
from framerunner.wire.link import Link, LinkProfile
from framerunner.wire.signing import Signing

_FORGOTTEN_US = 60_000_000
_CAPACITY = 64  # components in all; beyond, the one silent for longest is forgotten
_REFRESH_US = 1_000_000
_NEVER_FORWARDED = (
    mavlink.MAVLINK_MSG_ID_SETUP_SIGNING,  # it carries the key
    mavlink.MAVLINK_MSG_ID_RADIO_STATUS,  # about its own link
)

Component = tuple[int, int]  # system id, component id


class Router:
    """Remembers from which component packets were received on which link."""

    def __init__(self, is_own: Callable[[int, int], bool]) -> None:
        self._is_own = is_own
        self._received_us: dict[tuple[str, Component], int] = {}

    def note(self, link: str, source: Component, time_us: int) -> None:
        """Note a packet received from a component on a link."""
        key = (link, source)
        received_us = self._received_us.get(key)
        if received_us is not None and time_us - received_us < _REFRESH_US:
            return
        if received_us is None:
            self._make_room(time_us)
        self._received_us[key] = time_us

    def forget_link(self, link: str) -> None:
        """Forget all components of a link that was removed."""
        self._received_us = {key: time_us for key, time_us in self._received_us.items() if key[0] != link}

    def destinations(self, link: str, source: Component, message: Message, time_us: int) -> list[str]:
        """The links to which a packet is forwarded; an unknown message has no target: it is for everyone."""
        if len(self._received_us) < 2 or message.get_msgId() in _NEVER_FORWARDED:
            return []
        system_id = getattr(message, "target_system", BROADCAST)
        component_id = getattr(message, "target_component", BROADCAST)
        if self._is_own(system_id, component_id):
            return []
        with_target: dict[str, None] = {}  # in the order of their first packets
        with_sender = {link}
        for (name, component), received_us in self._received_us.items():
            if time_us - received_us > _FORGOTTEN_US:
                continue
            if component == source:
                with_sender.add(name)
            elif system_id == BROADCAST or (
                system_id == component[0] and component_id in (BROADCAST, component[1])
            ):
                with_target[name] = None
        return [name for name in with_target if name not in with_sender]

    def _make_room(self, time_us: int) -> None:
        received_us = self._received_us
        if len(received_us) < _CAPACITY:
            return
        for key in [key for key, then_us in received_us.items() if time_us - then_us > _FORGOTTEN_US]:
            del received_us[key]
        if len(received_us) >= _CAPACITY:
            del received_us[min(received_us, key=received_us.__getitem__)]


class Exchange:
    """Joins one system's components to its links.

    Args:
        system_id: of this system.
        component_ids: of its components that are not elsewhere on the links.
        signing: of all links; by default nothing is signed.

    Attributes:
        links: by name; they are added and removed, so a name may be missing later.
        time_us: vehicle time of the last update.
        boot_unix_us: time of boot, microseconds since 1970; 0: not known. A service that receives it sets it.
        refused_packets: valid packets that were refused because their signature is wrong or missing.
    """

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
        """Use one more link, with a name that no other link has, from the next update on."""
        self.links[profile.name] = Link(profile, self.signing, self._link_number)
        self._link_number = (self._link_number + 1) % 256

    def remove_link(self, name: str) -> None:
        """Stop using a link; what is still sent there is lost."""
        link = self.links.pop(name, None)
        if link is not None:
            link.open = False
            self._router.forget_link(name)

    def advance(self, time_us: int) -> None:
        """Set vehicle time, microseconds since boot; it never decreases."""
        self.time_us = time_us
        if self.signing.active:
            self.signing.advance(time_us)

    def receive(self, link: Link, max_steps: int) -> Iterator[Message]:
        """Read in at most some steps, forward, and yield the messages accepted on a link."""
        name = link.profile.name
        for message in link.reader.read(max_steps):
            packet = message.get_msgbuf()
            sender = source_of(packet)
            if self._is_own(*sender):  # our own packet in a loop, or another sender with our ids
                continue
            if not self.signing.accepts(packet, trusted=link.profile.trusted):
                self.refused_packets += 1
                continue
            sequence = packet[2 if packet[0] == mavlink.PROTOCOL_MARKER_V1 else 4]
            link.traffic.receive(sender, sequence, len(packet))
            self._router.note(name, sender, self.time_us)
            for other in self._router.destinations(name, sender, message, self.time_us):
                self.links[other].forward(packet)
            yield message

    def take_output(self) -> list[tuple[str, bytes]]:
        """The datagrams to send, each with its link's name; a datagram has one or more whole packets."""
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
        """Whether a message's target is our component or, `or_everyone`, system 0, as PX4 has it for few."""
        system_fits = message.target_system == self.system_id or (
            or_everyone and message.target_system == BROADCAST
        )
        return system_fits and message.target_component in (component_id, BROADCAST)

    def _is_own(self, system_id: int, component_id: int) -> bool:
        return system_id == self.system_id and component_id in self._component_ids
