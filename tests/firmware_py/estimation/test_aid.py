"""The gate of one kind of measurement: its noise as measured, and how often the estimate is set to it."""

import pytest

from firmware_py.estimation.aiding.aid import Aid
from firmware_py.estimation.navigation_filter import NavigationFilter
from firmware_py.estimation.settings import InertialNoise
from sitl.sensors.noise import normal_numbers

PERIOD_US = 20_000


def aid(max_resets=None):
    return Aid("place", 2, 5.0, 1_000_000, max_resets)


def variances(innovations, reported=1e-4):
    measured, found = aid(), []
    for number, innovation in enumerate(innovations):
        found.append(measured.variance(innovation, reported, number * PERIOD_US))
    return found


def noise(sigma, count=400):
    numbers = normal_numbers(3, "test", 2)
    return [tuple(sigma * each for each in next(numbers)) for _ in range(count)]


def test_noise_as_reported_counts_as_reported():
    assert set(variances(noise(0.01))) == {1e-4}


def test_much_more_noise_than_reported_is_measured():
    found = variances(noise(0.2))[100:]
    assert sum(found) / len(found) == pytest.approx(0.04, rel=0.2)


def test_an_estimate_that_drifts_away_is_no_noise():
    drifting = [(0.02 * number, -0.01 * number) for number in range(400)]
    assert set(variances(drifting)) == {1e-4}


def test_innovations_before_and_after_a_pause_are_not_compared():
    measured = aid()
    for now_us in (0, PERIOD_US, 2 * PERIOD_US):
        measured.variance((0.0, 0.0), 1e-4, now_us)
    later_us = 3_000_000
    assert measured.variance((9.0, 9.0), 1e-4, later_us) == 1e-4
    assert measured.variance((9.0, 9.0), 1e-4, later_us + PERIOD_US) == 1e-4
    assert measured.variance((9.0, 9.0), 1e-4, later_us + 2 * PERIOD_US) == 1e-4


def resets(max_resets, seconds):
    """How often within a time an estimate is set to measurements that never fit."""
    into, measured, count = NavigationFilter(InertialNoise()), aid(max_resets), 0
    measured.fuse_states(into, 6, (0.0, 0.0), (1.0, 1.0))
    for tick in range(1, seconds * 50):
        into.time_us = tick * PERIOD_US
        if measured.is_overdue(into.time_us):
            measured.accept_any()
            count += 1
        measured.fuse_states(into, 6, (1e6, 1e6), (1.0, 1.0))
    return count


def test_a_source_that_never_fits_is_believed_twice_in_ten_seconds():
    assert resets(2, 9) == 2
    assert resets(2, 20) == 4
    assert resets(None, 9) == 8
