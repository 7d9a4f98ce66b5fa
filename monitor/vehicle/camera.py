"""Where a vehicle's video is: asked of its camera, and believed only so far as is safe."""

from __future__ import annotations

import re
from collections.abc import Collection
from ipaddress import IPv4Address, IPv6Address, ip_address
from urllib.parse import SplitResult, urlsplit

from monitor.ports import Message
from wire.dialect import mavlink, request_message
from wire.simulator_api import VIDEO_PATH
from wire.status_text import plain
from wire.transports.urls import LinkError, parse_url

CAMERAS = range(mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_COMP_ID_CAMERA6 + 1)
_ASK_EVERY_S = 2.0
_ASKS = 8
_PATH = re.compile(r"(?:/[\w-][\w.-]{0,60}){0,5}/?", re.ASCII)
_WEB_PORTS = (80, 443)
_FIRST_FREE_PORT = 1024  # those below belong to other services
# What the simulator and the virtual camera serve on this machine: one port an instance.
_OWN_PORTS = range(8100, 8110)


class CameraWatch:
    """Asks a vehicle's camera once, and again until it answers.

    Args:
        drone_id: the vehicle's system id.
        link_host: the host to which the link goes; "" if it only listens.
        confirmed: HOST or HOST:PORT that the operator allows besides.

    Attributes:
        url: of the MJPEG video; None: none that may be asked for.
        problem: why an address was refused, for a notice; "" if none was.
    """

    def __init__(self, drone_id: int, link_host: str = "", confirmed: Collection[str] = ()) -> None:
        self._id = drone_id
        self._link_host = link_host
        self._confirmed = confirmed
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
        return request_message(self._id, wanted, self._component)

    def take(self, message: Message, host: str) -> None:
        """Take VIDEO_STREAM_INFORMATION; the first stream that can be shown counts.

        Args:
            message: as parsed.
            host: in numbers, from which it came; "" if over a wire.
        """
        self._answered = True
        url = plain(bytes(message._uri_raw), 200)
        if self.url is not None or not url.startswith(("http:", "https:")):
            return
        problem = refusal(url, host, self._link_host, self._confirmed)
        if problem:
            self.problem = (
                f"the video at {url} is not asked for: {problem}; if it is right, start the monitor with "
                "--camera-host HOST or HOST:PORT"
            )
        else:
            self.url = url


def refusal(url: str, host: str, link_host: str = "", confirmed: Collection[str] = ()) -> str:
    """Why an address that a vehicle told must not be asked for; "" if it may.

    A vehicle could name any address and have this machine ask there. So: HTTP, no user name, and what the
    operator confirmed or else the host that said so, with nothing that a camera does not need. On this
    machine, where packets of a distant vehicle may be passed on and other services trust who is local, only
    the simulator's and virtual camera's own addresses.

    Args:
        url: as told.
        host: in numbers, from which it was told; "" if over a wire.
        link_host: the host to which the link goes, as the operator wrote it; "" if it only listens.
        confirmed: HOST or HOST:PORT that the operator allows.
    """
    try:
        parts = urlsplit(url)
        name, port = parts.hostname or "", parts.port
    except ValueError:
        return "it is no address"
    problems = {
        "only http and https are spoken": parts.scheme not in ("http", "https"),
        "it holds a user name": "@" in parts.netloc,
        "port 0 is none": port == 0,
        "it names no host": not name,
    }
    problem = next((text for text, there in problems.items() if there), "")
    if problem or {name, f"{name}:{port}"} & {each.lower() for each in confirmed}:
        return problem
    return _unneeded(parts) or _other_host(name, host, link_host) or _trusting(parts)


def _unneeded(parts: SplitResult) -> str:
    """What an address holds that a camera does not need; "" if nothing."""
    if parts.query or parts.fragment or not _PATH.fullmatch(parts.path):
        return "it holds more than a plain path"
    port = parts.port or _WEB_PORTS[0]
    return "" if port in _WEB_PORTS or port >= _FIRST_FREE_PORT else f"port {port} is of another service"


def _other_host(name: str, host: str, link_host: str) -> str:
    if link_host and name == link_host.lower():
        return ""
    try:
        address = _plain_address(name)
    except ValueError:
        return "its host must be given in numbers"
    if host and address == _plain_address(host):
        return ""
    return (
        f"the drone's packets come from {host}"
        if host
        else "nobody knows where the drone's packets come from"
    )


def _trusting(parts: SplitResult) -> str:
    """Why an address of this very machine must not be asked for; "" if it may, or is not of this machine."""
    try:
        is_own = parts.hostname == "localhost" or _plain_address(parts.hostname or "").is_loopback
    except ValueError:
        is_own = False
    if not is_own or (parts.port in _OWN_PORTS and parts.path == VIDEO_PATH):
        return ""
    first, last = _OWN_PORTS[0], _OWN_PORTS[-1]
    return f"on this machine only {VIDEO_PATH} at ports {first} to {last} is asked for"


def _plain_address(text: str) -> IPv4Address | IPv6Address:
    """An address; an IPv4 one that is written as IPv6 is that IPv4 one. Raises `ValueError`."""
    address = ip_address(text.partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return address if mapped is None else mapped


def host_of(link_url: str) -> str:
    """The host to which a link goes; "" if it listens, or goes over a wire."""
    try:
        url = parse_url(link_url)
    except LinkError:
        return ""
    return url.address if url.scheme in ("udpout", "tcpout") and url.address != "0.0.0.0" else ""
