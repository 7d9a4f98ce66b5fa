"""What the services share: the autopilot, the links, the time, and how to send."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from firmware_py.mavlink.camera_model import CameraControl
from firmware_py.mavlink.failure_sink import FailureSink
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.video_links import VideoStream
from wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message
from wire.framing import Packet
from wire.signing import Signing


class Exchange:
    """One vehicle on its links.

    Attributes:
        autopilot: whom the services speak for.
        links: by name; they come and go, so keep a `Link`, or ask for a name anew, and expect it gone.
        system_id: of this vehicle.
        time_us: vehicle time of the last update.
        boot_unix_us: what time it was at boot, for SYSTEM_TIME; 0: not known.
        signing: of all links.
        video: the camera's streams, the one to be preferred first.
        sources: of messages that services make, by message id; for streams and requests.
        camera: on the vehicle; None: there is none.
        failures: breaks parts of the vehicle on purpose; None: nothing can be broken.
        claimed: commands that another component answers when they are meant for all.
    """

    __slots__ = (
        "autopilot",
        "boot_unix_us",
        "camera",
        "claimed",
        "failures",
        "links",
        "signing",
        "sources",
        "system_id",
        "time_us",
        "video",
    )

    def __init__(
        self,
        autopilot: AutopilotPort,
        links: Mapping[str, Link],
        system_id: int,
        boot_unix_us: int = 0,
        *,
        signing: Signing | None = None,
        video: Sequence[VideoStream] = (),
    ) -> None:
        self.autopilot = autopilot
        self.links = links
        self.system_id = system_id
        self.boot_unix_us = boot_unix_us
        self.signing = Signing(None, boot_unix_us) if signing is None else signing
        self.video = tuple(video)
        self.time_us = 0
        self.sources: dict[int, Callable[[], Message | None]] = {}
        self.camera: CameraControl | None = None
        self.failures: FailureSink | None = None
        self.claimed: frozenset[int] = frozenset()

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


Handler = Callable[[Exchange, Link, Message], None]
