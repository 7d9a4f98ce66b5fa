"""The course's addresses: lessons, a pupil's file for one, whether it passes, and the class's table.

GET  /api/course                     {"lessons": [...]}, texts in all languages
POST /api/course/open  {learner, lesson}     {"file"}: the pupil's mission, made if there is none
POST /api/course/check {learner, lesson, text}      JSON, a line each: {"place", "seconds"} while others are
                                     checked before, then {"passed", "reason", "flight"}: flown and judged
GET  /api/course/class               {"learners": [{"name", "word", "lessons": [...]}]}; a pupil's own row
GET  /api/course/class.csv           the same, for a spreadsheet; for organisers
POST /api/course/reset {learner, lesson}     a pupil begins a lesson anew, or with "" all; for organisers
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, HTTPException, Request
from starlette.requests import HTTPConnection
from starlette.responses import Response, StreamingResponse

from framerunner.course.lessons import Lesson, find_lesson, load_lessons
from framerunner.course.progress import (
    CourseEvent,
    CourseProgress,
    EventKind,
    LessonProgress,
    checked_name,
    progress_csv,
)
from framerunner.editing.editor_messages import MAX_TEXT, StartBatch
from framerunner.editing.service import EditingService, EditingSettings
from framerunner.editing.words import Said, language_of, reason
from framerunner.errors import UserError
from framerunner.files.text_file import make_file
from framerunner.monitor.access import Role, Visitor
from framerunner.monitor.visitors.pupils import PupilBook, file_key
from offboard.chart.mission_texts import Language

_NOT_STORED = {"Cache-Control": "no-store"}

_CHECKS_AT_ONCE = max(2, os.cpu_count() or 2)
_CHECK_S = 4.0  # expected before any has ended
_LONGEST_FLIGHT_S = 120.0
_Short = Annotated[str, Body(max_length=200)]
_Text = Annotated[str, Body(max_length=MAX_TEXT)]


class CourseRouter:
    """Addresses of the course; implements `framerunner.monitor.ports.Extension`.

    Args:
        folder: of the pupils' missions; the class's progress is kept there, too.
        pilot: a contestant's file, which flights execute, or a pilot's name; None: missions use `Pilot`
            itself.
        pupils: of the class, who log in; None: there is none.
    """

    def __init__(self, folder: Path, pilot: str | None = None, pupils: PupilBook | None = None) -> None:
        self._folder = folder
        self._pupils = pupils
        self._progress = CourseProgress(folder / "course-progress.jsonl")
        self._lessons = load_lessons()
        settings = EditingSettings(
            pilot,
            max_batches=_CHECKS_AT_ONCE,
            batch_s=_CHECK_S,
            jobs=1,
            silent_s=_LONGEST_FLIGHT_S,
            unwatched_s=0.0,
        )
        self._service = EditingService(settings)
        self._checked: set[str] = set()  # learners whose mission is being checked, or waits for it

    def router(self, who: Callable[[HTTPConnection], Visitor]) -> APIRouter:
        """The addresses; `who` tells who asks, and whether they may take part or teach."""
        router = APIRouter()

        def demand(request: Request, learner: str | None = None) -> Visitor:
            visitor = who(request)
            if not visitor.may_learn:
                raise HTTPException(403, Said("access.course").text(language_of(request)))
            if visitor.role is Role.PUPIL and learner not in (None, visitor.name):
                raise HTTPException(403, Said("access.learner", name=visitor.name).text(language_of(request)))
            return visitor

        @router.get("/api/course")
        def lessons() -> dict[str, Any]:
            return {"lessons": [_told(lesson) for lesson in self._lessons]}

        @router.post("/api/course/open")
        async def open_lesson(request: Request, learner: _Short, lesson: _Short) -> dict[str, str]:
            visitor = demand(request, learner)
            try:
                return {"file": await asyncio.to_thread(self._open, learner, lesson, visitor.key)}
            except (UserError, OSError) as error:
                raise HTTPException(400, str(error)) from None

        @router.post("/api/course/check")
        async def check(request: Request, learner: _Short, lesson: _Short, text: _Text) -> Response:
            demand(request, learner)
            language = language_of(request)
            try:
                found, name = find_lesson(lesson), checked_name(learner)
            except UserError as error:
                raise HTTPException(400, reason(error, language)) from None
            if name in self._checked:
                raise HTTPException(409, Said("lesson.one_check", name=name).text(language))
            lines = self._check(name, found, text, language)
            return StreamingResponse(lines, media_type="application/x-ndjson", headers=_NOT_STORED)

        self._add_class(router, demand)
        return router

    def _add_class(self, router: APIRouter, demand: Callable[[Request], Visitor]) -> None:
        """Add what a teacher needs."""

        def teacher(request: Request) -> None:
            if not demand(request).may_teach:
                raise HTTPException(403, Said("access.teach").text(language_of(request)))

        async def table() -> dict[str, dict[str, LessonProgress]]:
            try:
                return await asyncio.to_thread(self._progress.table, [each.name for each in self._lessons])
            except UserError as error:
                raise HTTPException(503, str(error)) from None

        @router.get("/api/course/class")
        async def class_table(request: Request) -> dict[str, Any]:
            visitor = demand(request)
            words = await asyncio.to_thread(self._words) if visitor.may_teach else {}
            rows = {**{name: {} for name in words}, **await table()}
            learners = [
                {
                    "name": name,
                    "word": words.get(name, ""),
                    "lessons": {lesson: asdict(done) for lesson, done in row.items()},
                }
                for name, row in rows.items()
                if visitor.may_teach or name == visitor.name
            ]
            return {"learners": learners}

        @router.get("/api/course/class.csv")
        async def export(request: Request) -> Response:
            teacher(request)
            text = progress_csv(await table(), [each.name for each in self._lessons])
            name = {"Content-Disposition": 'attachment; filename="class.csv"'}
            return Response(
                text.encode(), media_type="text/csv; charset=utf-8", headers={**_NOT_STORED, **name}
            )

        @router.post("/api/course/reset")
        async def reset(request: Request, learner: _Short, lesson: _Short = "") -> dict[str, str]:
            teacher(request)
            try:
                name = find_lesson(lesson).name if lesson else ""
                event = CourseEvent(time.time(), checked_name(learner), name, "reset")
                await asyncio.to_thread(self._progress.add, event)
            except UserError as error:
                raise HTTPException(400, str(error)) from None
            return {"learner": event.learner}

    async def run(self) -> None:
        """Wait until cancelled, then end all flights."""
        try:
            await asyncio.Event().wait()
        finally:
            await self._service.close()

    def _words(self) -> dict[str, str]:
        """The pupils' own code words, by name."""
        try:
            return {} if self._pupils is None else {each.name: each.word for each in self._pupils.all()}
        except UserError:  # told to pupils who log in
            return {}

    def _note(self, learner: str, lesson: Lesson, kind: EventKind, reason: str = "") -> None:
        self._progress.add(CourseEvent(time.time(), learner, lesson.name, kind, reason))

    def _open(self, learner: str, name: str, key: str) -> str:
        """The file of a pupil's mission of a lesson."""
        lesson, learner = find_lesson(name), checked_name(learner)
        path = self._folder / f"lesson_{lesson.number}_{key or file_key(learner)}.yaml"
        self._note(learner, lesson, "opened")
        with contextlib.suppress(FileExistsError):
            make_file(path, lesson.start)
        return path.name

    async def _check(self, learner: str, lesson: Lesson, text: str, language: Language) -> AsyncIterator[str]:
        """Lines that tell the place in the line, and at last the verdict."""
        if learner in self._checked:  # since the request was taken
            yield _line({"passed": False, "reason": Said("lesson.one_check", name=learner).text(language)})
            return
        self._checked.add(learner)
        watcher = _Result(language)
        try:
            start = StartBatch(
                kind="start_batch", text=text, level=None, scenarios=(lesson.name,), language=language
            )
            await self._service.do(start, watcher)
            while "reason" not in (told := await watcher.next()):
                yield _line({"place": told["place"], "seconds": told["seconds"]})
            passed, why = bool(told.get("completed")), str(told["reason"])
            if "verdict" in told:
                await asyncio.to_thread(self._note, learner, lesson, "passed" if passed else "flown", why)
            yield _line({"passed": passed, "reason": why, "flight": told})
        except UserError as error:
            yield _line({"passed": False, "reason": reason(error, language)})
        finally:  # also if the page has left
            self._checked.discard(learner)
            self._service.leave(watcher)


class _Result:
    """Hears of the one flight of a batch; a watcher of the service."""

    def __init__(self, language: Language) -> None:
        self.language = language
        self._told: asyncio.Queue[dict[str, Any]] = asyncio.Queue()

    async def next(self) -> dict[str, Any]:
        """The place in the line, or the flight as pages are told it; only a `reason` without one."""
        return await self._told.get()

    def put(self, line: str) -> None:
        """Take a message."""
        message = json.loads(line)
        if message["kind"] in ("flight", "waiting"):
            self._told.put_nowait(message)
        elif message["kind"] == "refused":
            self._told.put_nowait({"reason": message["text"]})
        elif message["kind"] == "batch_ended":
            words = message["text"] or Said("lesson.no_result").text(self.language)
            self._told.put_nowait({"reason": words})


def _line(told: dict[str, Any]) -> str:
    return json.dumps(told, ensure_ascii=False) + "\n"


def _told(lesson: Lesson) -> dict[str, Any]:
    text = lesson.text.model_dump(exclude={"solution"})
    return {"number": lesson.number, "name": lesson.name, **text}
