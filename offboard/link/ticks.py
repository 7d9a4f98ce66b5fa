"""The ticks of a vehicle, 20 a second of its time, and requests that wait while they go on.

A vehicle whose time can wait goes on tick by tick, as the app asks for them; any other one by itself. A
request counts when telemetry shows its effect.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from typing import Any, Protocol

from mavsdk.asyncio import MavsdkError

from offboard.drone import DroneError, VelocityFluCommand
from offboard.link.dialect import Dialect, TickExchange
from offboard.link.telemetry import TICK_US, TelemetryFeed

BEGIN_US = 10_000_000  # vehicle time; the preparation of a vehicle with an exchange begins at a multiple
ARM_US = 5_000_000  # vehicle time; such a vehicle is armed right after a multiple
TICK_LOST_S = 0.5  # wall time; a tick whose telemetry has not arrived by then was lost on the link
_MAX_LOST_IN_A_ROW = 10
WANTED_RATE_HZ = 50.0
CONFIRM_S = 6.0  # until one of the heartbeats, one a second, shows what was requested
_MAX_REQUEST_S = 10.0  # MAVSDK gives a request up before that
SHOWN_S = 1.5  # wall time until a heartbeat, one a second, shows the new mode


class PendingRequests:
    """Requests to MAVSDK. Each blocks a thread until its answer, and must end before MAVSDK is destroyed."""

    def __init__(self) -> None:
        self._pending: set[asyncio.Future[object]] = set()

    async def wait(self, request: Awaitable[object]) -> None:
        """Wait for the answer; the request continues even if this wait is cancelled.

        Raises:
            MavsdkError: it was refused, or not answered.
        """
        future = asyncio.ensure_future(request)
        self._pending.add(future)
        future.add_done_callback(self._done)
        await asyncio.shield(future)

    async def wait_for_all(self) -> None:
        """Wait until none is pending."""
        if self._pending:
            await asyncio.wait(self._pending, timeout=_MAX_REQUEST_S)

    def _done(self, future: asyncio.Future[object]) -> None:
        self._pending.discard(future)
        if not future.cancelled():
            future.exception()  # read, so that asyncio does not warn if the wait was cancelled


async def request_rates(feed: TelemetryFeed, plugin: Any, *, stands: bool = False) -> None:  # noqa: ANN401
    """Request 50 Hz of attitude and position, from MAVSDK's asyncio plugin, if the vehicle sends less.

    A refusal is no error. A vehicle whose time stands is asked for what is not known to come often enough.
    """
    if stands:
        needed = [plugin.set_rate_position_velocity_ned, plugin.set_rate_landed_state]
    else:
        start_us, attitudes, positions = feed.time_us, feed.attitudes, feed.positions
        await asyncio.sleep(0.5)
        span_s = max((feed.time_us - start_us) / 1e6, 1e-3)
        needed = []
        if (feed.attitudes - attitudes) / span_s < 0.9 * WANTED_RATE_HZ:
            needed.append(plugin.set_rate_attitude_euler)
        if (feed.positions - positions) / span_s < 0.9 * WANTED_RATE_HZ:
            needed.append(plugin.set_rate_position_velocity_ned)
    for request in needed:
        with contextlib.suppress(MavsdkError):
            await request(WANTED_RATE_HZ)


class VehicleClock(Protocol):
    """The time of a vehicle that can wait. Its coroutines raise `DroneError` when the vehicle is gone.

    Attributes:
        answers_take_time: the vehicle answers requests only while its time goes on, as PX4 does.
        gone: why the vehicle exists no longer; empty: it does.
    """

    answers_take_time: bool
    gone: str

    async def stop(self) -> int:
        """Stop time; returns the time of the last telemetry, microseconds."""
        ...

    async def advance(
        self, tick_us: int, command: VelocityFluCommand | None, *, at_once: bool = False
    ) -> None:
        """Let time run to a tick of the 50 ms grid, and wait until its image has been processed.

        A command was sent before and must arrive first. Time goes on a little after the tick, in which a real
        app would answer it; with `at_once` it does not, if the vehicle answers while its time stands.
        """

    def release(self) -> None:
        """Let time run freely from now on."""


class TickSource:
    """Waits for ticks.

    A real vehicle's time never waits: an app that is late skips ticks. The time of a simulator that this
    program has started can wait: then the app gets every tick and its image, on a busy machine too.

    Attributes:
        late: ticks that were skipped, or lost on the link, in flight.
        in_flight: ticks in flight, late ones included.
        waits: vehicle time waits for the app now.
        exchange: around each tick that is waited for; None: what is sent needs no waiting.
    """

    def __init__(self, feed: TelemetryFeed) -> None:
        self.late = 0
        self.in_flight = 0
        self.waits = False
        self.exchange: TickExchange | None = None
        self._feed = feed
        self._clock: VehicleClock | None = None
        self._number = 0
        self._last_in_flight: int | None = None

    def use_clock(self, clock: VehicleClock) -> None:
        """Let vehicle time wait for the app, from `begin` to `release`."""
        self._clock = clock

    @property
    def time_us(self) -> int:
        """Vehicle time, microseconds: that of the newest attitude, or of a later tick that was granted."""
        return max(self._feed.time_us, self._number * TICK_US if self.waits else 0)

    @property
    def steps(self) -> bool:
        """Vehicle time can wait, and the vehicle answers only while it goes on; see `SteppedPx4Dialect`."""
        return self._clock is not None and self._clock.answers_take_time

    @property
    def gone(self) -> str:
        """Why the vehicle exists no longer; empty: it does, or that cannot be known."""
        return "" if self._clock is None else self._clock.gone

    async def begin(self) -> None:
        """Let vehicle time wait from now on, if it can."""
        if self._clock is not None and not self.waits:
            self._number = await self._clock.stop() // TICK_US
            self._feed.take_samples()  # of ticks that nobody waited for
            self.waits = True

    async def begin_exchange(self, dialect: Dialect, requests: PendingRequests) -> None:
        """With an exchange: `begin` at a multiple of `BEGIN_US`; exchange at each tick; request streams."""
        if dialect.exchange is None:
            return
        await self.begin()
        clock, end_us = self._clock, _next_multiple_us(self._number, BEGIN_US)
        while clock is not None and self._number * TICK_US < end_us:
            self._number += 1
            await clock.advance(self._number * TICK_US, None)
        self.exchange = dialect.exchange
        await self.until_done(requests.wait(dialect.request_streams()))

    async def before_arming(
        self,
        plugin: Any,  # noqa: ANN401
        *request_more: Callable[[Any], Awaitable[None]],
    ) -> None:
        """Request rates and more, from MAVSDK's asyncio plugin.

        With an exchange let time pass to a multiple of `ARM_US`, so all such flights begin at the same time.
        """
        if self.exchange is None:
            await request_rates(self._feed, plugin, stands=self._clock is not None)
            for request in request_more:
                await request(plugin)
            return
        end_us = _next_multiple_us(self._number, ARM_US)
        while self._number * TICK_US < end_us and await self.next(TICK_LOST_S):
            pass

    async def next(
        self, timeout_s: float, command: VelocityFluCommand | None = None, *, at_once: bool = False
    ) -> bool:
        """Wait for the next tick; the feed's `sample` belongs to it then. False if there was none.

        Args:
            timeout_s: wall time to wait if vehicle time does not wait.
            command: see `VehicleClock.advance`; with one, ticks skipped are counted as late.
            at_once: likewise.
        """
        clock = self._clock
        if clock is None or not self.waits:
            return await self._next_free(timeout_s, in_flight=command is not None)
        for _ in range(_MAX_LOST_IN_A_ROW):
            self._number += 1
            self.in_flight += command is not None
            if self.exchange is not None:
                await self.exchange.before_tick()
            await clock.advance(self._number * TICK_US, command, at_once=at_once)
            if self.exchange is not None:
                await self.exchange.after_tick()
            if await self._feed.tick(self._number, TICK_LOST_S):
                return True
            self.late += 1
        return False

    async def until_done(self, work: Awaitable[None]) -> None:
        """Wait for a request's answer, with vehicle time going on if the answer takes time."""
        clock = self._clock
        if clock is None or not self.waits or not clock.answers_take_time:
            await work
            return
        task = asyncio.ensure_future(work)
        try:
            while not task.done():
                await self.next(TICK_LOST_S)
        except BaseException:
            task.cancel()
            raise
        await task

    def release(self) -> None:
        """Let vehicle time run freely."""
        if self._clock is not None and self.waits:
            self._clock.release()
        self.waits = False

    async def _next_free(self, timeout_s: float, *, in_flight: bool) -> bool:
        received = await self._feed.next_tick(timeout_s)
        number = self._feed.tick_number
        if received and in_flight:
            passed = 1 if self._last_in_flight is None else max(1, number - self._last_in_flight)
            self.in_flight += passed
            self.late += passed - 1
        self._last_in_flight = number if in_flight else None
        return received


def _next_multiple_us(tick_number: int, period_us: int) -> int:
    return -(-tick_number * TICK_US // period_us) * period_us


class Requester:
    """Sends requests to one vehicle, and waits while its ticks go on.

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
