"""URLs of MAVLink links, checked before anything is opened.

    udpin://HOST:PORT       listens there and sends to the latest sender
    udpout://HOST:PORT      sends there first, from a port that the system chooses
    tcpin://HOST:PORT       a TCP server
    tcpout://HOST:PORT      a TCP client
    serial:///dev/tty:BAUD  a serial line

All programs read this grammar; their `UrlRules` state what only some of them accept.
"""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from urllib.parse import parse_qsl

from framerunner.errors import UserError

SCHEMES = ("udpin", "udpout", "tcpin", "tcpout", "serial")
MAX_PORT = 65535
_URL = re.compile(r"(?P<scheme>[a-z]+)://(?P<address>[^?]+):(?P<number>[0-9]{1,9})(?:\?(?P<options>.*))?\Z")


class LinkError(UserError):
    """A link that cannot be opened or has failed; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class UrlRules:
    """What a program accepts, and its words for error messages."""

    subject: str  # field and value in error messages; `{}` is replaced by the value
    examples: str  # of valid URLs
    takes_options: bool = False  # NAME=VALUE may follow after a `?`
    listens_on_names: bool = False  # udpin and tcpin take a host's name, not only an IP address
    devices: tuple[str, ...] = ("/",)  # prefixes of serial devices


# MAVSDK reads these too: it listens on IP addresses only, and on Windows a serial device is COM3.
DRONE = UrlRules(
    "bad drone address '{}'",
    "udpin://0.0.0.0:14540, udpout://192.168.1.10:14550, tcpout://host:5760, serial:///dev/ttyUSB0:57600",
    devices=("/", "COM", "com"),
)


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """A checked URL."""

    text: str  # as given, without spaces around it
    scheme: str  # one of `SCHEMES`
    address: str  # host, or path of a device
    number: int  # port, or baud rate
    options: tuple[tuple[str, str], ...] = ()  # names and values after the `?`; the caller checks them

    @property
    def place(self) -> tuple[str, int]:
        """Address and number."""
        return (self.address, self.number)


def parse_url(text: str, rules: UrlRules = DRONE) -> LinkUrl:
    """Check a link's URL.

    Raises:
        LinkError: one line with the field, the value and what is accepted.
    """
    text = text.strip()
    subject = rules.subject.format(text)
    match = _URL.match(text)
    if not match or match["scheme"] not in SCHEMES or (match["options"] and not rules.takes_options):
        raise LinkError(f"{subject}: not the URL of a link; examples: {rules.examples}")
    scheme, address, number = match["scheme"], match["address"], int(match["number"])
    if scheme == "serial":
        if not address.startswith(rules.devices):
            raise LinkError(f"{subject}: a serial line looks like serial:///dev/ttyUSB0:57600")
    elif not 0 < number <= MAX_PORT:
        raise LinkError(f"{subject}: port {number} must be from 1 to {MAX_PORT}")
    elif ":" in address:  # MAVSDK knows no IPv6
        raise LinkError(f"{subject}: links go by IPv4; give an IPv4 address instead of {address}")
    elif scheme in ("udpin", "tcpin") and not rules.listens_on_names and not _is_ip(address):
        raise LinkError(f"{subject}: '{address}' must be an IP address to listen on, such as 0.0.0.0")
    options = parse_qsl(match["options"] or "", keep_blank_values=True)
    return LinkUrl(text, scheme, address, number, tuple(options))


def host_and_port(text: str, default_port: int) -> tuple[str, int]:
    """Split HOST or HOST:PORT; an IPv6 address with a port is in brackets.

    Raises:
        LinkError: the port is invalid.
    """
    host, colon, port = text.rpartition(":")
    if not colon or _is_ip(_without_brackets(text)):
        return (_without_brackets(text), default_port)
    host = _without_brackets(host)
    if not host or not port.isdecimal() or not 0 < int(port) <= MAX_PORT:
        raise LinkError(f"{text}: must be a host, or host:port with a port from 1 to {MAX_PORT}")
    return (host, int(port))


def in_url(host: str, port: int) -> str:
    """Host and port as a URL has them: IPv6 in brackets, with the % of its zone escaped (RFC 6874)."""
    return f"[{host.replace('%', '%25')}]:{port}" if ":" in host else f"{host}:{port}"


def is_loopback(host: str) -> bool:
    """Whether a host is this machine's loopback address, which cannot be reached from outside."""
    return host == "localhost" or (_is_ip(host) and ipaddress.ip_address(host).is_loopback)


def _without_brackets(host: str) -> str:
    inner = host[1:-1]
    return inner if host == f"[{inner}]" and ":" in inner else host


def _is_ip(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
