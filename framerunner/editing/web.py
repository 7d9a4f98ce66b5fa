"""The editor's addresses for flights: `GET /api/editing/choices` and the WebSocket `/ws/editing`.

`/api/editing/choices` is `{"scenarios": [names], "lessons": [names], "levels": [names], "max_text":
characters, "max_count": flights of a batch}`. A `scenario` below is the name of one or of a lesson, whose
goals then count; random ones are named as level and seed, such as `calm-17`.

`/ws/editing?language=es` has the server's words in Spanish. It is closed with code 4403 if the visitor may
not start flights. Each message is a JSON object. A request has `do` and may have `tag`, a whole number that
comes back with its answer:

    {"do": "start", "text": MISSION, "scenario": "test-case-1", "seed": 0, "speed": 1 or null,
     "paused": false, "break_on": [state ids]}      answer: started {run, layout} or refused
    {"do": "pause" | "go_on" | "stop", "run"}       answer: done or refused; likewise those that follow
    {"do": "step", "run", "ticks": 1}
    {"do": "speed", "run", "speed": vehicle seconds a second, null: as fast as possible}
    {"do": "break_on", "run", "states": [ids]}      replaces those named before
    {"do": "change", "run", "text": MISSION}        answer: changed {ids} or refused
    {"do": "watch", "run": id of a flight or batch} who started it watches it already
    {"do": "start_batch", "text", "level": "calm", "count": 20, "first_seed": 1}
    {"do": "start_batch", "text", "scenarios": [names]}      answer: batch_started {batch, count} or refused
    {"do": "cancel", "batch"}                       its results stay
    {"do": "start_live", "text", "scenario", "speed": 1.0}   a flight in the real simulator: `framerunner fly`
    {"do": "stop_live"}                             answer: done or refused

The server tells `{"kind": ...}`:

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
`red/resume`. `framerunner.editing.messages` has all fields. A mission is text, loaded by the checker of
missions; only the server's command line can name a Python file. Flights are simulated in processes with
limits of processor time and memory; what nobody watches for half a minute is ended.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import Callable

from fastapi import APIRouter
from pydantic import ValidationError
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket, WebSocketDisconnect

from framerunner.editing import messages
from framerunner.editing.places import lesson_names, level_names, scenario_names
from framerunner.editing.service import EditingService, EditingSettings
from framerunner.editing.words import Language, Said, language_of, say
from framerunner.monitor.access import Visitor, refuse
from framerunner.monitor.pilot_channel import Allowance
from scenarios.result import first_error

TOO_SLOW_CODE, TOO_MANY_CODE = 1013, 4429
_MAX_QUEUE = 1000
_MAX_MESSAGE = 4 * messages.MAX_TEXT


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
                "scenarios": scenario_names(),
                "lessons": lesson_names(),
                "levels": level_names(),
                "max_text": messages.MAX_TEXT,
                "max_count": messages.MAX_COUNT,
            }

        @router.websocket("/ws/editing")
        async def editing(websocket: WebSocket) -> None:
            language = language_of(websocket)
            if not who(websocket).may_learn:
                await refuse(websocket, say(Said("access.fly"), language))
                return
            await websocket.accept()
            await _Connection(websocket, self._service, language, lambda: who(websocket)).serve()

        return router

    async def run(self) -> None:
        """Wait until cancelled, then end all flights."""
        try:
            await asyncio.Event().wait()
        finally:
            await self._service.close()


class _Connection:
    """One browser's WebSocket; a watcher of the service."""

    def __init__(
        self,
        websocket: WebSocket,
        service: EditingService,
        language: Language,
        visitor: Callable[[], Visitor],
    ) -> None:
        self.language = language
        self._visitor = visitor
        self._websocket = websocket
        self._service = service
        self._outbox: deque[str] = deque()
        self._arrived = asyncio.Event()
        self._allowance = Allowance(time.monotonic)
        self._too_slow = False

    def put(self, line: str) -> None:
        """Queue a message; a page that does not keep up is disconnected."""
        if len(self._outbox) < _MAX_QUEUE:
            self._outbox.append(line)
        else:
            self._too_slow = True
        self._arrived.set()

    async def serve(self) -> None:
        """Receive and send until the browser disconnects or is disconnected."""
        self._service.enter(self)
        sending = asyncio.create_task(self._send())
        receiving = asyncio.create_task(self._receive())
        try:
            await asyncio.wait({sending, receiving}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._service.leave(self)
            for task in (sending, receiving):
                task.cancel()

    async def _receive(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                message = await self._websocket.receive()
                if message["type"] == "websocket.disconnect":
                    return
                text = message.get("text") or ""
                if not self._allowance.spend():
                    await self._websocket.close(TOO_MANY_CODE, "too many messages a second")
                    return
                await self._take(text)

    async def _take(self, text: str) -> None:
        if len(text) > _MAX_MESSAGE:
            text = say(Said("message.too_long"), self.language)
            self.put(messages.Refused(tag=0, text=text).model_dump_json())
            return
        try:
            request = messages.REQUEST.validate_json(text)
        except ValidationError as error:
            self.put(messages.Refused(tag=_tag_in(text), text=first_error(error)).model_dump_json())
            return
        visitor, is_live = self._visitor(), isinstance(request, messages.StartLive | messages.StopLive)
        if not (visitor.may_teach if is_live else visitor.may_learn):
            # A flight in the simulator is seen on all pages, and is a try of the contest.
            why = Said("access.live" if is_live and visitor.may_learn else "access.fly")
            self.put(messages.Refused(tag=request.tag, text=say(why, self.language)).model_dump_json())
            return
        await self._service.do(request.model_copy(update={"language": self.language}), self)

    async def _send(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError, OSError):
            while True:
                await self._arrived.wait()
                self._arrived.clear()
                if self._too_slow:
                    await self._websocket.close(TOO_SLOW_CODE, "this page does not keep up")
                    return
                while self._outbox:
                    await self._websocket.send_text(self._outbox.popleft())


def _tag_in(text: str) -> int:
    """The tag of a request that cannot be carried out; 0 if it has none."""
    with contextlib.suppress(ValidationError):
        return messages.TAGGED.validate_json(text).tag
    return 0
