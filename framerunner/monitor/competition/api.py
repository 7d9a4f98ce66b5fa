"""The contest over HTTP at `/api/competition`, and the WebSocket `/ws/competition` that reports changes.

Everybody may read; judges may write on tries, organisers on all.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, FastAPI, HTTPException, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError
from starlette.websockets import WebSocket

from framerunner.monitor.addresses import Places, client_address
from framerunner.monitor.channel import TRY_LATER_CODE, Channel, ChannelTerms, close
from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import DatabaseError
from framerunner.monitor.competition.rules import Correction, Rule
from framerunner.monitor.competition.service import CompetitionService
from framerunner.monitor.competition.validation import (
    DrawForm,
    Form,
    JudgementForm,
    NextForm,
    QueueForm,
    RefusedError,
    ScenarioForm,
    SettingsForm,
    TeamChangeForm,
    TeamForm,
    TeamOfTryForm,
    UndoForm,
    read_form,
    shown,
)
from framerunner.monitor.competition.views import (
    Message,
    RankingStateView,
    RankingView,
    StateView,
    ranking_csv,
    tries_csv,
)
from framerunner.monitor.urls import url_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from framerunner.monitor.access import Visitor
    from framerunner.monitor.server import Monitor

MAX_BODY_BYTES = 65_536
MAX_WATCHERS = 300
MAX_WATCHERS_PER_ADDRESS = 90
_MAX_ID = 2**31 - 1  # of a database's integer


def register(monitor: Monitor) -> None:
    """Add the contest to a monitor: its database, its interface and its live channel."""
    settings = monitor.settings
    service = CompetitionService(
        settings.database, monitor.equipment, f"the monitor at {url_of(*monitor.place, settings.scheme)}"
    )
    monitor.fleet.on_try(service.on_try_event)
    monitor.jobs.append(service.run)
    monitor.web.state.competition = service
    for error in (RefusedError, DatabaseError, SQLAlchemyError):
        monitor.web.add_exception_handler(error, _on_error)
    _add_channel(monitor.web, service)
    monitor.web.include_router(_reading_routes(service))
    monitor.web.include_router(
        _organising_routes(service, _Writers(service, monitor.access.require_organiser))
    )
    monitor.web.include_router(_judging_routes(service, _Writers(service, monitor.access.require_judge)))


def json_response(value: BaseModel | list[Any] | dict[str, Any]) -> Response:
    """Answer with JSON that no browser keeps."""
    text = value.model_dump_json(by_alias=True) if isinstance(value, BaseModel) else json.dumps(value)
    return Response(text, media_type="application/json", headers={"Cache-Control": "no-store"})


async def _on_error(request: Request, error: Exception) -> Response:
    """Answer in one line what went wrong."""
    status = error.status if isinstance(error, RefusedError) else 503
    text = "the database refused this; reload the page, then try again"
    return JSONResponse({"detail": text if isinstance(error, SQLAlchemyError) else str(error)}, status)


def _reading_routes(service: CompetitionService) -> APIRouter:
    routes = APIRouter(prefix="/api/competition")

    @routes.get("/state")
    async def state() -> Response:
        return json_response(StateView.of(service, board=await service.board()))

    @routes.get("/teams")
    async def teams() -> Response:
        return json_response([team.model_dump(mode="json") for team in (await service.board()).teams])

    @routes.get("/tries")
    async def tries() -> Response:
        return json_response([each.model_dump(mode="json") for each in (await service.board()).tries])

    @routes.get("/tries.csv")
    async def tries_as_csv() -> Response:
        return _csv("tries.csv", tries_csv(await service.read(lambda store: store.everything())))

    @routes.get("/tries/{try_id}")
    async def one_try(try_id: str) -> Response:
        number = _id("try", try_id)
        return json_response(await service.read(lambda store: store.detail(number)))

    @routes.get("/ranking")
    async def ranking(round: str = "") -> Response:  # noqa: A002 - its name in the address
        board = await service.board()
        rounds = tuple(ranking.round for ranking in board.rankings)
        chosen = _of_round(board.rankings, round)
        return json_response(RankingStateView.of(board, service, ranking=chosen, rounds=rounds))

    @routes.get("/ranking.csv")
    async def ranking_as_csv(round: str = "") -> Response:  # noqa: A002
        return _csv("ranking.csv", ranking_csv(_of_round((await service.board()).rankings, round)))

    return routes


class _Writers:
    """Reads the requests of those whom `require` lets in. All others are refused before the body is read."""

    def __init__(self, service: CompetitionService, require: Callable[[Request], Visitor]) -> None:
        self._service = service
        self._require = require

    async def read(self, request: Request, model: type[Form]) -> tuple[Form, Entry]:
        """Return the form, and who sent it now."""
        judge = self._require(request)
        if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
            raise HTTPException(415, "the body must be JSON; send Content-Type: application/json")
        body = await request.body()
        if len(body) > MAX_BODY_BYTES:
            raise HTTPException(413, f"the body has {len(body)} bytes; send at most {MAX_BODY_BYTES}")
        return read_form(model, body), self._service.entry(judge.name)


def _organising_routes(service: CompetitionService, organisers: _Writers) -> APIRouter:
    """Teams, calls and the queue, the draw, the rule."""
    routes = APIRouter(prefix="/api/competition")

    @routes.post("/teams")
    async def add_team(request: Request) -> Response:
        form, entry = await organisers.read(request, TeamForm)
        team = await service.change(lambda store: store.add_team(form.name, form.members, entry))
        return json_response({"team": team})

    @routes.post("/teams/{team_id}")
    async def change_team(request: Request, team_id: str) -> Response:
        form, entry = await organisers.read(request, TeamChangeForm)
        number = _id("team", team_id)
        await service.change(
            lambda store: store.change_team(number, form.name, form.members, form.withdrawn, entry)
        )
        return json_response({"team": number})

    @routes.post("/next")
    async def call(request: Request) -> Response:
        form, entry = await organisers.read(request, NextForm)
        if form.scenario:
            await service.frames(form.scenario)
        await service.change(lambda store: store.call(form.team, form.scenario, entry))
        return json_response({"team": form.team, "scenario": form.scenario})

    @routes.post("/next/undo")
    async def take_back(request: Request) -> Response:
        form, entry = await organisers.read(request, UndoForm)
        await service.change(lambda store: store.take_back(form.call, entry))
        return json_response({"call": form.call})

    @routes.post("/queue")
    async def set_queue(request: Request) -> Response:
        form, entry = await organisers.read(request, QueueForm)
        teams = service.shuffled(form.teams) if form.shuffle else form.teams
        await service.change(lambda store: store.set_queue(form.seen, teams, entry))
        return json_response({"teams": teams})

    @routes.post("/draw")
    async def draw(request: Request) -> Response:
        form, entry = await organisers.read(request, DrawForm)
        count = form.count or (await service.board()).rule.scenarios
        return json_response({"round": await service.draw(form.pool, count, entry)})

    @routes.post("/pool")
    async def check_scenario(request: Request) -> Response:
        form, _ = await organisers.read(request, ScenarioForm)
        await service.check_drawable(form.scenario)
        return json_response({"scenario": form.scenario})

    @routes.post("/settings")
    async def set_rule(request: Request) -> Response:
        form, entry = await organisers.read(request, SettingsForm)
        await service.change(lambda store: store.set_rule(Rule(**form.model_dump()), entry))
        return json_response(form)

    return routes


def _judging_routes(service: CompetitionService, judges: _Writers) -> APIRouter:
    """Judges' entries on a try."""
    routes = APIRouter(prefix="/api/competition")

    @routes.post("/tries/{try_id}/judgement")
    async def judge(request: Request, try_id: str) -> Response:
        form, entry = await judges.read(request, JudgementForm)
        number = _id("try", try_id)
        crossed = None if form.crossed is None else tuple(form.crossed)
        values = Correction(crossed, form.contacts, form.penalty_s, form.try_time_s, form.completed)
        await service.change(lambda store: store.correct(number, form.seen, values, form.remarks, entry))
        return json_response({"try": number})

    @routes.post("/tries/{try_id}/team")
    async def assign(request: Request, try_id: str) -> Response:
        form, entry = await judges.read(request, TeamOfTryForm)
        number = _id("try", try_id)
        await service.change(lambda store: store.assign(number, form.seen, form.team, entry))
        return json_response({"try": number})

    return routes


def _of_round(rankings: tuple[RankingView, ...], number: str) -> RankingView:
    """The ranking of a round, given as typed; "" for the present one."""
    for ranking in rankings:
        if number in {"", str(ranking.round)}:
            return ranking
    known = ", ".join(str(ranking.round) for ranking in rankings)
    raise RefusedError(f"round {shown(number)} does not exist; choose one of {known}", 404)


def _id(what: str, text: str) -> int:
    """The number of a try or team, from an address."""
    if not (text.isascii() and text.isdigit() and len(text) <= 10 and int(text) <= _MAX_ID):
        raise RefusedError(f"{what} {shown(text)} does not exist; choose one of the list", 404)
    return int(text)


def _csv(name: str, text: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"', "Cache-Control": "no-store"}
    return Response(text.encode(), media_type="text/csv; charset=utf-8", headers=headers)


def _add_channel(web: FastAPI, service: CompetitionService) -> None:
    """Add the WebSocket: it reports that the contest changed; pages then request what they show."""
    places = Places(MAX_WATCHERS, MAX_WATCHERS_PER_ADDRESS)

    @web.websocket("/ws/competition")
    async def live(websocket: WebSocket) -> None:
        await websocket.accept()
        address = client_address(websocket.scope)
        if places.take(address):
            await close(websocket, TRY_LATER_CODE, "too many are watching")
            return
        channel: Channel[None, Message] = Channel(websocket, ChannelTerms(None))

        def put(message: Message) -> None:
            channel.send(message, newest_of=message.kind)

        unsubscribe = service.subscribe(put)
        for message in service.messages():
            put(message)

        def left() -> None:
            unsubscribe()
            places.give_back(address)

        await channel.serve(left=left)
