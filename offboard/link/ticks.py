"""The ticks of a vehicle, 20 a second of its time, and vehicle time that waits for the app where it can.

A real vehicle's time never waits: an app that is late passes ticks over. A simulator that this program has
started can wait: then the app is given every tick, and the image that belongs to it, on a busy machine too.
"""

from __future__ import annotations

from typing import Protocol

from offboard.drone import VelocityCommand
from offboard.link.telemetry import TICK_US, TelemetryFeed

LOST_S = 0.5  # wall time; a tick whose telemetry has not come by then was lost on the link
_LOST_IN_A_ROW = 10


class VehicleClock(Protocol):
    """The time of a vehicle that can wait. Its coroutines raise `DroneError` when the vehicle is gone."""

    async def stop(self) -> int:
        """Let time stand still; returns the time of the last telemetry, microseconds."""
        ...

    async def advance(self, tick_us: int, command: VelocityCommand | None) -> None:
        """Let time go on to the next tick, and wait until its image has been seen.

        Args:
            tick_us: where the tick is on the grid of 50 ms.
            command: what was sent last and must arrive first; None: nothing must.
        """

    def release(self) -> None:
        """Let time go on by itself from now on."""


class TickSource:
    """Waits for ticks.

    Args:
        feed: telemetry of the vehicle.

    Attributes:
        late: ticks that were passed over, or lost on the link, in flight.
    """

    def __init__(self, feed: TelemetryFeed) -> None:
        self.late = 0
        self._feed = feed
        self._clock: VehicleClock | None = None
        self._number = 0
        self._waits = False
        self._given: int | None = None

    def grant(self, clock: VehicleClock) -> None:
        """Let vehicle time wait for the app, from `begin` to `release`."""
        self._clock = clock

    @property
    def waits(self) -> bool:
        """Vehicle time waits for the app now."""
        return self._waits

    async def begin(self) -> None:
        """Let vehicle time wait from now on, if it can."""
        if self._clock is not None:
            self._number = await self._clock.stop() // TICK_US
            self._waits = True

    async def next(self, timeout_s: float, command: VelocityCommand | None = None) -> bool:
        """Wait for the next tick; the feed's `sample` belongs to it then.

        Args:
            timeout_s: wall time to wait where vehicle time does not wait.
            command: see `VehicleClock.advance`; with one, ticks passed over are counted as late.

        Returns:
            False if none came.
        """
        clock = self._clock
        if clock is None or not self._waits:
            return await self._next_free(timeout_s, in_flight=command is not None)
        for _ in range(_LOST_IN_A_ROW):
            self._number += 1
            await clock.advance(self._number * TICK_US, command)
            if await self._feed.tick(self._number, LOST_S):
                return True
            self.late += 1
        return False

    def release(self) -> None:
        """Let vehicle time go on by itself."""
        if self._clock is not None and self._waits:
            self._clock.release()
        self._waits = False

    async def _next_free(self, timeout_s: float, *, in_flight: bool) -> bool:
        came = await self._feed.next_tick(timeout_s)
        number = self._feed.tick_number
        if self._given is not None and in_flight:
            self.late += max(0, number - self._given - 1)
        self._given = number if in_flight else None
        return came
