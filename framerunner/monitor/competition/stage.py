"""What the audience is shown of a contest: who flies, split times, the best tries, the ranking."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fastapi import Response
from pydantic import Field

from framerunner.monitor.competition.api import json_response
from framerunner.monitor.competition.board import OPEN_CLASS
from framerunner.monitor.competition.views import (
    Board,
    CallView,
    CompetitionView,
    QueueView,
    RankingView,
    RunningView,
    TryView,
)
from scenarios.result import RefereeReport

if TYPE_CHECKING:
    from framerunner.monitor.competition.service import CompetitionService
    from framerunner.monitor.server import Monitor


class FlownView(CompetitionView):
    """A try that is over, with its split times."""

    id: int
    drone_id: int
    team_name: str = Field(description='"" if unknown')
    scenario: str
    frames: tuple[str, ...] = Field(description="colours to cross, in order")
    crossed: tuple[str, ...]
    splits: dict[str, float] = Field(description="try time of each crossing by colour, where it is known")
    try_time_s: float
    penalty_s: float
    total_s: float
    completed: bool
    verdict: str


class StageView(CompetitionView):
    """All that the audience is shown."""

    running: tuple[RunningView, ...]
    called: CallView | None
    queue: QueueView
    last: FlownView | None = Field(description="the newest try that is over and judged")
    interrupted: FlownView | None = Field(
        description="the newest try as last seen, if the monitor was stopped meanwhile and it was not judged"
    )
    last_against: FlownView | None = Field(description="the best other try at the scenario of the last")
    best: tuple[FlownView, ...] = Field(description="the best try at each scenario")
    ranking: RankingView
    complete: bool = Field(description="every team has flown every scenario of the round")


def register(monitor: Monitor) -> None:
    """Add the address; the contest's service must be there."""
    service: CompetitionService = monitor.web.state.competition

    @monitor.web.get("/api/competition/stage")
    async def stage() -> Response:
        board = await service.board()
        last, interrupted, against, *best = _select(board)
        wanted = {each.id for each in (last, interrupted, against, *best) if each is not None}
        reports = await service.read(lambda store: store.reports(wanted)) if wanted else {}
        cells = [cell for row in board.rankings[0].rows for cell in row.cells]
        view = StageView.of(
            board,
            running=service.running,
            last=_flown_view(last, reports),
            interrupted=_flown_view(interrupted, reports),
            last_against=_flown_view(against, reports),
            best=tuple(flown for each in best if (flown := _flown_view(each, reports)) is not None),
            ranking=board.rankings[0],
            complete=bool(cells) and all(cell.state != "not flown" for cell in cells),
        )
        return json_response(view)


def _select(board: Board) -> list[TryView | None]:
    """The tries that are shown: `last`, `interrupted` and `last_against`, then those of `best`."""
    over = [each for each in board.tries if each.judged and each.state != "running"]
    last = over[0] if over else None
    newest = board.tries[0] if board.tries else None
    is_open = newest is not None and newest.state == "interrupted" and not newest.judged
    against = None
    if last is not None:
        against = _best([each for each in over if each.scenario == last.scenario and each is not last])
    scenarios = dict.fromkeys(each.scenario for each in over)
    best = (_best([each for each in over if each.scenario == scenario]) for scenario in scenarios)
    return [last, newest if is_open else None, against, *best]


def _best(tries: list[TryView]) -> TryView | None:
    """The try that counts least; those without a team only if no team has flown, none of the class `open`."""
    tries = [each for each in tries if each.barrier != OPEN_CLASS]
    of_teams = [each for each in tries if each.team is not None]
    crossed = [each for each in of_teams or tries if each.result.crossed]
    return min(
        crossed, key=lambda each: (not each.result.completed, each.result.counted_s, each.id), default=None
    )


def _flown_view(each: TryView | None, reports: Mapping[int, RefereeReport | None]) -> FlownView | None:
    if each is None:
        return None
    result, report = each.result, reports.get(each.id)
    times_s = {} if report is None else report.times_s
    return FlownView.of(
        each,
        result,
        splits={colour: time_s for colour, time_s in times_s.items() if colour in result.crossed},
        verdict="corrected by a judge" if each.corrected_by else each.verdict,
    )
