"""The app's longest ticks in many flights in lockstep: processor time from a state to its command.

    python -m benchmarks.ticks LEVEL [--count N] [--seed S] [--repeats R]

A tick is one turn of the mission: map, choice of a viewpoint, plan, command; images are painted and searched
before it. Planning is the search for a path, the path in time and the command. A flight is the same each
time, so one with a tick over the limit is flown again, and the least time of each tick counts: what other
programs do to the processor's caches is left out.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any
from unittest.mock import patch

from benchmarks.peers.job import SINGLE_THREADS

os.environ.update(SINGLE_THREADS)  # before NumPy is imported

import cv2
import numpy as np

from framerunner.evaluation.plan import plan_level
from framerunner.flying.lockstep import lockstep_flight
from framerunner.flying.plan import FlightPlan
from offboard.app import Moment
from offboard.drone import DroneState
from offboard.engine import MissionEngine
from offboard.mission import load_mission
from offboard.navigation.path_flight import PathFlight

LIMIT_MS = 20.0
SHARES = (50, 99, 99.9)
SHOWN = 10  # of the longest ticks


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.ticks", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("level", nargs="?", default="crowded", metavar="LEVEL", help="name or file")
    parser.add_argument("--mission", default="explorer", metavar="NAME", help="name or file")
    parser.add_argument("--count", type=int, default=20, help="of flights")
    parser.add_argument("--seed", type=int, default=1, help="of the first")
    parser.add_argument("--repeats", type=int, default=3, help="of a flight, at most")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    plans = plan_level(options.level, options.seed, options.count, load_mission(options.mission))
    every, clean = [], 0
    for plan in plans.tasks():
        is_clean, flown = ticks(plan)
        clean += is_clean
        for _ in range(options.repeats - 1):
            if max(tick.took_ms for tick in flown) <= LIMIT_MS:
                break
            flown = [one.least(other) for one, other in zip(flown, ticks(plan)[1], strict=True)]
        every += flown
    print(f"{options.count} flights, {clean} clean")
    for what, times in (("ticks", "took_ms"), ("planning in them", "planned_ms")):
        longest = sorted(every, key=attrgetter(times), reverse=True)[:SHOWN]
        all_ms = np.array([getattr(tick, times) for tick in every])
        below = ", ".join(f"{share} % below {np.percentile(all_ms, share):.1f} ms" for share in SHARES)
        print(f"{len(every)} {what}: {np.sum(all_ms > LIMIT_MS)} over {LIMIT_MS:g} ms; {below}")
        for tick in longest:
            print(f"  {getattr(tick, times):.1f} ms: {tick.where}")


@dataclass(frozen=True, slots=True)
class Tick:
    """Processor time of a tick, of planning in it, and where it was."""

    took_ms: float
    planned_ms: float
    where: str

    def least(self, other: Tick) -> Tick:
        """Of the same tick, flown twice."""
        return Tick(min(self.took_ms, other.took_ms), min(self.planned_ms, other.planned_ms), self.where)


class Watch:
    """Sums the processor time of calls."""

    def __init__(self) -> None:
        self.ms = 0.0

    def timed(self, call: Callable[..., Any]) -> Callable[..., Any]:
        """The same call, timed."""

        def watched(*arguments: Any, **named: Any) -> Any:
            began_s = time.thread_time()
            try:
                return call(*arguments, **named)
            finally:
                self.ms += 1e3 * (time.thread_time() - began_s)

        return watched


def ticks(plan: FlightPlan) -> tuple[bool, list[Tick]]:
    """Whether a flight is clean, and its ticks."""
    found: list[Tick] = []
    turn, planning = Watch(), Watch()

    async def begin(engine: MissionEngine, state: DroneState) -> None:
        turn.ms = planning.ms = 0.0

    def end(moment: Moment) -> None:
        where = f"{plan.scenario.name}, {moment.flight_time_s:.2f} s after take-off in {moment.mission_state}"
        found.append(Tick(turn.ms, planning.ms, where))

    with (
        patch.object(MissionEngine, "tick", turn.timed(MissionEngine.tick)),
        patch.object(PathFlight, "fly", planning.timed(PathFlight.fly)),
    ):
        flown = asyncio.run(lockstep_flight(plan, observers=(end,), before_tick=begin))
    return flown.result.verdict == "clean", found


if __name__ == "__main__":
    main()
