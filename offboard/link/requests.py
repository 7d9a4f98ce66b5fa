"""Requests to MAVSDK: each blocks a thread until it is answered, and must end before MAVSDK is destroyed."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable

_LONGEST_S = 10.0  # MAVSDK gives a request up by itself before that


class Requests:
    """Those under way."""

    def __init__(self) -> None:
        self._under_way: set[asyncio.Future[object]] = set()

    async def wait(self, request: Awaitable[object]) -> None:
        """Wait for the answer to a request; if this is cancelled, the request goes on all the same.

        Raises:
            MavsdkError: it was refused, or not answered.
        """
        asked = asyncio.ensure_future(request)
        self._under_way.add(asked)
        asked.add_done_callback(self._answered)
        await asyncio.shield(asked)

    async def settled(self) -> None:
        """Wait until none is under way."""
        if self._under_way:
            await asyncio.wait(self._under_way, timeout=_LONGEST_S)

    def _answered(self, asked: asyncio.Future[object]) -> None:
        self._under_way.discard(asked)
        if not asked.cancelled():
            asked.exception()  # whoever asked may have gone
