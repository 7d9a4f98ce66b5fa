"""Addresses of links, `--link URL`, checked before anything is opened.

    udpout://HOST:PORT      speaks to it unasked, from a port of its own
    udpin://HOST:PORT       listens there, speaks to whoever spoke
    tcpin://HOST:PORT       a TCP server; each client is a link of its own
    tcpout://HOST:PORT      a TCP client that tries again until it is let in
    serial:///dev/tty:BAUD  a serial line

Behind a `?` may stand `streams=onboard|ground|normal` and `rate=BYTES`, what streams may take a second.
"""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass, replace
from math import inf
from urllib.parse import parse_qsl

from firmware_py.mavlink.rates import GROUND, NORMAL, ONBOARD
from wire.link import LinkProfile

SCHEMES = ("udpout", "udpin", "tcpin", "tcpout", "serial")
EXAMPLES = "udpout://192.168.1.20:14550, tcpin://127.0.0.1:5760, serial:///dev/ttyS1:57600?streams=onboard"
_URL = re.compile(r"(?P<scheme>[a-z]+)://(?P<address>[^?]*):(?P<number>\d{1,9})(?:\?(?P<query>.*))?\Z")
_PROFILES = {profile.name: profile for profile in (ONBOARD, GROUND, NORMAL)}
_MIN_RATE, _MAX_RATE = 100, 10_000_000  # bytes a second


class LinkError(OSError):
    """A link that cannot be opened; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """A checked address of a link.

    Attributes:
        text: as people wrote it; the link's name.
        scheme: one of `SCHEMES`.
        address: host, or path of a device.
        number: port, or baud rate.
        profile: its streams and how much it carries.
    """

    text: str
    scheme: str
    address: str
    number: int
    profile: LinkProfile


def parse_link(text: str) -> LinkUrl:
    """Check the address of a link.

    Raises:
        LinkError: one line that says what is wrong, with examples.
    """
    text = text.strip()
    match = _URL.match(text)
    if not match or match["scheme"] not in SCHEMES or not match["address"]:
        raise LinkError(f"--link {text}: not an address of a link; examples: {EXAMPLES}")
    scheme, address, number = match["scheme"], match["address"], int(match["number"])
    if scheme == "serial":
        if not address.startswith("/"):
            raise LinkError(f"--link {text}: a serial line looks like serial:///dev/ttyUSB0:57600")
    elif not 0 < number < 65536:
        raise LinkError(f"--link {text}: port {number} must be from 1 to 65535")
    return LinkUrl(text, scheme, address, number, _profile(text, scheme, address, number, match["query"]))


def _profile(text: str, scheme: str, address: str, number: int, query: str | None) -> LinkProfile:
    default = NORMAL if scheme == "serial" else GROUND
    # PX4's MAV_0_RATE = 0: half of what the line can do at ten bits a byte.
    rate = number / 20 if scheme == "serial" else inf
    profile = default
    for name, value in parse_qsl(query or "", keep_blank_values=True):
        if name == "streams" and value in _PROFILES:
            profile = _PROFILES[value]
        elif name == "rate" and value.isdecimal() and _MIN_RATE <= int(value) <= _MAX_RATE:
            rate = float(value)
        elif name == "rate":
            raise LinkError(f"--link {text}: rate {value} must be from {_MIN_RATE} to {_MAX_RATE} bytes/s")
        else:
            raise LinkError(
                f"--link {text}: '{name}={value}' is not known; "
                f"there are streams={'|'.join(_PROFILES)} and rate=BYTES"
            )
    trusted = scheme == "serial" or is_loopback(address)
    return replace(profile, name=text, bytes_s=rate, trusted=trusted)


def is_loopback(host: str) -> bool:
    """Whether an address is this machine's own, which nobody outside can reach or hear."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def host_and_port(text: str, default_port: int) -> tuple[str, int]:
    """Split HOST or HOST:PORT.

    Raises:
        LinkError: the port is no port.
    """
    host, colon, port = text.rpartition(":")
    if not colon:
        return (text, default_port)
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise LinkError(f"{text}: must be a host, or host:port with a port from 1 to 65535")
    return (host, int(port))
