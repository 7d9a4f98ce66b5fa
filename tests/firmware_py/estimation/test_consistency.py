"""Errors of eight flights agree with the filter's covariance; `benchmarks.estimation` flies 200."""

import numpy as np
import pytest
from scipy.stats import chi2

from benchmarks.estimation import STATES, fly


def share(values, numbers):
    low, high = chi2.ppf((0.025, 0.975), numbers)
    return np.mean((np.array(values) > low) & (np.array(values) < high))


@pytest.mark.parametrize("suite", ["mocap", "outdoor", "flow"])
def test_errors_and_innovations_are_in_their_bounds(suite):
    flights = [fly(suite, 300 + seed, 6.0) for seed in range(8)]
    assert share([value for flight in flights for value in flight.nees], STATES) >= 0.9
    for name, (numbers, _) in flights[0].nis.items():
        values = [value for flight in flights for value in flight.nis[name][1]]
        assert share(values, numbers) >= 0.9, name
        assert np.mean(values) == pytest.approx(numbers, rel=0.15), name
