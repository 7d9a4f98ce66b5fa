"""The vehicle's latest telemetry, and its ticks: 20 a second of vehicle time.

MAVSDK's asyncio streams put every sample into an unbounded queue, so a slow reader reads old values. Here the
plugin's callbacks, on MAVSDK's own thread, keep the latest sample and its age; the event loop is woken only
when the time stamp of the attitude crosses the 50 ms grid.

Links swap and delay packets: an attitude or a position older than the one before is dropped. MAVSDK's
telemetry plugin gives positions without their time stamps, so they are read as JSON from `mavlink_direct`.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from math import radians
from typing import Any

from framerunner.geometry.axes import Pose
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message
from framerunner.wire.mission_tunnel import TEXT_PREFIX
from framerunner.wire.status_text import plain
from framerunner.wire.vehicle_telemetry import MessageOrder
from offboard.arming import Arming
from offboard.link.direct import subscribe
from offboard.link.gimbal import GimbalAttitude, gimbal_attitude

TICK_US = 50_000
LAG_GROWTH_S = 2e-5  # with each attitude: 1 ms a second, more than clocks differ
MAX_JITTER_S = 0.05
SILENT_S = 1.0  # wall time
TEXTS_KEPT = 8
TEXT_AGE_S = 8.0
SAMPLES_KEPT = 40  # until they are taken: two seconds of ticks
CHECKS = "pre-arm checks not passed"


@dataclass(frozen=True, slots=True)
class TelemetrySample:
    """Where the vehicle was when its clock crossed the 50 ms grid, in its local NED axes."""

    time_us: int  # of the attitude that crossed, microseconds since boot
    yaw_ned_rad: float  # clockwise from north
    position_ned_m: Vec3  # latest by then
    velocity_ned_m_s: Vec3
    position_us: int = 0  # of position and velocity, microseconds since boot
    roll_rad: float = 0.0  # with `yaw_ned_rad` the attitude: Euler angles Z-Y-X, body FRD to NED
    pitch_rad: float = 0.0
    gimbal: GimbalAttitude | None = None  # latest by then
    landed: bool = True  # latest by then

    @property
    def attitude_ned(self) -> Quaternion:
        """Body FRD to NED."""
        return quaternion_from_euler(self.roll_rad, self.pitch_rad, self.yaw_ned_rad)

    @property
    def camera_attitude_ned(self) -> Quaternion | None:
        """Of a camera on a gimbal; None: there is none."""
        return None if self.gimbal is None else self.gimbal.ned(self.yaw_ned_rad)


class TelemetryFeed:
    """Latest values; written on MAVSDK's thread, read on the loop's. Each field is replaced whole.

    `clock` is monotonic wall time, seconds. Time, yaw, position and velocity have the units of
    `TelemetrySample`.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.sample = TelemetrySample(0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # of the last tick
        self.tick_number = 0  # of the last tick, counted from the vehicle's boot
        self.time_us = 0
        self.yaw_ned_rad = 0.0
        self.position_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self.velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.position_us = 0
        self.gimbal: GimbalAttitude | None = None  # None before the first
        self.arming = Arming()  # with the heartbeats
        self.mode = ""  # name of the flight mode, such as "OFFBOARD"
        self.landed = True  # from EXTENDED_SYS_STATE
        self.needs_landed_state = False  # the vehicle is not ready before that is received
        self.health: Any = None  # MAVSDK's; None before the first
        self.attitudes = 0  # how many were received
        self.positions = 0
        self._attitude_received_s = 0.0
        self._heard_from_s = 0.0  # since then it was not silent for a second
        self._position_received_s = 0.0
        self._heartbeat_received_s = 0.0
        self._landed_received = False
        self._lag_s: float | None = None  # of vehicle time behind wall time
        self._texts: deque[tuple[float, str]] = deque(maxlen=TEXTS_KEPT)
        self._attitude_order = MessageOrder()
        self._position_order = MessageOrder()
        self._samples: deque[TelemetrySample] = deque(maxlen=SAMPLES_KEPT)
        self._taken = self.sample  # what the waiting tasks have had; the next tick is another one
        self._loop: asyncio.AbstractEventLoop | None = None
        self._new_tick = asyncio.Event()

    def subscribe(
        self,
        plugin: Any,  # noqa: ANN401 - MAVSDK is untyped
        direct: Any,  # noqa: ANN401
        numbered_modes: Mapping[int, str] | None = None,
    ) -> None:
        """Subscribe to MAVSDK's synchronous plugins `telemetry` and `mavlink_direct`.

        Args:
            plugin: `telemetry`.
            direct: `mavlink_direct`.
            numbered_modes: names of the vehicle's modes by HEARTBEAT.custom_mode; without, MAVSDK names them.
        """
        self._loop = asyncio.get_running_loop()
        plugin.subscribe_attitude_euler(self._on_attitude)
        subscribe(direct, "LOCAL_POSITION_NED", self._on_position)
        subscribe(direct, "GIMBAL_DEVICE_ATTITUDE_STATUS", partial(_take_gimbal, self))
        plugin.subscribe_armed(self._on_armed)
        if numbered_modes:
            subscribe(direct, "HEARTBEAT", partial(_take_mode, self, numbered_modes))
        else:
            plugin.subscribe_flight_mode(self._on_mode)
        plugin.subscribe_landed_state(self._on_landed)
        plugin.subscribe_health(partial(_take_health, self))
        plugin.subscribe_status_text(self._on_text)

    async def next_tick(self, timeout_s: float) -> bool:
        """Wait for the next tick; False if there was none within `timeout_s` of wall time.

        Ticks that were not waited for are skipped.
        """
        # Woken for a tick that was taken with the one before, it waits on.
        if not await self._woken_until(lambda: self.sample is not self._taken, timeout_s):
            return False
        self._taken = self.sample
        return True

    def take_samples(self) -> tuple[TelemetrySample, list[TelemetrySample]]:
        """The newest tick's sample, after which `next_tick` waits for another, and those before it.

        Those since the last call, oldest first; of many only the last `SAMPLES_KEPT`.
        """
        newest = self._taken = self.sample
        samples = []
        with contextlib.suppress(IndexError):
            while True:
                samples.append(self._samples.popleft())
        return newest, [sample for sample in samples if sample.time_us < newest.time_us]

    async def tick(self, number: int, timeout_s: float) -> bool:
        """Wait for the tick of this number, or a later one; False after `timeout_s` of wall time."""
        is_there = await self._woken_until(lambda: self.tick_number >= number, timeout_s)
        self._taken = self.sample
        return is_there

    async def _woken_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Look at each tick whether a condition holds; False after a wall time."""
        with contextlib.suppress(TimeoutError):
            # Not wait_for: before Python 3.12 it loses a cancellation that arrives together with the tick,
            # and then a loop under a time limit never ends.
            async with asyncio.timeout(timeout_s):
                while not condition():
                    self._new_tick.clear()
                    await self._new_tick.wait()
        return condition()

    def time_at_us(self, wall_s: float) -> int | None:
        """Vehicle time at a monotonic wall time, as telemetry shows it; None before the first attitude."""
        return None if self._lag_s is None else round((wall_s - self._lag_s) * 1e6)

    def age_s(self) -> float:
        """Wall time since the older of attitude and position was received, seconds."""
        return self._clock() - min(self._attitude_received_s, self._position_received_s)

    def heard_for_s(self) -> float:
        """Wall time since attitudes came again after a silence of `SILENT_S`, or came first, seconds."""
        return self._clock() - self._heard_from_s

    def heartbeat_age_s(self) -> float:
        """Wall time since the last heartbeat was received, seconds."""
        return self._clock() - self._heartbeat_received_s

    def recent_texts(self) -> str:
        """The vehicle's recent status texts, for the end of an error message; empty if there are none."""
        since = self._clock() - TEXT_AGE_S
        texts = list(dict.fromkeys(text for at, text in list(self._texts) if at >= since))
        return f"; the vehicle says: {' | '.join(texts)}" if texts else ""

    @property
    def armed(self) -> bool | None:
        """By the last heartbeat; None if none counts yet."""
        return self.arming.shown

    def missing(self) -> list[str]:
        """What has not been received yet, or what prevents arming; empty if the vehicle is ready."""
        health = self.health
        missing = []
        if not self.attitudes:
            missing.append("no attitude (ATTITUDE)")
        if not self.positions:
            missing.append("no local position (LOCAL_POSITION_NED)")
        if self.armed is None or not self.mode:
            missing.append("no heartbeat")
        if self.needs_landed_state and not self._landed_received:
            missing.append("no landed state (EXTENDED_SYS_STATE)")
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
        now_s = self._clock()
        if now_s - self._attitude_received_s > SILENT_S:
            self._heard_from_s = now_s
        self._attitude_received_s = now_s
        self._lag_s = least_lag(self._lag_s, self._attitude_received_s - time_us * 1e-6)
        self.attitudes += 1
        tick = time_us // TICK_US
        if tick != self.tick_number:
            self.sample = TelemetrySample(
                time_us,
                self.yaw_ned_rad,
                self.position_ned_m,
                self.velocity_ned_m_s,
                self.position_us,
                radians(euler.roll_deg),
                radians(euler.pitch_deg),
                self.gimbal,
                self.landed,
            )
            self._samples.append(self.sample)
            self.tick_number = tick  # after its sample, for tasks that look at the number
            self._wake()

    def _on_position(self, message: Message) -> None:
        position_us = message.time_boot_ms * 1000
        if not self._position_order.is_next(position_us):
            return
        self.position_ned_m = (message.x, message.y, message.z)
        self.velocity_ned_m_s = (message.vx, message.vy, message.vz)
        self.position_us = position_us
        self._position_received_s = self._clock()
        self.positions += 1

    def _on_armed(self, armed: bool, _user: object) -> None:
        self.arming.see_heartbeat(bool(armed))
        self._heartbeat_received_s = self._clock()  # MAVSDK calls this with each heartbeat

    def _on_mode(self, mode: Any, _user: object) -> None:  # noqa: ANN401
        self.mode = getattr(mode, "name", str(mode))

    def _on_landed(self, state: Any, _user: object) -> None:  # noqa: ANN401
        self.landed = getattr(state, "name", str(state)) == "ON_GROUND"
        self._landed_received = True

    def _on_text(self, text: Any, _user: object) -> None:  # noqa: ANN401
        said = plain(text.text)
        if not said.startswith(TEXT_PREFIX):  # MAVSDK also passes the texts of this app's companion
            self._texts.append((self._clock(), said))

    def _wake(self) -> None:
        loop = self._loop
        if loop is None or loop.is_closed():
            return
        try:
            loop.call_soon_threadsafe(self._new_tick.set)
        except RuntimeError:  # closed between the test and the call
            self._loop = None


def pose_of(feed: TelemetryFeed) -> Pose:
    """Where the vehicle is, in its local NED axes."""
    return Pose(feed.position_ned_m, feed.yaw_ned_rad)


def _take_health(feed: TelemetryFeed, health: Any, _user: object) -> None:  # noqa: ANN401
    feed.health = health


def _take_gimbal(feed: TelemetryFeed, message: Message) -> None:
    feed.gimbal = gimbal_attitude(message) or feed.gimbal


def _take_mode(feed: TelemetryFeed, names: Mapping[int, str], heartbeat: Message) -> None:
    """Take the mode in an autopilot's HEARTBEAT."""
    if heartbeat.get_srcComponent() == AUTOPILOT_COMPONENT_ID:
        number = heartbeat.custom_mode
        feed.mode = names.get(number, f"mode {number}")


def least_lag(before_s: float | None, lag_s: float) -> float:
    """How far vehicle time is behind wall time, by the message that was underway for the shortest time.

    A message that came late makes the lag seem larger, so the smallest counts; but clocks differ in pace, and
    a simulator may be slow, so it is never far from the newest.
    """
    if before_s is None:
        return lag_s
    return max(min(before_s + LAG_GROWTH_S, lag_s), lag_s - MAX_JITTER_S)
