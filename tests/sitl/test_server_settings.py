"""Links that a user requests."""

from math import inf

import pytest

from firmware_py.mavlink.telemetry.profiles import GROUND, NORMAL, ONBOARD
from framerunner.wire.transports.urls import LinkError
from sitl.server_settings import parse_link


@pytest.mark.parametrize(
    ("text", "parts", "rates", "bytes_s", "trusted"),
    [
        ("udpout://192.168.1.20:14550", ("udpout", "192.168.1.20", 14550), GROUND, inf, False),
        ("udpin://0.0.0.0:14600?streams=onboard", ("udpin", "0.0.0.0", 14600), ONBOARD, inf, False),
        ("tcpin://127.0.0.1:5760", ("tcpin", "127.0.0.1", 5760), GROUND, inf, True),
        ("tcpout://localhost:5760?rate=5000", ("tcpout", "localhost", 5760), GROUND, 5000.0, True),
        ("serial:///dev/ttyS1:57600", ("serial", "/dev/ttyS1", 57600), NORMAL, 2880.0, True),
        (
            "serial:///dev/ttyS1:921600?streams=onboard&rate=80000",
            ("serial", "/dev/ttyS1", 921600),
            ONBOARD,
            80000.0,
            True,
        ),
    ],
)
def test_good_addresses(text, parts, rates, bytes_s, trusted):
    link = parse_link(f" {text} ")
    assert (link.url.scheme, link.url.address, link.url.number) == parts
    assert link.profile.name == link.url.text == text
    assert link.profile.rates_hz == rates.rates_hz
    assert link.profile.bytes_s == bytes_s
    assert link.profile.trusted is trusted


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "examples"),
        ("192.168.1.20:14550", "examples"),
        ("http://a:80", "examples"),
        ("udpout://:14550", "examples"),
        ("udpout://a", "examples"),
        ("udpout://a:0", "1 to 65535"),
        ("tcpin://a:70000", "70000"),
        ("serial://ttyUSB0:57600", "/dev/ttyUSB0"),
        ("udpout://a:1?streams=all", "streams=onboard|ground|normal"),
        ("udpout://a:1?speed=5", "speed=5"),
        ("udpout://a:1?rate=1", "100 to 10000000"),
        ("udpout://a:1?rate=-5", "rate -5"),
    ],
)
def test_bad_addresses_are_refused_in_one_line(text, complaint):
    with pytest.raises(LinkError) as error:
        parse_link(text)
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)
