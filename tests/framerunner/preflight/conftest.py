from types import SimpleNamespace

import pytest

from framerunner.flying.plan import FlightPlan
from framerunner.preflight import link as preflight_link
from offboard.limits import Caps
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.framerunner.preflight.bench import BenchLink


@pytest.fixture
def scenario():
    return load_scenario("test-case-1")


@pytest.fixture
def plan(scenario):
    return FlightPlan(scenario, load_mission("explorer_soft_landing"), None, caps=Caps())


@pytest.fixture
def link(scenario, monkeypatch):
    """The link that the checks open; their clock is the simulation's."""
    bench = BenchLink(scenario)
    clock = SimpleNamespace(monotonic=lambda: bench.simulation.time_us / 1e6)
    monkeypatch.setattr(preflight_link, "time", clock)
    monkeypatch.setattr(preflight_link, "open_link", lambda url: bench)
    return bench
