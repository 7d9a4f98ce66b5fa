import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.streams import MAX_SEED, SeedError, random_stream

seeds = st.integers(0, MAX_SEED)


def numbers(seed, name, count=4):
    stream = random_stream(seed, name)
    return [stream.random() for _ in range(count)]


def test_numbers_stay_as_they_are():
    # Results of old seeds can be compared only while these numbers are the same: on every machine, for ever.
    assert numbers(1, "wind", 3) == [0.9660842807621509, 0.9907271339130758, 0.20296987957631096]
    assert numbers(MAX_SEED, "wind", 1) == [0.016727917582789242]


@given(seeds, st.text(max_size=10), st.text(max_size=10))
def test_streams_of_other_names_are_others(seed, name, other):
    assert (numbers(seed, name) == numbers(seed, other)) == (name == other)


@given(st.sampled_from([0, 1, 2**31, 2**32 - 1, 2**32, 2**33, 2**62]), seeds)
def test_streams_of_other_seeds_are_others(seed, other):
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


@pytest.mark.parametrize("seed", [-1, MAX_SEED + 1, -(10**30)])
def test_a_seed_out_of_range_is_refused(seed):
    with pytest.raises(SeedError, match=f"seed {seed} is out of range; use a whole number from 0 to 9223"):
        random_stream(seed, "wind")
