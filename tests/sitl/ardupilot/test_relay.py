"""The relay of MAVLink between ArduPilot and the app, between two real sockets."""

import socket
from contextlib import ExitStack, closing

import pytest

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from framerunner.wire.transports.sockets import bind_udp
from sitl.ardupilot.relay import AppRelay
from sitl.ardupilot.sole_sender import SoleSender

APP = mavlink.MAVLink(None, srcSystem=245, srcComponent=190)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
PING = mavlink.MAVLink_ping_message(0, 7, 0, 0)
SETPOINT = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 8, 1479, *(0.0,) * 11)
TUNNEL = mavlink.MAVLink_tunnel_message(0, 0, 1, 128, bytes(range(128)))


def bound(stack):
    opened = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    opened.bind(("127.0.0.1", 0))
    opened.settimeout(5.0)
    return opened


@pytest.fixture
def places():
    """The relay, ArduPilot's socket, the app's, and what both send to."""
    with ExitStack() as stack:
        app, ardupilot = bound(stack), bound(stack)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        listening = bind_udp(("127.0.0.1", port), "")
        sender = SoleSender("ArduPilot", port, lambda line: None)
        relay = stack.enter_context(closing(AppRelay(listening, app.getsockname(), sender, 1)))
        ardupilot.connect(("127.0.0.1", port))
        ardupilot.send(b"first")
        relay.from_ardupilot()
        data, relay_place = app.recvfrom(2048)
        assert data == b"first"
        app.connect(relay_place)
        yield relay, ardupilot, app


def kinds(data):
    return [message.get_type() for message in PacketReader().feed(data)]


def test_what_the_app_sends_waits_and_is_one_datagram_with_setpoints_first(places):
    relay, ardupilot, app = places
    for message in (HEARTBEAT, TUNNEL, SETPOINT):
        app.send(message.pack(APP))
    relay.from_app()
    ardupilot.setblocking(False)
    with pytest.raises(BlockingIOError):
        ardupilot.recv(2048)
    relay.flush()
    assert kinds(ardupilot.recv(2048)) == ["SET_POSITION_TARGET_LOCAL_NED", "HEARTBEAT", "TUNNEL"]
    relay.flush()
    with pytest.raises(BlockingIOError):
        ardupilot.recv(2048)


def test_no_datagram_is_longer_than_ardupilots_buffer(places):
    relay, ardupilot, app = places
    for _ in range(7):
        app.send(TUNNEL.pack(APP))
    relay.from_app()
    relay.flush()
    read = [ardupilot.recv(2048) for _ in range(4)]
    assert sum(len(kinds(data)) for data in read) == 7
    assert max(map(len, read)) < 512


def test_a_ping_is_returned_after_what_ardupilot_has_sent_before_and_not_passed_on(places):
    relay, ardupilot, app = places
    ardupilot.send(b"attitude")
    app.send(SETPOINT.pack(APP))
    app.send(PING.pack(APP))
    relay.from_app()
    assert app.recv(2048) == b"attitude"
    (answer,) = PacketReader().feed(app.recv(2048))
    assert (answer.seq, answer.target_system, answer.target_component) == (7, 245, 190)
    assert answer.get_srcSystem() == 1
    relay.flush()
    assert kinds(ardupilot.recv(2048)) == ["SET_POSITION_TARGET_LOCAL_NED"]


def test_a_stranger_is_not_taken_for_ardupilot(places):
    relay, ardupilot, app = places
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(b"stranger", ardupilot.getpeername())
        relay.from_ardupilot()
    app.send(SETPOINT.pack(APP))
    relay.from_app()
    relay.flush()
    assert kinds(ardupilot.recv(2048)) == ["SET_POSITION_TARGET_LOCAL_NED"]
    app.setblocking(False)
    with pytest.raises(BlockingIOError):
        app.recv(2048)
