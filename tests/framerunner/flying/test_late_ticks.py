"""Missions with a map on a machine that is too slow, in simulated time: late ticks cost no flight."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import dataclass, replace
from random import Random

import pytest

from framerunner.flying import lockstep
from framerunner.flying.fly import FinishedFlight
from framerunner.flying.lockstep import LockstepVehicle, fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.app import Observer
from offboard.drone import DroneState, VelocityFluCommand
from offboard.mission import load_mission
from offboard.perception import CAMERA_DEAD_S, CameraSilentError
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
        silent_s: vehicle time from and to which no image is seen.
    """

    stalls: float = 0.0
    longest_ticks: int = 1
    images_late_ticks: int = 0
    images_lost: float = 0.0
    silent_s: tuple[float, float] = (0.0, 0.0)


class LateDrone:
    """A drone whose time does not wait: its app misses ticks, and commands hold meanwhile."""

    def __init__(self, drone, late: Lateness, random: Random):
        self._drone, self._late, self._random = drone, late, random

    def __getattr__(self, name):
        return getattr(self._drone, name)

    async def ticks(self) -> AsyncGenerator[DroneState, None]:
        missed: list[DroneState] = []
        stalled = 0
        async for state in self._drone.ticks():
            if stalled > 0:
                stalled -= 1
                missed.append(state)
                if len(missed) == STAND_STILL_TICKS:
                    self._drone.command(VelocityFluCommand())
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
        begin_s, end_s = self._late.silent_s
        for image in self._perception.take():
            silent = begin_s <= time_us / 1e6 < end_s
            if not silent and self._random.random() >= self._late.images_lost:
                late_us = 50_000 * self._random.randint(0, self._late.images_late_ticks)
                self._under_way.append((time_us + late_us, image))
        while self._under_way and self._under_way[0][0] <= time_us:
            self._seen = self._under_way.pop(0)[1]
            self._new.append(self._seen)
        age_s = (time_us - (self._seen.time_us or time_us)) / 1e6
        if age_s > CAMERA_DEAD_S:
            raise CameraSilentError(age_s)
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


def fly_late(monkeypatch, scenario: str, late: Lateness, *observers: Observer) -> FinishedFlight:
    """Fly `explorer` with an app that is late."""
    monkeypatch.setattr(lockstep, "LockstepVehicle", LateVehicle)
    monkeypatch.setattr(LateVehicle, "late", late, raising=False)
    plan = FlightPlan(load_scenario(scenario), load_mission("explorer"))
    return fly_lockstep(plan, observers=observers)


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
    result = fly_late(monkeypatch, scenario, late).result
    assert result.verdict in ("clean", "completed"), result.reason
    assert result.try_time_s < 60.0


def test_a_drone_whose_camera_is_silent_hovers_and_then_flies_on(monkeypatch):
    moments = []
    result = fly_late(monkeypatch, "test-case-1", Lateness(silent_s=(14.0, 17.5)), moments.append).result
    assert result.verdict == "clean", result.reason
    hovering = [moment for moment in moments if moment.remark.startswith("hovers")]
    assert {moment.command for moment in hovering} == {VelocityFluCommand()}
    assert hovering[0].remark == "hovers: no image for 1.0 s"
    assert len(hovering) == pytest.approx(20 * 2.8, abs=4)  # until the next image that is processed


def test_a_camera_that_stays_silent_ends_the_flight_after_five_seconds(monkeypatch):
    flown = fly_late(monkeypatch, "test-case-1", Lateness(silent_s=(14.0, 99.0)))
    assert flown.outcome.ended == "aborted"
    assert flown.outcome.reason.startswith("the camera is dead: no image for 5.")
