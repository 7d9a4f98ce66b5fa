"""A short flight, recorded once for all tests."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from framerunner.flying.fly import FinishedFlight
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.recording.mcap_writer import FlightRecording
from offboard.mission import load_mission
from scenarios.loader import load_scenario

SEED = 7


@dataclass(frozen=True)
class Recorded:
    path: Path
    flown: FinishedFlight
    moments: list
    images: list


def short_scenario():
    return load_scenario("test-case-1").model_copy(update={"try_limit_s": 5.0})


def record(path):
    scenario, mission = short_scenario(), load_mission("frame_challenge")
    moments, images = [], []
    with FlightRecording(path, scenario, mission, SEED) as recording:

        def observe(moment):
            moments.append(moment)
            recording.see(moment)

        def keep(time_us, image):
            images.append((time_us, image.copy()))
            recording.see_image(time_us, image)

        flown = fly_lockstep(FlightPlan(scenario, mission, SEED), observers=(observe,), on_image=keep)
        recording.finish(flown.result, flown.track)
    assert recording.problem == ""
    return Recorded(path, flown, moments, images)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    return record(tmp_path_factory.mktemp("recorded") / "flight.mcap")
