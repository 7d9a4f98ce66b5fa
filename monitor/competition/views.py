"""What the pages and the interface at `/api/competition` are told, as documented models."""

from __future__ import annotations

from datetime import datetime

from pydantic import BaseModel, ConfigDict, Field

from monitor.competition.rules import Counting


class View(BaseModel):
    """Base of all that is told."""

    model_config = ConfigDict(frozen=True)


class TeamView(View):
    """A team."""

    id: int
    name: str = Field(description="as entered; to be shown as text")
    members: str = Field(description="as entered; to be shown as text")
    withdrawn: bool = Field(description="out of the contest; its tries are kept")


class ResultView(View):
    """What a try was worth."""

    crossed: tuple[str, ...] = Field(description="frames crossed in their turn")
    missing: tuple[str, ...] = Field(description="frames not crossed in their turn")
    contacts: int
    penalty_s: float
    try_time_s: float
    total_s: float = Field(description="try time and penalty")
    completed: bool
    counted_s: float = Field(description="what it adds to a team's total")


class TryView(View):
    """A try."""

    id: int
    attempt: int = Field(description="counts the team's tries at this scenario from 1; 0 without a team")
    round: int = Field(description="in which it was flown; 0 before the first draw")
    team: int | None = Field(description="id; null until a judge says whose it was")
    team_name: str
    scenario: str = Field(description='"" where nobody knows')
    drone_id: int
    frames: tuple[str, ...] = Field(description="colours to cross, in order")
    state: str = Field(description='"running", "ended", or "interrupted": to be judged by hand')
    judged: bool = Field(description="it has a result: it ended, or a judge corrected it")
    barrier: str = Field(
        description='why no ranking has it: "no team", "withdrawn", "no scenario", "not drawn"; "" if one has'
    )
    verdict: str = Field(description="the referee's word")
    reason: str = Field(description="the referee's sentence")
    source: str = Field(description='what the referee saw by: "truth" or "telemetry"')
    final: bool = Field(description="the referee's values are those of the app's result")
    referee: ResultView
    result: ResultView = Field(description="after correction")
    corrected_by: str = Field(description='who corrected it last; "" for nobody')
    judgements: int = Field(description="how often judges changed it; a correction must carry this number")
    started: datetime
    ended: datetime | None


class JudgementView(View):
    """What a judge said of a try; null is "as the referee says"."""

    number: int
    kind: str = Field(description='"correction" or "team"')
    team_name: str = Field(description='whose it is, where `kind` is "team"; "" for nobody\'s')
    crossed: tuple[str, ...] | None
    contacts: int | None
    penalty_s: float | None
    try_time_s: float | None
    completed: bool | None
    remarks: str
    who: str
    at: datetime


class DrawView(View):
    """Scenarios drawn for a round."""

    round: int
    scenarios: tuple[str, ...]
    commands: tuple[str, ...] = Field(description="what a team types to fly each")
    pool: tuple[str, ...] = Field(description="what was in the pot")
    who: str
    at: datetime


class CallView(View):
    """The team that is called to the start; the next try that begins is its."""

    id: int
    team: int
    team_name: str
    scenario: str = Field(description='"" for whatever the drone flies')
    attempt: int | None = Field(
        description="id of the try that the team flies on this call now", serialization_alias="try"
    )
    who: str
    at: datetime


class QueuedView(View):
    """A team in the queue."""

    team: int
    team_name: str


class QueueView(View):
    """Who flies after the team that is called."""

    number: int = Field(description="names this state of the queue; who sets another must carry it")
    teams: tuple[QueuedView, ...] = Field(description="the first flies first")


class LastCallView(View):
    """The call that a judge can still take back."""

    id: int
    team: int
    team_name: str
    tries: tuple[int, ...] = Field(description="flown on it: they would become nobody's")


class RuleView(View):
    """The combination rule."""

    limit_s: float = Field(description="what a try that is not completed counts at least")
    missing_frame_s: float = Field(description="and for each frame missing")
    scenarios: int = Field(description="how many make a round")
    counting: Counting = Field(description="which of several tries at one scenario counts")
    who: str = Field(description='who set it last; "" for the defaults')
    at: datetime | None


class RivalView(View):
    """Another try of the same team at the same scenario of the round."""

    attempt: int = Field(serialization_alias="try")
    counted_s: float
    contacts: int


class TryDetail(View):
    """A try with all that judges said of it."""

    attempt: TryView = Field(serialization_alias="try")
    rival: RivalView | None = Field(description="of the other tries the one that would count; null for none")
    correction: JudgementView | None = Field(description="the one that holds")
    rule: RuleView
    history: tuple[JudgementView, ...] = Field(description="newest first")


class CellView(View):
    """A team at one scenario."""

    scenario: str
    counted_s: float
    state: str = Field(description='"completed", "not completed" or "not flown"')
    attempt: int | None = Field(description="id of the try that counts", serialization_alias="try")
    missing: int = Field(description="frames missing")
    tries: int = Field(description="how many the team had")


class RowView(View):
    """A row of the ranking."""

    rank: int
    team: int
    name: str
    total_s: float
    contacts: int
    flown: int = Field(description="scenarios with a judged try")
    cells: tuple[CellView, ...]


class RankingView(View):
    """The ranking of a round."""

    round: int
    scenarios: tuple[str, ...] = Field(description='"" where one is still to be drawn')
    rows: tuple[RowView, ...]


class RunningView(View):
    """A try that is being flown; sent every second."""

    id: int
    team: int | None = Field(description="id; null until a judge says whose it is")
    team_name: str
    scenario: str
    barrier: str = Field(description="as of a try")
    drone_id: int
    frames: tuple[str, ...]
    crossed: tuple[str, ...]
    contacts: int
    penalty_s: float
    try_time_s: float


class Board(View):
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


class StateView(View):
    """All that a page needs at first."""

    board: Board
    running: tuple[RunningView, ...]
    problem: str = Field(description='what the database says; "" while it works')
    scenarios: tuple[str, ...] = Field(description="names that can be drawn: those with all three frames")


class RankingStateView(View):
    """A ranking and what is going on."""

    version: int
    ranking: RankingView
    rounds: tuple[int, ...] = Field(description="that there are, the present one first")
    rule: RuleView
    called: CallView | None
    queue: QueueView
    running: tuple[RunningView, ...]
    problem: str
