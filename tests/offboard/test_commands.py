"""Requests to MAVSDK, without a vehicle."""

from __future__ import annotations

import asyncio

import pytest

from offboard.link.ticks import PendingRequests


async def test_a_request_continues_when_the_wait_for_it_is_cancelled():
    answered = []

    async def request():
        await asyncio.sleep(0.05)
        answered.append(True)

    requests = PendingRequests()
    waiting = asyncio.create_task(requests.wait(request()))
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    assert not answered
    await requests.wait_for_all()
    assert answered
