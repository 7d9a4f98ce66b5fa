"""The vehicle's latest telemetry and its 20 Hz ticks, without queues.

MAVSDK's asyncio streams put every sample into an unbounded queue, so a slow reader reads the past. Here the
plugin's callbacks, on MAVSDK's own thread, keep the latest sample and its age; the event loop is woken only
twenty times a second of vehicle time, when the time stamp of the attitude crosses the 50 ms grid.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from dataclasses import dataclass
from math import radians
from typing import Any

from mission_link.messages import TEXT_PREFIX
from scenarios.axes import Vec3

TICK_US = 50_000
TEXTS_KEPT = 8
TEXT_AGE_S = 8.0


@dataclass(frozen=True, slots=True)
class Sample:
    """Where the vehicle was when its clock crossed the 50 ms grid, in its local NED axes.

    Attributes:
        time_us: of the attitude that crossed, microseconds since boot.
        yaw_ned_rad: clockwise from north.
        position_ned_m: latest by then, shape (3,).
        velocity_ned_m_s: shape (3,).
    """

    time_us: int
    yaw_ned_rad: float
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3


class TelemetryFeed:
    """Latest values; written on MAVSDK's thread, read on the loop's. Each field is replaced whole.

    Attributes:
        sample: of the last tick.
        time_us: vehicle time of the latest attitude, microseconds since its boot.
        yaw_ned_rad: heading, clockwise from north.
        position_ned_m: local position, shape (3,).
        velocity_ned_m_s: shape (3,).
        armed: as the last heartbeat says; None before the first.
        mode: flight mode in words, such as "OFFBOARD".
        landed: as EXTENDED_SYS_STATE says.
        health: MAVSDK's health, None before the first.
        attitudes: how many came.
        positions: how many came.
    """

    def __init__(self) -> None:
        self.sample = Sample(0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self.time_us = 0
        self.yaw_ned_rad = 0.0
        self.position_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self.velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.armed: bool | None = None
        self.mode = ""
        self.landed = True
        self.health: Any = None
        self.attitudes = 0
        self.positions = 0
        self.attitude_received_s = 0.0
        self.position_received_s = 0.0
        self._texts: deque[tuple[float, str]] = deque(maxlen=TEXTS_KEPT)
        self._tick = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._new_tick = asyncio.Event()

    def subscribe(self, plugin: Any) -> None:  # noqa: ANN401 - MAVSDK is untyped
        """Listen to a vehicle.

        Args:
            plugin: MAVSDK's telemetry plugin (the synchronous one).
        """
        self._loop = asyncio.get_running_loop()
        plugin.subscribe_attitude_euler(self._on_attitude)
        plugin.subscribe_position_velocity_ned(self._on_position)
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
            await asyncio.wait_for(self._new_tick.wait(), timeout_s)
        except TimeoutError:
            return False
        self._new_tick.clear()
        return True

    def age_s(self) -> float:
        """Wall time since the older of attitude and position came, seconds."""
        return time.monotonic() - min(self.attitude_received_s, self.position_received_s)

    def recent_texts(self) -> str:
        """What the vehicle said lately, for the end of an error message; empty if nothing."""
        since = time.monotonic() - TEXT_AGE_S
        texts = list(dict.fromkeys(text for at, text in list(self._texts) if at >= since))
        return f"; the vehicle says: {' | '.join(texts)}" if texts else ""

    def _on_attitude(self, euler: Any, _user: object) -> None:  # noqa: ANN401
        self.yaw_ned_rad = radians(euler.yaw_deg)
        self.time_us = time_us = euler.timestamp_us
        self.attitude_received_s = time.monotonic()
        self.attitudes += 1
        tick = time_us // TICK_US
        if tick != self._tick:
            self._tick = tick
            self.sample = Sample(time_us, self.yaw_ned_rad, self.position_ned_m, self.velocity_ned_m_s)
            self._wake()

    def _on_position(self, sample: Any, _user: object) -> None:  # noqa: ANN401
        position, velocity = sample.position, sample.velocity
        self.position_ned_m = (position.north_m, position.east_m, position.down_m)
        self.velocity_ned_m_s = (velocity.north_m_s, velocity.east_m_s, velocity.down_m_s)
        self.position_received_s = time.monotonic()
        self.positions += 1

    def _on_armed(self, armed: bool, _user: object) -> None:
        self.armed = bool(armed)

    def _on_mode(self, mode: Any, _user: object) -> None:  # noqa: ANN401
        self.mode = getattr(mode, "name", str(mode))

    def _on_landed(self, state: Any, _user: object) -> None:  # noqa: ANN401
        self.landed = getattr(state, "name", str(state)) == "ON_GROUND"

    def _on_health(self, health: Any, _user: object) -> None:  # noqa: ANN401
        self.health = health

    def _on_text(self, text: Any, _user: object) -> None:  # noqa: ANN401
        words = text.text.strip()
        if not words.startswith(TEXT_PREFIX):  # MAVSDK hands over what this app's own companion says, too
            self._texts.append((time.monotonic(), words))

    def _wake(self) -> None:
        loop = self._loop
        if loop is None or loop.is_closed():
            return
        try:
            loop.call_soon_threadsafe(self._new_tick.set)
        except RuntimeError:  # closed between the test and the call
            self._loop = None
