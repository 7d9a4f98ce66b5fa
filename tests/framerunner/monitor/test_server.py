import asyncio
import json
import re
import socket

import aiohttp
import pytest

from framerunner.monitor.pages.static_files import STATIC
from framerunner.monitor.settings import ConnectionLimits, MonitorError, MonitorSettings
from tests.framerunner.monitor.sample_page import EVIL
from tests.framerunner.monitor.serving import browser, serving

SAMPLE = "tests.framerunner.monitor.sample_page"
MAX_BODY_BYTES = ConnectionLimits().body_bytes


async def test_a_page_has_frame_data_and_headers(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client, client.get(served.url) as answer:
        text = await answer.text()
        assert answer.status == 200
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["X-Frame-Options"] == "DENY"
        assert "Server" not in answer.headers
    assert '<a href="/" aria-current="page">Live</a>' in text
    assert EVIL not in text
    data = re.search(r'<script type="application/json" id="page-data">(.*?)</script>', text)[1]
    assert json.loads(data) == {"text": EVIL, "judge": False}


async def test_the_policy_allows_nothing_inline(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        for path in ("", "login"):
            async with client.get(served.url + path) as answer:
                policy, text = answer.headers["Content-Security-Policy"], await answer.text()
            assert "default-src 'none'" in policy
            assert "script-src 'self'; style-src 'self';" in policy
            assert "unsafe" not in policy
            assert (
                re.search(r"<style|\sstyle=|\son\w+=|<script(?![^>]*(src=|application/json))", text) is None
            )


async def test_all_addresses_in_a_page_are_served_locally(monkeypatch):
    """The page works offline: every address in it is one of ours and is answered."""
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        text = await (await client.get(served.url)).text()
        addresses = re.findall(r'(?:src|href)="([^"#]+)"|url\("([^"]+)"\)', text)
        own = {first or second for first, second in addresses} - {
            "/chart",
            "/edit",
            "/course",
            "/pilot",
            "/operator",
            "/competition",
            "/ranking",
            "/stage",
            "/replay",
        }
        assert len(own) == 5  # icon, style, two scripts of which one stands for both, log-in
        assert all(address.startswith("/") and not address.startswith("//") for address in own)
        for address in sorted(own):
            async with client.get(served.url.rstrip("/") + address) as answer:
                assert answer.status == 200, address


async def test_files_are_compressed_and_revalidated_or_named_by_their_content(monkeypatch):
    async with serving(monkeypatch) as served, browser() as client:
        async with client.get(served.url + "static/shell.css") as answer:
            assert answer.headers["Cache-Control"] == "no-cache"
            assert answer.headers["Content-Encoding"] == "gzip"
            assert await answer.read() == (STATIC / "shell.css").read_bytes()
            tag = answer.headers["ETag"]
        async with client.get(served.url + "static/shell.css", headers={"If-None-Match": tag}) as answer:
            assert answer.status == 304
        async with client.get(
            served.url + "static/shell.css", headers={"Accept-Encoding": "identity"}
        ) as answer:
            assert "Content-Encoding" not in answer.headers
            assert await answer.read() == (STATIC / "shell.css").read_bytes()
        scene = next((STATIC / "chunks").glob("scene-*.js"))
        async with client.get(f"{served.url}static/chunks/{scene.name}") as answer:
            assert "javascript" in answer.headers["Content-Type"]
            assert "immutable" in answer.headers["Cache-Control"]
            assert await answer.read() == scene.read_bytes()
        async with client.get(served.url + "static/..%2f..%2fpyproject.toml") as answer:
            assert answer.status == 404


FOREIGN = (
    {"Host": "evil.example"},
    {"Host": "127.0.0.1.evil.example:80"},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:1"},
)


async def test_foreign_names_and_pages_are_refused(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        for path in ("", "ws/live", "static/shell.js"):
            for headers in FOREIGN:
                async with client.get(served.url + path, headers=headers) as answer:
                    assert answer.status == 403, (path, headers)
                    assert (await answer.text()).count("\n") == 1
                with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                    await client.ws_connect(served.url + path, headers=headers)
                assert refused.value.status == 403, (path, headers)


async def test_own_host_names_are_accepted(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        for host in (f"localhost:{served.port}", "[::1]:8080", "127.0.0.1"):
            headers = {"Host": host, "Origin": f"http://{host}"}
            async with client.get(served.url, headers=headers) as answer:
                assert answer.status == 200
            async with client.ws_connect(served.url + "ws/live", headers=headers) as live:
                assert (await live.receive_json())["kind"] == "world"


async def test_any_host_name_is_accepted_from_another_machine(monkeypatch):
    async with serving(monkeypatch, SAMPLE, bind="0.0.0.0") as served, browser() as client:
        url = f"http://127.0.0.1:{served.port}/"
        async with client.get(url, headers={"Host": "laptop.local:8080"}) as answer:
            assert answer.status == 200
        async with client.get(url, headers={"Host": "a.example", "Origin": "http://b.example"}) as answer:
            assert answer.status == 403


async def test_a_form_of_another_site_is_refused_even_without_origin(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        async with client.post(served.url + "size", headers={"Sec-Fetch-Site": "cross-site"}) as answer:
            assert answer.status == 403
        async with client.get(served.url, headers={"Sec-Fetch-Site": "cross-site"}) as answer:
            assert answer.status == 200  # somebody followed a link


async def pieces(count):
    for _ in range(count):
        yield b"x" * (MAX_BODY_BYTES // 4)


async def test_bodies_are_limited_whether_announced_or_not(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        async with client.post(served.url + "size", data=b"x" * MAX_BODY_BYTES) as answer:
            assert await answer.json() == MAX_BODY_BYTES
        async with client.post(served.url + "size", data=pieces(4)) as answer:
            assert await answer.json() == MAX_BODY_BYTES
        async with client.post(served.url + "size", data=pieces(5)) as answer:
            assert answer.status == 413
        head = f"POST /size HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {MAX_BODY_BYTES + 1}\r\n\r\n"
        reader, writer = await asyncio.open_connection("127.0.0.1", served.port)
        writer.write(head.encode())
        assert b" 413 " in await asyncio.wait_for(reader.readline(), 10)
        writer.close()


async def test_a_taken_port_is_reported_in_one_line(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(MonitorError) as refused:
            async with serving(monkeypatch, port=port):
                pass
    assert str(refused.value) == (
        f"monitor: cannot listen on 127.0.0.1 port {port}: address already in use; choose another with --port"
    )


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (MonitorSettings(judge_password="short"), "FRAMERUNNER_JUDGE_PASSWORD has 5 characters"),
        (MonitorSettings(port=70000), "--port 70000: must be from 0 to 65535"),
        (MonitorSettings(bind=" "), "--bind is empty"),
        (
            MonitorSettings(trusted_proxies=("proxy.local",)),
            "--trusted-proxy 'proxy.local': must be",
        ),
    ],
)
def test_invalid_settings_are_refused(settings, words):
    with pytest.raises(MonitorError, match=words):
        settings.check()
    assert "short" not in repr(settings)


async def test_an_unknown_bind_address_is_reported_in_one_line(monkeypatch):
    with pytest.raises(MonitorError, match=r"--bind no\.such\.host\.invalid: .*give an address"):
        async with serving(monkeypatch, bind="no.such.host.invalid"):
            pass


async def test_it_ends_soon_despite_viewers_and_frees_its_port(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served, browser() as client:
        port = served.port
        live = await client.ws_connect(served.url + "ws/live")
        await live.receive_json()
        served.task.cancel()
        done, _ = await asyncio.wait({served.task}, timeout=20)  # 0.3 s on a quiet machine
        assert done == {served.task}
        assert served.task.cancelled()
        assert served.fleet.hearers == []
    async with (
        serving(monkeypatch, SAMPLE, port=port) as again,
        browser() as client,
        client.get(again.url) as answer,
    ):
        assert answer.status == 200


async def test_a_job_that_fails_ends_the_monitor_with_its_error(monkeypatch):
    async def fail(_):
        raise MonitorError("monitor: the database cannot be opened")

    monkeypatch.setattr("framerunner.monitor.live_channel.LiveChannel.run", fail)
    with pytest.raises(MonitorError, match="the database cannot be opened"):
        async with serving(monkeypatch) as served:
            await served.task
