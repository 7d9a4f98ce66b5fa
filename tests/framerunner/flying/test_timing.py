"""What a flight says of a machine that did not keep up."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from framerunner.flying.real_time import flight_timing


def timing(ticks=(2000, 0), oldest_s=0.11, missed=None, factor=1.0, fused=True, repeats=True):
    drone, perception = SimpleNamespace(ticks_in_flight=ticks), SimpleNamespace(oldest_s=oldest_s)
    clock = None if missed is None else SimpleNamespace(images_missed=missed[0], setpoints_missed=missed[1])
    return flight_timing(drone, perception, clock, factor, 1.0, fused=fused, repeats=repeats)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, ""),
        ({"missed": (0, 0)}, ""),
        (
            {"ticks": (2000, 62), "oldest_s": 0.312},
            "3.1 % of ticks were late, the oldest image was 0.31 s old; "
            "the flight was still fused by time stamps",
        ),
        (
            {"ticks": (2000, 2), "missed": (1, 3), "fused": False},
            "0.1 % of ticks were late, 1 image came late, 3 setpoints came late, "
            "the oldest image was 0.11 s old; the flight may differ from one on a free machine",
        ),
        (
            {"missed": (0, 0), "factor": 0.9},
            "vehicle time ran at 0.90 of the requested speed; it waited for the app, so the flight is the "
            "same as on a free machine",
        ),
        (
            {"missed": (0, 0), "factor": 0.9, "repeats": False},
            "vehicle time ran at 0.90 of the requested speed; it waited for the app, but the flight may "
            "differ from one on a free machine",
        ),
        ({"factor": 0.9}, "vehicle time ran at 0.90 of the requested speed; nothing came late to the app"),
    ],
)
def test_what_was_late_is_said_in_words_only_if_something_was(values, words):
    told = timing(**values)
    assert told.words == (f"the machine did not keep up: {words}" if words else "")
    assert told.kept_up == (not words)


def test_late_ticks_are_a_share_of_all_ticks_also_of_none():
    assert timing(ticks=(400, 10)).late_share == 0.025
    assert timing(ticks=(0, 0)).late_share == 0.0
