"""What the audience is shown of a contest: who flies, split times, the best, the ranking."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fastapi import HTTPException, Response
from pydantic import Field
from sqlalchemy.exc import SQLAlchemyError

from monitor.competition.database import DatabaseError
from monitor.competition.views import Board, CallView, QueueView, RankingView, RunningView, TryView, View
from scenarios.result import RefereeReport

if TYPE_CHECKING:
    from monitor.competition.service import CompetitionService
    from monitor.server import Monitor


class FlownView(View):
    """A try that is over, with its split times."""

    id: int
    drone_id: int
    team_name: str = Field(description='"" if nobody knows')
    scenario: str
    frames: tuple[str, ...] = Field(description="colours to cross, in order")
    crossed: tuple[str, ...]
    splits: dict[str, float] = Field(description="try time of each crossing by colour, where it is known")
    try_time_s: float
    penalty_s: float
    total_s: float
    completed: bool
    verdict: str


class StageView(View):
    """All that the audience is shown."""

    running: tuple[RunningView, ...]
    called: CallView | None
    queue: QueueView
    last: FlownView | None = Field(description="the newest try that is over and judged")
    interrupted: FlownView | None = Field(
        description="the newest try as last seen, if the monitor was stopped meanwhile and nobody judged it"
    )
    last_against: FlownView | None = Field(description="the best try at the same scenario but for the last")
    best: tuple[FlownView, ...] = Field(description="the best try at each scenario")
    ranking: RankingView
    complete: bool = Field(description="every team has flown every scenario of the round")


def register(monitor: Monitor) -> None:
    """Add the address; the contest's service must be there."""
    service: CompetitionService = monitor.web.state.competition

    @monitor.web.get("/api/competition/stage")
    async def stage() -> Response:
        try:
            board = await service.board()
            wanted = {each.id for each in _shown(board)}
            reports = await service.read(lambda store: store.reports(wanted)) if wanted else {}
        except (DatabaseError, SQLAlchemyError) as error:
            raise HTTPException(503, str(error)) from error
        view = stage_view(board, service.running, reports)
        text = view.model_dump_json(by_alias=True)
        return Response(text, media_type="application/json", headers={"Cache-Control": "no-store"})


def stage_view(
    board: Board, running: tuple[RunningView, ...], reports: Mapping[int, RefereeReport | None]
) -> StageView:
    """Put it together.

    Args:
        board: the contest.
        running: tries that are being flown.
        reports: what the referee said of tries, by their ids; for split times.
    """

    def flown(each: TryView | None) -> FlownView | None:
        return None if each is None else _flown_view(each, reports.get(each.id))

    last = _last(board)
    against = _best(board, last.scenario, without=last.id) if last is not None else None
    best = (flown(_best(board, name)) for name in _scenarios(board))
    ranking = board.rankings[0]
    cells = [cell for row in ranking.rows for cell in row.cells]
    return StageView(
        running=running,
        called=board.called,
        queue=board.queue,
        last=flown(last),
        interrupted=flown(_interrupted(board)),
        last_against=flown(against),
        best=tuple(each for each in best if each is not None),
        ranking=ranking,
        complete=bool(cells) and all(cell.state != "not flown" for cell in cells),
    )


def _shown(board: Board) -> list[TryView]:
    """The tries whose split times are shown."""
    last = _last(board)
    against = _best(board, last.scenario, without=last.id) if last is not None else None
    tries = (last, against, _interrupted(board), *(_best(board, name) for name in _scenarios(board)))
    return [each for each in tries if each is not None]


def _last(board: Board) -> TryView | None:
    return next((each for each in board.tries if _is_over(each)), None)


def _interrupted(board: Board) -> TryView | None:
    newest = board.tries[0] if board.tries else None
    return newest if newest is not None and newest.state == "interrupted" and not newest.judged else None


def _is_over(each: TryView) -> bool:
    return each.judged and each.state != "running"


def _scenarios(board: Board) -> list[str]:
    return list(dict.fromkeys(each.scenario for each in board.tries if _is_over(each)))


def _best(board: Board, scenario: str, without: int | None = None) -> TryView | None:
    """The try at a scenario that counts least; those without a team only where no team has flown it."""
    tries = [
        each for each in board.tries if _is_over(each) and each.scenario == scenario and each.id != without
    ]
    of_teams = [each for each in tries if each.team is not None]
    worth = [each for each in of_teams or tries if each.result.crossed]
    return min(
        worth, key=lambda each: (not each.result.completed, each.result.counted_s, each.id), default=None
    )


def _flown_view(each: TryView, report: RefereeReport | None) -> FlownView:
    result = each.result
    times_s = {} if report is None else report.times_s
    return FlownView(
        id=each.id,
        drone_id=each.drone_id,
        team_name=each.team_name,
        scenario=each.scenario,
        frames=each.frames,
        crossed=result.crossed,
        splits={colour: time_s for colour, time_s in times_s.items() if colour in result.crossed},
        try_time_s=result.try_time_s,
        penalty_s=result.penalty_s,
        total_s=result.total_s,
        completed=result.completed,
        verdict="corrected by a judge" if each.corrected_by else each.verdict,
    )
