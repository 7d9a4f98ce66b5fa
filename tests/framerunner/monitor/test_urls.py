"""Addresses for people, and their QR codes, read back as a phone reads them."""

import socket

import cv2
import numpy as np
import pytest
from ifaddr import IP, Adapter

from framerunner.monitor import urls
from framerunner.monitor.urls import (
    is_for_others,
    network_addresses,
    terminal_code,
    url_of,
    urls_for_people,
    urls_for_visitor,
)
from tests.framerunner.monitor.serving import browser, serving

ADAPTERS = (
    Adapter("lo", "lo", [IP("127.0.0.1", 8, "lo"), IP(("::1", 0, 0), 128, "lo")]),
    Adapter("docker0", "docker0", [IP("172.17.0.1", 16, "docker0")]),
    Adapter("eth0", "eth0", [IP(("2001:db8::5", 0, 0), 64, "eth0"), IP("10.0.0.3", 8, "eth0")]),
    Adapter("usb0", "usb0", [IP("169.254.7.7", 16, "usb0"), IP(("fe80::1", 0, 3), 64, "usb0")]),
    Adapter("wlan0", "wlan0", [IP("192.168.1.5", 24, "wlan0")]),
)
LINK = "http://192.168.178.123:8080/login?token=" + "aB3_-xYz" * 5 + "abc"


@pytest.fixture
def networks(monkeypatch):
    """A machine with a wired network, the wireless default route, and interfaces that no phone reaches."""
    monkeypatch.setattr(urls.ifaddr, "get_adapters", lambda: ADAPTERS)
    monkeypatch.setattr(urls, "_default_address", lambda: "192.168.1.5")


def read_code(image):
    """The text of a QR code in an image; "" without one. OpenCV's other detector misses some."""
    return cv2.QRCodeDetectorAruco().detectAndDecode(image)[0]


def picture(text):
    """What a terminal shows: each half block is 8 pixels wide and high."""
    rows = []
    for line in text.splitlines():
        assert line.startswith("\x1b[97;40m") and line.endswith("\x1b[0m")
        signs = line.removeprefix("\x1b[97;40m").removesuffix("\x1b[0m")
        rows.append([sign in "█▀" for sign in signs])
        rows.append([sign in "█▄" for sign in signs])
    return np.kron(np.array(rows, np.uint8) * 255, np.ones((8, 8), np.uint8))


def test_only_addresses_that_phones_reach_are_listed(networks):
    assert urls_for_people("0.0.0.0", 8080) == ["http://192.168.1.5:8080/", "http://10.0.0.3:8080/"]
    assert urls_for_people("::", 80)[2:] == ["http://[2001:db8::5]:80/"]
    assert network_addresses(ADAPTERS[:2], "") == []


def test_a_single_bind_address_is_listed():
    assert urls_for_people("127.0.0.1", 8080) == ["http://127.0.0.1:8080/"]
    assert urls_for_people("::1", 80) == [url_of("::1", 80)] == ["http://[::1]:80/"]
    assert [is_for_others(host) for host in ("127.0.0.1", "::1", "0.0.0.0", "192.168.1.5")] == [
        False, False, True, True,
    ]  # fmt: skip


def test_the_host_name_of_the_request_is_listed_first(networks):
    told = urls_for_people("0.0.0.0", 8080)
    for own in ("http://localhost:8080/join", "http://127.0.0.1:8080/join", told[0] + "join"):
        assert urls_for_visitor("0.0.0.0", 8080, own) == told
    assert urls_for_visitor("0.0.0.0", 8080, "https://contest.example/join")[0] == "https://contest.example/"


def test_this_machines_own_addresses_can_be_opened():
    for url in urls_for_people("0.0.0.0", 80):
        with socket.create_server((url.split("/")[2].removesuffix(":80"), 0)):
            pass


@pytest.mark.parametrize("text", ["http://10.0.0.3:8080/", LINK])
def test_a_phone_reads_the_code_in_a_terminal(text):
    lines = terminal_code(text)
    assert read_code(picture(lines)) == text
    assert max(len(line) for line in lines.splitlines()) - len("\x1b[97;40m\x1b[0m") <= 60


@pytest.mark.parametrize(("bind", "qr_codes"), [("0.0.0.0", True), ("0.0.0.0", False), ("127.0.0.1", True)])
async def test_the_monitor_prints_its_addresses_for_phones(monkeypatch, networks, bind, qr_codes):
    async with serving(monkeypatch, bind=bind, qr_codes=qr_codes) as served:
        said = "\n".join(served.lines)
        host = "192.168.1.5" if bind == "0.0.0.0" else "127.0.0.1"
        assert served.lines[0] == f"monitor: http://{host}:{served.port}/"
        assert f"organisers log in at http://{host}:{served.port}/login?token=" in said
        assert (f"monitor: http://10.0.0.3:{served.port}/" in said) == (bind == "0.0.0.0")
        assert "0.0.0.0" not in said
        codes = [line.partition("\n")[2] for line in served.lines if "█" in line]
        read = [read_code(picture(code)) for code in codes]
        wanted = [served.url, f"{served.url}login?token={served.invitation}"]
        assert read == (wanted if qr_codes and bind == "0.0.0.0" else [])


async def test_without_a_network_the_loopback_address_is_printed(monkeypatch):
    monkeypatch.setattr(urls.ifaddr, "get_adapters", lambda: ADAPTERS[:1])
    async with (
        serving(monkeypatch, "framerunner.monitor.pages.join", bind="0.0.0.0") as served,
        browser() as client,
    ):
        assert served.lines[0] == f"monitor: http://127.0.0.1:{served.port}/"
        assert "no network" in served.lines[1]
        async with client.get(f"{served.url}join") as answer:
            assert "in no network" in await answer.text()
        async with client.get(f"{served.url}join.svg") as answer:
            assert answer.status == 404


@pytest.mark.asyncio(loop_scope="session")
async def test_a_page_shows_the_code(monkeypatch, networks, chromium):
    async with serving(monkeypatch, "framerunner.monitor.pages.join", bind="0.0.0.0") as served:
        for width, height in ((375, 812), (1920, 1080)):
            page = await chromium.new_page(viewport={"width": width, "height": height})
            for path in ("join", "join.svg"):
                await page.goto(f"http://127.0.0.1:{served.port}/{path}")
                png = np.frombuffer(await page.screenshot(), np.uint8)
                seen = cv2.imdecode(png, cv2.IMREAD_COLOR)
                assert read_code(seen) == f"http://192.168.1.5:{served.port}/", (width, path)
            await page.goto(f"http://127.0.0.1:{served.port}/join")
            assert await page.evaluate("document.documentElement.scrollWidth") <= width
            assert "token" not in await page.content()
            await page.close()


async def test_a_monitor_for_this_machine_says_how_to_let_phones_in(monkeypatch):
    async with (
        serving(monkeypatch, "framerunner.monitor.pages.join") as served,
        browser() as client,
        client.get(f"{served.url}join") as answer,
    ):
        assert "--bind 0.0.0.0" in await answer.text()
