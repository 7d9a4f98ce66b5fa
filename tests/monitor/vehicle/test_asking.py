"""What a vehicle is asked for: little, and never for less than it sends."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from monitor.vehicle.asking import BootTime, RateWatch


def wanted(messages):
    return [(each.target_system, each.command, each.param1, each.param2) for each in messages]


@pytest.mark.parametrize("rate_hz", [15.0, 25.0, 50.0, 100.0])
def test_enough_is_left_as_it_is(rate_hz):
    watch = RateWatch(1, 0.0)
    for second in range(1, 30):
        assert watch.questions((round(second * rate_hz), round(second * rate_hz)), float(second)) == []


def test_only_what_is_slow_is_asked_for_and_not_for_ever():
    watch = RateWatch(3, 0.0)
    assert watch.questions((10, 1), 1.0) == []
    assert wanted(watch.questions((60, 4), 3.0)) == [(3, 511, 32, 40_000)]
    assert watch.questions((80, 5), 4.0) == []
    asked = [watch.questions((60 + 20 * second, second), 3.0 + 3 * second) for second in range(1, 30)]
    assert [len(each) for each in asked] == [2] * 4 + [0] * 25


def test_a_drone_that_says_nothing_yet_is_not_asked():
    watch = RateWatch(1, 0.0)
    assert watch.questions((0, 0), 10.0) == []


def time_told(unix_us, boot_ms):
    return mavlink.MAVLink_system_time_message(unix_us, boot_ms)


def test_the_boot_is_named_by_the_first_date_that_is_one():
    boot = BootTime(1)
    assert wanted([boot.question(0.0)]) == [(1, 512, 2, 0)]
    assert boot.question(1.0) is None
    boot.take(time_told(0, 5000))
    assert boot.unix_us is None
    boot.take(time_told(1_700_000_005_000_000, 5000))
    boot.take(time_told(1_800_000_005_000_000, 5000))
    assert boot.unix_us == 1_700_000_000_000_000
    assert boot.question(100.0) is None


def test_a_drone_without_a_date_is_left_alone():
    boot = BootTime(1)
    assert sum(boot.question(3.0 * count) is not None for count in range(40)) == 5
