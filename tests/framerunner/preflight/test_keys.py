"""Characters of a terminal and their times, and what the operator demands by them."""

import pytest

from framerunner.preflight.keys import KeyReader
from offboard.safety.operator import Operator


def type_keys(operator, *characters):
    """Characters as (key, time)."""
    operator.ask_for_go()
    reader = KeyReader(operator)
    for key, at_s in sorted(characters, key=lambda each: each[1]):
        reader.take(key, at_s)
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


@pytest.mark.parametrize("to_s", [1.1, 1.51, 1.55, 4.0])
def test_a_stop_that_is_held_or_pressed_again_is_one_stop(to_s):
    keys = (*held(" ", 1.0, to_s), (" ", 5.0), (" ", 5.3))
    operator = type_keys(Operator(needs_go=False), *keys)
    assert (operator.stops, operator.kills) == (1, False)


@pytest.mark.parametrize("key", ["k", "K"])
def test_k_after_a_stop_stops_the_motors(key):
    assert type_keys(Operator(needs_go=False), (" ", 1.0), (key, 1.1)).kills
    assert type_keys(Operator(needs_go=False), *held(" ", 1.0, 3.0), *held(key, 3.1, 5.0)).stops == 2


def test_k_alone_means_nothing():
    assert type_keys(Operator(needs_go=False), *held("k", 1.0, 3.0)).stops == 0


def test_no_go_after_a_stop():
    operator = type_keys(Operator(), (" ", 1.0), *held("g", 2.0, 4.0))
    assert (operator.has_go, operator.stops) == (False, 1)
