"""The monitor over TLS, with certificates that openssl makes as docs/companion.md says."""

import asyncio
import shutil
import ssl
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import aiohttp
import pytest

from framerunner.monitor.connections import ConnectionLimiter
from framerunner.monitor.settings import ConnectionLimits, MonitorError, MonitorSettings
from framerunner.monitor.tls import load_certificate
from tests.chromium import Complaints
from tests.framerunner.monitor.serving import browser, serving

PASSWORD = "correct horse"
SAMPLE = "tests.framerunner.monitor.sample_page"
pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl")


def openssl(*arguments):
    subprocess.run(["openssl", *arguments], check=True, capture_output=True)


def make_certificate(folder, name="monitor", hosts="DNS:drone.local,IP:127.0.0.1", purpose="serverAuth"):
    """A self-signed certificate and its key."""
    paths = folder / f"{name}.crt", folder / f"{name}.key"
    openssl(
        *("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "365"),
        *("-keyout", str(paths[1]), "-out", str(paths[0]), "-subj", "/CN=drone.local"),
        *("-addext", f"subjectAltName={hosts}", "-addext", f"extendedKeyUsage={purpose}"),
    )
    return paths


@pytest.fixture(scope="module")
def pair(tmp_path_factory) -> tuple[Path, Path]:
    return make_certificate(tmp_path_factory.mktemp("tls"))


def trusting(pair):
    """A client's context that trusts only this certificate, and checks the host's name."""
    return ssl.create_default_context(cafile=str(pair[0]))


async def is_ended(reader, within_s):
    """Whether the server ends a connection without a word."""
    try:
        async with asyncio.timeout(within_s):
            return await reader.read() == b""
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


def with_tls(pair, **more):
    return {"certificate": pair[0], "key": pair[1], **more}


async def test_pages_log_in_and_websockets_work_over_tls(monkeypatch, pair):
    async with (
        serving(monkeypatch, SAMPLE, password=PASSWORD, **with_tls(pair)) as served,
        browser() as client,
    ):
        assert served.url.startswith("https://127.0.0.1:")
        trusted = trusting(pair)
        form = {"name": "Ann", "secret": PASSWORD}
        async with client.post(served.url + "login", data=form, ssl=trusted, allow_redirects=False) as answer:
            assert answer.status == 303
            assert "; Secure" in answer.headers["Set-Cookie"]
            assert "Strict-Transport-Security" not in answer.headers  # other ports of the host speak HTTP
        async with client.get(served.url, ssl=trusted) as answer:
            assert answer.status == 200
            assert "Ann" in await answer.text()
        live = served.url.replace("https:", "wss:") + "ws/live"
        async with client.ws_connect(live, ssl=trusted) as socket:
            assert (await socket.receive_json(timeout=10))["kind"]


async def test_who_comes_by_http_is_sent_to_https(monkeypatch, pair):
    async with serving(monkeypatch, SAMPLE, **with_tls(pair)) as served, browser() as client:
        plain = served.url.replace("https:", "http:")
        async with client.get(plain + "chart?x=1", allow_redirects=False) as answer:
            assert (answer.status, answer.headers["Location"]) == (307, served.url + "chart?x=1")
        async with client.post(plain + "login", data={"name": "Ann", "secret": "x"}) as answer:
            assert answer.status == 403
            assert f"open {served.url}" in await answer.text()
            assert "Set-Cookie" not in answer.headers
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await client.ws_connect(plain.replace("http:", "ws:") + "ws/live")
        assert refused.value.status == 403


async def test_a_client_that_does_not_trust_it_harms_nobody(monkeypatch, pair):
    problems = []
    asyncio.get_running_loop().set_exception_handler(lambda _, problem: problems.append(problem))
    async with serving(monkeypatch, SAMPLE, **with_tls(pair)) as served, browser() as client:
        with pytest.raises(aiohttp.ClientConnectorCertificateError):
            await client.get(served.url, ssl=ssl.create_default_context())
        reader, writer = await asyncio.open_connection("127.0.0.1", served.port)
        writer.write(b"\x16\x03\x01 no handshake")
        assert len(await reader.read()) < 20  # an alert, then the end
        writer.close()
        async with client.get(served.url, ssl=trusting(pair)) as answer:
            assert answer.status == 200
    assert problems == []


async def test_silent_connections_end_and_are_limited(monkeypatch, pair):
    limits = ConnectionLimits(head_s=1.0, per_address=3)
    async with serving(monkeypatch, SAMPLE, **with_tls(pair, limits=limits)) as served:
        silent = [await asyncio.open_connection("127.0.0.1", served.port) for _ in range(3)]
        silent[1][1].write(b"\x16")  # a handshake that goes no further
        too_many = await asyncio.open_connection("127.0.0.1", served.port)
        assert await is_ended(too_many[0], within_s=0.5)
        assert not await is_ended(silent[0][0], within_s=0.1)
        assert all([await is_ended(reader, within_s=5) for reader, _ in silent])
        async with browser() as client, client.get(served.url, ssl=trusting(pair)) as answer:
            assert answer.status == 200
        for _, writer in (*silent, too_many):
            writer.close()


async def test_a_slow_viewer_holds_back_no_more_than_over_http(monkeypatch, pair):
    """What waits for a viewer is old when it arrives: TLS must not make its buffer eight times as large."""
    gates = []

    class Seen(ConnectionLimiter):
        def connection_made(self, transport):
            super().connection_made(transport)
            gates.append(transport)

    monkeypatch.setattr("framerunner.monitor.tls.ConnectionLimiter", Seen)
    async with serving(monkeypatch, SAMPLE, **with_tls(pair)) as served, browser() as client:
        await client.get(served.url, ssl=trusting(pair))
        assert gates[0].get_write_buffer_limits()[1] <= 1 << 16


async def test_what_browsers_will_refuse_is_said(monkeypatch, pair, tmp_path):
    async with serving(monkeypatch, bind="0.0.0.0", **with_tls(pair)) as served:
        assert served.lines[0] == f"monitor: https://drone.local:{served.port}/"
        assert any("the certificate is for 127.0.0.1, drone.local" in line for line in served.lines)
    async with serving(monkeypatch, bind="0.0.0.0") as served:
        assert any("plain text" in line for line in served.lines)


def test_a_certificate_of_soon_or_not_yet_is_remarked(pair):
    loaded = load_certificate(*pair)
    assert loaded.remark == ""
    in_days = datetime.now(UTC).timestamp() + 360 * 86400
    assert "expires on" in load_certificate(*pair, lambda: in_days).remark
    assert "is the clock" in load_certificate(*pair, lambda: 1e9).remark


def test_the_key_may_be_in_the_same_file(pair, tmp_path):
    both = tmp_path / "both.pem"
    both.write_text(pair[1].read_text() + pair[0].read_text())
    assert load_certificate(both, None).hosts == ("127.0.0.1", "drone.local")


def test_bad_certificates_are_refused_in_a_line(pair, tmp_path):
    other = make_certificate(tmp_path, "other")
    client_only = make_certificate(tmp_path, "client", purpose="clientAuth")
    locked, damaged = tmp_path / "locked.key", tmp_path / "damaged.crt"
    openssl("pkey", "-in", str(pair[1]), "-aes128", "-passout", "pass:x", "-out", str(locked))
    damaged.write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    later = datetime.now(UTC).timestamp() + 400 * 86400
    for expected, arguments in {
        "no such file": (tmp_path / "none.crt", pair[1]),
        "is a directory": (tmp_path, None),
        "holds no private key": (pair[0], None),
        "holds no certificate": (pair[1], pair[1]),
        "is not the key of": (pair[0], other[1]),
        "is encrypted": (pair[0], locked),
        "cannot be used": (damaged, pair[1]),
        "purpose": client_only,
        "has expired on": (*pair, lambda: later),
    }.items():
        with pytest.raises(MonitorError, match=expected) as caught:
            load_certificate(*arguments)
        assert "\n" not in str(caught.value)
        assert str(arguments[0]) in str(caught.value) or "--key" in str(caught.value)
    with pytest.raises(MonitorError, match="--certificate"):
        MonitorSettings(key=pair[1]).check()


@pytest.mark.asyncio(loop_scope="session")
async def test_a_browser_shows_the_live_page_over_tls(monkeypatch, pair, chromium):
    async with serving(monkeypatch, "framerunner.monitor.pages.table", **with_tls(pair)) as served:
        context = await chromium.new_context(ignore_https_errors=True)
        page = await context.new_page()
        complaints = Complaints(page)
        opened = asyncio.get_running_loop().create_future()
        page.on("websocket", lambda socket: opened.done() or opened.set_result(socket.url))
        await page.goto(served.url.replace("https:", "http:"))
        async with asyncio.timeout(30):
            assert (await opened).startswith("wss://")
        assert page.url == served.url
        assert [each for each in complaints if "//127.0.0.1:" not in each] == []
