"""Where a mission that is being edited can be flown: by name only, never by file."""

from __future__ import annotations

from framerunner.course.lessons import load_lessons
from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import Scenario
from scenarios.random_scenarios import LEVEL_FILES


def scenario_names() -> list[str]:
    """Names of the scenarios of the package."""
    return list_scenarios()


def lesson_names() -> list[str]:
    """Names of the lessons, whose scenarios can be flown."""
    return [lesson.name for lesson in load_lessons()]


def level_names() -> list[str]:
    """Names of the levels, from which random scenarios are drawn."""
    return LEVEL_FILES.names()


def find_scenario(name: str) -> Scenario:
    """A scenario of the package, a lesson's, or a random one such as "calm-17".

    Args:
        name: as `framerunner.editing.messages` accepts it, which is no path.

    Raises:
        ScenarioError: there is none.
    """
    lesson = next((each for each in load_lessons() if each.name == name), None)
    return load_scenario(name) if lesson is None else lesson.scenario
