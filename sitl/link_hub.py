"""Connects a vehicle's MAVLink node to its links, and bounds the processor time that their input takes."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from framerunner.wire.link import LinkProfile
from framerunner.wire.transports.sockets import Address, Stream, bind_udp, open_serial, resolved_ipv4
from framerunner.wire.transports.urls import LinkError, LinkUrl, is_loopback
from sitl.faults.link import LinkFault
from sitl.links import (
    Joined,
    Receive,
    ReconnectingLink,
    StreamLink,
    StreamLinks,
    TcpServer,
    UdpAddresses,
    UdpLink,
    connect_tcp_async,
    open_udp,
)
from sitl.server_settings import RequestedLink

_INPUT_SHARE = 0.25  # of a core
_MAX_SAVED_S = 0.004  # processor time that may be saved up while no input is received: one control period
_STEPS_A_TURN = 4  # at most about 0.4 ms
_NOTICE_PERIOD_S = 10.0


class LinkHub:
    """All links of one vehicle.

    Args:
        node: has no links yet.
        notice: called with lines for people.
        fault: called for the active fault of the link to the app, if it has one.
    """

    def __init__(
        self,
        node: MavlinkNode,
        notice: Callable[[str], None] = lambda line: None,
        fault: Callable[[], LinkFault | None] = lambda: None,
    ) -> None:
        self._node = node
        self._input = LinkInput(node, notice)
        self._fault = fault
        self._faulty: LinkFault | None = None  # as of the last update
        self._now_us = 0
        self._carriers: dict[str, list[UdpLink] | list[StreamLink]] = {}
        self._opened: list[UdpLink | StreamLinks] = []
        self._joined = 0

    async def open_udp(self, profile: LinkProfile, addresses: UdpAddresses) -> None:
        """Open a UDP link and send on it from now on.

        Raises:
            LinkError: the local port is in use or an address is wrong.
        """
        self._add(profile, [await open_udp(addresses, self._receiver(profile.name))])

    async def open_payload(self, profile: LinkProfile, addresses: UdpAddresses) -> None:
        """Open the payload link and send on it from now on.

        PX4 sends from 14280 to 14030, where a camera's program listens; MAVSDK's camera client sends to
        14030. Here the camera is in the simulator. So this link has two sockets: it sends from 14280 to
        14030, and listens on 14030 as well unless another program does. One that binds it later, as MAVSDK
        does, receives instead.

        Args:
            profile: of the link.
            addresses: PX4's; the remote's port is listened on too if the remote is this machine.

        Raises:
            LinkError: the local port is in use or an address is wrong.
        """
        receive, (host, port) = self._receiver(profile.name), addresses.bind
        links = [await open_udp(addresses, receive)]
        assert addresses.remote is not None
        remote = await asyncio.to_thread(resolved_ipv4, addresses.remote)

        def accepts(peer: Address) -> bool:
            return peer[1] != port and (not is_loopback(host) or is_loopback(peer[0]))

        if is_loopback(remote[0]):
            # Everywhere, where MAVSDK binds: a more specific address would receive before it.
            with suppress(LinkError):
                listener = bind_udp(("0.0.0.0", remote[1]), "", gives_way=True, patience_s=0.0)
                links.append(UdpLink(listener, None, receive, accepts=accepts))
        self._add(profile, links)

    def _add(self, profile: LinkProfile, links: list[UdpLink]) -> None:
        self._opened += links
        self._node.add_link(profile)
        self._carriers[profile.name] = links

    async def open(self, link: RequestedLink) -> None:
        """Open a link that the user requested.

        Raises:
            LinkError: it cannot be opened.
        """
        url, profile = link.url, link.profile
        if url.scheme == "udpout":
            here = "127.0.0.1" if is_loopback(url.address) else "0.0.0.0"
            await self.open_udp(profile, UdpAddresses((here, 0), url.place))
        elif url.scheme == "udpin":
            await self.open_udp(profile, UdpAddresses(url.place, None))
        else:
            self._opened.append(self._open_stream(url, self._joiner(profile)))

    def read(self) -> None:
        """Process waiting input, as far as there is time, and send the answers."""
        self._input.work()
        self._flush()

    def update(self, time_us: int) -> None:
        """Process waiting input, then send what is due at a vehicle time."""
        self._now_us, self._faulty = time_us, self._fault()
        if self._faulty is not None:
            for data in self._faulty.up.all(time_us):
                self._input.take(ONBOARD.name, data)
            for data in self._faulty.down.all(time_us):
                self._send(ONBOARD.name, data)
        self._input.work()
        self._node.update(time_us)
        self._flush()

    def repeat(self) -> None:
        """Send all streams again, while vehicle time stands."""
        self._node.repeat()
        self._flush()

    def _flush(self) -> None:
        for name, data in self._node.take_output():
            if self._faulty is not None and name == ONBOARD.name:
                self._faulty.down.send(self._now_us, data)
            else:
                self._send(name, data)

    def _send(self, name: str, data: bytes) -> None:
        for carrier in self._carriers[name]:
            carrier.send(data)

    def close(self) -> None:
        """Close all links."""
        for opened in self._opened:
            opened.close()

    def _open_stream(self, url: LinkUrl, joined: Joined) -> StreamLinks:
        if url.scheme == "tcpin":
            return TcpServer(url.place, joined, self._leave)
        if url.scheme == "tcpout":
            return ReconnectingLink(lambda: connect_tcp_async(url.place), joined, self._leave)

        async def open_again() -> Stream:
            return open_serial(*url.place)

        return ReconnectingLink(open_again, joined, self._leave, open_serial(*url.place))

    def _receiver(self, name: str) -> Receive:
        def receive(data: bytes) -> None:
            if self._faulty is not None and name == ONBOARD.name:
                self._faulty.up.send(self._now_us, data)
                return
            self._input.take(name, data)
            self._flush()  # answers do not wait for the next tick

        return receive

    def _joiner(self, profile: LinkProfile) -> Joined:
        def join(carrier: StreamLink) -> Receive:
            self._joined += 1
            name = f"{profile.name}#{self._joined}"
            self._node.add_link(replace(profile, name=name))
            self._carriers[name] = [carrier]
            return self._receiver(name)

        return join

    def _leave(self, carrier: StreamLink) -> None:
        for name, known in list(self._carriers.items()):
            if carrier in known:
                self._node.remove_link(name)
                del self._carriers[name]


class LinkInput:
    """Input of all links of one vehicle, processed so that a flood does not delay the control loop.

    Processing input may take a quarter of one processor core. What is received faster waits, up to 64 KiB
    a link; what exceeds that is dropped, as a late command is worse than a lost one. Links take turns, so
    a flood on one delays the input of another by milliseconds.

    Args:
        node: processes the input.
        notice: called with lines for people when input was dropped.
        clock: monotonic seconds.
        processor_clock: processor time of this thread in seconds.
    """

    def __init__(
        self,
        node: MavlinkNode,
        notice: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
        processor_clock: Callable[[], float] = time.thread_time,
    ) -> None:
        self._node = node
        self._notice = notice
        self._clock, self._processor_clock = clock, processor_clock
        self._waiting: deque[str] = deque()  # names of links with input, the next one first
        self._filled_s = clock()
        self._saved_s = _MAX_SAVED_S
        self._dropped_bytes: dict[str, int] = {}
        self._noticed_s = -_NOTICE_PERIOD_S

    def take(self, link: str, data: bytes) -> None:
        """Take bytes received on a link, and process them as far as there is time."""
        if dropped_bytes := self._node.add_input(link, data):
            self._dropped_bytes[link] = self._dropped_bytes.get(link, 0) + dropped_bytes
        if link not in self._waiting:
            self._waiting.append(link)
        self.work()

    def work(self) -> None:
        """Process waiting input, as far as there is time; to be called at every control tick."""
        now_s = self._clock()
        self._saved_s = min(_MAX_SAVED_S, self._saved_s + _INPUT_SHARE * (now_s - self._filled_s))
        self._filled_s = now_s
        waiting = self._waiting
        while waiting and self._saved_s > 0.0:
            link = waiting.popleft()
            began_s = self._processor_clock()
            if self._node.process_input(link, _STEPS_A_TURN):
                waiting.append(link)
            self._saved_s -= self._processor_clock() - began_s
        if self._dropped_bytes and now_s - self._noticed_s >= _NOTICE_PERIOD_S:
            self._noticed_s = now_s
            for link, dropped_bytes in self._dropped_bytes.items():
                self._notice(f"too much input on link {link}: {dropped_bytes} bytes dropped")
            self._dropped_bytes.clear()
