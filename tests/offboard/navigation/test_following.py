"""Following a path: the simulated drone in lockstep stays clean through layouts that it knows."""

from __future__ import annotations

import pytest

from tests.offboard.navigation.flown_layouts import Layout, fly


@pytest.mark.parametrize("seed", [200, 203])
def test_known_layout_is_flown_cleanly_while_planning_again(seed: int):
    report, farthest_m, limited_s = fly(Layout.random(seed), replan_s=0.4)
    assert report.verdict == "clean"
    assert max(report.crossing_offsets_m) < 0.05
    assert farthest_m < 0.3
    assert limited_s == 0.0
