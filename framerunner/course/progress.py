"""What a class has done: one line for each event in a file, and the table that a teacher sees.

Lines are only added, each with one call, so that a program that is killed loses no finished line, and a line
that it has half written is left out when the file is read.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter, ValidationError

from framerunner.errors import SettingError
from framerunner.files.spreadsheet import csv_text
from framerunner.files.text_file import append_in_folder, read_in_folder

EventKind = Literal["opened", "flown", "passed", "reset"]
MAX_LEARNER = 60  # characters of a name
_ADVICE = f"use 1 to {MAX_LEARNER} printable characters"
_MAX_FILE_BYTES = 50_000_000


@dataclass(frozen=True, slots=True)
class CourseEvent:
    """Something that a learner has done.

    Attributes:
        time_s: Unix time.
        learner: name.
        lesson: name of the lesson; "" of a reset: all lessons.
        kind: the lesson was opened, a mission flown in it, flown so that it passes, or a teacher has let the
            learner begin anew.
        reason: the referee's sentence on the flight; empty: there was none.
    """

    time_s: float
    learner: str
    lesson: str
    kind: EventKind
    reason: str = ""


_EVENT = TypeAdapter(CourseEvent)


@dataclass(frozen=True, slots=True)
class LessonProgress:
    """A learner's progress in one lesson.

    Attributes:
        flights: missions flown, those that passed included.
        passed_after_s: from opening it to passing; None: not passed.
        last_reason: the referee's sentence on the last flight.
    """

    flights: int = 0
    passed_after_s: float | None = None
    last_reason: str = ""


class CourseProgress:
    """The events of a class.

    Args:
        path: of the file; it and its folder are made when there is something to write.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def add(self, event: CourseEvent) -> None:
        """Write an event.

        Raises:
            SettingError: the name cannot be used, or the file cannot be written.
        """
        if checked_name(event.learner) != event.learner:
            raise SettingError(f"learner {event.learner!r}: {_ADVICE}")
        line = json.dumps(asdict(event), ensure_ascii=False) + "\n"
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            append_in_folder(self._path, line.encode("utf-8", "replace"))
        except OSError as error:
            raise SettingError(f"{self._path}: cannot be written ({error.strerror})") from None

    def events(self) -> Iterator[CourseEvent]:
        """All events, in the order in which they were written; lines that are damaged are left out."""
        try:
            content = read_in_folder(self._path, _MAX_FILE_BYTES)
        except FileNotFoundError:
            return
        except OSError as error:
            raise SettingError(f"{self._path}: cannot be read ({error.strerror})") from None
        for line in content.splitlines():
            event = _read(line)
            if event is not None:
                yield event

    def table(self, lessons: Sequence[str]) -> dict[str, dict[str, LessonProgress]]:
        """Each learner's progress, by name and lesson; learners in the order in which they began."""
        opened: dict[tuple[str, str], float] = {}
        found: dict[str, dict[str, LessonProgress]] = {}
        for event in self.events():
            if event.kind == "reset":
                for lesson in lessons if event.lesson == "" else (event.lesson,):
                    found.get(event.learner, {}).pop(lesson, None)
                    opened.pop((event.learner, lesson), None)
                continue
            if event.lesson not in lessons:
                continue
            row = found.setdefault(event.learner, {})
            before = row.get(event.lesson, LessonProgress())
            start_s = opened.setdefault((event.learner, event.lesson), event.time_s)
            passed_after_s = before.passed_after_s
            if event.kind == "passed" and passed_after_s is None:
                passed_after_s = max(event.time_s - start_s, 0.0)
            flown = event.kind != "opened"
            row[event.lesson] = LessonProgress(
                before.flights + flown, passed_after_s, event.reason if flown else before.last_reason
            )
        return found


def progress_csv(table: Mapping[str, Mapping[str, LessonProgress]], lessons: Sequence[str]) -> str:
    """The table of a class for a spreadsheet: a row for each learner and lesson."""
    columns = ("pupil", "lesson", "flights", "passed", "passed_after_min", "last_flight")
    rows: list[tuple[object, ...]] = []
    for learner, row in table.items():
        for lesson, done in ((each, row[each]) for each in lessons if each in row):
            minutes = None if done.passed_after_s is None else round(done.passed_after_s / 60.0, 1)
            rows.append((learner, lesson, done.flights, minutes is not None, minutes, done.last_reason))
    return csv_text(columns, rows)


def checked_name(text: str) -> str:
    """A learner's name as it is kept: one line of printable characters.

    Raises:
        SettingError: there is none, or it is too long.
    """
    if not text.strip():
        raise SettingError("nobody has given a name in this browser; open the lesson from the page Course")
    name = _one_line(text)
    if not name or len(name) > MAX_LEARNER:
        raise SettingError(f"learner {text[:60]!r}: {_ADVICE}")
    return name


def _one_line(text: str) -> str:
    return " ".join("".join(each if each.isprintable() else " " for each in text).split())


def _read(line: bytes) -> CourseEvent | None:
    try:
        event = _EVENT.validate_json(line)
    except ValidationError:
        return None
    learner = _one_line(event.learner)[:MAX_LEARNER].strip()
    return replace(event, learner=learner) if learner else None
