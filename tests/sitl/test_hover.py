"""Drones on honest sensors hold their place, and follow velocities in wind; see also `benchmarks.hover`."""

import numpy as np
import pytest

from benchmarks.hover import follow_velocity, hold_place


@pytest.mark.parametrize("airframe", ["abejorro", "racer-3in"])
def test_with_motion_capture_it_stays_within_three_centimetres(airframe):
    assert hold_place("mocap", airframe, seed=11, seconds=25.0).max_m < 0.03


def test_outdoors_it_drifts_slowly_with_gps():
    held = [hold_place("outdoor", "x500", seed, seconds=25.0) for seed in (11, 12, 13)]
    assert np.sqrt(np.mean([each.absolute_m**2 for each in held])) < 1.5
    assert max(each.relative_m for each in held) < 0.3


@pytest.mark.parametrize(
    ("suite", "airframe", "limit_m_s"),
    [("ideal", "x500", 0.01), ("outdoor", "x500", 0.05), ("mocap", "racer-3in", 0.03)],
)
def test_wind_of_five_metres_a_second_leaves_no_steady_error_of_velocity(suite, airframe, limit_m_s):
    assert follow_velocity(suite, airframe, seed=11, seconds=20.0, wind_m_s=5.0) < limit_m_s
