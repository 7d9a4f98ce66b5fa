"""Frames of random shapes, and random cameras."""

import re
from math import atan, cos, isclose

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.geometry.gate_shape import PAPER_GATE
from scenarios.loader import dump_yaml, parse_scenario
from scenarios.random_numbers import MAX_SEED, LevelError, Range
from scenarios.random_scenarios import load_level, random_scenario

SIZES, VIEWS, CALM = (load_level(name) for name in ("sizes", "views", "calm"))
seeds = st.integers(0, MAX_SEED) | st.integers(0, 1000)


@given(seeds)
def test_the_drone_fits_through_every_frame_of_sizes(seed):
    scenario = random_scenario(SIZES, seed)
    for gate in scenario.frames:
        width_m, height_m = gate.opening_m
        assert width_m >= 0.29 - 1e-9 and height_m >= 0.11 - 1e-9
        assert 0.3 <= gate.outer_width_m <= 1.5 and 0.15 <= gate.outer_height_m <= 1.5
        assert gate.z_m - gate.outer_height_m / 2 >= 0.2 - 1e-9
    assert len({gate.shape for gate in scenario.frames}) in (1, 3)
    assert parse_scenario(dump_yaml(scenario)) == scenario


def test_shapes_differ_within_half_of_the_layouts_and_reach_from_narrow_to_wide():
    scenarios = [random_scenario(SIZES, seed) for seed in range(300)]
    several = [scenario for scenario in scenarios if len({gate.shape for gate in scenario.frames}) > 1]
    assert 120 < len(several) < 180
    widths_m = [gate.outer_width_m for scenario in scenarios for gate in scenario.frames]
    assert min(widths_m) < 0.36 and max(widths_m) > 1.45
    assert any(gate.outer_height_m > gate.outer_width_m for gate in scenarios[0].frames + scenarios[3].frames)


def test_shapes_change_nothing_else_that_is_drawn():
    plain = SIZES.model_copy(update={"shapes": None})
    for seed in range(5):
        shaped, other = random_scenario(SIZES, seed), random_scenario(plain, seed)
        assert [(a.x_m, a.y_m, a.yaw_rad) for a in shaped.frames] == [
            (a.x_m, a.y_m, a.yaw_rad) for a in other.frames
        ]
        assert all(gate.shape == PAPER_GATE for gate in other.frames)


@given(seeds)
def test_views_has_the_layout_of_calm_and_larger_images(seed):
    scenario, calm = random_scenario(VIEWS, seed), random_scenario(CALM, seed)
    assert (scenario.base, scenario.start, scenario.frames) == (calm.base, calm.start, calm.frames)
    camera = scenario.camera
    assert (camera.width_px, camera.height_px) in ((640, 480), (1280, 720))
    roll_rad, pitch_rad, yaw_rad = camera.mounting_frd_rad
    assert roll_rad == yaw_rad == 0.0 and abs(pitch_rad) <= 0.349
    half_rad = atan(camera.width_px / 2 / camera.focal_px)
    assert isclose(2.0 * half_rad, camera.horizontal_fov_rad) and cos(half_rad) > 0.7


def test_a_level_whose_frames_nothing_fits_is_refused_in_one_line():
    narrow = SIZES.shapes.model_copy(update={"outer_width_m": Range(low=0.1, high=0.2)})
    with pytest.raises(LevelError, match=re.escape("widen outer_width_m or aspect")):
        random_scenario(SIZES.model_copy(update={"shapes": narrow}), 1)
