"""The flights in lockstep that README and the docs show as examples."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.loader import load_scenario

ROOT = Path(__file__).parents[2]
EXAMPLE = re.compile(r"^ +framerunner fly ([\w-]+) --lockstep(?: --record)?$", re.MULTILINE)


def examples() -> list[str]:
    """Names of the scenarios, each once."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return sorted({name for page in pages for name in EXAMPLE.findall(page.read_text(encoding="utf-8"))})


def test_readme_and_docs_show_flights():
    assert {"calm-17", "crowded-17", "test-case-1"} <= set(examples())


@pytest.mark.parametrize("name", examples())
def test_a_documented_flight_is_clean(name: str):
    flight = fly_lockstep(FlightPlan(load_scenario(name), load_mission("explorer")))
    assert flight.result.verdict == "clean", flight.result.cause
