"""What a class has done: one line for each event in a file, and the table that a teacher sees.

Lines are only added, each with one call, so that a program that is killed loses no finished line, and a line
that it has half written is left out when the file is read.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from errors import SettingError

EventKind = Literal["opened", "flown", "passed"]
MAX_LEARNER = 40  # characters of a name
_KINDS = ("opened", "flown", "passed")
_MAX_FILE_BYTES = 50_000_000


@dataclass(frozen=True, slots=True)
class CourseEvent:
    """Something that a learner has done.

    Attributes:
        time_s: Unix time.
        learner: name.
        lesson: name of the lesson.
        kind: the lesson was opened, a mission flown in it, or flown so that it passes.
        reason: the referee's sentence on the flight; empty: there was none.
    """

    time_s: float
    learner: str
    lesson: str
    kind: EventKind
    reason: str = ""


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
        if not event.learner or learner_name(event.learner) != event.learner:
            raise SettingError(f"learner {event.learner!r}: use 1 to {MAX_LEARNER} printable characters")
        line = json.dumps(asdict(event), ensure_ascii=False) + "\n"
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o600)
            try:
                size = os.fstat(handle).st_size
                if size and os.pread(handle, 1, size - 1) != b"\n":  # a line that a full disk took in part
                    line = "\n" + line
                os.write(handle, line.encode("utf-8", "replace"))
            finally:
                os.close(handle)
        except OSError as error:
            raise SettingError(f"{self._path}: cannot be written ({error.strerror})") from None

    def events(self) -> Iterator[CourseEvent]:
        """All events, in the order in which they were written; lines that are damaged are left out."""
        try:
            with self._path.open("rb") as file:
                content = file.read(_MAX_FILE_BYTES)
        except FileNotFoundError:
            return
        for line in content.splitlines():
            event = _read(line)
            if event is not None:
                yield event

    def table(self, lessons: Sequence[str]) -> dict[str, dict[str, LessonProgress]]:
        """Each learner's progress, by name and lesson; learners in the order in which they began."""
        opened: dict[tuple[str, str], float] = {}
        found: dict[str, dict[str, LessonProgress]] = {}
        for event in self.events():
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


def learner_name(text: str) -> str:
    """A name as it is kept: one line of printable characters, not too long; may be empty."""
    line = "".join(each if each.isprintable() else " " for each in text)
    return " ".join(line.split())[:MAX_LEARNER].strip()


def _read(line: bytes) -> CourseEvent | None:
    try:
        found = json.loads(line)
        event = CourseEvent(
            float(found["time_s"]),
            learner_name(str(found["learner"])),
            str(found["lesson"]),
            found["kind"],
            str(found.get("reason", "")),
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    return event if event.kind in _KINDS and event.learner else None
