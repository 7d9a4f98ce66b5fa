"""What `/api/competition` sends: documented models, and CSV files made of them."""

from __future__ import annotations

from datetime import datetime
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from framerunner.files.spreadsheet import csv_text

Counting = Literal["best", "last"]


class CompetitionView(BaseModel):
    """Base of all views."""

    model_config = ConfigDict(frozen=True)

    @classmethod
    def of(cls, *sources: object, **more: object) -> Self:
        """A view of rows and other objects: each field as given, else of the first that has it."""
        fields = {
            name: getattr(each, name)
            for each in reversed(sources)
            for name in cls.model_fields
            if name not in more and hasattr(each, name)
        }
        return cls.model_validate(fields | more)


class TeamView(CompetitionView):
    """A team."""

    id: int
    name: str = Field(description="as entered; to be shown as text")
    members: str = Field(description="as entered; to be shown as text")
    withdrawn: bool = Field(description="out of the contest; its tries are kept")


class ResultView(CompetitionView):
    """What a try was worth."""

    crossed: tuple[str, ...] = Field(description="frames crossed in the right order")
    missing: tuple[str, ...] = Field(description="the other frames")
    contacts: int
    penalty_s: float
    try_time_s: float
    total_s: float = Field(description="try time and penalty")
    completed: bool
    counted_s: float = Field(description="what it adds to a team's total")


class TryView(CompetitionView):
    """A try."""

    id: int
    attempt: int = Field(description="counts the team's tries at this scenario from 1; 0 without a team")
    round: int = Field(description="in which it was flown; 0 before the first draw")
    team: int | None = Field(description="id; null until a judge assigns it")
    team_name: str
    scenario: str = Field(description='"" if unknown')
    drone_id: int
    frames: tuple[str, ...] = Field(description="colours to cross, in order")
    state: str = Field(description='"running", "ended", or "interrupted": to be judged by hand')
    judged: bool = Field(description="it has a result: it ended, or a judge corrected it")
    barrier: str = Field(
        description='why no ranking has it: "open class", "no team", "withdrawn", "no scenario" or '
        '"not drawn"; "" if one has'
    )
    verdict: str = Field(description="the referee's")
    reason: str = Field(description="the referee's, one sentence")
    source: str = Field(description='of the referee\'s states: "truth" or "telemetry"')
    final: bool = Field(description="the referee's values are those of the app's result")
    referee: ResultView
    result: ResultView = Field(description="after correction")
    corrected_by: str = Field(description='who corrected it last; "" if it was not corrected')
    judgements: int = Field(description="how often judges changed it; a correction must have this number")
    started: datetime
    ended: datetime | None


class JudgementView(CompetitionView):
    """A judge's entry on a try; null is "as the referee says"."""

    number: int
    kind: str = Field(description='"correction" or "team"')
    team_name: str = Field(description='where `kind` is "team", the team; "" for none')
    crossed: tuple[str, ...] | None
    contacts: int | None
    penalty_s: float | None
    try_time_s: float | None
    completed: bool | None
    remarks: str
    who: str
    at: datetime


class DrawView(CompetitionView):
    """Scenarios drawn for a round."""

    round: int
    scenarios: tuple[str, ...]
    commands: tuple[str, ...] = Field(description="what a team types to fly each")
    pool: tuple[str, ...] = Field(description="names that could be drawn")
    who: str
    at: datetime


class QueuedView(CompetitionView):
    """A team in the queue."""

    team: int
    team_name: str


class CallView(QueuedView):
    """The team that is called to the start; the next try that begins is assigned to it."""

    id: int
    scenario: str = Field(description='"" for whatever the drone flies')
    attempt: int | None = Field(
        description="id of the try that the team flies on this call now", serialization_alias="try"
    )
    who: str
    at: datetime


class QueueView(CompetitionView):
    """The teams that fly after the one that is called."""

    number: int = Field(description="of this state of the queue; a request to change it must have it")
    teams: tuple[QueuedView, ...] = Field(description="the first flies first")


class LastCallView(QueuedView):
    """The call that a judge can still take back."""

    id: int
    tries: tuple[int, ...] = Field(description="flown on it: they would have no team")


class RuleView(CompetitionView):
    """The combination rule."""

    limit_s: float = Field(description="what a try that is not completed counts at least")
    missing_frame_s: float = Field(description="what it counts more for each frame missing")
    scenarios: int = Field(description="how many make a round")
    counting: Counting = Field(description="which of several tries at one scenario counts")
    who: str = Field(description='who set it; "" for the defaults')
    at: datetime | None


class RivalView(CompetitionView):
    """Another try of the same team at the same scenario of the round."""

    attempt: int = Field(serialization_alias="try")
    counted_s: float
    contacts: int


class TryDetail(CompetitionView):
    """A try with all judges' entries."""

    attempt: TryView = Field(serialization_alias="try")
    rival: RivalView | None = Field(description="of the other tries the one that would count; null for none")
    correction: JudgementView | None = Field(description="the last one")
    rule: RuleView
    history: tuple[JudgementView, ...] = Field(description="newest first")


class CellView(CompetitionView):
    """A team at one scenario."""

    scenario: str
    counted_s: float
    state: str = Field(description='"completed", "not completed" or "not flown"')
    attempt: int | None = Field(description="id of the try that counts", serialization_alias="try")
    missing: int = Field(description="frames missing")
    tries: int = Field(description="how many the team had")


class RowView(CompetitionView):
    """A row of the ranking."""

    rank: int | None = Field(description="null before the first judged try")
    team: int
    name: str
    total_s: float
    contacts: int = Field(description="of the tries that count")
    flown: int = Field(description="scenarios with a judged try")
    cells: tuple[CellView, ...]


class RankingView(CompetitionView):
    """The ranking of a round."""

    round: int
    scenarios: tuple[str, ...] = Field(description='"" where one is still to be drawn')
    rows: tuple[RowView, ...]


class RunningView(CompetitionView):
    """A try that is being flown; sent every second."""

    id: int
    team: int | None = Field(description="id; null until a judge assigns it")
    team_name: str
    scenario: str
    barrier: str = Field(description="as of a try")
    drone_id: int
    frames: tuple[str, ...]
    crossed: tuple[str, ...]
    contacts: int
    penalty_s: float
    try_time_s: float


class ChangedMessage(CompetitionView):
    """The contest changed; pages then request what they show."""

    kind: Literal["changed"] = "changed"
    version: int
    problem: str = Field(description='what is wrong with the database; "" while it works')


class RunningMessage(CompetitionView):
    """The tries that are being flown."""

    kind: Literal["running"] = "running"
    tries: tuple[RunningView, ...]


Message = ChangedMessage | RunningMessage


class Board(CompetitionView):
    """The whole contest as of one moment."""

    version: int = Field(description="grows with each change")
    round: int = Field(description="the present one; 0 before the first draw")
    rule: RuleView
    teams: tuple[TeamView, ...]
    called: CallView | None
    last_call: LastCallView | None
    queue: QueueView
    draws: tuple[DrawView, ...] = Field(description="newest first")
    tries: tuple[TryView, ...] = Field(description="newest first, at most 500")
    rankings: tuple[RankingView, ...] = Field(description="one for each round, the present one first")


class StateView(CompetitionView):
    """The contest and the tries being flown."""

    board: Board
    running: tuple[RunningView, ...]
    problem: str = Field(description='what is wrong with the database; "" while it works')
    scenarios: tuple[str, ...] = Field(description="names that can be drawn: those with all three frames")


class RankingStateView(CompetitionView):
    """A ranking, the queue and the tries being flown."""

    version: int
    ranking: RankingView
    rounds: tuple[int, ...] = Field(description="the present one first")
    rule: RuleView
    called: CallView | None
    queue: QueueView
    running: tuple[RunningView, ...]
    problem: str


_TRY_COLUMNS = (
    *("try", "round", "team", "scenario", "attempt", "drone", "state", "judged", "verdict"),
    *("crossed", "missing", "contacts", "penalty_s", "try_time_s", "total_s", "completed", "counted_s"),
    *("counts", "why_not", "corrected_by", "source", "final", "started", "ended", "reason"),
)


def ranking_csv(ranking: RankingView) -> str:
    """The ranking of a round; for each scenario what it counts and the try that counts."""
    columns = ["rank", "team", "total_s", "contacts", "flown"]
    for number, name in enumerate(ranking.scenarios, 1):
        scenario = name or f"scenario {number}"
        columns += [f"{scenario} counted_s", f"{scenario} state", f"{scenario} try"]
    rows: list[list[object]] = []
    for row in ranking.rows:
        values: list[object] = [row.rank, row.name, f"{row.total_s:.2f}", row.contacts, row.flown]
        for flown in row.cells:
            values += [f"{flown.counted_s:.2f}", flown.state, flown.attempt]
        rows.append(values)
    return csv_text(columns, rows)


def tries_csv(board: Board) -> str:
    """The tries of a board with all of them, oldest first, after correction."""
    counting = {
        (row.team, cell.scenario, ranking.round): cell.attempt
        for ranking in board.rankings
        for row in ranking.rows
        for cell in row.cells
    }
    rows: list[list[object]] = []
    for each in reversed(board.tries):
        result = each.result
        chosen = counting.get((each.team or 0, each.scenario, each.round))
        counts = chosen == each.id
        why_not = "" if counts else _why_not(each, chosen, board.rule.counting)
        rows.append(
            [
                *(each.id, each.round, each.team_name, each.scenario, each.attempt or "", each.drone_id),
                *(each.state, each.judged, each.verdict, " ".join(result.crossed), " ".join(result.missing)),
                *(result.contacts, result.penalty_s, result.try_time_s, result.total_s, result.completed),
                *(result.counted_s, counts, why_not, each.corrected_by, each.source, each.final),
                each.started.isoformat(),
                *(each.ended.isoformat() if each.ended is not None else "", each.reason),
            ]
        )
    return csv_text(_TRY_COLUMNS, rows)


def _why_not(each: TryView, chosen: int | None, counting: Counting) -> str:
    """Why a try does not count; `chosen`: the try of its team that counts at its scenario."""
    if each.state == "running":
        return "is being flown"
    if not each.judged:
        return "interrupted: to be judged"
    if each.barrier or chosen is None:
        return each.barrier
    return f"try {chosen} is {'better' if counting == 'best' else 'later'}"
