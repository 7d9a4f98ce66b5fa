"""The app's longest ticks in many flights in lockstep: processor time from a state to its command.

    python -m benchmarks.ticks LEVEL [--count N] [--seed S] [--repeats R]

A tick is one turn of the mission: map, choice of a viewpoint, plan, command; images are painted and searched
before it. A flight is the same each time, so one with a tick over the limit is flown again, and the
least time of each tick counts: what other programs do to the processor's caches is left out.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import time
from typing import Any

from benchmarks.peers.job import SINGLE_THREADS

os.environ.update(SINGLE_THREADS)  # before NumPy is imported

import cv2
import numpy as np

from framerunner.evaluation.plan import plan_level
from framerunner.flying.lockstep import lockstep_flight
from framerunner.flying.plan import FlightPlan
from offboard.app import Moment
from offboard.drone import DroneState, VelocityCommand
from offboard.engine import MissionEngine
from offboard.mission import load_mission

LIMIT_MS = 20.0


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
    longest, every, clean = (0.0, ""), [], 0
    for plan in plans.tasks():
        is_clean, flown = ticks(plan)
        clean += is_clean
        repeats = [flown]
        while len(repeats) < options.repeats and max(ms for ms, _, _ in repeats[-1]) > LIMIT_MS:
            repeats.append(ticks(plan)[1])
        for same in zip(*repeats, strict=True):
            took_ms = min(ms for ms, _, _ in same)
            _, at_s, state = same[0]
            every.append(took_ms)
            longest = max(longest, (took_ms, f"{plan.scenario.name}, {at_s:.2f} s after take-off in {state}"))
    over = sum(ms > LIMIT_MS for ms in every)
    print(f"{options.count} flights, {clean} clean; longest tick: {longest[0]:.1f} ms ({longest[1]})")
    print(f"{len(every)} ticks: {over} over {LIMIT_MS:g} ms", end="; ")
    print(", ".join(f"{share} % below {np.percentile(every, share):.1f} ms" for share in (50, 99, 99.9)))


def ticks(plan: FlightPlan) -> tuple[bool, list[tuple[float, float, str]]]:
    """Whether a flight is clean; of each tick processor time, ms, time of flight, s, and mission's state."""
    found: list[tuple[float, float, str]] = []
    took_ms = 0.0

    async def begin(engine: MissionEngine, state: DroneState) -> None:
        turn = type(engine).tick

        def timed(*arguments: Any, **named: Any) -> VelocityCommand:
            nonlocal took_ms
            began_s = time.thread_time()
            try:
                return turn(engine, *arguments, **named)
            finally:
                took_ms = 1e3 * (time.thread_time() - began_s)

        engine.tick = timed

    def end(moment: Moment) -> None:
        found.append((took_ms, moment.flight_time_s, moment.mission_state))

    flown = asyncio.run(lockstep_flight(plan, observers=(end,), before_tick=begin))
    return flown.result.verdict == "clean", found


if __name__ == "__main__":
    main()
