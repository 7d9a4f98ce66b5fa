"""Whole flights over bad links, in simulated time: what became of them, and how near the box they came.

    python -m benchmarks.bad_links --mission careful_crossing --scenario test-case-1 --seeds 20

The quick selection that is tested stands in `tests/framerunner/test_bad_links.py`.
"""

from __future__ import annotations

import argparse
from collections import Counter

from joblib import Parallel, delayed

from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.framerunner.simulated_link import LinkedFlight, fly_over
from tests.framerunner.test_bad_links import IMPAIRMENTS, silence_later


def fly(name: str, scenario: str, mission: str, seed: int) -> tuple[str, float, float, float, bool]:
    """One flight: how it ended, m outside, least height, seconds kept in the box, whether it ended safely."""
    flight = fly_over(
        silence_later(IMPAIRMENTS[name], 5 * seed), load_scenario(scenario), load_mission(mission), seed=seed
    )
    return (
        _end(flight),
        flight.farthest_outside_m,
        flight.lowest_m(),
        flight.outcome.kept_in_box_s,
        flight.ended_safely,
    )


def _end(flight: LinkedFlight) -> str:
    crossed = f"{len(flight.frames)} frames"
    if flight.outcome.ended == "finished":
        return f"completed, {crossed}"
    reason = "link lost" if flight.outcome.reason.startswith("link lost") else flight.outcome.reason[:40]
    return f"{reason}: {flight.mode.name}"


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
        rows = Parallel(n_jobs=given.jobs)(work)
        ends = ", ".join(f"{count} {end}" for end, count in Counter(row[0] for row in rows).most_common())
        _, outside_m, height_m, kept_s, safely = zip(*rows, strict=True)
        print(
            f"{name}: {sum(safely)} of {len(rows)} ended safely; at most {max(outside_m):.2f} m outside the "
            f"box, at least {min(height_m):.2f} m high, limited for {max(kept_s):.1f} s; {ends}",
            flush=True,
        )


if __name__ == "__main__":
    main()
