"""Simulated time and wall time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.pacing.pacer import Pacer


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_time_passes_at_the_given_speed_without_drift(speed):
    pacer = Pacer(speed, now_s=100.0)
    assert pacer.target_us(100.0) == 0
    assert pacer.target_us(100.0 + 36000.0) == round(36000e6 * speed)
    assert pacer.wait_s(100.0, 4000) == pytest.approx(0.004 / speed)
    assert pacer.wait_s(101.0, 4000) == 0.0


def test_a_short_delay_is_caught_up():
    pacer = Pacer(1.0, now_s=0.0)
    assert pacer.give_up_lag(1.0, 950_000) == 0.0
    assert pacer.target_us(1.0) == 1_000_000


def test_a_long_delay_slows_simulated_time_and_skips_nothing():
    pacer = Pacer(2.0, now_s=0.0)
    assert pacer.give_up_lag(1.0, 1_000_000) == pytest.approx(0.5)
    assert pacer.target_us(1.0) == 1_000_000
    assert pacer.target_us(1.5) == 2_000_000


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=50))
def test_the_target_never_goes_back_below_what_was_reached(delays):
    pacer, now_s, time_us = Pacer(1.0, 0.0), 0.0, 0
    for delay_s in delays:
        now_s += delay_s
        time_us = min(pacer.target_us(now_s), time_us + 100_000)  # a machine too slow
        pacer.give_up_lag(now_s, time_us)
        assert time_us <= pacer.target_us(now_s) <= time_us + 100_001


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), 1e9])
def test_refuses_a_speed_that_makes_no_sense(speed):
    with pytest.raises(ValueError, match="speed"):
        Pacer(speed, 0.0)
