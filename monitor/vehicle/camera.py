"""Where a vehicle's video is: asked of its camera, and believed only so far as is safe."""

from __future__ import annotations

from ipaddress import IPv4Address, IPv6Address, ip_address
from urllib.parse import urlsplit

from pymavlink.dialects.v20 import common as mavlink

from monitor.ports import Message
from monitor.vehicle.texts import plain

CAMERAS = range(mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_COMP_ID_CAMERA6 + 1)
_ASK_EVERY_S = 2.0
_ASKS = 8


class CameraWatch:
    """Asks a vehicle's camera once, and again until it answers.

    Args:
        drone_id: the vehicle's system id.
        link_host: the host to which the link goes; "" if it only listens.

    Attributes:
        url: of the MJPEG video; None: none that may be asked for.
        problem: why an address was refused, for a notice; "" if none was.
    """

    def __init__(self, drone_id: int, link_host: str = "") -> None:
        self._id = drone_id
        self._link_host = link_host
        self._component: int | None = None
        self._asked_s = -1e9
        self._asks = 0
        self._answered = False
        self.url: str | None = None
        self.problem = ""

    def see(self, component: int) -> None:
        """Note that a component sent its heartbeat."""
        if component in CAMERAS and self._component is None:
            self._component = component

    def question(self, now_s: float) -> Message | None:
        """What is to be asked now; None: nothing."""
        if self._component is None or self._answered or self._asks >= _ASKS:
            return None
        if now_s - self._asked_s < _ASK_EVERY_S:
            return None
        self._asked_s = now_s
        self._asks += 1
        wanted = mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
        return request(self._id, self._component, wanted)

    def take(self, message: Message) -> None:
        """Take VIDEO_STREAM_INFORMATION; the first stream that can be shown counts."""
        self._answered = True
        url = plain(bytes(message._uri_raw), 200)
        if self.url is not None or not url.startswith(("http:", "https:")):
            return
        problem = refusal(url, self._link_host)
        if problem:
            self.problem = f"the video at {url} is not asked for: {problem}"
        else:
            self.url = url


def refusal(url: str, link_host: str = "") -> str:
    """Why an address that a vehicle told must not be asked for; "" if it may.

    A vehicle could name any address and have this machine ask there. So: HTTP, no user name, and a host that
    is given in numbers and is this machine, in a private network, or the one that the link goes to.

    Args:
        url: as told.
        link_host: the host to which the link goes; "" if it only listens.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        return "it is no address"
    problems = {
        "only http and https are spoken": parts.scheme not in ("http", "https"),
        "it holds a user name": "@" in parts.netloc,
        "port 0 is none": port == 0,
    }
    problem = next((text for text, there in problems.items() if there), "")
    if problem or (link_host and host == link_host.lower()):
        return problem
    try:
        return (
            "" if _is_near(ip_address(host)) else "its host is neither this machine nor in a private network"
        )
    except ValueError:
        return "its host must be given in numbers"


def _is_near(address: IPv4Address | IPv6Address) -> bool:
    odd = address.is_link_local or address.is_multicast or address.is_unspecified or address.is_reserved
    return address.is_loopback or (address.is_private and not odd)


def host_of(link_url: str) -> str:
    """The host to which a link goes; "" if it listens, or goes over a wire."""
    try:
        parts = urlsplit(link_url)
        host = parts.hostname or ""
    except ValueError:
        return ""
    return host if parts.scheme in ("udpout", "tcpout", "udp", "tcp") and host != "0.0.0.0" else ""


def request(system: int, component: int, message_id: int) -> Message:
    """Write REQUEST_MESSAGE."""
    return mavlink.MAVLink_command_long_message(
        system, component, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, message_id, 0, 0, 0, 0, 0, 0
    )
