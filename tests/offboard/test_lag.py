"""How late a vehicle answers is learned from what it is told and what it does."""

from math import exp, sin

import pytest

from offboard.link.lag import FIRST_S, LONGEST_S, LagEstimate

STEP_S = 0.05


def watch(estimate, lag_s, told, seconds=20.0):
    """Show it a vehicle of first order, commanded by `told(time)`."""
    speed = 0.0
    for tick in range(round(seconds / STEP_S)):
        wanted = told(tick * STEP_S)
        speed = wanted + exp(-STEP_S / lag_s) * (speed - wanted)
        estimate.see(wanted, speed, STEP_S)
    return estimate.lag_s


def steps(time_s):
    return 0.5 if time_s % 4.0 < 2.0 else -0.2


@pytest.mark.parametrize("lag_s", [0.1, 0.2, 0.4, 0.6])
@pytest.mark.parametrize("told", [steps, lambda time_s: 0.4 * sin(2.0 * time_s)])
def test_learns_the_lag(lag_s, told):
    assert watch(LagEstimate(0.1), lag_s, told) == pytest.approx(lag_s, abs=0.05)


def test_guesses_before_it_has_seen_a_change_and_takes_no_noise_for_one():
    estimate = LagEstimate(0.1)
    assert estimate.lag_s == FIRST_S
    for tick in range(200):
        estimate.see(0.3, 0.04 * (-1) ** tick, STEP_S)
    assert estimate.lag_s == FIRST_S


def test_stays_within_bounds():
    assert watch(LagEstimate(0.1), 2.0, lambda _: 1.0) == LONGEST_S
    ahead = LagEstimate(0.1)
    for tick in range(100):
        ahead.see(0.0, 0.02 * tick, STEP_S)  # speeds up untold
    assert ahead.lag_s == 0.0
