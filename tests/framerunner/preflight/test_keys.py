"""Characters of a terminal and their times, and what the operator demands by them."""

import pytest

from framerunner.preflight.keys import KeyReader
from offboard.safety.operator import Operator


def type_keys(operator, *characters, until_s=10.0):
    """Characters as (key, time), then silence; the reader is updated every 50 ms."""
    reader, left = KeyReader(operator), sorted(characters, key=lambda each: each[1])
    for step in range(round(until_s / 0.01)):
        now_s = step / 100
        while left and left[0][1] <= now_s:
            key, at_s = left.pop(0)
            reader.take(key, at_s)
        if step % 5 == 0:
            reader.update(now_s)
    return operator


def held(key, from_s, to_s, delay_s=0.5, rate_hz=30.0):
    """A key that is held: its repetition begins after a delay."""
    times = [from_s]
    at_s = from_s + delay_s
    while at_s < to_s:
        times.append(at_s)
        at_s += 1 / rate_hz
    return [(key, each) for each in times]


@pytest.mark.parametrize("key", ["g", "G"])
def test_a_held_key_gives_the_go(key):
    assert type_keys(Operator(), *held(key, 1.0, 2.2)).has_go


@pytest.mark.parametrize(
    "characters",
    [held("g", 1.0, 1.8), [("g", 1.0)], [("g", 1.0), ("g", 3.0), ("g", 5.0)], held("h", 1.0, 3.0)],
    ids=["let go", "once", "now and then", "another key"],
)
def test_less_gives_no_go(characters):
    assert not type_keys(Operator(), *characters).has_go


def test_another_key_interrupts_the_go():
    characters = [*held("g", 1.0, 1.7), ("x", 1.71), *held("g", 1.72, 2.4)]
    assert not type_keys(Operator(), *characters).has_go


@pytest.mark.parametrize("delay_s", [0.25, 0.5, 0.66])
def test_a_stop_that_is_held_is_one_stop(delay_s):
    operator = type_keys(Operator(needs_go=False), *held(" ", 1.0, 4.0, delay_s))
    assert (operator.stops, operator.kills) == (1, False)


@pytest.mark.parametrize("gap_s", [0.2, 0.4, 0.6, 1.0, 3.0])
def test_two_presses_stop_the_motors(gap_s):
    operator = type_keys(Operator(needs_go=False), (" ", 1.0), (" ", 1.0 + gap_s))
    assert operator.kills


def test_a_second_press_after_a_held_one_stops_the_motors():
    operator = type_keys(Operator(needs_go=False), *held(" ", 1.0, 2.0), (" ", 2.4))
    assert operator.kills


def test_a_second_press_that_is_held_stops_the_motors():
    operator = type_keys(Operator(needs_go=False), (" ", 1.0), *held(" ", 2.0, 4.0))
    assert operator.stops >= 2


def test_no_go_after_a_stop():
    operator = type_keys(Operator(), (" ", 1.0), *held("g", 2.0, 4.0))
    assert (operator.has_go, operator.stops) == (False, 1)
