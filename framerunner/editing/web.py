"""The editor's addresses for flights: `GET /api/editing/choices` and the WebSocket `/ws/editing`.

`/api/editing/choices` is `{"scenarios": [names], "lessons": [names], "levels": [names], "max_text":
characters, "max_count": flights of a batch}`. A `scenario` below is the name of one or of a lesson, whose
goals then count; random ones are named as level and seed, such as `calm-17`.

`/ws/editing?language=es` has the server's words in Spanish. It is closed with code 4403 if the visitor may
not start flights. Each message is a JSON object. A request may have `tag`, a whole number that
comes back with its answer:

    {"kind": "start", "text": MISSION, "scenario": "test-case-1", "seed": 0, "speed": 1 or null,
     "paused": false, "break_on": [state ids]}      answer: started {run, layout} or refused
    {"kind": "pause" | "go_on" | "stop", "run"}       answer: done or refused; likewise those that follow
    {"kind": "step", "run", "ticks": 1}
    {"kind": "speed", "run", "speed": vehicle seconds a second, null: as fast as possible}
    {"kind": "break_on", "run", "states": [ids]}      replaces those named before
    {"kind": "change", "run", "text": MISSION}        answer: changed {ids} or refused
    {"kind": "watch", "run": id of a flight or batch} who started it watches it already
    {"kind": "start_batch", "text", "level": "calm", "count": 20, "first_seed": 1}
    {"kind": "start_batch", "text", "scenarios": [names]}      answer: batch_started {batch, count} or refused
    {"kind": "cancel", "batch"}                       its results stay
    {"kind": "start_live", "text", "scenario", "speed": 1.0}   flies in the real simulator: `framerunner fly`
    {"kind": "stop_live"}                             answer: done or refused

The server tells:

    now      {run, full, time_s, began_s, state, active, seconds_in_state, paused, stopped_in, speed,
              guards: [{id, to, when, holds}], values: [{name, value, unit}],
              taken: [{ids, source, target, when, values: [[name, value]], time_s, seconds}], counts: {id: n},
              spans: [{state, from_s, to_s}], contacts: [{name, time_s}], pose: [x, y, z, yaw],
              command: [forward, left, up, yaw rate],
              trail: [[time_s, x, y, z]]}           at most 25 a second, at once when the flight pauses
    changed  {run, tag, ids: {id before: id now}}
    ended    {run, text, lost_in, result: as result.json or null, counts, spans}
    flight   {batch, scenario, seed, verdict, completed, reason, cause, lost_in, rank, total_time_s,
              frames_crossed, counts, track: {time_s, x, y, z, state, states}, layout: the scenario,
              result: as result.json, replay: its name in /api/runs}
    live     {state: starting | flying | ended | stopped, scenario, speed, text}   the real simulator, to all
    batch_ended {batch, flown, completed, count, text, order}
    refused  {tag, text, lines, run};  done {tag};  started {tag, run, layout: the scenario};
    batch_started {tag, batch, count}

Ids of transitions are those of `offboard.chart.spec.transition_id`, such as `red.turning/2`, `red/then` and
`red/resume`. `framerunner.editing.editor_messages` has all fields. A mission is text, loaded by the checker
of missions; only the server's command line can name a Python file. Flights are simulated in processes with
limits of processor time and memory; what nobody watches for half a minute is ended.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from fastapi import APIRouter
from pydantic import BaseModel, ValidationError
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket

from framerunner.course.lessons import load_lessons
from framerunner.editing import editor_messages
from framerunner.editing.service import EditingService, EditingSettings
from framerunner.editing.words import Said, language_of
from framerunner.monitor.access import Visitor
from framerunner.monitor.channel import Channel, ChannelTerms, PageMessageError, refuse
from offboard.chart.mission_texts import Language
from scenarios.loader import list_scenarios
from scenarios.random_scenarios import LEVEL_FILES

_FROM_PAGE: ChannelTerms[editor_messages.Request] = ChannelTerms(
    editor_messages.REQUEST,
    max_bytes=4 * editor_messages.MAX_TEXT,
    max_waiting=1000,
)


class EditingRouter:
    """The editor's addresses; implements `framerunner.monitor.ports.Extension`.

    Args:
        settings: what browsers may start.
    """

    def __init__(self, settings: EditingSettings | None = None) -> None:
        self._service = EditingService(settings or EditingSettings())

    def router(self, who: Callable[[HTTPConnection], Visitor]) -> APIRouter:
        """The addresses; `who` tells who may start flights."""
        router = APIRouter()

        @router.get("/api/editing/choices")
        def choices() -> dict[str, list[str] | int]:
            return {
                "scenarios": list_scenarios(),
                "lessons": [lesson.name for lesson in load_lessons()],
                "levels": LEVEL_FILES.names(),
                "max_text": editor_messages.MAX_TEXT,
                "max_count": editor_messages.MAX_COUNT,
            }

        @router.websocket("/ws/editing")
        async def editing(websocket: WebSocket) -> None:
            language = language_of(websocket)
            if not who(websocket).may_learn:
                await refuse(websocket, Said("access.fly").text(language))
                return
            await websocket.accept()
            page = EditorPage(websocket, language)

            async def take(request: editor_messages.Request) -> None:
                visitor = who(websocket)
                is_live = isinstance(request, editor_messages.StartLive | editor_messages.StopLive)
                if not (visitor.may_teach if is_live else visitor.may_learn):
                    # A flight in the simulator is seen on all pages, and is a try of the contest.
                    why = Said("access.live" if is_live and visitor.may_learn else "access.fly")
                    page.send(editor_messages.Refused(tag=request.tag, text=why.text(language)))
                    return
                await self._service.do(request.model_copy(update={"language": language}), page)

            self._service.enter(page)
            await page.serve(take, left=lambda: self._service.leave(page), refused=page.refuse)

        return router

    async def run(self) -> None:
        """Wait until cancelled, then end all flights."""
        try:
            await asyncio.Event().wait()
        finally:
            await self._service.close()


class EditorPage(Channel[editor_messages.Request, BaseModel]):
    """One browser's WebSocket; a watcher of the service. `language` is that of the page."""

    def __init__(self, websocket: WebSocket, language: Language) -> None:
        super().__init__(websocket, _FROM_PAGE)
        self.language = language

    def refuse(self, text: str, problem: PageMessageError) -> None:
        """Answer a message that is no request; what a person has typed may be the reason."""
        tag = 0
        with contextlib.suppress(ValidationError):
            tag = editor_messages.TAGGED.validate_json(text).tag
        self.send(editor_messages.Refused(tag=tag, text=str(problem)))
