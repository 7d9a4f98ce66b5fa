import itertools
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from scenarios.loader import dump_yaml, parse_scenario
from scenarios.models import COLOURS, Arena, Camera, Light
from scenarios.random_numbers import MAX_SEED, LevelError, random_stream
from scenarios.random_scenarios import load_level, random_scenario

ROOT = Path(__file__).parents[2]
CALM = load_level("calm")
seeds = st.integers(0, MAX_SEED) | st.integers(0, 1000)


def with_layout(**changes):
    return CALM.model_copy(update={"layout": CALM.layout.model_copy(update=changes)})


def places(scenario):
    return [(part.x_m, part.y_m) for part in (scenario.base, *scenario.frames)]


@given(seeds)
def test_scenarios_of_calm_are_within_its_limits(seed):
    scenario = random_scenario(CALM, seed)
    assert all(abs(value) <= 4 for place in places(scenario) for value in place)
    assert all(math.dist(*pair) >= 1.5 for pair in itertools.combinations(places(scenario), 2))
    assert tuple(gate.colour for gate in scenario.frames) == COLOURS
    assert all(0.5 <= gate.z_m <= 2.5 for gate in scenario.frames)
    assert all(abs(part.yaw_rad) <= math.pi for part in (scenario.start, *scenario.frames))
    assert (scenario.start.x_m, scenario.start.y_m) == (scenario.base.x_m, scenario.base.y_m)
    assert (scenario.arena, scenario.camera, scenario.light) == (Arena(), Camera(), Light())


@given(seeds)
def test_it_names_its_level_and_seed_and_round_trips(seed):
    scenario = random_scenario(CALM, seed)
    assert scenario.name == f"calm-{seed}"
    assert scenario.description == f"Random scenario of level calm, seed {seed}."
    assert parse_scenario(dump_yaml(scenario)) == scenario
    drawn = [*itertools.chain(*places(scenario)), scenario.start.yaw_rad]
    drawn += [value for gate in scenario.frames for value in (gate.z_m, gate.yaw_rad)]
    assert all(value == round(value, 3) for value in drawn)


def test_calm_17_never_changes():
    scenario = random_scenario(CALM, 17)
    assert places(scenario) == [(3.356, -2.251), (-1.088, -0.083), (-1.51, 1.82), (-2.403, -2.574)]
    assert [gate.z_m for gate in scenario.frames] == [2.265, 2.002, 2.189]
    assert [gate.yaw_rad for gate in scenario.frames] == [-2.429, -3.11, 2.478]
    assert scenario.start.yaw_rad == -1.224


@pytest.mark.parametrize("hash_seed", ["0", "4242"])
def test_another_process_draws_the_same(hash_seed):
    program = (
        "from scenarios.loader import dump_yaml\n"
        "from scenarios.random_scenarios import load_level, random_scenario\n"
        "for seed in (7, 3, 12345678901234): print(dump_yaml(random_scenario(load_level('calm'), seed)))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONUTF8": "1"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    here = [dump_yaml(random_scenario(CALM, seed)) + "\n" for seed in (7, 3, 12345678901234)]
    assert done.stdout == "".join(here)


def test_numpys_global_random_state_has_no_effect():
    np.random.seed(1)
    first = random_scenario(CALM, 9)
    np.random.seed(2)
    before = np.random.get_state()[1].copy()
    assert random_scenario(CALM, 9) == first
    assert (np.random.get_state()[1] == before).all()


def test_what_is_changed_in_one_part_of_a_level_changes_no_other():
    low = with_layout(frame_z_m=CALM.layout.frame_z_m.model_copy(update={"high": 1.0}))
    crowded = with_layout(apart_m=0.2)
    for seed in range(20):
        calm = random_scenario(CALM, seed)
        flat, near = random_scenario(low, seed), random_scenario(crowded, seed)
        assert flat.base == calm.base
        assert flat.start == calm.start
        assert [gate.yaw_rad for gate in flat.frames] == [gate.yaw_rad for gate in calm.frames]
        assert max(gate.z_m for gate in flat.frames) <= 1.0
        assert [(gate.z_m, gate.yaw_rad) for gate in near.frames] == [
            (gate.z_m, gate.yaw_rad) for gate in calm.frames
        ]


def test_the_name_of_a_level_changes_the_scenarios_name_only():
    other = CALM.model_copy(update={"name": "b" * 60})
    scenario = random_scenario(other, MAX_SEED)
    named = {"name": f"calm-{MAX_SEED}", "description": f"Random scenario of level calm, seed {MAX_SEED}."}
    assert scenario.model_copy(update=named) == random_scenario(CALM, MAX_SEED)


@pytest.fixture(scope="module")
def many():
    """1000 scenarios: fixed seeds, so the statistics below are the same in every run."""
    return [random_scenario(CALM, seed) for seed in range(1000)]


def uniformity(values, low, high):
    """p-value of a Kolmogorov-Smirnov test against the uniform distribution."""
    return stats.kstest(values, "uniform", args=(low, high - low)).pvalue


def test_heights_and_yaws_are_uniform(many):
    for index in range(3):
        gates = [scenario.frames[index] for scenario in many]
        assert uniformity([gate.z_m for gate in gates], 0.5, 2.5) > 0.001
        assert uniformity([gate.yaw_rad for gate in gates], -math.pi, math.pi) > 0.001
    assert uniformity([scenario.start.yaw_rad for scenario in many], -math.pi, math.pi) > 0.001


def test_places_fill_the_square_and_no_part_is_favoured(many):
    # Keeping apart pushes places outwards a little, all four parts alike: so each is compared with all.
    coordinates = np.array([places(scenario) for scenario in many])
    assert (np.abs(coordinates).max(axis=(0, 1)) > 3.99).all()
    for axis in (0, 1):
        pooled = coordinates[:, :, axis].ravel()
        counts, _ = np.histogram(pooled, bins=8, range=(-4, 4))
        assert counts.min() > 0.75 * counts.mean()
        assert counts.max() < 1.35 * counts.mean()
        for part in range(4):
            own, others = coordinates[:, part, axis], np.delete(coordinates, part, axis=1)[:, :, axis].ravel()
            assert stats.ks_2samp(own, others).pvalue > 0.001


def test_independent_draws_do_not_correlate(many):
    columns = [
        [
            *itertools.chain(*places(scenario)),
            scenario.start.yaw_rad,
            *(value for gate in scenario.frames for value in (gate.z_m, gate.yaw_rad)),
        ]
        for scenario in many
    ]
    matrix = np.corrcoef(np.array(columns).T)
    np.fill_diagonal(matrix, 0)
    matrix[:8, :8] = 0  # places keep apart: they do
    assert np.abs(matrix).max() < 5 / math.sqrt(len(many))


def test_both_ends_of_a_range_are_drawn():
    narrow = with_layout(frame_z_m=CALM.layout.frame_z_m.model_copy(update={"low": 2.499}))
    heights = {gate.z_m for seed in range(10) for gate in random_scenario(narrow, seed).frames}
    assert heights == {2.499, 2.5}


def test_impossible_distances_are_refused_in_one_line():
    with pytest.raises(LevelError) as caught:
        random_scenario(with_layout(apart_m=12.0), 3)
    assert str(caught.value) == (
        "level calm, seed 3: 20000 draws found no room for 4 places 12 m apart in 8 × 8 m; "
        "lower layout.apart_m or widen layout.x_m and layout.y_m"
    )


@pytest.mark.parametrize("seed", [-1, MAX_SEED + 1, -(10**30)])
def test_a_seed_out_of_range_is_refused_in_one_line(seed):
    with pytest.raises(LevelError) as caught:
        random_scenario(CALM, seed)
    assert str(caught.value) == f"seed {seed} is out of range; use a whole number from 0 to {MAX_SEED}"


def test_reading_scenarios_does_not_load_numpy():
    program = (
        "import sys; from scenarios.loader import load_scenario; load_scenario('empty')\n"
        "sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


def numbers(seed, name, count=4):
    stream = random_stream(seed, name)
    return [stream.random() for _ in range(count)]


def test_random_numbers_never_change():
    # Results of old seeds can be compared only while these numbers are the same: on every machine, for ever.
    assert numbers(1, "wind", 3) == [0.9660842807621509, 0.9907271339130758, 0.20296987957631096]
    assert numbers(MAX_SEED, "wind", 1) == [0.016727917582789242]


@given(st.integers(0, MAX_SEED), st.text(max_size=10), st.text(max_size=10))
def test_streams_differ_by_name(seed, name, other):
    assert (numbers(seed, name) == numbers(seed, other)) == (name == other)


@given(st.sampled_from([0, 1, 2**31, 2**32 - 1, 2**32, 2**33, 2**62]), st.integers(0, MAX_SEED))
def test_streams_differ_by_seed(seed, other):
    assert (numbers(seed, "wind") == numbers(other, "wind")) == (seed == other)


def test_drawing_from_one_stream_leaves_another_alone():
    busy, quiet = random_stream(5, "noise"), random_stream(5, "wind")
    busy.random(1000)
    assert [quiet.random() for _ in range(4)] == numbers(5, "wind")


def test_streams_of_neighbouring_seeds_and_names_do_not_correlate():
    streams = [(seed, name) for seed in (0, 1, 2, 2**32) for name in ("wind", "wind2", "noise")]
    series = np.array([random_stream(seed, name).random(2000) for seed, name in streams])
    correlations = np.corrcoef(series)[np.triu_indices(len(streams), 1)]
    assert np.abs(correlations).max() < 5 / np.sqrt(2000)
