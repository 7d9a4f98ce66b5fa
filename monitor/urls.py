"""The addresses under which people open the monitor, from this machine and from their phones."""

from __future__ import annotations

import socket
from collections.abc import Iterable
from ipaddress import IPv4Address, IPv6Address, ip_address
from urllib.parse import urlsplit

import ifaddr

from wire.transports.urls import is_loopback

# Networks within this machine, of containers and virtual machines: no phone is in them.
_VIRTUAL = ("docker", "br-", "veth", "virbr", "lxc", "lxdbr", "cni", "podman", "vmnet", "vboxnet")
_ELSEWHERE = ("192.0.2.1", 9)  # TEST-NET-1 of RFC 5737; nothing is sent there


def url_of(host: str, port: int) -> str:
    """The address of the monitor's first page."""
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def urls_for_people(host: str, port: int) -> list[str]:
    """The addresses that open the monitor, the best first.

    Args:
        host: IP address that it listens on; an unspecified one (0.0.0.0, ::) stands for all networks.
        port: TCP port.

    Returns:
        One or more; none for an unspecified `host` on a machine without a network.
    """
    if not ip_address(host).is_unspecified:
        return [url_of(host, port)]
    found = network_addresses(ifaddr.get_adapters(), _first_choice())
    usable = [each for each in found if ":" not in each or ":" in host]
    return [url_of(each, port) for each in usable]


def network_addresses(adapters: Iterable[ifaddr.Adapter], first_choice: str) -> list[str]:
    """This machine's addresses in the networks it is in.

    Args:
        adapters: its network interfaces.
        first_choice: address of the interface that leads elsewhere; "" if none does.

    Returns:
        IPv4 first, among them `first_choice`; without those that only this machine or its containers reach.
    """
    found: list[IPv4Address | IPv6Address] = []
    for adapter in adapters:
        if adapter.nice_name.startswith(_VIRTUAL):
            continue
        texts = (each.ip if isinstance(each.ip, str) else each.ip[0] for each in adapter.ips)
        found += [ip_address(text.partition("%")[0]) for text in texts]
    usable = [each for each in found if not (each.is_loopback or each.is_link_local)]
    usable.sort(key=lambda each: (each.version, str(each) != first_choice))
    return [str(each) for each in usable]


def is_for_others(host: str) -> bool:
    """Whether another machine can open the monitor that listens on this IP address."""
    return not ip_address(host).is_loopback


def urls_for_visitor(host: str, port: int, asked: str) -> list[str]:
    """As `urls_for_people`, with the name first by which somebody already opened the monitor.

    Args:
        host: as above.
        port: as above.
        asked: URL of that visitor's request.
    """
    urls = urls_for_people(host, port)
    parts = urlsplit(asked)
    theirs = f"{parts.scheme}://{parts.netloc}/"
    if is_loopback(parts.hostname or "localhost"):
        return urls
    return [theirs, *(url for url in urls if url != theirs)]


def _first_choice() -> str:
    """The address from which this machine would speak to the world; "" without a way there."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)
        except OSError:
            return ""
        return str(probe.getsockname()[0])
