"""Addresses of vehicles, checked before MAVSDK sees them, so that a fault is one clear line."""

from __future__ import annotations

import ipaddress
import re
import socket
from dataclasses import dataclass
from pathlib import Path

from offboard.drone import DroneError

SCHEMES = ("udpin", "udpout", "tcpout", "tcpin", "serial")
EXAMPLES = (
    "udpin://0.0.0.0:14540, udpout://192.168.1.10:14550, tcpout://host:5760, serial:///dev/ttyUSB0:57600"
)
_URL = re.compile(r"(?P<scheme>[a-z]+)://(?P<address>.*):(?P<number>\d+)\Z")


@dataclass(frozen=True, slots=True)
class VehicleUrl:
    """A checked address.

    Attributes:
        text: as given to MAVSDK.
        scheme: one of `SCHEMES`.
        address: host or device path.
        number: port, or baud rate of a serial line.
    """

    text: str
    scheme: str
    address: str
    number: int


def parse_url(text: str) -> VehicleUrl:
    """Check the form of an address.

    Raises:
        DroneError: with what is wrong and examples.
    """
    match = _URL.match(text.strip())
    if not match or match["scheme"] not in SCHEMES or not match["address"]:
        raise DroneError(f"bad drone address '{text}'; examples: {EXAMPLES}")
    url = VehicleUrl(text.strip(), match["scheme"], match["address"], int(match["number"]))
    if url.scheme == "serial":
        if not url.address.startswith("/") and not url.address.upper().startswith("COM"):
            raise DroneError(
                f"bad drone address '{text}'; a serial one looks like serial:///dev/ttyUSB0:57600"
            )
    elif not 0 < url.number < 65536:
        raise DroneError(f"bad drone address '{text}'; port {url.number} is not in 1..65535")
    elif url.scheme in ("udpin", "tcpin") and not _is_ip(url.address):
        raise DroneError(f"bad drone address '{text}'; listen on an IP address such as 0.0.0.0")
    return url


def check_free(url: VehicleUrl, advice: str = "give another address") -> None:
    """See that the port or device can be had.

    MAVSDK binds a UDP port that another program holds without complaint, and the last binder gets all
    packets; so the port is bound here first, exclusively, and let go.

    Args:
        url: where to listen.
        advice: for people, if the port is taken.

    Raises:
        DroneError: port taken, device missing.
    """
    if url.scheme == "udpin":
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind((url.address, url.number))
            except OSError as error:
                raise DroneError(
                    f"cannot listen on {url.text}: {error.strerror}; is another flight or ground station on "
                    f"UDP port {url.number}? Close it or {advice}"
                ) from None
    elif url.scheme == "serial" and url.address.startswith("/") and not Path(url.address).exists():
        raise DroneError(f"serial device {url.address} does not exist; is it plugged in?")


def _is_ip(address: str) -> bool:
    try:
        ipaddress.ip_address(address)
    except ValueError:
        return False
    return True
