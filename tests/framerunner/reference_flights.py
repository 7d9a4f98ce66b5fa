"""Stored flights, against which flights are compared tick by tick.

`python -m tests.framerunner.reference_flights` stores them again, after a change that is meant to
change flights.

One file for each scenario in `reference_flights/`: CSV, compressed (`zcat` shows it), one row for each tick.
Two machines may compute the last bits of a state differently. Such a difference stays below a micrometre in
these flights: a start moved by 1e-7 m moves no position by 0.1 mm. One of 1e-3 m lets the detector see other
pixels, after which the flight differs. The tolerances are between.
"""

from __future__ import annotations

import csv
import functools
import gzip
import io
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise
from math import cos, dist, sin
from pathlib import Path

from framerunner.flying.fly import FinishedFlight
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.app import Moment
from offboard.mission import load_mission
from scenarios.loader import load_scenario

FOLDER = Path(__file__).with_suffix("")
SCENARIOS = ("test-case-1", "test-case-2", "test-case-3", "round-1")
POSITION_TOLERANCE_M = 0.02
HEADING_TOLERANCE = 0.02  # distance of the two unit vectors; about radians
LENGTH_TOLERANCE = 2  # ticks: a transition may be one tick earlier or later


@dataclass(frozen=True, slots=True)
class Tick:
    """What is stored of one tick.

    Attributes:
        time_us: vehicle time.
        x_mm: arena position, rounded.
        y_mm: see x_mm.
        z_mm: see x_mm.
        yaw_mrad: rounded.
        mission_state: such as "red.turning".
    """

    time_us: int
    x_mm: int
    y_mm: int
    z_mm: int
    yaw_mrad: int
    mission_state: str

    @classmethod
    def of(cls, moment: Moment) -> Tick:
        state = moment.state
        rounded = (round(1000 * value) for value in (state.x, state.y, state.z, state.yaw))
        return cls(state.time_us, *rounded, moment.mission_state)

    @property
    def position_m(self) -> tuple[float, float, float]:
        return (self.x_mm / 1000, self.y_mm / 1000, self.z_mm / 1000)

    @property
    def heading(self) -> tuple[float, float]:
        return (cos(self.yaw_mrad / 1000), sin(self.yaw_mrad / 1000))


@functools.cache
def fly(name: str) -> tuple[FinishedFlight, tuple[Tick, ...]]:
    """Fly a scenario in lockstep, once in a process for all tests."""
    ticks: list[Tick] = []
    flown = fly_lockstep(
        FlightPlan(load_scenario(name), load_mission("frame_challenge")),
        observers=(lambda moment: ticks.append(Tick.of(moment)),),
    )
    return flown, tuple(ticks)


def load(name: str) -> tuple[Tick, ...]:
    """Return a stored flight."""
    with gzip.open(_file(name), "rt", encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    return tuple(Tick(*(int(value) for value in row[:5]), row[5]) for row in rows)


def store(name: str, ticks: Sequence[Tick]) -> None:
    """Store a flight; the same flight gives the same file."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Tick.__dataclass_fields__)
    writer.writerows(astuple(tick) for tick in ticks)
    FOLDER.mkdir(exist_ok=True)
    _file(name).write_bytes(gzip.compress(text.getvalue().encode(), mtime=0))


def first_difference(stored: Sequence[Tick], flown: Sequence[Tick]) -> str | None:
    """Say in one line where a flight first differs from a stored one by more than the tolerances."""
    for number, (old, new) in enumerate(zip(stored, flown, strict=False)):
        around = {tick.mission_state for tick in stored[max(number - 1, 0) : number + 2]}
        where = f"tick {number}, vehicle time {old.time_us / 1e6:.2f} s, {old.mission_state}"
        if new.time_us != old.time_us:
            return f"{where}: time is {new.time_us} us, stored {old.time_us} us"
        apart_m = dist(old.position_m, new.position_m)
        if apart_m > POSITION_TOLERANCE_M:
            return f"{where}: {apart_m:.3f} m apart: at {new.position_m} m, stored {old.position_m} m"
        if dist(old.heading, new.heading) > HEADING_TOLERANCE:
            return f"{where}: yaw is {new.yaw_mrad / 1000} rad, stored {old.yaw_mrad / 1000} rad"
        if new.mission_state not in around:
            return f"{where}: state is {new.mission_state}"
    if abs(len(flown) - len(stored)) > LENGTH_TOLERANCE:
        return f"{len(flown)} ticks, stored {len(stored)}"
    return None


def _file(name: str) -> Path:
    return FOLDER / f"{name}.csv.gz"


def _store_all() -> None:
    for name in SCENARIOS:
        flown, ticks = fly(name)
        stored = load(name) if _file(name).exists() else ()
        changed = _changed(stored, ticks)
        store(name, ticks)
        states = sum(old.mission_state != new.mission_state for old, new in pairwise(ticks)) + 1
        print(f"{name}: {flown.result.verdict}, {len(ticks)} ticks, {states} states; {changed}")


def _changed(stored: Sequence[Tick], ticks: Sequence[Tick]) -> str:
    if not stored:
        return "new"
    return first_difference(stored, ticks) or ("within the tolerances" if stored != ticks else "as stored")


if __name__ == "__main__":
    _store_all()
