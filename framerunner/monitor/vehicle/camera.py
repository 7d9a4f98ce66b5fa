"""Where a vehicle's video is: requested from its camera, and used only if that is safe."""

from __future__ import annotations

import re
from collections.abc import Collection
from ipaddress import IPv4Address, IPv6Address, ip_address
from urllib.parse import SplitResult, urlsplit

from framerunner.wire.dialect import Message, mavlink, request_message
from framerunner.wire.session.session import Request
from framerunner.wire.simulator_api import VIDEO_PATH
from framerunner.wire.status_text import plain
from framerunner.wire.transports.urls import LinkError, in_url, parse_url

CAMERAS = range(mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_COMP_ID_CAMERA6 + 1)
_MAX_REQUESTS, _REPEAT_S = 8, 2.0
_PATH = re.compile(r"(?:/[\w-][\w.-]{0,60}){0,5}/?", re.ASCII)
_WEB_PORTS = (80, 443)
_FIRST_FREE_PORT = 1024  # lower ones belong to other services
# Of the simulator and the virtual camera on this machine: one port for each instance.
_OWN_PORTS = range(8100, 8110)


class CameraWatch:
    """Requests the URL of a vehicle's video until its camera answers.

    Args:
        link_host: the host to which the link is opened; "" if it only listens.
        confirmed: HOST or HOST:PORT that the operator allows.

    Attributes:
        url: of the MJPEG video; None: none that may be fetched.
        problem: why a URL was refused, for a notice; "" if none was.
    """

    def __init__(self, drone_id: int, link_host: str = "", confirmed: Collection[str] = ()) -> None:
        self._id = drone_id
        self._link_host = link_host
        self._confirmed = confirmed
        self._request: Request[None] | None = None
        self.url: str | None = None
        self.problem = ""

    def see(self, component: int) -> None:
        """Take a component's heartbeat; the first camera counts."""
        if component in CAMERAS and self._request is None:
            number = mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
            message = request_message(self._id, number, component)
            self._request = Request(message, lambda _: None, tries=_MAX_REQUESTS, every_s=_REPEAT_S)

    def request(self, now_s: float) -> Message | None:
        """The request to send now; None: none."""
        return None if self._request is None else self._request.due(now_s)

    def take(self, message: Message, host: str) -> None:
        """Take VIDEO_STREAM_INFORMATION from a host; the first stream that can be shown counts."""
        if self._request is not None:
            self._request.end()
        url = plain(bytes(message._uri_raw), 200)
        if self.url is not None or not url.startswith(("http:", "https:")):
            return
        problem = refusal(url, host, self._link_host, self._confirmed)
        if problem:
            self.problem = (
                f"the video at {url} is not fetched: {problem}; if it is right, start the monitor with "
                "--camera-host HOST or HOST:PORT"
            )
        else:
            self.url = url


def refusal(url: str, host: str, link_host: str = "", confirmed: Collection[str] = ()) -> str:
    """Why a URL that a vehicle sent must not be fetched; "" if it may.

    A vehicle could send any URL and make this machine request it. So it must be HTTP without a user name, at
    a host that the operator confirmed or from which the URL came, without parts that a camera does not need.
    On this machine, where packets of a remote vehicle may be forwarded and other services trust local
    clients, only the URLs of the simulator and the virtual camera are allowed.

    Args:
        url: as sent.
        host: IP address of the sender; "" on a serial line.
        link_host: the host to which the link is opened, as the operator wrote it; "" if it only listens.
        confirmed: HOST or HOST:PORT that the operator allows.
    """
    try:
        parts = urlsplit(url)
        name, port = parts.hostname or "", parts.port
    except ValueError:
        return "it is no address"
    problems = {
        "only http and https are supported": parts.scheme not in ("http", "https"),
        "it holds a user name": "@" in parts.netloc,
        "port 0 is none": port == 0,
        "it names no host": not name,
    }
    problem = next((text for text, there in problems.items() if there), "")
    if problem or {name, in_url(name, port or 0)} & {each.lower() for each in confirmed}:
        return problem
    return _more_than_needed(parts) or _other_host(name, host, link_host) or _other_service(parts)


def _more_than_needed(parts: SplitResult) -> str:
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
    return f"the drone's packets come from {host or 'an unknown host'}"


def _other_service(parts: SplitResult) -> str:
    """Why a URL of this machine must not be fetched; "" if it may, or is of another machine."""
    try:
        is_own = parts.hostname == "localhost" or _plain_address(parts.hostname or "").is_loopback
    except ValueError:
        is_own = False
    if not is_own or (parts.port in _OWN_PORTS and parts.path == VIDEO_PATH):
        return ""
    first, last = _OWN_PORTS[0], _OWN_PORTS[-1]
    return f"on this machine only {VIDEO_PATH} at ports {first} to {last} is fetched"


def _plain_address(text: str) -> IPv4Address | IPv6Address:
    """An IP address; IPv4 written as IPv6 becomes IPv4. Raises `ValueError`."""
    address = ip_address(text.partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return address if mapped is None else mapped


def host_of(link_url: str) -> str:
    """The host to which a link is opened; "" if it listens or is a serial line."""
    try:
        url = parse_url(link_url)
    except LinkError:
        return ""
    return url.address if url.scheme in ("udpout", "tcpout") and url.address != "0.0.0.0" else ""
