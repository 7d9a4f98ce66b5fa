"""Following a path: the simulated drone in lockstep stays clean through layouts that it knows."""

from __future__ import annotations

import pytest

from framerunner.flying.response import Response
from tests.offboard.navigation.flown_layouts import Layout, fly


@pytest.mark.parametrize("seed", [200, 203])
def test_known_layout_is_flown_cleanly_while_planning_again(seed: int):
    report, farthest_m, limited_s = fly(Layout.random(seed), replan_s=0.4)
    assert report.verdict == "clean"
    assert max(report.crossing_offsets_m) < 0.05
    assert farthest_m < 0.3
    assert limited_s == 0.0


def test_vehicle_that_answers_late_is_flown_cleanly_but_more_slowly():
    late = Response(lag_s=0.6, dead_time_s=0.15, height_wander_m=0.05)
    report, _, limited_s = fly(Layout.random(203), replan_s=0.8, response=late)
    assert report.verdict == "clean"
    assert max(report.crossing_offsets_m) < 0.07
    assert limited_s == 0.0
