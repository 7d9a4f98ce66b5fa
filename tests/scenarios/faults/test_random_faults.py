"""The fault of each flight of level faulty."""

from collections import Counter

from scenarios.faults.table import row_of
from scenarios.random_scenarios import load_level, random_scenario

SEEDS = range(400)


def test_each_flight_has_one_fault_that_the_table_has():
    level = load_level("faulty")
    calm = load_level("calm")
    kinds = Counter()
    for seed in SEEDS:
        scenario = random_scenario(level, seed)
        (fault,) = scenario.faults
        kinds[str(fault.model_copy(update={"at_s": 0.0, "number": None}))] += 1
        assert 3.0 <= fault.at_s <= 20.0
        assert row_of(fault, level.sensors) is not None
        assert random_scenario(level, seed) == scenario
        assert (scenario.base, scenario.frames) == (
            random_scenario(calm, seed).base,
            random_scenario(calm, seed).frames,
        )
    assert len(kinds) == len(level.faults.any_of)
    assert max(kinds.values()) < 4 * len(SEEDS) / len(kinds)


def test_any_motor_may_fail():
    level = load_level("faulty")
    numbers = {
        fault.number
        for seed in range(1000)
        for fault in random_scenario(level, seed).faults
        if fault.part == "motor"
    }
    assert numbers == {1, 2, 3, 4}
