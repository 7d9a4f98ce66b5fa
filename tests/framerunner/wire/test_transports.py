"""URLs of links, and sockets that never block."""

import socket
import threading

import pytest

from framerunner.wire.transports.sockets import (
    MAX_DATAGRAMS_AT_ONCE,
    MAX_UNSENT_BYTES,
    OneClient,
    Stream,
    bind_udp,
    check_free,
    connect_tcp,
    connect_udp,
    listen_tcp,
)
from framerunner.wire.transports.urls import (
    LinkError,
    LinkUrl,
    UrlRules,
    host_and_port,
    in_url,
    is_loopback,
    parse_url,
)
from tests.processes import bound


@pytest.mark.parametrize(
    "text",
    [
        "udpin://0.0.0.0:14540",
        "udpout://192.168.1.10:14550",
        "tcpout://localhost:5760",
        "serial:///dev/ttyUSB0:57600",
    ],
)
def test_good_addresses(text):
    assert parse_url(f" {text} ").text == text


@pytest.mark.parametrize(
    "text",
    [
        "",
        "14540",
        "udp://:14540",
        "udpin://:14540",
        "udpin://0.0.0.0",
        "udpin://0.0.0.0:0",
        "udpin://0.0.0.0:99999",
        "udpin://localhost:14540",
        "http://0.0.0.0:80",
        "serial://ttyUSB0:57600",
        "udpin://0.0.0.0:14540x",
        "udpin://0.0.0.0:14540?streams=onboard",
    ],
)
def test_bad_addresses_are_named(text):
    with pytest.raises(LinkError, match=r"^bad drone address '") as caught:
        parse_url(text)
    assert f"'{text}'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_program_has_rules_for_what_it_accepts():
    rules = UrlRules("--at {}", "tcpin://a:1", takes_options=True, listens_on_names=True)
    url = parse_url("tcpin://localhost:1?a=b&c=", rules)
    assert url == LinkUrl("tcpin://localhost:1?a=b&c=", "tcpin", "localhost", 1, (("a", "b"), ("c", "")))
    with pytest.raises(LinkError, match=r"^--at x: not the URL of a link; examples: tcpin://a:1$"):
        parse_url("x", rules)
    with pytest.raises(LinkError, match=r"^--at serial://COM3:57600: a serial line looks like"):
        parse_url("serial://COM3:57600", rules)
    assert parse_url("serial://COM3:57600").address == "COM3"


def test_hosts_with_and_without_port():
    assert host_and_port("station", 14550) == ("station", 14550)
    assert host_and_port("10.0.0.1:14999", 14550) == ("10.0.0.1", 14999)
    assert host_and_port("::1", 14550) == host_and_port("[::1]", 14550) == ("::1", 14550)
    assert host_and_port("[fe80::1%eth0]:14999", 14550) == ("fe80::1%eth0", 14999)
    for bad in ("a:", ":5", "a:b", "a:70000", "a:0"):
        with pytest.raises(LinkError):
            host_and_port(bad, 14550)


def test_hosts_in_urls():
    assert in_url("10.0.0.1", 8100) == "10.0.0.1:8100"
    assert in_url("::1", 8100) == "[::1]:8100"
    assert in_url("fe80::1%eth0", 8100) == "[fe80::1%25eth0]:8100"


@pytest.mark.parametrize("url", ["udpin://[::1]:1", "udpin://::1:1", "udpout://[::1]:1", "tcpout://[::1]:1"])
def test_ipv6_is_refused_because_mavsdk_does_not_know_it(url):
    with pytest.raises(LinkError, match=r"links go by IPv4; give an IPv4 address instead of \[?::1"):
        parse_url(url)


@pytest.mark.parametrize(
    ("host", "own"), [("127.0.0.2", True), ("::1", True), ("0.0.0.0", False), ("x", False)]
)
def test_loopback(host, own):
    assert is_loopback(host) is own


def test_a_missing_serial_device_is_reported():
    with pytest.raises(LinkError, match=r"/dev/ttyNONE9 cannot be opened .*; is it plugged in"):
        check_free(parse_url("serial:///dev/ttyNONE9:57600"), "")


def connected():
    with listen_tcp(("127.0.0.1", 0)) as listener:
        client = connect_tcp(listener.getsockname())
        return client, Stream.of(*listener.accept())


def test_what_is_not_read_waits_up_to_a_limit_and_is_then_lost_whole():
    client, server = connected()
    packet = bytes(range(256)) * 4
    for _ in range(10_000):
        client.write(packet)
    assert client.has_unsent()
    assert len(client._unsent) <= MAX_UNSENT_BYTES
    received = bytearray()
    while (data := server.read()) or client.has_unsent():
        received += data or b""
        client.flush()
    assert received == packet * (len(received) // len(packet))
    client.close()
    with pytest.raises(ConnectionResetError, match="the other side closed the connection"):
        server.read()
    server.write(packet)  # to nobody
    server.write(packet)
    assert not server.has_unsent()
    server.close()


def test_one_client_after_the_other():
    server = OneClient(listen_tcp(("127.0.0.1", 0)))
    place = server._listener.getsockname()
    assert server.read() is None
    server.write(b"to nobody")
    first, second = connect_tcp(place), connect_tcp(place)
    assert server.read() is None  # lets the first in
    first.write(b"a")
    second.write(b"b")
    assert (server.read(), server.read()) == (b"a", None)
    server.write(b"c")
    assert first.read() == b"c"
    first.close()
    assert (server.read(), server.read(), server.read()) == (None, None, b"b")
    second.close()
    server.close()


@pytest.mark.parametrize("kind", [socket.SOCK_DGRAM, socket.SOCK_STREAM])
def test_a_port_that_another_program_only_tries_is_opened_a_moment_later(kind):
    """Programs find a free instance by binding its ports, while a simulator may be about to open them."""
    with bound(0, kind) as trying:
        place = trying.getsockname()
        opens = bind_udp if kind == socket.SOCK_DGRAM else listen_tcp
        with pytest.raises(LinkError, match="in use"):
            opens(place, "", patience_s=0.0)
        threading.Timer(0.1, trying.close).start()
        opens(place, "", patience_s=10.0).close()


def test_of_a_flood_of_datagrams_so_many_are_read_at_once():
    listening = bind_udp(("127.0.0.1", 0), "")
    place = listening._socket.getsockname()
    first, other = connect_udp(place), connect_udp(place)
    assert listening.read_all() == []
    first.write(b"a")
    other.write(b"")  # is a datagram, too
    for number in range(1, MAX_DATAGRAMS_AT_ONCE):
        other.write(bytes([number]))
    read = listening.read_all()
    assert read[:2] == [(b"a", first._socket.getsockname()), (b"", other._socket.getsockname())]
    assert len(read) == MAX_DATAGRAMS_AT_ONCE
    assert [data for data, _ in listening.read_all()] == [bytes([MAX_DATAGRAMS_AT_ONCE - 1])]
    for each in (listening, first, other):
        each.close()


def test_a_datagram_behind_the_refusal_of_one_that_was_sent_is_read():
    listening = bind_udp(("127.0.0.1", 0), "")
    place = listening._socket.getsockname()
    client = connect_udp(place)
    mine = client._socket.getsockname()
    listening.close()
    client.write(b"to nobody")  # refused, which the next call reports
    again = bind_udp(place, "")
    again.write(b"a", mine)
    assert (client.read(), client.read()) == (b"a", None)
    for each in (client, again):
        each.close()
