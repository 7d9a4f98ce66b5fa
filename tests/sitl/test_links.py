"""UDP links over real sockets."""

import asyncio
import os
import socket

import pytest

from framerunner.wire.transports.urls import LinkError
from sitl.links import MAX_PEERS, UdpAddresses, UdpLink, open_udp

PACKET = bytes((0xFD, 0, 0))


def peer():
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", 0))
    sock.settimeout(2.0)
    return sock


async def test_speaks_unasked_and_hears_the_answer():
    got = []
    with peer() as station:
        link = await open_udp(UdpAddresses(("127.0.0.1", 0), station.getsockname()), got.append)
        link.send(b"hello")
        data, address = await asyncio.to_thread(station.recvfrom, 100)
        assert data == b"hello"
        station.sendto(b"answer", address)
        for _ in range(100):
            await asyncio.sleep(0.01)
            if got:
                break
        link.close()
    assert got == [b"answer"]


async def test_nobody_there_does_no_harm():
    with peer() as station:
        closed = station.getsockname()
    link = await open_udp(UdpAddresses(("127.0.0.1", 0), closed), lambda data: None)
    for _ in range(5):
        link.send(b"x")
        await asyncio.sleep(0.01)
    link.close()
    link.send(b"after close")


async def test_a_taken_port_is_said_in_one_line():
    with peer() as station:
        with pytest.raises(LinkError) as error:
            await open_udp(UdpAddresses(station.getsockname(), ("127.0.0.1", 9)), lambda data: None)
        assert str(station.getsockname()[1]) in str(error.value)
        assert "--instance" in str(error.value)
        assert "\n" not in str(error.value)


class FakeSocket:
    """Returns one datagram at a time and records the addresses that others are sent to."""

    def __init__(self):
        self.sent = []
        self.peer = None
        self.data = None
        self._pipe = os.pipe()

    def fileno(self):
        return self._pipe[0]

    def read(self):
        return self.data

    def write(self, data, to=None):
        self.sent.append(to)

    def close(self):
        for each in self._pipe:
            os.close(each)


@pytest.fixture
async def link():
    """A link with the remote "home": how it receives, its clock (s), and the targets of its next datagram."""
    now = [0.0]
    transport = FakeSocket()
    link = UdpLink(transport, ("home", 1), lambda data: None, clock=lambda: now[0])

    def receive(data, peer):
        transport.data, transport.peer = data, peer
        link._read()

    def targets():
        transport.sent.clear()
        link.send(b"")
        return transport.sent

    yield receive, now, targets
    link.close()


async def test_speaks_to_home_and_to_all_who_spoke_lately(link):
    receive, now, targets = link
    assert targets() == [("home", 1)]
    receive(PACKET, ("a", 1))
    receive(PACKET, ("home", 1))
    assert targets() == [("home", 1), ("a", 1)]
    now[0] = 3.0
    receive(PACKET, ("b", 2))
    assert targets() == [("home", 1), ("a", 1), ("b", 2)]
    now[0] = 5.1
    assert targets() == [("home", 1), ("b", 2)]
    now[0] = 8.1
    assert targets() == [("home", 1)]


async def test_what_is_not_mavlink_makes_no_peer(link):
    receive, _, targets = link
    for noise in (b"", b"GET / HTTP/1.1", bytes(20)):
        receive(noise, ("a", 1))
    assert targets() == [("home", 1)]


async def test_peers_are_few(link):
    receive, _, targets = link
    for port in range(20):
        receive(PACKET, ("a", port))
    assert len(targets()) == 1 + MAX_PEERS
