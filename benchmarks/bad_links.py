"""Whole flights over bad links, in simulated time: how they ended and how near they came to the box's limits.

    python -m benchmarks.bad_links --mission careful_crossing --scenario test-case-1 --seeds 20

The quick selection that is tested is `tests/framerunner/test_bad_links.py`.
"""

from __future__ import annotations

import argparse
from collections import Counter
from math import isfinite

from joblib import Parallel, delayed

from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.framerunner.simulated_link import LinkedFlight, fly_over
from tests.framerunner.test_bad_links import IMPAIRMENTS, silence_later


def fly(name: str, scenario: str, mission: str, seed: int) -> tuple[str, float, float, float, bool]:
    """One flight: how it ended, m outside, minimum height, s limited by the box, whether it ended safely."""
    flight = fly_over(
        silence_later(IMPAIRMENTS[name], 5 * seed), load_scenario(scenario), load_mission(mission), seed=seed
    )
    kept_s = flight.outcome.kept_in_box_s
    return end_of(flight), flight.farthest_outside_m, flight.lowest_m(), kept_s, flight.ended_safely


def end_of(flight: LinkedFlight) -> str:
    if flight.outcome.ended == "finished":
        return f"completed, {len(flight.frames)} frames"
    reason = "link lost" if flight.outcome.reason.startswith("link lost") else flight.outcome.reason[:40]
    return f"{reason}: {flight.mode.name}"


def summary(rows: list[tuple[str, float, float, float, bool]]) -> str:
    """One line about all flights over one kind of link."""
    ends = ", ".join(f"{count} {end}" for end, count in Counter(row[0] for row in rows).most_common())
    _, outside_m, height_m, kept_s, safely = zip(*rows, strict=True)
    farthest_m, lowest_m = max(outside_m), min(height_m)
    box = f"at most {farthest_m:.2f} m outside" if farthest_m > 0 else f"at least {-farthest_m:.2f} m inside"
    height = f"at least {lowest_m:.2f} m high" if isfinite(lowest_m) else "no drone left its start"
    return (
        f"{sum(safely)} of {len(rows)} ended safely; {box} the box, {height}, "
        f"limited for {max(kept_s):.1f} s; {ends}"
    )


def main() -> None:
    """Fly and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mission", default="frame_challenge")
    parser.add_argument("--scenario", default="test-case-1")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    for name in IMPAIRMENTS:
        work = (delayed(fly)(name, given.scenario, given.mission, seed) for seed in range(given.seeds))
        print(f"{name}: {summary(Parallel(n_jobs=given.jobs)(work))}", flush=True)


if __name__ == "__main__":
    main()
