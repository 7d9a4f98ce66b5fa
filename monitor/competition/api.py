"""The contest over HTTP at `/api/competition`: all may read, judges may write."""

from __future__ import annotations

import json
from collections.abc import Awaitable
from typing import TYPE_CHECKING, Any, TypeVar

from fastapi import APIRouter, HTTPException, Request, Response
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError

from monitor.competition.calls import Entry
from monitor.competition.channel import add_channel
from monitor.competition.database import DatabaseError
from monitor.competition.export import ranking_csv, tries_csv
from monitor.competition.forms import (
    MOST_BODY_BYTES,
    DrawForm,
    Form,
    JudgementForm,
    NextForm,
    QueueForm,
    SettingsForm,
    TeamChangeForm,
    TeamForm,
    TeamOfTryForm,
    UndoForm,
    read_form,
)
from monitor.competition.rules import Correction, Rule
from monitor.competition.service import CompetitionService
from monitor.competition.views import RankingStateView, RankingView, StateView
from monitor.competition.words import Refused, shown

if TYPE_CHECKING:
    from monitor.access import Access
    from monitor.server import Monitor

Answer = TypeVar("Answer")
_MOST_ID = 2**31 - 1  # of a database's integer


def register(monitor: Monitor) -> None:
    """Add the contest to a monitor: its database, its interface and its live channel."""
    service = CompetitionService(monitor.settings.database, monitor.equipment)
    monitor.fleet.on_try(service.hear)
    monitor.jobs.append(service.run)
    monitor.web.state.competition = service
    add_channel(monitor.web, service)
    monitor.web.include_router(reading_routes(service))
    judges = _Judges(service, monitor.access)
    monitor.web.include_router(organising_routes(service, judges))
    monitor.web.include_router(judging_routes(service, judges))


def reading_routes(service: CompetitionService) -> APIRouter:
    """What everybody may read."""
    routes = APIRouter(prefix="/api/competition")

    @routes.get("/state")
    async def state() -> Response:
        return _json(await _words(_state(service)))

    @routes.get("/teams")
    async def teams() -> Response:
        return _json([team.model_dump(mode="json") for team in (await _words(_state(service))).board.teams])

    @routes.get("/tries")
    async def tries() -> Response:
        board = (await _words(_state(service))).board
        return _json([each.model_dump(mode="json") for each in board.tries])

    @routes.get("/tries.csv")
    async def tries_as_csv() -> Response:
        return _csv("tries.csv", tries_csv(await _words(service.read(lambda store: store.everything()))))

    @routes.get("/tries/{try_id}")
    async def one_try(try_id: str) -> Response:
        number = await _words(_ident("try", try_id))
        return _json(await _words(service.read(lambda store: store.detail(number))))

    @routes.get("/ranking")
    async def ranking(round: str = "") -> Response:  # noqa: A002 - its name in the address
        return _json(await _words(_ranking(service, round)))

    @routes.get("/ranking.csv")
    async def ranking_as_csv(round: str = "") -> Response:  # noqa: A002
        return _csv("ranking.csv", ranking_csv((await _words(_ranking(service, round))).ranking))

    return routes


class _Judges:
    """Reads what judges send. Everybody else's request is refused before its body is looked at."""

    def __init__(self, service: CompetitionService, access: Access) -> None:
        self._service = service
        self._access = access

    async def asked(self, request: Request, model: type[Form]) -> tuple[Form, Entry]:
        """What a judge asks for, and who it is, now."""
        judge = self._access.require_judge(request)
        if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
            raise HTTPException(415, "the body must be JSON; send Content-Type: application/json")
        body = await request.body()
        if len(body) > MOST_BODY_BYTES:
            raise HTTPException(413, f"the body has {len(body)} bytes; send at most {MOST_BODY_BYTES}")
        try:
            return read_form(model, body), self._service.entry(judge.name)
        except Refused as error:
            raise HTTPException(error.status, str(error)) from error


def organising_routes(service: CompetitionService, judges: _Judges) -> APIRouter:
    """Teams, calls and the queue, the draw, the rule."""
    routes = APIRouter(prefix="/api/competition")

    @routes.post("/teams")
    async def add_team(request: Request) -> Response:
        form, entry = await judges.asked(request, TeamForm)
        team = await _words(service.change(lambda store: store.add_team(form.name, form.members, entry)))
        return _json({"team": team})

    @routes.post("/teams/{team_id}")
    async def change_team(request: Request, team_id: str) -> Response:
        form, entry = await judges.asked(request, TeamChangeForm)
        number = await _words(_ident("team", team_id))
        values = (form.name, form.members, form.withdrawn)
        await _words(service.change(lambda store: store.change_team(number, *values, entry)))
        return _json({"team": number})

    @routes.post("/next")
    async def call(request: Request) -> Response:
        form, entry = await judges.asked(request, NextForm)
        if form.scenario:
            await _words(service.frames(form.scenario))
        await _words(service.change(lambda store: store.call(form.team, form.scenario, entry)))
        return _json({"team": form.team, "scenario": form.scenario})

    @routes.post("/next/undo")
    async def take_back(request: Request) -> Response:
        form, entry = await judges.asked(request, UndoForm)
        await _words(service.change(lambda store: store.take_back(form.call, entry)))
        return _json({"call": form.call})

    @routes.post("/queue")
    async def set_queue(request: Request) -> Response:
        form, entry = await judges.asked(request, QueueForm)
        teams = service.shuffled(form.teams) if form.shuffle else form.teams
        await _words(service.change(lambda store: store.set_queue(form.seen, teams, entry)))
        return _json({"teams": teams})

    @routes.post("/draw")
    async def draw(request: Request) -> Response:
        form, entry = await judges.asked(request, DrawForm)
        count = form.count or (await _words(_state(service))).board.rule.scenarios
        number = await _words(service.draw(form.pool, count, entry.who))
        return _json({"round": number})

    @routes.post("/settings")
    async def set_rule(request: Request) -> Response:
        form, entry = await judges.asked(request, SettingsForm)
        rule = Rule(form.limit_s, form.missing_frame_s, form.scenarios, form.counting)
        await _words(service.change(lambda store: store.set_rule(rule, entry)))
        return _json(form)

    return routes


def judging_routes(service: CompetitionService, judges: _Judges) -> APIRouter:
    """What judges say of a try."""
    routes = APIRouter(prefix="/api/competition")

    @routes.post("/tries/{try_id}/judgement")
    async def judge(request: Request, try_id: str) -> Response:
        form, entry = await judges.asked(request, JudgementForm)
        number = await _words(_ident("try", try_id))
        crossed = None if form.crossed is None else tuple(form.crossed)
        said = Correction(crossed, form.contacts, form.penalty_s, form.try_time_s, form.completed)
        await _words(
            service.change(lambda store: store.correct(number, form.seen, said, form.remarks, entry))
        )
        return _json({"try": number})

    @routes.post("/tries/{try_id}/team")
    async def assign(request: Request, try_id: str) -> Response:
        form, entry = await judges.asked(request, TeamOfTryForm)
        number = await _words(_ident("try", try_id))
        await _words(service.change(lambda store: store.assign(number, form.seen, form.team, entry)))
        return _json({"try": number})

    return routes


async def _words(work: Awaitable[Answer]) -> Answer:
    """Do it; what goes wrong is answered in one line."""
    try:
        return await work
    except Refused as error:
        raise HTTPException(error.status, str(error)) from error
    except DatabaseError as error:
        raise HTTPException(503, str(error)) from error
    except SQLAlchemyError as error:
        raise HTTPException(503, "the database refused this; look anew, then try again") from error


async def _state(service: CompetitionService) -> StateView:
    board = await service.board()
    return StateView(
        board=board, running=service.running, problem=service.problem, scenarios=service.scenarios
    )


async def _ranking(service: CompetitionService, number: str) -> RankingStateView:
    board = await service.board()
    return RankingStateView(
        version=board.version,
        ranking=_of_round(board.rankings, number),
        rounds=tuple(ranking.round for ranking in board.rankings),
        rule=board.rule,
        called=board.called,
        queue=board.queue,
        running=service.running,
        problem=service.problem,
    )


def _of_round(rankings: tuple[RankingView, ...], number: str) -> RankingView:
    """The ranking of a round, given as typed; "" for the present one."""
    for ranking in rankings:
        if number in {"", str(ranking.round)}:
            return ranking
    known = ", ".join(str(ranking.round) for ranking in rankings)
    raise Refused(f"round {shown(number)} does not exist; choose one of {known}", 404)


async def _ident(what: str, text: str) -> int:
    """The number of a try or team, from an address."""
    if not (text.isascii() and text.isdigit() and len(text) <= 10 and int(text) <= _MOST_ID):
        raise Refused(f"{what} {shown(text)} does not exist; choose one of the list", 404)
    return int(text)


def _json(value: BaseModel | list[Any] | dict[str, Any]) -> Response:
    text = value.model_dump_json(by_alias=True) if isinstance(value, BaseModel) else json.dumps(value)
    return Response(text, media_type="application/json", headers={"Cache-Control": "no-store"})


def _csv(name: str, text: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"', "Cache-Control": "no-store"}
    return Response(text.encode(), media_type="text/csv; charset=utf-8", headers=headers)
