"""Requests to a vehicle that count when its telemetry shows their effect."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from mavsdk.asyncio import MavsdkError

from offboard.drone import DroneError
from offboard.link.commands import PendingRequests
from offboard.link.telemetry import TelemetryFeed, TickSource

CONFIRM_S = 6.0  # until one of the heartbeats, one a second, shows what was requested
SHOWN_S = 1.5  # wall time until a heartbeat, one a second, shows the new mode


class Asking:
    """Asks one vehicle, and waits while its ticks go on.

    Args:
        feed: the vehicle's telemetry.
        ticks: from the feed.
        requests: those that are not answered yet.
    """

    def __init__(self, feed: TelemetryFeed, ticks: TickSource, requests: PendingRequests) -> None:
        self._feed, self._ticks, self._requests = feed, ticks, requests

    async def request(
        self, what: str, request: Awaitable[object], shown: Callable[[], bool] | None = None
    ) -> None:
        """Wait for the answer and, with `shown`, until telemetry shows the effect.

        Acknowledgements are not trusted: PX4 sends two for a mode, the first one always "accepted"; and a
        link may lose all answers to a request that had its effect.

        Raises:
            DroneError: it was refused, or its effect is not shown.
        """
        feed = self._feed
        try:
            await self._ticks.until_done(self._requests.wait(request))
        except MavsdkError as error:
            result = getattr(getattr(error, "result", None), "name", str(error))
            if result == "TIMEOUT" and shown is not None and await self.becomes(shown, SHOWN_S):
                return
            raise DroneError(f"{what} was refused: {result}{feed.recent_texts()}") from None
        if shown is None:
            return
        try:
            await self.until(shown, CONFIRM_S)
        except TimeoutError:
            raise DroneError(not_shown(feed, what)) from None

    async def becomes(self, condition: Callable[[], bool], limit_s: float) -> bool:
        """Wait for a condition for some time; whether it holds."""
        with contextlib.suppress(TimeoutError):
            await self.until(condition, limit_s)
        return condition()

    async def until(self, condition: Callable[[], bool], limit_s: float) -> None:
        """Wait for a condition; the limit is vehicle time if that waits for the app, else wall time.

        Raises:
            TimeoutError: it did not come.
        """
        waits, limit_us = self._ticks.waits, self._ticks.time_us + round(limit_s * 1e6)
        async with asyncio.timeout(None if waits else limit_s):
            while not condition():
                if waits and self._ticks.time_us > limit_us:
                    raise TimeoutError
                await self._ticks.next(0.05, at_once=True)


def not_shown(feed: TelemetryFeed, what: str) -> str:
    """The message about a request that was acknowledged and had no effect within `CONFIRM_S`."""
    armed = "armed" if feed.armed else "disarmed"
    return (
        f"{what} was acknowledged, but telemetry still shows mode {feed.mode}, {armed} "
        f"after {CONFIRM_S:g} s{feed.recent_texts()}"
    )
