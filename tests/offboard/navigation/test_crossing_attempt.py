"""Why an attempt to cross a gate is given up."""

from dataclasses import replace

import pytest

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape
from offboard.navigation.crossing_attempt import CrossingAttempt
from offboard.navigation.goals import PathGate
from offboard.navigation.path import Crossing
from offboard.navigation.view import GateEstimate

UNSURE = GateEstimate("red", (2.0, 0.0, 1.0), 0.0, (0.1, 0.1, 0.1), 0.1, False, False, 3, 0)
CERTAIN = replace(UNSURE, certain=True)


def attempt(known=None):
    crossing = CrossingAttempt("red", 0.0, 0.0, 0.0)
    if known is not None:
        crossing.must_look(known, 2.0, 1.5, 0.0)
    return crossing


def test_each_reason_is_said():
    lost = attempt()
    lost.lose(1.0)
    assert lost.refusal == ""
    lost.lose(2.0)
    assert lost.refusal == "lost from the map"
    blocked = attempt()
    blocked.fly(no_path="obstacles block the way to gate 1", now_s=3.0)
    assert blocked.refusal == "no path: obstacles block the way to gate 1"
    unsure = attempt()
    assert not unsure.must_look(UNSURE, 1.6, 1.5, 0.0)
    for now_s in (1.0, 6.0):
        assert unsure.must_look(UNSURE, 1.4, 1.5, now_s)
    assert unsure.refusal == "still not certain after 4 s before it"
    slow = attempt()
    slow.move((0.0, 0.0, 1.0), 26.0)
    assert slow.refusal == "not through it within 25 s"
    near = attempt()
    near.aim(Crossing(PathGate((2.0, 0.0, 1.0), 0.0), 0.0, 1.0))
    near.move((1.5, 0.0, 1.0), 26.0)
    assert near.refusal == ""
    near.move((1.5, 0.0, 1.0), 36.0)
    assert near.refusal == "not through it within 25 s"
    stuck = attempt()
    for tick in range(13):
        stuck.move((0.2 * tick % 0.3, 0.0, 1.0), 0.5 * tick)
        assert stuck.refusal == ""
    stuck.move((0.1, 0.0, 1.0), 6.5)
    assert stuck.refusal == "stuck for 6 s"


def test_the_drone_must_be_nearer_to_the_axis_of_a_narrow_opening_before_it_commits():
    for shape, committed in ((PAPER_GATE, True), (GateShape(0.31, 0.2, 0.01, 0.01), False)):
        crossing = attempt(CERTAIN)
        crossing.aim(Crossing(PathGate((2.0, 0.0, 1.0), 0.0, shape), 0.0, 1.0))
        crossing.move((1.75, 0.04, 1.0), 1.0)
        assert crossing.is_committed is committed


def test_a_miss_is_refused_and_a_passage_is_not():
    missed, wide = "passed its plane 0.30 m from its centre", GateShape(outer_width_m=0.8)
    for left_m, shape, refusal in ((0.3, PAPER_GATE, missed), (0.05, PAPER_GATE, ""), (0.3, wide, "")):
        crossing = attempt(CERTAIN)
        crossing.aim(Crossing(PathGate((2.0, 0.0, 1.0), 0.0, shape), 0.0, 1.0))
        for x_m in (1.9, 2.1):
            crossing.move((x_m, left_m, 1.0), 1.0)
        assert (crossing.refusal, crossing.passed) == (refusal, not refusal)


@pytest.mark.parametrize("known", [UNSURE, replace(CERTAIN, position_m=(4.0, 1.0, 1.0))])
def test_a_guess_is_not_flown_through_as_a_gate(known):
    """What the path leads through has never been certain, or what was certain is elsewhere."""
    crossing = attempt(known)
    crossing.aim(Crossing(PathGate((2.0, 0.0, 1.0), 0.0), 0.0, 1.0))
    crossing.move((1.9, 0.0, 1.0), 1.0)
    assert not crossing.is_committed
    crossing.move((2.1, 0.0, 1.0), 1.1)
    assert (crossing.refusal, crossing.passed) == ("passed its plane before it was certain", False)
