"""The observer learns a constant push with the poles it was given, within its limit."""

from math import exp

import pytest

from firmware_py.control.observer import DisturbanceObserver

PERIOD_S = 0.004


def learn(observer, push, seconds, *, known=0.0, velocity=0.0):
    for _ in range(round(seconds / PERIOD_S)):
        observer.correct((velocity, -velocity, 0.0))
        observer.predict(known, -known, 0.0)
        velocity += (push + known) * PERIOD_S
    return velocity


def test_learns_a_constant_push_with_a_double_pole():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    learn(observer, 3.0, 1.0)
    expected = 3.0 * (1 - exp(-2.0) * (1 + 2.0))
    assert observer.d[0] == pytest.approx(expected, rel=0.02)
    assert observer.d[1] == pytest.approx(-expected, rel=0.02)
    assert observer.d[2] == 0.0


def test_what_is_known_is_not_learnt():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    learn(observer, 0.0, 2.0, known=5.0)
    assert observer.d == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_starts_at_any_velocity_without_a_kick():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    learn(observer, 0.0, 0.1, velocity=12.0)
    assert observer.d == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_keeps_to_its_limit():
    observer = DisturbanceObserver(2.0, PERIOD_S, 1.0)
    learn(observer, 8.0, 3.0)
    assert observer.d == (1.0, -1.0, 0.0)


def test_held_it_learns_nothing_and_forgets_nothing():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    velocity = learn(observer, 3.0, 3.0)
    before = observer.d
    for _ in range(250):
        observer.hold((velocity, -velocity, 0.0))
    observer.correct((velocity, -velocity, 0.0))
    assert observer.d == before
    observer.reset()
    assert observer.d == (0.0, 0.0, 0.0)
