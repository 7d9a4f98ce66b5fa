"""Characters of a terminal and their times, and what the operator demands by them."""

import os
import pty
import signal
import subprocess
import sys
import termios
from math import ceil
from textwrap import dedent

import pytest

from framerunner.preflight.keys import KeyReader
from offboard.safety.operator import Operator
from tests.processes import wait_until


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
    "repetition",
    [
        {"delay_s": 0.25, "rate_hz": 10.9},
        {"delay_s": 0.66, "rate_hz": 25.0},
        {"delay_s": 0.375, "rate_hz": 11.1},
    ],
    ids=["Linux console", "X11", "macOS"],
)
def test_a_held_key_gives_the_go_with_the_repetition_that_is_usual_there(repetition):
    assert type_keys(Operator(), *held("g", 1.0, 2.7, **repetition)).has_go


def test_characters_that_a_slow_network_delivers_together_give_the_go():
    late = [(key, ceil(at_s / 0.25) * 0.25) for key, at_s in held("g", 1.0, 2.5)]
    assert type_keys(Operator(), *late).has_go


@pytest.mark.parametrize(
    "characters",
    [
        held("g", 1.0, 1.8),
        [("g", 1.0)],
        [("g", 1.0), ("g", 3.0), ("g", 5.0)],
        [("g", 1.0), ("g", 1.7), ("g", 2.4)],
        held("g", 1.0, 6.0, delay_s=0.14, rate_hz=7.0),
        [("g", 1.0)] * 20,
        held("h", 1.0, 3.0),
    ],
    ids=["let go", "once", "now and then", "three times", "fast taps", "pasted", "another key"],
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


def test_what_is_pressed_again_is_demanded_again():
    operator = type_keys(Operator(needs_go=False), (" ", 1.0), (" ", 4.0), ("k", 5.0), ("k", 6.0), ("k", 9.0))
    assert (operator.landings, operator.motor_stops) == (2, 3)


def test_k_alone_means_nothing():
    assert type_keys(Operator(needs_go=False), *held("k", 1.0, 3.0)).stops == 0


def test_no_go_after_a_stop():
    operator = type_keys(Operator(), (" ", 1.0), *held("g", 2.0, 4.0))
    assert (operator.has_go, operator.stops) == (False, 1)


PROGRAM = dedent("""\
    import asyncio
    from framerunner.preflight.keys import TerminalKeys
    from offboard.safety.operator import Operator

    async def main():
        operator, stopped = Operator(), asyncio.Event()
        operator.on_stop(stopped.set)
        async with TerminalKeys(operator):
            print("ready", flush=True)
            await stopped.wait()

    asyncio.run(main())
    """)


def test_a_program_that_was_stopped_takes_its_keys_again():
    """As a shell does, somebody sets the terminal's modes meanwhile; a stop by the terminal has no effect."""
    ours, terminal = pty.openpty()
    cooked = termios.tcgetattr(terminal)
    command = [sys.executable, "-c", PROGRAM]
    try:
        with subprocess.Popen(command, stdin=terminal, stdout=subprocess.PIPE) as program:
            assert program.stdout.readline() == b"ready\n"
            program.send_signal(signal.SIGTSTP)
            program.send_signal(signal.SIGSTOP)
            os.waitid(os.P_PID, program.pid, os.WSTOPPED)
            termios.tcsetattr(terminal, termios.TCSANOW, cooked)
            program.send_signal(signal.SIGCONT)
            assert wait_until(lambda: not termios.tcgetattr(terminal)[3] & termios.ICANON, 5.0)
            os.write(ours, b" ")
            assert program.wait(5.0) == 0
        assert termios.tcgetattr(terminal)[3] & termios.ICANON
    finally:
        os.close(ours)
        os.close(terminal)
