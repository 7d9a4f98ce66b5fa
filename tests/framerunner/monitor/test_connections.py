"""Malicious clients: unfinished requests, too many connections, forged addresses. Real sockets."""

import asyncio
import contextlib
import socket
from collections import Counter

import aiohttp
import pytest

from framerunner.monitor.addresses import Places, visitor_key
from framerunner.monitor.settings import ConnectionLimits
from framerunner.monitor.visitors.login_limit import RateLimit
from tests.framerunner.monitor.serving import browser, serving

SAMPLE = "tests.framerunner.monitor.sample_page"
PASSWORD = "correct horse"
OTHER = "127.0.0.2"  # another client, on Linux's loopback
BODY = "Content-Type: application/x-www-form-urlencoded\r\n"


async def connected(served, head="", address="127.0.0.1"):
    """A connection from an address that has sent some of a request."""
    reader, writer = await asyncio.open_connection("127.0.0.1", served.port, local_addr=(address, 0))
    writer.write(head.encode())
    return reader, writer


async def answer_of(served, request, address="127.0.0.1"):
    """Status and all data until the server closes; status 0 without any."""
    reader, writer = await connected(served, request, address)
    async with asyncio.timeout(15):
        try:
            data = await reader.read()
        except ConnectionResetError:
            data = b""
    writer.close()
    return int(data.split(b" ")[1]) if data else 0, data.decode(errors="replace")


def get(path="/login", head=""):
    return f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n{head}\r\n"


def test_an_address_has_only_its_share_of_the_places():
    places = Places(3, 2)
    assert [places.take(address) for address in ("10.0.0.1", "::ffff:10.0.0.1")] == ["", ""]
    assert places.take("10.0.0.1") == "2 are connected from 10.0.0.1; no more can"
    assert places.take("2001:db8::1") == ""
    assert places.take("10.0.0.2") == "3 are connected; no more can"
    places.give_back("10.0.0.1")
    assert places.take("10.0.0.1") == ""
    assert len(places) == 3
    assert visitor_key("2001:db8::1") == visitor_key("2001:db8::2") != visitor_key("2001:db8:0:1::2")


@pytest.mark.parametrize("head", ["", "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n", "GET /a"])
async def test_a_head_that_does_not_end_is_closed_although_bytes_are_sent(monkeypatch, head):
    async with serving(monkeypatch, limits=ConnectionLimits(head_s=0.5)) as served:
        reader, writer = await connected(served, head)
        data = b""
        async with asyncio.timeout(15):
            while not reader.at_eof():
                with contextlib.suppress(OSError):
                    writer.write(b"X" if head else b"")
                with contextlib.suppress(TimeoutError, ConnectionResetError):
                    data += await asyncio.wait_for(reader.read(1000), 0.1)
        assert data.startswith(b"HTTP/1.1 408 ") if head else not data
        writer.close()


async def test_a_second_request_on_a_connection_has_a_deadline_too(monkeypatch):
    async with serving(monkeypatch, limits=ConnectionLimits(head_s=0.5, keep_alive_s=1)) as served:
        reader, writer = await connected(served, "GET /static/shell.css HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        async with asyncio.timeout(15):
            head = await reader.readuntil(b"\r\n\r\n")
            length = next(line for line in head.lower().split(b"\r\n") if line.startswith(b"content-length"))
            await reader.readexactly(int(length.partition(b":")[2]))
            writer.write(b"GET / HTTP/1.1\r\n")
            assert (await reader.read())[:13] in (b"HTTP/1.1 408 ", b"")
        writer.close()


async def test_an_endless_head_is_refused(monkeypatch):
    async with serving(monkeypatch, limits=ConnectionLimits(head_bytes=2000)) as served:
        reader, writer = await connected(served, "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        async with asyncio.timeout(15):
            data = b""
            with contextlib.suppress(ConnectionError):
                while not data:  # or until the connection ends
                    writer.write(b"X-A: " + b"a" * 1000 + b"\r\n")
                    await writer.drain()
                    with contextlib.suppress(TimeoutError):
                        data = await asyncio.wait_for(reader.read(1000), 0.02)
                assert data.startswith(b"HTTP/1.1 431 ")
        writer.close()
        assert (await answer_of(served, get()))[0] == 200


async def test_a_body_that_is_not_sent_times_out(monkeypatch):
    async with serving(monkeypatch, limits=ConnectionLimits(body_s=0.5)) as served:
        head = f"POST /login HTTP/1.1\r\nHost: 127.0.0.1\r\n{BODY}Content-Length: 100\r\n\r\nname="
        status, text = await answer_of(served, head)
        assert status == 408
        assert "no whole body within 0.5 s" in text


@pytest.mark.parametrize(
    ("request_head", "status"),
    [
        (f"POST /login HTTP/1.1\r\n{BODY}Content-Length: 70000", 413),
        (f"POST /login HTTP/1.1\r\n{BODY}Content-Length: {'9' * 15}", 413),
        (f"GET /login HTTP/1.1\r\n{BODY}Content-Length: 1", 413),
        (f"GET /login HTTP/1.1\r\n{BODY}Transfer-Encoding: chunked", 413),
        ("POST /judges-only HTTP/1.1\r\nContent-Type: application/json\r\nContent-Length: 60000", 403),
        ("POST /api/competition/teams HTTP/1.1\r\nContent-Type: application/json\r\nContent-Length: 9", 403),
    ],
)
async def test_a_request_is_refused_before_its_body_is_read(monkeypatch, request_head, status):
    async with serving(monkeypatch, SAMPLE, "framerunner.monitor.competition.api") as served:
        reader, writer = await connected(served, f"{request_head}\r\nHost: 127.0.0.1\r\n\r\n")
        async with asyncio.timeout(15):
            assert (await reader.readline()).startswith(f"HTTP/1.1 {status} ".encode())
        writer.close()


async def test_one_address_cannot_take_all_connections(monkeypatch):
    async with serving(monkeypatch, limits=ConnectionLimits(per_address=5)) as served:
        held = [await connected(served, "GET / HTTP/1.1\r\n") for _ in range(5)]
        status, text = await answer_of(served, get())
        assert status == 503
        assert "5 are connected from 127.0.0.1" in text
        assert (await answer_of(served, get(), OTHER))[0] == 200
        for _, writer in held:
            writer.close()
        async with asyncio.timeout(15):
            while (await answer_of(served, get()))[0] != 200:  # noqa: ASYNC110
                await asyncio.sleep(0.05)


async def test_one_address_cannot_take_all_places_of_viewers(monkeypatch):
    for limit in ("live_channel.MAX_VIEWERS_PER_ADDRESS", "competition.api.MAX_WATCHERS_PER_ADDRESS"):
        monkeypatch.setattr(f"framerunner.monitor.{limit}", 2)
    async with serving(monkeypatch, "framerunner.monitor.competition.api") as served, browser() as client:
        elsewhere = aiohttp.TCPConnector(local_addr=(OTHER, 0))
        async with aiohttp.ClientSession(connector=elsewhere) as other:
            for path in ("ws/live", "ws/competition"):
                viewers = [await client.ws_connect(served.url + path) for _ in range(3)]
                viewers.append(await other.ws_connect(served.url + path))
                closed = Counter()
                for viewer in viewers:
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(viewer.receive(), 5)
                    closed[viewer.close_code] += 1
                assert closed == {None: 3, 1013: 1}
                assert viewers[2].close_code == 1013
                await viewers[0].close()


async def test_a_client_that_does_not_read_is_disconnected(monkeypatch):
    async with serving(monkeypatch, limits=ConnectionLimits(stalled_s=0.5)) as served:
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        with client:
            client.connect(("127.0.0.1", served.port))
            client.settimeout(10)
            request = "GET /static/shell.css HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 2000
            await asyncio.to_thread(client.sendall, request.encode())
            await asyncio.sleep(1.5)
            got = await asyncio.to_thread(read_all, client)
            assert 0 < got.count(b"HTTP/1.1 200 OK") < 2000


def read_all(client):
    """All data until the connection ends."""
    data = bytearray()
    with contextlib.suppress(ConnectionResetError):
        while part := client.recv(1 << 16):
            data += part
    return data


async def logged_in(served, head):
    """The cookie that a log-in sets."""
    form = f"name=Ada&secret={PASSWORD.replace(' ', '+')}"
    text = f"POST /login HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n{head}{BODY}"
    status, answer = await answer_of(served, f"{text}Content-Length: {len(form)}\r\n\r\n{form}")
    assert status == 303, answer
    return next(line for line in answer.lower().split("\r\n") if line.startswith("set-cookie"))


async def test_the_cookie_is_secure_if_a_trusted_proxy_reports_tls(monkeypatch):
    said = "X-Forwarded-For: 10.0.0.7\r\nX-Forwarded-Proto: https\r\n"
    for proxies, secure in (((), False), (("127.0.0.1",), True), (("10.0.0.0/8",), False)):
        async with serving(monkeypatch, bind="0.0.0.0", password=PASSWORD, trusted_proxies=proxies) as served:
            assert ("; secure" in await logged_in(served, said)) is secure
            assert "; secure" not in await logged_in(served, "")


async def guesses(served, forwarded):
    """Guess the password once; the status."""
    form = "name=Eve&secret=guess+guess"
    head = f"POST /login HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nX-Forwarded-For: {forwarded}\r\n"
    return (await answer_of(served, f"{head}{BODY}Content-Length: {len(form)}\r\n\r\n{form}"))[0]


async def test_behind_a_proxy_the_true_address_counts_and_a_forged_one_does_not(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.visitors.login_limit.ONE_ADDRESS", RateLimit(2, 1000.0))
    more = {"bind": "0.0.0.0", "password": PASSWORD}
    async with serving(monkeypatch, trusted_proxies=("127.0.0.1",), **more) as served:
        # What a client forges stands before what the proxy adds.
        tries = [await guesses(served, f"10.9.9.{number}, 10.0.0.7") for number in range(3)]
        assert tries == [403, 403, 429]
        assert await guesses(served, "10.0.0.8") == 403
    async with serving(monkeypatch, **more) as served:
        assert [await guesses(served, f"10.9.9.{number}") for number in range(3)] == [403, 403, 429]


async def test_a_proxy_s_connections_are_not_counted_but_its_clients_requests_are(monkeypatch):
    limits = ConnectionLimits(per_address=2)
    async with (
        serving(monkeypatch, limits=limits, trusted_proxies=("127.0.0.1",)) as served,
        browser() as client,
    ):
        url = served.url + "ws/live"
        held = [
            await client.ws_connect(url, headers={"X-Forwarded-For": f"10.0.0.{number}"})
            for number in (1, 2, 3, 1)
        ]
        with pytest.raises(aiohttp.WSServerHandshakeError):
            await client.ws_connect(url, headers={"X-Forwarded-For": "10.0.0.1"})
        async with client.get(served.url + "login", headers={"X-Forwarded-For": "10.0.0.1"}) as answer:
            assert answer.status == 429
            assert "2 are connected from 10.0.0.1" in await answer.text()
        assert not any(each.closed for each in held)


@pytest.mark.parametrize(
    ("proxies", "head", "status"),
    [
        ((), "", 200),
        ((), "X-Forwarded-For: 127.0.0.1\r\n", 403),  # a proxy that was not configured
        ((), "Forwarded: for=127.0.0.1\r\n", 403),
        (("127.0.0.1",), "X-Forwarded-For: 127.0.0.1\r\n", 403),
        (("127.0.0.1",), "X-Forwarded-For: 10.0.0.7\r\n", 403),
        (("127.0.0.1",), "", 403),
    ],
)
async def test_a_header_makes_no_client_local(monkeypatch, proxies, head, status):
    async with serving(monkeypatch, SAMPLE, trusted_proxies=proxies) as served:
        request = f"POST /pilots-only HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n{head}\r\n"
        assert (await answer_of(served, request))[0] == status
