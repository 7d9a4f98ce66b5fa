"""A drone's links over real sockets and a pair of pseudo terminals."""

import asyncio
import os
import pty
from contextlib import asynccontextmanager

import pytest

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.node import MavlinkNode
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from framerunner.wire.transports.sockets import MAX_UNSENT_BYTES
from framerunner.wire.transports.urls import LinkError
from sitl.link_hub import LinkHub
from sitl.server_settings import parse_link
from tests.free_ports import free_port
from tests.processes import bound

STATION = mavlink.MAVLink(None, 255, 190)
BEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
REQUEST = mavlink.MAVLink_param_request_read_message(1, 1, b"MAV_SYS_ID", -1)


class Drone:
    """A node with its hub; its time advances when a test says so."""

    def __init__(self):
        autopilot = Autopilot(load_airframe("abejorro"), GeodeticPoint(47.0, 8.0, 400.0))
        self.node = MavlinkNode(autopilot, ())
        self.hub = LinkHub(self.node)
        self.time_us = 0

    def pass_time(self):
        self.time_us += 100_000
        self.hub.update(self.time_us)


@asynccontextmanager
async def drone_with(*urls):
    drone = Drone()
    try:
        for url in urls:
            await drone.hub.open(parse_link(url))
        yield drone
    finally:
        drone.hub.close()
        await asyncio.sleep(0.01)


async def heard(drone, read, kind, message=BEAT):
    """Send a message and wait for a kind of message; `read` returns received bytes, or b""."""
    reader = PacketReader()
    for _ in range(300):
        drone.pass_time()
        await asyncio.sleep(0.005)
        for got in reader.feed(read()):
            if got.get_type() == kind and got.get_srcSystem() == 1:
                return got
    raise AssertionError(f"no {kind}")


class TcpPeer:
    def __init__(self, reader, writer):
        self._reader, self.writer = reader, writer
        self._data = bytearray()
        self.task = asyncio.create_task(self._run())

    async def _run(self):
        while data := await self._reader.read(4096):
            self._data += data

    def read(self):
        data, self._data = bytes(self._data), bytearray()
        return data

    def send(self, message, packer=STATION):
        self.writer.write(message.pack(packer))

    def leave(self):
        self.writer.close()


async def tcp_peer(port):
    return TcpPeer(*await asyncio.open_connection("127.0.0.1", port))


async def test_tcp_clients_come_ask_and_go():
    port = free_port()
    async with drone_with(f"tcpin://127.0.0.1:{port}") as drone:
        first, second = await tcp_peer(port), await tcp_peer(port)
        first.send(REQUEST)
        value = await heard(drone, first.read, "PARAM_VALUE")
        assert value.param_id == "MAV_SYS_ID"
        await heard(drone, second.read, "HEARTBEAT")
        first.leave()
        for _ in range(20):
            drone.pass_time()
            await asyncio.sleep(0.005)
        assert len(drone.hub._carriers) == 1
        await heard(drone, second.read, "HEARTBEAT")
        second.leave()


async def test_tcp_clients_hear_each_other():
    port = free_port()
    async with drone_with(f"tcpin://127.0.0.1:{port}") as drone:
        first, second = await tcp_peer(port), await tcp_peer(port)
        first.send(BEAT)
        await asyncio.sleep(0.05)
        app = mavlink.MAVLink(None, 245, 191)
        packet = bytes(BEAT.pack(app))
        second.writer.write(packet)
        for _ in range(100):
            await asyncio.sleep(0.01)
            if packet in first._data:
                break
        assert packet in first._data
        assert packet not in second._data
        drone.pass_time()
        first.leave()
        second.leave()


async def test_a_tcp_client_connects_when_the_server_comes_and_again_when_it_was_gone(monkeypatch):
    monkeypatch.setattr("sitl.links.RETRY_S", 0.02)
    port = free_port()
    async with drone_with(f"tcpout://127.0.0.1:{port}") as drone:
        for _ in range(2):
            peers = []
            server = await asyncio.start_server(
                lambda r, w, to=peers: to.append(TcpPeer(r, w)), "127.0.0.1", port
            )
            for _ in range(300):
                await asyncio.sleep(0.01)
                if peers:
                    break
            await heard(drone, peers[0].read, "HEARTBEAT")
            server.close()
            peers[0].leave()
            await asyncio.sleep(0.05)


async def test_a_choked_tcp_client_costs_nothing_but_its_packets():
    port = free_port()
    async with drone_with(f"tcpin://127.0.0.1:{port}") as drone:
        _, writer = await asyncio.open_connection("127.0.0.1", port, limit=1024)
        await asyncio.sleep(0.05)
        for _ in range(3000):
            drone.pass_time()
            if drone.time_us % 10_000_000 == 0:
                await asyncio.sleep(0)
        ((carrier,),) = drone.hub._carriers.values()
        assert len(carrier._stream._unsent) <= MAX_UNSENT_BYTES
        writer.close()


async def test_udp_in_answers_who_speaks():
    port = free_port()
    async with drone_with(f"udpin://127.0.0.1:{port}") as drone:
        with bound(0) as station:
            station.setblocking(False)
            station.sendto(BEAT.pack(STATION), ("127.0.0.1", port))

            def read():
                try:
                    return station.recv(4096)
                except BlockingIOError:
                    return b""

            await heard(drone, read, "HEARTBEAT")


async def test_udp_out_speaks_first():
    with bound(0) as station:
        station.setblocking(False)
        async with drone_with(f"udpout://127.0.0.1:{station.getsockname()[1]}") as drone:
            drone.pass_time()
            for _ in range(100):
                await asyncio.sleep(0.01)
                try:
                    assert station.recv(4096)[0] == 0xFD
                    return
                except BlockingIOError:
                    drone.pass_time()
    raise AssertionError("nothing was received")


async def test_a_tcp_client_is_heard_after_a_megabyte_of_noise():
    port = free_port()
    async with drone_with(f"tcpin://127.0.0.1:{port}") as drone:
        peer = await tcp_peer(port)
        for _ in range(20):
            peer.writer.write(b"\xfe" * 50_000)
            drone.pass_time()
            await asyncio.sleep(0.005)
        peer.send(REQUEST)
        assert (await heard(drone, peer.read, "PARAM_VALUE")).param_id == "MAV_SYS_ID"
        peer.leave()


async def test_a_serial_line_carries_both_ways():
    ours, theirs = pty.openpty()
    os.set_blocking(ours, False)

    def read():
        try:
            return os.read(ours, 4096)
        except BlockingIOError:
            return b""

    async with drone_with(f"serial://{os.ttyname(theirs)}:57600") as drone:
        assert (await heard(drone, read, "HEARTBEAT")).autopilot == mavlink.MAV_AUTOPILOT_PX4
        os.write(ours, bytes(REQUEST.pack(STATION)))
        assert (await heard(drone, read, "PARAM_VALUE")).param_id == "MAV_SYS_ID"
    os.close(ours)
    os.close(theirs)


async def test_a_serial_line_that_was_gone_is_opened_again(monkeypatch, tmp_path):
    monkeypatch.setattr("sitl.links.RETRY_S", 0.02)
    device = tmp_path / "tty"

    def plug_in():
        ours, theirs = pty.openpty()
        os.set_blocking(ours, False)
        device.unlink(missing_ok=True)
        device.symlink_to(os.ttyname(theirs))
        return ours, theirs

    def read(ours):
        try:
            return os.read(ours, 4096)
        except BlockingIOError:
            return b""

    line = plug_in()
    async with drone_with(f"serial://{device}:57600") as drone:
        await heard(drone, lambda: read(line[0]), "HEARTBEAT")
        device.unlink()  # as an adapter's; else it may soon name the terminal of another program
        os.close(line[0])
        os.close(line[1])
        await asyncio.sleep(0.1)
        assert drone.hub._carriers == {}
        line = plug_in()
        await heard(drone, lambda: read(line[0]), "HEARTBEAT")
    os.close(line[0])
    os.close(line[1])


async def test_only_so_many_tcp_clients_are_let_in():
    port = free_port()
    async with drone_with(f"tcpin://127.0.0.1:{port}") as drone:
        peers = [await tcp_peer(port) for _ in range(17)]
        async with asyncio.timeout(5):
            await asyncio.wait([peer.task for peer in peers], return_when=asyncio.FIRST_COMPLETED)
        assert len(drone.hub._carriers) == 16
        for peer in peers:
            peer.leave()


@pytest.mark.parametrize(
    ("url", "complaint"),
    [
        ("serial:///dev/null:57600", "not a serial line"),
        ("serial:///dev/not-there:57600", "No such file"),
        ("serial:///dev/null:57601", "baud rate"),
        ("tcpin://192.0.2.1:5760", "192.0.2.1:5760 cannot be listened on (Cannot assign requested address);"),
    ],
)
async def test_a_link_that_cannot_be_opened_is_reported_in_one_line(url, complaint):
    with pytest.raises(LinkError) as error:
        async with drone_with(url):
            pass
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)


async def test_a_taken_tcp_port_is_said():
    port = free_port()
    async with drone_with(f"tcpin://127.0.0.1:{port}"):
        with pytest.raises(LinkError, match=f"{port} cannot be listened on .*; choose another port"):
            async with drone_with(f"tcpin://127.0.0.1:{port}"):
                pass
