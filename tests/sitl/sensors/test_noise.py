"""Random processes, sampling times and delays."""

from itertools import pairwise

import numpy as np
import pytest

from sitl.sensors.noise import Delay, GaussMarkov, SamplingTimes, normal_numbers
from tests.sitl.sensors.statistics import TICK_US, autocorrelation


def test_a_gauss_markov_process_has_its_spread_and_autocorrelation_for_any_step():
    for step_s in (0.1, 2.0):
        process = GaussMarkov(1, "test", 4, 3.0, 10.0)
        values = np.array([process.advance(step_s) for _ in range(round(10_000 / step_s))])
        assert values.std() == pytest.approx(3.0, rel=0.06)
        for lag_s in (4.0, 10.0, 20.0):
            expected = np.exp(-lag_s / 10.0)
            assert autocorrelation(values, round(lag_s / step_s)) == pytest.approx(expected, abs=0.05)


def test_a_gauss_markov_process_begins_in_its_steady_state():
    assert np.std([GaussMarkov(seed, "test", 3, 2.0, 10.0).values for seed in range(300)]) == pytest.approx(
        2.0, rel=0.1
    )


def test_normal_numbers_are_normal_and_go_on_beyond_a_block():
    numbers = normal_numbers(1, "test", 3)
    values = np.array([next(numbers) for _ in range(20_000)])
    assert values.mean(axis=0) == pytest.approx(0.0, abs=0.03)
    assert values.std(axis=0) == pytest.approx(1.0, rel=0.02)
    assert abs(autocorrelation(values, 256)) < 0.02


@pytest.mark.parametrize("rate_hz", [8.0, 25.0, 30.0, 50.0, 250.0])
def test_the_mean_rate_is_exact_and_no_two_samples_are_nearer_than_a_tick_less_than_a_period(rate_hz):
    times = SamplingTimes(rate_hz)
    found = [tick * TICK_US for tick in range(15_000) if times.due(tick * TICK_US)]
    assert len(found) == 60 * rate_hz
    gaps = [after - before for before, after in pairwise(found)]
    assert max(gaps) - 1e6 / rate_hz < TICK_US
    assert 1e6 / rate_hz - min(gaps) < TICK_US


def test_no_samples_are_made_up_for_times_that_were_left_out():
    times = SamplingTimes(50.0)
    assert [times.due(time_us) for time_us in (0, 1_000_000, 1_004_000, 1_020_000)] == [
        True,
        True,
        False,
        True,
    ]


def test_only_the_newest_arrived_sample_is_delivered():
    delay = Delay(0.03)
    for time_us in (0, 10_000, 20_000):
        delay.send(time_us, time_us)
    assert delay.newest(29_999) is None
    assert delay.newest(41_000) == 10_000
    assert delay.newest(45_000) is None
    assert delay.newest(50_000) == 20_000
