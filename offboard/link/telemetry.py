"""The vehicle's latest telemetry and its 20 Hz ticks, without queues.

MAVSDK's asyncio streams put every sample into an unbounded queue, so a slow reader reads the past. Here the
plugin's callbacks, on MAVSDK's own thread, keep the latest sample and its age; the event loop is woken only
twenty times a second of vehicle time, when the time stamp of the attitude crosses the 50 ms grid.

Links swap and delay: an attitude or a position older than the one before is dropped. MAVSDK's telemetry
plugin gives positions without their time stamps, so they come by its `mavlink_direct`, as JSON.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import nan, radians
from typing import Any

from mavsdk.asyncio import MavsdkError

from geometry.vectors import Vec3
from wire.mission_tunnel import TEXT_PREFIX
from wire.vehicle_telemetry import MessageOrder

TICK_US = 50_000
TEXTS_KEPT = 8
TEXT_AGE_S = 8.0
WANTED_RATE_HZ = 50.0
CHECKS = "pre-arm checks not passed"


@dataclass(frozen=True, slots=True)
class Sample:
    """Where the vehicle was when its clock crossed the 50 ms grid, in its local NED axes.

    Attributes:
        time_us: of the attitude that crossed, microseconds since boot.
        yaw_ned_rad: clockwise from north.
        position_ned_m: latest by then, shape (3,).
        velocity_ned_m_s: shape (3,).
        position_us: when that was so, microseconds since boot.
    """

    time_us: int
    yaw_ned_rad: float
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    position_us: int = 0


class TelemetryFeed:
    """Latest values; written on MAVSDK's thread, read on the loop's. Each field is replaced whole.

    Args:
        clock: monotonic wall time, seconds.

    Attributes:
        sample: of the last tick.
        time_us: vehicle time of the latest attitude, microseconds since its boot.
        yaw_ned_rad: heading, clockwise from north.
        position_ned_m: local position, shape (3,).
        velocity_ned_m_s: shape (3,).
        position_us: when that was so, microseconds since boot.
        armed: as the last heartbeat says; None before the first.
        mode: flight mode in words, such as "OFFBOARD".
        landed: as EXTENDED_SYS_STATE says.
        health: MAVSDK's health, None before the first.
        attitudes: how many came.
        positions: how many came.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.sample = Sample(0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self.time_us = 0
        self.yaw_ned_rad = 0.0
        self.position_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self.velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.position_us = 0
        self.armed: bool | None = None
        self.mode = ""
        self.landed = True
        self.health: Any = None
        self.attitudes = 0
        self.positions = 0
        self.attitude_received_s = 0.0
        self.position_received_s = 0.0
        self.heartbeat_received_s = 0.0
        self._texts: deque[tuple[float, str]] = deque(maxlen=TEXTS_KEPT)
        self._attitude_order = MessageOrder()
        self._position_order = MessageOrder()
        self._tick = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._new_tick = asyncio.Event()

    def subscribe(self, plugin: Any, direct: Any) -> None:  # noqa: ANN401 - MAVSDK is untyped
        """Listen to a vehicle.

        Args:
            plugin: MAVSDK's telemetry plugin (the synchronous one).
            direct: its `mavlink_direct` plugin (the synchronous one).
        """
        self._loop = asyncio.get_running_loop()
        plugin.subscribe_attitude_euler(self._on_attitude)
        direct.subscribe_message("LOCAL_POSITION_NED", self._on_position)
        plugin.subscribe_armed(self._on_armed)
        plugin.subscribe_flight_mode(self._on_mode)
        plugin.subscribe_landed_state(self._on_landed)
        plugin.subscribe_health(self._on_health)
        plugin.subscribe_status_text(self._on_text)

    async def next_tick(self, timeout_s: float) -> bool:
        """Wait for the next crossing of the 50 ms grid of vehicle time.

        Crossings that nobody waited for are passed over; `sample` is the last one's.

        Returns:
            False if none came within `timeout_s` of wall time.
        """
        try:
            # Not wait_for: before Python 3.12 it loses a cancellation that comes together with the tick, and
            # then whoever waits in a loop under a time limit waits for ever.
            async with asyncio.timeout(timeout_s):
                await self._new_tick.wait()
        except TimeoutError:
            return False
        self._new_tick.clear()
        return True

    async def tick(self, number: int, timeout_s: float) -> bool:
        """Wait until the crossing of a given number, counted from the vehicle's boot, has been seen.

        Returns:
            False if it was not within `timeout_s` of wall time.
        """
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout_s):
                while self.tick_number < number:
                    self._new_tick.clear()
                    await self._new_tick.wait()
        return self.tick_number >= number

    @property
    def tick_number(self) -> int:
        """Number of the last crossing, counted from the vehicle's boot."""
        return self._tick

    def age_s(self) -> float:
        """Wall time since the older of attitude and position came, seconds."""
        return self._clock() - min(self.attitude_received_s, self.position_received_s)

    def heartbeat_age_s(self) -> float:
        """Wall time since the last heartbeat came, which tells of mode and arming, seconds."""
        return self._clock() - self.heartbeat_received_s

    def recent_texts(self) -> str:
        """What the vehicle said lately, for the end of an error message; empty if nothing."""
        since = self._clock() - TEXT_AGE_S
        texts = list(dict.fromkeys(text for at, text in list(self._texts) if at >= since))
        return f"; the vehicle says: {' | '.join(texts)}" if texts else ""

    def missing(self) -> list[str]:
        """What the vehicle has not told yet, or what keeps it from being armed; empty if it is ready."""
        health = self.health
        missing = []
        if not self.attitudes:
            missing.append("no attitude (ATTITUDE)")
        if not self.positions:
            missing.append("no local position (LOCAL_POSITION_NED)")
        if self.armed is None or not self.mode:
            missing.append("no heartbeat")
        if health is None:
            missing.append("no health (SYS_STATUS)")
        elif not health.is_armable:
            missing.append(CHECKS)
        return missing

    def _on_attitude(self, euler: Any, _user: object) -> None:  # noqa: ANN401
        time_us = euler.timestamp_us
        if not self._attitude_order.is_next(time_us):
            return
        self.yaw_ned_rad = radians(euler.yaw_deg)
        self.time_us = time_us
        self.attitude_received_s = self._clock()
        self.attitudes += 1
        tick = time_us // TICK_US
        if tick != self._tick:
            self._tick = tick
            self.sample = Sample(
                time_us, self.yaw_ned_rad, self.position_ned_m, self.velocity_ned_m_s, self.position_us
            )
            self._wake()

    def _on_position(self, message: Any, _user: object) -> None:  # noqa: ANN401
        told = json.loads(message.fields_json)
        position_us = told["time_boot_ms"] * 1000
        if not self._position_order.is_next(position_us):
            return
        self.position_ned_m = (_number(told["x"]), _number(told["y"]), _number(told["z"]))
        self.velocity_ned_m_s = (_number(told["vx"]), _number(told["vy"]), _number(told["vz"]))
        self.position_us = position_us
        self.position_received_s = self._clock()
        self.positions += 1

    def _on_armed(self, armed: bool, _user: object) -> None:
        self.armed = bool(armed)
        self.heartbeat_received_s = self._clock()  # MAVSDK tells of it with each heartbeat

    def _on_mode(self, mode: Any, _user: object) -> None:  # noqa: ANN401
        self.mode = getattr(mode, "name", str(mode))

    def _on_landed(self, state: Any, _user: object) -> None:  # noqa: ANN401
        self.landed = getattr(state, "name", str(state)) == "ON_GROUND"

    def _on_health(self, health: Any, _user: object) -> None:  # noqa: ANN401
        self.health = health

    def _on_text(self, text: Any, _user: object) -> None:  # noqa: ANN401
        words = text.text.strip()
        if not words.startswith(TEXT_PREFIX):  # MAVSDK hands over what this app's own companion says, too
            self._texts.append((self._clock(), words))

    def _wake(self) -> None:
        loop = self._loop
        if loop is None or loop.is_closed():
            return
        try:
            loop.call_soon_threadsafe(self._new_tick.set)
        except RuntimeError:  # closed between the test and the call
            self._loop = None


def _number(value: float | None) -> float:
    """JSON has no word for what is not finite; MAVSDK writes null."""
    return nan if value is None else value


async def ask_for_rates(feed: TelemetryFeed, plugin: Any) -> None:  # noqa: ANN401
    """Ask for 50 Hz of attitude and position where the vehicle sends less; a refusal is no error.

    Args:
        feed: listens to the vehicle.
        plugin: MAVSDK's telemetry plugin (the asyncio one).
    """
    start_us, attitudes, positions = feed.time_us, feed.attitudes, feed.positions
    await asyncio.sleep(0.5)
    span_s = max((feed.time_us - start_us) / 1e6, 1e-3)
    with contextlib.suppress(MavsdkError):
        if (feed.attitudes - attitudes) / span_s < 0.9 * WANTED_RATE_HZ:
            await plugin.set_rate_attitude_euler(WANTED_RATE_HZ)
        if (feed.positions - positions) / span_s < 0.9 * WANTED_RATE_HZ:
            await plugin.set_rate_position_velocity_ned(WANTED_RATE_HZ)
