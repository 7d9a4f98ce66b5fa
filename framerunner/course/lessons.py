"""Lessons: a text, a scenario whose goals the referee checks, a mission to start from, and a solution.

Each is a folder of `lessons/`, in the order of their numbers: `lesson.yaml`, `scenario.yaml`, `start.yaml`
and `solution.yaml`, unless the lesson names a mission of the package as its solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable

from pydantic import Field

from framerunner.errors import UserError
from framerunner.files.text_file import decode_text, read_text
from framerunner.files.yaml_file import FileKind
from offboard.chart.mission_texts import Language
from offboard.mission import MISSIONS
from scenarios.loader import parse_scenario
from scenarios.models import Scenario
from scenarios.part import Part


class LessonError(UserError):
    """A lesson that there is not, or whose files are damaged; the message is one line."""


class Words(Part):
    """A text in each language."""

    en: str = Field(min_length=1, description="English")
    es: str = Field(min_length=1, description="Spanish")

    def in_language(self, language: Language) -> str:
        """The text in one language."""
        return self.en if language == "en" else self.es


class LessonText(Part):
    """What a lesson says."""

    minutes: int = Field(gt=0, le=120, description="that a pupil needs for it")
    title: Words = Field(description="a few words")
    goal: Words = Field(description="what the drone has to do, in a sentence")
    steps: tuple[Words, ...] = Field(description="what to do, one after the other")
    hints: tuple[Words, ...] = Field((), description="for those who are stuck")
    introduces: tuple[str, ...] = Field((), description="names of the mission language that are new")
    solution: str | None = Field(None, description="mission of the package that solves it")


@dataclass(frozen=True, slots=True)
class Lesson:
    """A lesson.

    Attributes:
        number: from 1.
        name: `1_take_off` and so on.
        text: what it says.
        scenario: what is flown; reaching its goals, or crossing its gates, and landing passes the lesson.
        start: mission to start from, YAML; it flies, but does not pass.
        solution: a mission that passes, YAML.
    """

    number: int
    name: str
    text: LessonText
    scenario: Scenario
    start: str
    solution: str


_TEXTS = FileKind("lesson", LessonText, LessonError, folder="course/lessons", package="framerunner")


def load_lessons() -> tuple[Lesson, ...]:
    """All lessons, in order."""
    folders = sorted(
        (each for each in _folder().iterdir() if each.is_dir() and each.name[:1].isdigit()),
        key=lambda each: each.name,
    )
    return tuple(_load(number, folder) for number, folder in enumerate(folders, start=1))


def find_lesson(name: str) -> Lesson:
    """A lesson by its number or name.

    Raises:
        LessonError: there is none.
    """
    lessons = load_lessons()
    for lesson in lessons:
        if name in {str(lesson.number), lesson.name}:
            return lesson
    known = ", ".join(f"{lesson.number} ({lesson.name})" for lesson in lessons)
    raise LessonError(f"unknown lesson '{name}'; use one of {known}")


def _folder() -> Traversable:
    return resources.files("framerunner") / "course" / "lessons"


def _load(number: int, folder: Traversable) -> Lesson:
    text = _TEXTS.parse((folder / "lesson.yaml").read_bytes(), f"{folder.name}/lesson.yaml")
    if text.solution is None:
        solution = decode_text((folder / "solution.yaml").read_bytes())
    else:
        solution = read_text(MISSIONS / f"{text.solution}.yaml")
    start = decode_text((folder / "start.yaml").read_bytes())
    scenario = parse_scenario((folder / "scenario.yaml").read_bytes(), f"{folder.name}/scenario.yaml")
    return Lesson(number, folder.name, text, scenario, start, solution)
