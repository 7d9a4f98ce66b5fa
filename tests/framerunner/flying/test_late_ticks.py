"""Missions with a map on a machine that is too slow, in simulated time: late ticks cost no flight."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from random import Random

import pytest

from framerunner.flying import lockstep
from framerunner.flying.lockstep import LockstepVehicle, fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.drone import DroneState, VelocityCommand
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from vision.types import Detections

STAND_STILL_TICKS = 10  # after which a real app's drone is told to stand still


@dataclass(frozen=True)
class Lateness:
    """How late an app is.

    Attributes:
        stalls: share of ticks after which it stalls.
        longest_ticks: of a stall.
        images_late_ticks: up to so many ticks later than they arrive images are seen.
        images_lost: share that is never seen.
    """

    stalls: float = 0.0
    longest_ticks: int = 1
    images_late_ticks: int = 0
    images_lost: float = 0.0


class LateDrone:
    """A drone whose time does not wait: its app misses ticks, and commands hold meanwhile."""

    def __init__(self, drone, late: Lateness, random: Random):
        self._drone, self._late, self._random = drone, late, random

    def __getattr__(self, name):
        return getattr(self._drone, name)

    async def ticks(self) -> AsyncIterator[DroneState]:
        missed: list[DroneState] = []
        stalled = 0
        async for state in self._drone.ticks():
            if stalled > 0:
                stalled -= 1
                missed.append(state)
                if len(missed) == STAND_STILL_TICKS:
                    self._drone.command(VelocityCommand())
                continue
            yield replace(state, missed=tuple(missed))
            missed.clear()
            if self._random.random() < self._late.stalls:
                stalled = self._random.randint(1, self._late.longest_ticks)


class LatePerception:
    """Images that are seen late, in bursts, or never."""

    def __init__(self, perception, late: Lateness, random: Random):
        self._perception, self._late, self._random = perception, late, random
        self._under_way: list[tuple[int, Detections]] = []
        self._seen = Detections()
        self._new: list[Detections] = []

    def __getattr__(self, name):
        return getattr(self._perception, name)

    def latest(self, time_us: int) -> Detections:
        self._perception.latest(time_us)
        for image in self._perception.take():
            if self._random.random() >= self._late.images_lost:
                late_us = 50_000 * self._random.randint(0, self._late.images_late_ticks)
                self._under_way.append((time_us + late_us, image))
        while self._under_way and self._under_way[0][0] <= time_us:
            self._seen = self._under_way.pop(0)[1]
            self._new.append(self._seen)
        return self._seen

    def take(self) -> tuple[Detections, ...]:
        taken, self._new = tuple(self._new), []
        return taken


class LateVehicle(LockstepVehicle):
    """A vehicle whose app is late."""

    late: Lateness

    def __init__(self, plan, *args, **keywords):
        super().__init__(plan, *args, **keywords)
        random = Random(plan.scenario.name)
        self.drone = LateDrone(self.drone, self.late, random)
        self.perception = LatePerception(self.perception, self.late, random)


@pytest.mark.parametrize(
    ("scenario", "late"),
    [
        ("calm-301", Lateness(stalls=0.3, longest_ticks=4, images_late_ticks=4)),
        ("calm-302", Lateness(stalls=0.02, longest_ticks=16, images_late_ticks=2)),
        ("test-case-1", Lateness(images_late_ticks=8, images_lost=0.6)),
    ],
    ids=["short stalls", "long stalls", "few images"],
)
def test_a_flight_with_late_ticks_and_images_is_completed(monkeypatch, scenario, late):
    monkeypatch.setattr(lockstep, "LockstepVehicle", LateVehicle)
    monkeypatch.setattr(LateVehicle, "late", late, raising=False)
    result = fly_lockstep(FlightPlan(load_scenario(scenario), load_mission("explorer"))).result
    assert result.verdict in ("clean", "completed"), result.reason
    assert result.try_time_s < 60.0
