from dataclasses import replace

import pytest

from scenarios.touchdown import Landing
from scenarios.verdict import TryFacts, Verdict, judge

ALL = ("red", "green", "blue")
GOOD = TryFacts(
    missed_goal="",
    expected=ALL,
    crossed=ALL,
    contact_frames=(),
    outside_s=0.0,
    try_time_s=92.14,
    began=True,
    taken_off=True,
    motors_on=False,
    settled=True,
    timed_out=False,
    wrong_order="",
    crash="",
    landing=Landing("base", 0.02),
)


@pytest.mark.parametrize(
    ("changes", "ended", "verdict", "reason"),
    [
        ({}, None, "clean", "clean after 92.1 s in here; crossed: red, green, blue"),
        ({}, "interrupted", "clean", "clean after 92.1 s in here; crossed: red, green, blue"),
        (
            {"contact_frames": ("red", "blue", "red"), "outside_s": 0.8},
            None,
            "completed",
            "completed after 92.1 s in here (contacts: 3, with red, blue; outside the arena for 0.80 s); "
            "crossed: red, green, blue",
        ),
        (
            {"outside_s": 0.01},
            None,
            "completed",
            "completed after 92.1 s in here (outside the arena for 0.01 s); crossed: red, green, blue",
        ),
        (
            {"timed_out": True, "crossed": (), "landing": None, "try_time_s": 180.0},
            "the limit was reached",
            "timed out",
            "timed out after 180.0 s in here; crossed: none",
        ),
        (
            {"crash": "hit the floor at 3.0 m/s", "landing": None, "crossed": ("red",)},
            "link lost",
            "crashed",
            "crashed after 92.1 s in here (the drone hit the floor at 3.0 m/s); crossed: red",
        ),
        (
            {"wrong_order": "crossed blue before green at 9.0 s", "crossed": ("red", "blue")},
            None,
            "wrong order",
            "wrong order after 92.1 s in here (crossed blue before green at 9.0 s); crossed: red, blue",
        ),
        (
            {
                "wrong_order": "crossed blue before red at 9.0 s",
                "crossed": ("blue",),
                "crash": "fell",
                "timed_out": True,
            },
            None,
            "wrong order",
            "wrong order after 92.1 s in here (crossed blue before red at 9.0 s; the drone fell); "
            "crossed: blue",
        ),
        (
            {"crossed": ("red",), "landing": None, "motors_on": True, "settled": False},
            "link\nlost",
            "aborted",
            "aborted after 92.1 s in here (link lost); crossed: red",
        ),
        (
            {"crossed": ("red",)},
            None,
            "aborted",
            "aborted after 92.1 s in here (landed on the base without crossing green, blue); crossed: red",
        ),
        (
            {"landing": Landing("floor", 1.234)},
            None,
            "aborted",
            "aborted after 92.1 s in here (landed 1.23 m from the base's centre, not on the base); "
            "crossed: red, green, blue",
        ),
        (
            {"landing": None},
            None,
            "aborted",
            "aborted after 92.1 s in here (did not come to rest on base or floor); crossed: red, green, blue",
        ),
    ],
)
def test_verdict_and_reason(changes, ended, verdict, reason):
    facts = replace(GOOD, **changes)
    assert judge(facts, "here", ended) == (verdict, reason)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"began": False, "settled": False}, "the motors were never on"),
        ({"motors_on": True, "settled": False}, "the motors were still on"),
        ({"settled": False}, "not yet at rest"),
        ({"taken_off": False}, "never took off"),
    ],
)
def test_the_reason_names_what_a_try_lacks(changes, words):
    verdict, reason = judge(replace(GOOD, landing=None, **changes))
    assert verdict is Verdict.ABORTED
    assert words in reason


def test_without_a_mission_no_state_is_named():
    assert judge(GOOD)[1] == "clean after 92.1 s; crossed: red, green, blue"
