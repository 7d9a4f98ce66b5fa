"""Telemetry that comes late, doubled or swapped, without a vehicle."""

from __future__ import annotations

import asyncio
import json
from types import SimpleNamespace

from framerunner.wire.vehicle_telemetry import MessageOrder
from offboard.link.telemetry import SAMPLES_KEPT, TelemetryFeed


def test_what_is_older_is_dropped_and_a_jump_of_seconds_is_a_restart():
    order = MessageOrder()
    stamps_ms = (10_000, 10_020, 10_010, 10_020, 9_000, 7_100, 10_040, 6_000, 6_020, 6_010)
    assert [ms for ms in stamps_ms if order.is_next(ms * 1000)] == [
        10_000,
        10_020,
        10_020,
        10_040,
        6_000,
        6_020,
    ]


class Plugin:
    """What `TelemetryFeed` subscribes to."""

    def __init__(self):
        self.called = {}

    def __getattr__(self, name):
        return lambda callback: self.called.__setitem__(name, callback)

    def subscribe_message(self, name, callback):
        self.called[name] = callback

    def attitude(self, ms):
        self.called["subscribe_attitude_euler"](
            SimpleNamespace(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, timestamp_us=ms * 1000), None
        )

    def position(self, ms, x):
        told = {"time_boot_ms": ms, "x": x, "y": 0.0, "z": None, "vx": 0.0, "vy": 0.0, "vz": 0.0}
        message = SimpleNamespace(system_id=1, component_id=1, fields_json=json.dumps(told))
        self.called["LOCAL_POSITION_NED"](message, None)


async def test_ticks_and_positions_never_go_back():
    feed, plugin = TelemetryFeed(), Plugin()
    feed.subscribe(plugin, plugin)
    plugin.position(10_040, 1.0)
    plugin.attitude(10_050)
    plugin.position(10_020, 0.9)  # late
    plugin.attitude(10_040)
    assert (feed.sample.time_us, feed.sample.position_us) == (10_050_000, 10_040_000)
    assert feed.position_ned_m[0] == 1.0
    plugin.attitude(10_100)
    assert (feed.sample.time_us, feed.sample.position_ned_m[0]) == (10_100_000, 1.0)
    assert feed.position_ned_m[2] != feed.position_ned_m[2]  # null: not a number
    assert (feed.attitudes, feed.positions) == (2, 1)
    plugin.attitude(1_000)  # restarted
    assert feed.sample.time_us == 1_000_000
    await asyncio.sleep(0)


async def test_the_samples_of_all_ticks_are_kept_until_they_are_taken():
    feed, plugin = TelemetryFeed(), Plugin()
    feed.subscribe(plugin, plugin)
    for ms in range(10_000, 10_220, 20):
        plugin.position(ms - 5, ms / 1000)
        plugin.attitude(ms)
    newest, before = feed.take_samples()
    taken = [*before, newest]
    assert [sample.time_us // 1000 for sample in taken] == [10_000, 10_060, 10_100, 10_160, 10_200]
    assert [sample.position_ned_m[0] for sample in taken] == [10.0, 10.06, 10.1, 10.16, 10.2]
    assert feed.take_samples() == (newest, [])
    for ms in range(11_000, 20_000, 50):
        plugin.attitude(ms)
    newest, before = feed.take_samples()
    assert (len(before) + 1, before[-1].time_us, newest.time_us) == (SAMPLES_KEPT, 19_900_000, 19_950_000)
    await asyncio.sleep(0)
