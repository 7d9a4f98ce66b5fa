"""URLs under which people open the monitor, from this machine and from their phones, and QR codes of them."""

from __future__ import annotations

import io
import socket
from collections.abc import Iterable
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import ifaddr
import segno

from framerunner.wire.transports.urls import in_url, is_loopback

if TYPE_CHECKING:
    from starlette.requests import Request

    from framerunner.monitor.server import Monitor

# Networks within this machine, of containers and virtual machines: no phone is in them.
_VIRTUAL = ("docker", "br-", "veth", "virbr", "lxc", "lxdbr", "cni", "podman", "vmnet", "vboxnet")
_ELSEWHERE = ("192.0.2.1", 9)  # TEST-NET-1 of RFC 5737; nothing is sent there
_QUIET_ZONE = 4  # modules of white around a code that the standard (ISO/IEC 18004) requires
# Not in the colours of the terminal: not every phone reads an inverted code.
_WHITE_ON_BLACK = "\x1b[97;40m"
_PLAIN = "\x1b[0m"


def url_of(host: str, port: int, scheme: str = "http") -> str:
    """URL of the monitor's first page."""
    return f"{scheme}://{in_url(host, port)}/"


def urls_for_people(host: str, port: int, scheme: str = "http") -> list[str]:
    """The URLs that open the monitor, the best first.

    Args:
        host: IP address that it listens on; an unspecified one (0.0.0.0, ::) stands for all networks.
        port: TCP port.
        scheme: http or https.

    Returns:
        One or more; none for an unspecified `host` on a machine without a network.
    """
    if not ip_address(host).is_unspecified:
        return [url_of(host, port, scheme)]
    found = network_addresses(ifaddr.get_adapters(), _default_address())
    usable = [each for each in found if ":" not in each or ":" in host]
    return [url_of(each, port, scheme) for each in usable]


def urls_for_visitor(host: str, port: int, requested: str, scheme: str = "http") -> list[str]:
    """As `urls_for_people`, but first the scheme and host of a visitor's request, unless it is loopback."""
    urls = urls_for_people(host, port, scheme)
    parts = urlsplit(requested)
    theirs = f"{parts.scheme}://{parts.netloc}/"
    if is_loopback(parts.hostname or "localhost"):
        return urls
    return [theirs, *(url for url in urls if url != theirs)]


def urls_of(monitor: Monitor, request: Request) -> list[str]:
    """The URLs that open a monitor on other machines; none if it is for this one only, or in no network."""
    if not is_for_others(monitor.place[0]):
        return []
    return urls_for_visitor(*monitor.place, str(request.url), monitor.settings.scheme)


def is_for_others(host: str) -> bool:
    """Whether another machine can open the monitor that listens on this IP address."""
    return not ip_address(host).is_loopback


def network_addresses(adapters: Iterable[ifaddr.Adapter], first: str) -> list[str]:
    """This machine's addresses that other machines can reach: IPv4 before IPv6.

    Args:
        adapters: its network interfaces.
        first: the address that is listed first, if it is there.
    """
    found: list[IPv4Address | IPv6Address] = []
    for adapter in adapters:
        if adapter.nice_name.startswith(_VIRTUAL):
            continue
        texts = (each.ip if isinstance(each.ip, str) else each.ip[0] for each in adapter.ips)
        found += [ip_address(text.partition("%")[0]) for text in texts]
    usable = [each for each in found if not (each.is_loopback or each.is_link_local)]
    usable.sort(key=lambda each: (each.version, str(each) != first))
    return [str(each) for each in usable]


def _default_address() -> str:
    """The address of the interface with the default route; "" without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)
        except OSError:
            return ""
        return str(probe.getsockname()[0])


def terminal_code(text: str) -> str:
    """A QR code as lines of half blocks, for a terminal with UTF-8 and colours."""
    lines = io.StringIO()
    segno.make_qr(text, error="l").terminal(lines, border=2, compact=True)
    return "\n".join(f"{_WHITE_ON_BLACK}{line}{_PLAIN}" for line in lines.getvalue().splitlines() if line)


def svg_code(text: str) -> str:
    """A QR code as an SVG image, black on white, that fills its container."""
    code = segno.make_qr(text, error="m")
    return str(code.svg_inline(border=_QUIET_ZONE, dark="#000", light="#fff", omitsize=True))
