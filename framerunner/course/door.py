"""The course's addresses: lessons, a pupil's file for one, whether it passes, and the class's table.

GET  /api/course                     {"lessons": [...]}, texts in all languages
POST /api/course/open  {learner, lesson}     {"file"}: the pupil's mission, made if there is none
POST /api/course/check {learner, lesson, text}      {"passed", "reason", "flight"}: flown, judged and kept
GET  /api/course/class               {"learners": [{"name", "lessons": [...]}]}
"""

from __future__ import annotations

import asyncio
import json
import re
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, HTTPException, Request
from starlette.requests import HTTPConnection

from errors import UserError
from framerunner.course.lessons import Lesson, find_lesson, load_lessons
from framerunner.course.progress import CourseEvent, CourseProgress, EventKind, learner_name
from framerunner.editing.messages import MAX_TEXT, StartBatch
from framerunner.editing.service import EditingService, EditingSettings
from framerunner.editing.words import Language, Said, language_of, reason, say

_CHECKS_AT_ONCE = 2
_LONGEST_WAIT_S = 120.0
_Short = Annotated[str, Body(max_length=200)]
_Text = Annotated[str, Body(max_length=MAX_TEXT)]


class CourseDoor:
    """Addresses of the course; implements `monitor.ports.Extension`.

    Args:
        folder: of the pupils' missions; the class's progress is kept there, too.
        pilot: a contestant's file, which flights execute; None: missions use `Pilot` itself.
    """

    def __init__(self, folder: Path, pilot: Path | None = None) -> None:
        self._folder = folder
        self._progress = CourseProgress(folder / "course-progress.jsonl")
        self._lessons = load_lessons()
        self._service = EditingService(EditingSettings(pilot, max_batches=_CHECKS_AT_ONCE, jobs=1))
        self._places = asyncio.Semaphore(_CHECKS_AT_ONCE)

    def router(self, may_act: Callable[[HTTPConnection], bool]) -> APIRouter:
        """The addresses; `may_act` says who may take part."""
        router = APIRouter()

        def demand(request: Request) -> None:
            if not may_act(request):
                raise HTTPException(403, say(Said("access.course"), language_of(request)))

        @router.get("/api/course")
        def lessons() -> dict[str, Any]:
            return {"lessons": [_told(lesson) for lesson in self._lessons]}

        @router.post("/api/course/open")
        async def open_lesson(request: Request, learner: _Short, lesson: _Short) -> dict[str, str]:
            demand(request)
            try:
                return {"file": await asyncio.to_thread(self._open, learner, lesson)}
            except (UserError, OSError) as error:
                raise HTTPException(400, str(error)) from None

        @router.post("/api/course/check")
        async def check(request: Request, learner: _Short, lesson: _Short, text: _Text) -> dict[str, Any]:
            demand(request)
            try:
                return await self._check(learner, lesson, text, language_of(request))
            except UserError as error:
                raise HTTPException(400, reason(error, language_of(request))) from None

        @router.get("/api/course/class")
        async def class_table(request: Request) -> dict[str, Any]:
            demand(request)
            table = await asyncio.to_thread(self._progress.table, [each.name for each in self._lessons])
            learners = [
                {"name": name, "lessons": {lesson: asdict(done) for lesson, done in row.items()}}
                for name, row in table.items()
            ]
            return {"learners": learners}

        return router

    async def run(self) -> None:
        """Wait until cancelled, then end all flights."""
        try:
            await asyncio.Event().wait()
        finally:
            await self._service.close()

    def _note(self, learner: str, lesson: Lesson, kind: EventKind, reason: str = "") -> None:
        self._progress.add(CourseEvent(time.time(), learner, lesson.name, kind, reason))

    def _open(self, learner: str, name: str) -> str:
        """The file of a pupil's mission of a lesson."""
        lesson, learner = find_lesson(name), learner_name(learner)
        self._note(learner, lesson, "opened")
        path = self._folder / f"lesson_{lesson.number}_{_file_part(learner)}.yaml"
        if not path.exists():
            self._folder.mkdir(parents=True, exist_ok=True)
            path.write_text(lesson.start, encoding="utf-8")
        return path.name

    async def _check(self, learner: str, name: str, text: str, language: Language) -> dict[str, Any]:
        lesson, learner = find_lesson(name), learner_name(learner)
        async with self._places:
            flight = await self._fly(lesson, text, language)
        passed = bool(flight.get("completed"))
        why = str(flight["reason"])
        if "verdict" in flight:
            await asyncio.to_thread(self._note, learner, lesson, "passed" if passed else "flown", why)
        return {"passed": passed, "reason": why, "flight": flight}

    async def _fly(self, lesson: Lesson, text: str, language: Language) -> dict[str, Any]:
        """The flight as the editor's page is told it; only a `reason` if there was none."""
        watcher = _Result(language)
        start = StartBatch(
            do="start_batch", text=text, level=None, scenarios=(lesson.name,), language=language
        )
        await self._service.do(start, watcher)
        try:
            async with asyncio.timeout(_LONGEST_WAIT_S):
                return await watcher.flight
        except TimeoutError:
            self._service.leave(watcher)
            return {"reason": say(Said("lesson.too_long", seconds=_LONGEST_WAIT_S), language)}


class _Result:
    """Waits for the one flight of a batch; a watcher of the service."""

    def __init__(self, language: Language) -> None:
        self.language = language
        self.flight: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()

    def put(self, line: str) -> None:
        """Take a message."""
        message = json.loads(line)
        if self.flight.done():
            return
        if message["kind"] == "flight":
            self.flight.set_result(message)
        elif message["kind"] == "refused":
            self.flight.set_result({"reason": message["text"]})
        elif message["kind"] == "batch_ended":
            self.flight.set_result(
                {"reason": message["text"] or say(Said("lesson.no_result"), self.language)}
            )


def _told(lesson: Lesson) -> dict[str, Any]:
    text = lesson.text.model_dump(exclude={"solution"})
    return {"number": lesson.number, "name": lesson.name, **text}


def _file_part(learner: str) -> str:
    """A pupil's name as part of a file's name; different names may share it only if they are much alike."""
    plain = re.sub(r"[^a-z0-9]+", "_", learner.casefold()).strip("_")
    return plain or "".join(f"{ord(each):x}" for each in learner)[:40]
