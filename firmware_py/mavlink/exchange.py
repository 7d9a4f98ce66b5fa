"""What the services share: the autopilot, the links, the time, and how to send."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_py.mavlink.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message
from firmware_py.mavlink.framing import Packet
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.port import AutopilotPort


class Exchange:
    """One vehicle on its links.

    Attributes:
        autopilot: whom the services speak for.
        links: by name.
        system_id: of this vehicle.
        time_us: vehicle time of the last update.
        boot_unix_us: what time it was at boot, for SYSTEM_TIME; 0: not known.
    """

    __slots__ = ("autopilot", "boot_unix_us", "links", "system_id", "time_us")

    def __init__(
        self, autopilot: AutopilotPort, links: Mapping[str, Link], system_id: int, boot_unix_us: int = 0
    ) -> None:
        self.autopilot = autopilot
        self.links = links
        self.system_id = system_id
        self.boot_unix_us = boot_unix_us
        self.time_us = 0

    def packet(self, message: Message) -> Packet:
        """Pack a message as ours."""
        return Packet(message, self.system_id, AUTOPILOT_COMPONENT_ID)

    def send(self, link: Link, message: Message) -> None:
        """Send on one link."""
        link.send(self.packet(message))

    def broadcast(self, message: Message) -> None:
        """Send on all links."""
        packet = self.packet(message)
        for link in self.links.values():
            link.send(packet)

    def is_for_us(self, message: Message, *, or_everyone: bool = False) -> bool:
        """Whether a message names us as its target.

        Args:
            message: with target_system and target_component.
            or_everyone: whether target system 0 counts too; PX4 takes that for few messages only.
        """
        system_fits = message.target_system == self.system_id or (
            or_everyone and message.target_system == BROADCAST
        )
        return system_fits and message.target_component in (AUTOPILOT_COMPONENT_ID, BROADCAST)


Handler = Callable[[Exchange, Link, Message], None]
