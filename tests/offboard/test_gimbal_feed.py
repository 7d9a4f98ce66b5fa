"""GIMBAL_DEVICE_ATTITUDE_STATUS as MAVSDK passes it on."""

import json
from math import nan
from types import SimpleNamespace

import pytest

from framerunner.geometry.rotations import euler_from_quaternion, quaternion_from_euler
from offboard.link.gimbal_feed import GimbalFeed

LOCKED, IN_VEHICLE_FRAME, IN_EARTH_FRAME = 16, 32, 64


class Direct:
    """MAVSDK's plugin: passes on what a test tells."""

    def subscribe_message(self, name, callback):
        assert name == "GIMBAL_DEVICE_ATTITUDE_STATUS"
        self.callback = callback

    def tell(self, q, flags):
        fields = json.dumps({"q": q, "flags": flags})
        self.callback(SimpleNamespace(system_id=1, component_id=154, fields_json=fields), None)


@pytest.fixture
def direct():
    return Direct()


@pytest.fixture
def feed(direct):
    feed = GimbalFeed()
    feed.subscribe(direct)
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
def test_its_yaw_is_to_the_heading_or_to_north(direct, feed, flags, yaw_rad):
    direct.tell(list(quaternion_from_euler(0.0, -0.3, 0.5)), flags)
    assert euler_from_quaternion(feed.newest.ned(1.0)) == pytest.approx((0.0, -0.3, yaw_rad))


@pytest.mark.parametrize("q", [[0.0, 0.0, 0.0, 0.0], [nan, 0.0, 0.0, 0.0], [None] * 4, [1.0, 0.0]])
def test_what_is_no_attitude_is_ignored(direct, feed, q):
    direct.tell(q, IN_VEHICLE_FRAME)
    assert feed.newest is None
