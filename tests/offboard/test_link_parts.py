"""Addresses, requests and telemetry, without a vehicle."""

from __future__ import annotations

import asyncio

import pytest

from offboard.drone import DroneError
from offboard.link.requests import Requests
from offboard.link.telemetry import TelemetryFeed
from offboard.link.url import check_free, parse_url


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
    assert parse_url(text).text == text


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
    ],
)
def test_bad_addresses_are_named(text):
    with pytest.raises(DroneError, match=r"^bad drone address '") as caught:
        parse_url(text)
    assert f"'{text}'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_serial_device_is_told():
    with pytest.raises(DroneError, match="/dev/ttyNONE9 does not exist"):
        check_free(parse_url("serial:///dev/ttyNONE9:57600"))


async def test_a_request_outlives_whoever_asked_and_is_waited_for():
    answered = []

    async def request():
        await asyncio.sleep(0.05)
        answered.append(True)

    requests = Requests()
    asking = asyncio.create_task(requests.wait(request()))
    await asyncio.sleep(0)
    asking.cancel()
    with pytest.raises(asyncio.CancelledError):
        await asking
    assert not answered
    await requests.settled()
    assert answered


async def test_a_cancellation_together_with_a_tick_is_not_lost():
    """Else a wait under a time limit goes on for ever when its end and a tick coincide."""
    for turns in range(4):
        feed = TelemetryFeed()
        waiting = asyncio.create_task(feed.next_tick(5.0))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        feed._new_tick.set()
        for _ in range(turns):
            await asyncio.sleep(0)
        cancelled = waiting.cancel()
        await asyncio.wait({waiting})
        assert waiting.cancelled() == cancelled
