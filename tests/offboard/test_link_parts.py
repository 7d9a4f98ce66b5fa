"""Requests and telemetry, without a vehicle."""

from __future__ import annotations

import asyncio

import pytest

from offboard.link.requests import Requests
from offboard.link.telemetry import TelemetryFeed


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
