"""The simulator's addresses, links and speed: PX4's ports, shifted by instance as PX4 shifts them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

from firmware_py.mavlink.telemetry.profiles import GROUND, NORMAL, ONBOARD
from framerunner.wire.link import LinkProfile
from framerunner.wire.signing import SigningKey
from framerunner.wire.transports.sockets import Address, resolved_ipv4
from framerunner.wire.transports.urls import (
    MAX_PORT,
    LinkError,
    LinkUrl,
    UrlRules,
    host_and_port,
    is_loopback,
    parse_url,
)
from sitl.links import UdpAddresses

_LAST_ONBOARD_PORT = 14549  # PX4 sends all instances beyond the tenth there
_GROUND_PORT = 14550  # of every instance, so that one ground station sees them all
VIDEO_PORT = 8100  # 8080 is the monitor's
_RTP_PORT = 5600  # where QGroundControl listens; the one after it is for RTCP
_PORT_SCHEMES = ("udpin", "tcpin")
_LINK = UrlRules(
    "--link {}",
    "udpout://192.168.1.20:14550, tcpin://127.0.0.1:5760, serial:///dev/ttyS1:57600?streams=onboard",
    takes_options=True,
    listens_on_names=True,
)
_PROFILES = {profile.name: profile for profile in (ONBOARD, GROUND, NORMAL)}
_MIN_RATE, _MAX_RATE = 100, 10_000_000  # bytes a second


@dataclass(frozen=True, slots=True)
class RequestedLink:
    """A link that the user requested."""

    url: LinkUrl
    profile: LinkProfile  # its streams and their rate


def parse_link(text: str) -> RequestedLink:
    """Read `--link URL[?streams=onboard|ground|normal&rate=BYTES]`; the rate limits streams, bytes a second.

    Raises:
        LinkError: one line that says what is wrong, with examples.
    """
    url = parse_url(text, _LINK)
    is_serial = url.scheme == "serial"
    profile = NORMAL if is_serial else GROUND
    rate = url.number / 20 if is_serial else inf  # PX4's MAV_0_RATE = 0: half of the line, at ten bits a byte
    for name, value in url.options:
        if name == "streams" and value in _PROFILES:
            profile = _PROFILES[value]
        elif name == "rate" and value.isdecimal() and _MIN_RATE <= int(value) <= _MAX_RATE:
            rate = float(value)
        elif name == "rate":
            raise LinkError(
                f"--link {url.text}: rate {value} must be from {_MIN_RATE} to {_MAX_RATE} bytes/s"
            )
        else:
            raise LinkError(
                f"--link {url.text}: '{name}={value}' is not known; "
                f"there are streams={'|'.join(_PROFILES)} and rate=BYTES"
            )
    trusted = is_serial or is_loopback(url.address)
    return RequestedLink(url, replace(profile, name=url.text, bytes_s=rate, trusted=trusted))


def rtp_address(text: str, instance: int) -> Address:
    """The address for an instance's H.264, from HOST or HOST:PORT; by default port 5600 plus two an instance.

    Raises:
        LinkError: the port is not a port number.
    """
    return host_and_port(text, _RTP_PORT + 2 * instance)


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """The simulator's addresses, links and speed, and what its drones have."""

    instance: int = 0  # shifts ports and the system id, as PX4's instances do
    bind: str = "127.0.0.1"  # address of all sockets
    onboard_remote: str = "127.0.0.1"  # host, or host:port, that the onboard link (14540) always sends to
    ground_remote: str = "127.0.0.1"  # host, or host:port, that the ground link (14550) always sends to
    video_port: int | None = None  # TCP; None: 8100 plus instance
    video_rtp: Address | None = None  # for H.264 in RTP; None: not sent
    speed: float = 1.0  # simulated seconds a second
    links: tuple[RequestedLink, ...] = ()  # further ones
    signing_key: SigningKey | None = None  # of MAVLink; None: unsigned
    storage: Path | None = None  # folder for the drones' files and logs; None: a temporary one
    shell: bool = False  # over MAVLink
    camera: bool = True  # a MAVLink camera component
    show_layout: bool = False  # tell everybody who asks where the gates and obstacles are
    parameters: Path | None = None  # file for changed ones (drone 2: NAME-2.params); None: they are not kept

    @property
    def onboard(self) -> UdpAddresses:
        """The link for companion apps: PX4's 14580 to 14540."""
        remote = host_and_port(self.onboard_remote, min(14540 + self.instance, _LAST_ONBOARD_PORT))
        return UdpAddresses((self._from(remote[0]), 14580 + self.instance), remote)

    @property
    def ground(self) -> UdpAddresses:
        """The link for ground stations: PX4's 18570 to 14550, which is the same for all instances."""
        remote = host_and_port(self.ground_remote, _GROUND_PORT)
        return UdpAddresses((self._from(remote[0]), 18570 + self.instance), remote)

    @property
    def payload(self) -> tuple[LinkProfile, UdpAddresses] | None:
        """The link of the camera and other devices: PX4's 14280 to 14030; None without a camera.

        It has the streams of a radio, as few as PX4's link of 4 kB/s.
        """
        if not self.camera:
            return None
        here = "127.0.0.1"
        addresses = UdpAddresses((self.bind, 14280 + self.instance), (here, 14030 + self.instance))
        return replace(NORMAL, name="payload", trusted=is_loopback(self.bind)), addresses

    @property
    def default_links(self) -> tuple[tuple[LinkProfile, UdpAddresses], ...]:
        """The onboard and the ground link."""
        return tuple(
            (replace(profile, trusted=is_loopback(addresses.bind[0])), addresses)
            for profile, addresses in ((ONBOARD, self.onboard), (GROUND, self.ground))
        )

    @property
    def http_port(self) -> int:
        """TCP port of the video."""
        return VIDEO_PORT + self.instance if self.video_port is None else self.video_port

    @property
    def is_open(self) -> bool:
        """Whether another machine can command the drone without a key."""
        links = [profile for profile, _ in self.default_links] + [link.profile for link in self.links]
        return self.signing_key is None and not all(link.trusted for link in links)

    def check(self, count: int) -> None:
        """Check the address that is listened on and the ports of all drones.

        Raises:
            LinkError: there is no such IPv4 address, or a port is too large.
        """
        try:
            resolved_ipv4((self.bind, self.http_port))
        except LinkError:
            raise LinkError(
                f"--bind {self.bind}: is no IPv4 address, by which MAVLink is sent; give one of this "
                "machine, such as 127.0.0.1, or 0.0.0.0 for all networks"
            ) from None
        for by in range(count):
            drone = self.shifted(by)
            ports = [addresses.remote for _, addresses in drone.default_links]
            ports += [drone.video_rtp, *((link.url.text, link.url.number) for link in drone.links)]
            for place in ports:
                if place is not None and place[1] > MAX_PORT and not place[0].startswith("serial"):
                    raise LinkError(f"{place[0]}: port {place[1]} of drone {by + 1} is above {MAX_PORT}")

    def shifted(self, by: int) -> ServerSettings:
        """Settings of another drone of the same program: its ports and system id are higher by `by`."""
        if by == 0:
            return self
        file = self.parameters
        return replace(
            self,
            instance=self.instance + by,
            video_port=None if self.video_port is None else self.video_port + by,
            video_rtp=None if self.video_rtp is None else (self.video_rtp[0], self.video_rtp[1] + 2 * by),
            links=tuple(_shifted(link, by) for link in self.links),
            parameters=None if file is None else file.with_stem(f"{file.stem}-{self.instance + by + 1}"),
        )

    def _from(self, remote: str) -> str:
        """The local address for a remote: a socket on the loopback address cannot send to another machine."""
        return self.bind if is_loopback(remote) or not is_loopback(self.bind) else "0.0.0.0"


def _shifted(link: RequestedLink, by: int) -> RequestedLink:
    url = link.url
    return replace(link, url=replace(url, number=url.number + by)) if url.scheme in _PORT_SCHEMES else link
