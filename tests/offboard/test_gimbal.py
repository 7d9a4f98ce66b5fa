"""GIMBAL_DEVICE_ATTITUDE_STATUS as MAVSDK passes it on."""

import json
from math import nan
from types import SimpleNamespace

import pytest

from framerunner.geometry.rotations import euler_from_quaternion, quaternion_from_euler
from offboard.link.telemetry import TelemetryFeed

LOCKED, IN_VEHICLE_FRAME, IN_EARTH_FRAME = 16, 32, 64


class Plugins:
    """MAVSDK's `telemetry` and `mavlink_direct`: pass on what a test tells."""

    def __init__(self):
        self.callbacks = {}
        self.time_us = 0

    def __getattr__(self, name):
        return lambda callback: self.callbacks.__setitem__(name, callback)

    def subscribe_message(self, name, callback):
        self.callbacks[name] = callback

    def tell(self, q, flags):
        fields = json.dumps({"q": q, "flags": flags})
        message = SimpleNamespace(system_id=1, component_id=154, fields_json=fields)
        self.callbacks["GIMBAL_DEVICE_ATTITUDE_STATUS"](message, None)

    def attitude_at_tick(self, feed):
        """The gimbal's, in the sample of the next tick."""
        self.time_us += 50_000
        euler = SimpleNamespace(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, timestamp_us=self.time_us)
        self.callbacks["subscribe_attitude_euler"](euler, None)
        return feed.sample.gimbal


@pytest.fixture
def direct():
    return Plugins()


@pytest.fixture
async def feed(direct):
    feed = TelemetryFeed()
    feed.subscribe(direct, direct)
    return feed


@pytest.mark.parametrize(
    ("flags", "yaw_rad"),
    [
        (IN_VEHICLE_FRAME, 1.5),
        (LOCKED | IN_VEHICLE_FRAME, 1.5),
        (0, 1.5),
        (LOCKED, 0.5),
        (IN_EARTH_FRAME, 0.5),
    ],
)
async def test_its_yaw_is_to_the_heading_or_to_north(direct, feed, flags, yaw_rad):
    direct.tell(list(quaternion_from_euler(0.0, -0.3, 0.5)), flags)
    assert euler_from_quaternion(direct.attitude_at_tick(feed).ned(1.0)) == pytest.approx(
        (0.0, -0.3, yaw_rad)
    )


@pytest.mark.parametrize("q", [[0.0, 0.0, 0.0, 0.0], [nan, 0.0, 0.0, 0.0], [None] * 4, [1.0, 0.0]])
async def test_what_is_no_attitude_is_ignored(direct, feed, q):
    direct.tell(q, IN_VEHICLE_FRAME)
    assert direct.attitude_at_tick(feed) is None
