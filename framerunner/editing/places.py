"""Where a mission that is being edited can be flown: by name only, never by file."""

from __future__ import annotations

from framerunner.course.lessons import load_lessons
from scenarios.loader import load_scenario
from scenarios.models import Scenario


def find_scenario(name: str) -> Scenario:
    """A scenario of the package, a lesson's, or a random one such as "calm-17".

    Args:
        name: as `framerunner.editing.editor_messages` accepts it, which is no path.

    Raises:
        ScenarioError: there is none.
    """
    lesson = next((each for each in load_lessons() if each.name == name), None)
    return load_scenario(name) if lesson is None else lesson.scenario
