"""Where the simulator listens and speaks: PX4's ports, shifted by instance as PX4 shifts them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

from firmware_py.mavlink.telemetry.streams import GROUND, NORMAL, ONBOARD
from sitl.links import UdpAddresses
from wire.link import LinkProfile
from wire.signing import SigningKey
from wire.transports.sockets import Address
from wire.transports.urls import MAX_PORT, LinkError, LinkUrl, UrlRules, host_and_port, is_loopback, parse_url

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
class WantedLink:
    """A link that a person asked for.

    Attributes:
        url: where it goes.
        profile: its streams and how much it carries.
    """

    url: LinkUrl
    profile: LinkProfile


def parse_link(text: str) -> WantedLink:
    """Check `--link URL`, with `?streams=onboard|ground|normal&rate=BYTES` if wanted.

    The rate is what streams may take a second.

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
    return WantedLink(url, replace(profile, name=url.text, bytes_s=rate, trusted=trusted))


def rtp_address(text: str, instance: int) -> Address:
    """Where an instance sends its H.264, from HOST or HOST:PORT; by default two ports each from 5600.

    Raises:
        LinkError: the port is no port.
    """
    return host_and_port(text, _RTP_PORT + 2 * instance)


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """Where the simulator listens and speaks, and how fast it runs.

    Attributes:
        instance: shifts ports and the system id, as PX4's instances do.
        bind: address of all sockets.
        onboard_remote: host, or host:port, to which the onboard link (14540) speaks unasked.
        ground_remote: host, or host:port, to which the ground link (14550) speaks unasked.
        video_port: TCP port of the video; None for port 8100 plus instance.
        video_rtp: to which H.264 in RTP goes; None: nowhere.
        speed: simulated seconds a second.
        links: more links.
        signing_key: with which MAVLink is signed; None: it is not.
        storage: folder for the drones' files and logs; None: they are kept in memory.
        shell: whether the drones have a shell over MAVLink.
        camera: whether the drones tell of their camera over MAVLink.
        parameters: file that keeps changed parameters (drone 2: NAME-2.params); None: nothing does.
    """

    instance: int = 0
    bind: str = "127.0.0.1"
    onboard_remote: str = "127.0.0.1"
    ground_remote: str = "127.0.0.1"
    video_port: int | None = None
    video_rtp: Address | None = None
    speed: float = 1.0
    links: tuple[WantedLink, ...] = ()
    signing_key: SigningKey | None = None
    storage: Path | None = None
    shell: bool = False
    camera: bool = True
    parameters: Path | None = None

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
    def standing_links(self) -> tuple[tuple[LinkProfile, UdpAddresses], ...]:
        """The two links that are always there."""
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
        """Whether somebody on another machine can command the drone without a key."""
        links = [profile for profile, _ in self.standing_links] + [link.profile for link in self.links]
        return self.signing_key is None and not all(link.trusted for link in links)

    def check(self, count: int) -> None:
        """See that addresses make sense, for so many drones.

        Raises:
            LinkError: one does not.
        """
        for by in range(count):
            drone = self.shifted(by)
            ports = [addresses.remote for _, addresses in drone.standing_links]
            ports += [drone.video_rtp, *((link.url.text, link.url.number) for link in drone.links)]
            for place in ports:
                if place is not None and place[1] > MAX_PORT and not place[0].startswith("serial"):
                    raise LinkError(f"{place[0]}: port {place[1]} of drone {by + 1} is above {MAX_PORT}")

    def shifted(self, by: int) -> ServerSettings:
        """Settings of another drone of the same program: every port it opens is higher by so much."""
        if by == 0:
            return self
        return replace(
            self,
            instance=self.instance + by,
            video_port=None if self.video_port is None else self.video_port + by,
            video_rtp=None if self.video_rtp is None else (self.video_rtp[0], self.video_rtp[1] + 2 * by),
            links=tuple(_shifted(link, by) for link in self.links),
            parameters=_own_file(self.parameters, self.instance + by + 1),
        )

    def _from(self, remote: str) -> str:
        """What to listen on: from the loopback address nothing goes out to another machine."""
        return self.bind if is_loopback(remote) or not is_loopback(self.bind) else "0.0.0.0"


def _own_file(path: Path | None, system_id: int) -> Path | None:
    return None if path is None else path.with_stem(f"{path.stem}-{system_id}")


def _shifted(link: WantedLink, by: int) -> WantedLink:
    url = link.url
    return replace(link, url=replace(url, number=url.number + by)) if url.scheme in _PORT_SCHEMES else link
