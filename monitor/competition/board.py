"""The whole contest, read from the database in one go and put together for the pages."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from monitor.competition import tables
from monitor.competition.calls import (
    current_call,
    flying_on,
    last_call,
    queue_number,
    read_queue,
    tries_of,
)
from monitor.competition.rules import (
    Attempt,
    Correction,
    Counting,
    RankedTeam,
    Rule,
    TryScore,
    choose,
    correct,
    counted_cs,
    rank,
    read_report,
)
from monitor.competition.views import (
    Board,
    CallView,
    CellView,
    DrawView,
    JudgementView,
    LastCallView,
    QueuedView,
    QueueView,
    RankingView,
    ResultView,
    RivalView,
    RowView,
    RuleView,
    TeamView,
    TryDetail,
    TryView,
)
from monitor.competition.words import from_wire
from scenarios.result import RefereeReport

MOST_TRIES_SHOWN = 500


@dataclass(frozen=True, slots=True)
class _Judged:
    """A try with what was said of it."""

    row: tables.Try
    report: RefereeReport | None
    referee: TryScore
    result: TryScore
    correction: tables.Judgement | None
    judgements: int

    @property
    def counts(self) -> bool:
        """Whether it has a result."""
        return self.row.state == "ended" or (self.row.state == "interrupted" and self.correction is not None)


def read_board(session: Session, version: int, most_tries: int = MOST_TRIES_SHOWN) -> Board:
    """Read everything, and of the tries the newest to show."""
    rule_row = last_settings(session)
    rule = rule_of(rule_row)
    teams = list(session.scalars(select(tables.Team).order_by(tables.Team.id)))
    by_id = {team.id: team for team in teams}
    names = {team.id: team.name for team in teams}
    tries = _judged_tries(session)
    draws = list(session.scalars(select(tables.Draw).order_by(tables.Draw.id)))
    present = present_round(draws)
    rounds = sorted({present, *(draw.round for draw in draws), *(judged.row.round for judged in tries)})
    attempts = _attempt_numbers(tries)
    countable = {number: _countable(number, draws, tries, rule) for number in rounds}
    return Board(
        version=version,
        round=present,
        rule=_rule_view(rule, rule_row),
        teams=tuple(
            TeamView(id=team.id, name=team.name, members=team.members, withdrawn=team.withdrawn)
            for team in teams
        ),
        called=_call_view(session, names),
        last_call=_last_call_view(session, names),
        queue=_queue_view(session, names),
        draws=tuple(draw_view(draw) for draw in reversed(draws)),
        tries=tuple(
            _try_view(judged, names, attempts, rule, _barrier(judged.row, by_id, countable[judged.row.round]))
            for judged in reversed(tries[-most_tries:])
        ),
        rankings=tuple(_ranking(number, teams, draws, tries, rule) for number in reversed(rounds)),
    )


def read_detail(session: Session, try_id: int) -> TryDetail | None:
    """Read a try with its history; None if there is no such."""
    row = session.get(tables.Try, try_id)
    if row is None:
        return None
    teams = {team.id: team for team in session.scalars(select(tables.Team))}
    names = {team.id: team.name for team in teams.values()}
    same = [judged for judged in _tries_of_team(session, row) if judged.row.id != row.id]
    said = list(
        session.scalars(
            select(tables.Judgement)
            .where(tables.Judgement.try_id == try_id)
            .order_by(tables.Judgement.number.desc())
        )
    )
    judged = _judge(row, said[::-1])
    number = 1 + sum(1 for other in same if other.row.id < row.id) if row.team_id is not None else 0
    rule_row = last_settings(session)
    rule = rule_of(rule_row)
    views = tuple(_judgement_view(entry, names) for entry in said)
    of_round = select(tables.Draw).where(tables.Draw.round == row.round).order_by(tables.Draw.id)
    draws = list(session.scalars(of_round))
    scenarios = _countable(row.round, draws, [] if draws else _judged_tries(session), rule)
    return TryDetail(
        attempt=_try_view(judged, names, {row.id: number}, rule, _barrier(row, teams, scenarios)),
        rival=_rival_view(same, rule),
        correction=next((view for view in views if view.kind == "correction"), None),
        rule=_rule_view(rule, rule_row),
        history=views,
    )


def _tries_of_team(session: Session, row: tables.Try) -> list[_Judged]:
    """All tries of a try's team at its scenario in its round, oldest first; none of a try without a team."""
    if row.team_id is None:
        return []
    same = select(tables.Try).where(
        tables.Try.round == row.round, tables.Try.team_id == row.team_id, tables.Try.scenario == row.scenario
    )
    rows = list(session.scalars(same.order_by(tables.Try.id)))
    of_these = tables.Judgement.try_id.in_([each.id for each in rows])
    said: dict[int, list[tables.Judgement]] = {}
    for entry in session.scalars(select(tables.Judgement).where(of_these).order_by(tables.Judgement.number)):
        said.setdefault(entry.try_id, []).append(entry)
    return [_judge(each, said.get(each.id, [])) for each in rows]


def _barrier(row: tables.Try, teams: Mapping[int, tables.Team], scenarios: frozenset[str] | None) -> str:
    """Why no ranking has a try, as in `TryView`; "" if one has or may have it.

    Args:
        row: the try.
        teams: by id.
        scenarios: `_countable` of the try's round.
    """
    team = teams.get(row.team_id) if row.team_id is not None else None
    if team is None:
        return "no team"
    if team.withdrawn:
        return "withdrawn"
    if not row.scenario:
        return "no scenario"
    return "" if scenarios is None or row.scenario in scenarios else "not drawn"


def _countable(
    number: int, draws: Sequence[tables.Draw], tries: Sequence[_Judged], rule: Rule
) -> frozenset[str] | None:
    """The scenarios of a round; None while any other that is flown would still become one of them."""
    names = [name for name, _ in _scenarios(number, draws, _attempts(number, tries))][: rule.scenarios]
    is_complete = len(names) == rule.scenarios or any(draw.round == number for draw in draws)
    return frozenset(names) if is_complete else None


def _rival_view(same: Sequence[_Judged], rule: Rule) -> RivalView | None:
    rival = choose((_attempt(judged) for judged in same if judged.counts), rule)
    if rival is None:
        return None
    return RivalView(
        attempt=rival.order,
        counted_s=counted_cs(rival.result, rule) / 100,
        contacts=rival.result.contacts,
    )


def _attempt(judged: _Judged) -> Attempt:
    """A try of a team, for the ranking."""
    assert judged.row.team_id is not None
    return Attempt(judged.row.team_id, judged.row.scenario, judged.row.id, judged.result)


def last_settings(session: Session) -> tables.SettingsChange | None:
    """The rule as somebody set it last."""
    newest = select(tables.SettingsChange).order_by(tables.SettingsChange.id.desc()).limit(1)
    return session.scalars(newest).first()


def rule_of(row: tables.SettingsChange | None) -> Rule:
    """The rule; its defaults where nobody set it."""
    if row is None:
        return Rule()
    counting: Counting = "last" if row.counting == "last" else "best"
    return Rule(row.limit_s, row.missing_frame_s, row.scenarios, counting)


def present_round(draws: Sequence[tables.Draw]) -> int:
    """The round of the last draw; 0 before the first."""
    return max((draw.round for draw in draws), default=0)


def drawn_scenarios(draw: tables.Draw) -> list[tuple[str, tuple[str, ...]]]:
    """Name and frames of each scenario of a draw."""
    words = [line.split() for line in draw.scenarios.splitlines()]
    return [(name, tuple(frames)) for name, *frames in words]


def draw_view(draw: tables.Draw) -> DrawView:
    """A draw as it is told."""
    names = tuple(name for name, _ in drawn_scenarios(draw))
    return DrawView(
        round=draw.round,
        scenarios=names,
        commands=tuple(f"framerunner fly {name}" for name in names),
        pool=tuple(draw.pool.splitlines()),
        who=draw.who,
        at=draw.at,
    )


def _judged_tries(session: Session) -> list[_Judged]:
    said: dict[int, list[tables.Judgement]] = {}
    for entry in session.scalars(select(tables.Judgement).order_by(tables.Judgement.number)):
        said.setdefault(entry.try_id, []).append(entry)
    rows = session.scalars(select(tables.Try).order_by(tables.Try.id))
    return [_judge(row, said.get(row.id, [])) for row in rows]


def _judge(row: tables.Try, said: Sequence[tables.Judgement]) -> _Judged:
    """Lay the last correction over what the referee says. `said`: oldest first."""
    report = stored_report(row.report)
    referee = read_report(report, row.frames.split())
    last = next((entry for entry in reversed(said) if entry.kind == "correction"), None)
    correction = None
    if last is not None:
        crossed = None if last.crossed is None else tuple(last.crossed.split())
        correction = Correction(crossed, last.contacts, last.penalty_s, last.try_time_s, last.completed)
    return _Judged(row, report, referee, correct(referee, correction), last, len(said))


def stored_report(text: str) -> RefereeReport | None:
    """What the database has of a referee's report; None if nobody judged."""
    try:
        return RefereeReport.from_outside(json.loads(text))
    except ValueError:
        return None


def _attempt_numbers(tries: Sequence[_Judged]) -> dict[int, int]:
    counter: Counter[tuple[int, int, str]] = Counter()
    numbers = {}
    for judged in tries:
        row = judged.row
        if row.team_id is not None:
            counter[row.round, row.team_id, row.scenario] += 1
            numbers[row.id] = counter[row.round, row.team_id, row.scenario]
    return numbers


def _ranking(
    number: int,
    teams: Sequence[tables.Team],
    draws: Sequence[tables.Draw],
    tries: Sequence[_Judged],
    rule: Rule,
) -> RankingView:
    attempts = _attempts(number, tries)
    scenarios = _scenarios(number, draws, attempts)
    flown = Counter((attempt.team, attempt.scenario) for attempt in attempts)
    names = {team.id: team.name for team in teams if not team.withdrawn}
    rows = rank(names, scenarios, attempts, rule)
    shown = [name for name, _ in scenarios][: rule.scenarios]
    return RankingView(
        round=number,
        scenarios=(*shown, *[""] * (rule.scenarios - len(shown))),
        rows=tuple(_row_view(row, flown) for row in rows),
    )


def _attempts(number: int, tries: Sequence[_Judged]) -> list[Attempt]:
    """The tries that can count in the ranking of a round."""
    return [
        _attempt(judged)
        for judged in tries
        if judged.row.round == number
        and judged.row.team_id is not None
        and judged.row.scenario
        and judged.counts
    ]


def _scenarios(
    number: int, draws: Sequence[tables.Draw], attempts: Sequence[Attempt]
) -> list[tuple[str, tuple[str, ...]]]:
    """Names and frames of a round's scenarios: those drawn, or, where nothing was drawn, those flown."""
    draw = next((draw for draw in reversed(draws) if draw.round == number), None)
    if draw is not None:
        return drawn_scenarios(draw)
    frames = {attempt.scenario: attempt.result.frames for attempt in reversed(attempts)}
    return [(name, frames[name]) for name in dict.fromkeys(attempt.scenario for attempt in attempts)]


def _row_view(row: RankedTeam, flown: Mapping[tuple[int, str], int]) -> RowView:
    cells = []
    for cell in row.cells:
        result = cell.attempt.result if cell.attempt is not None else None
        state = "not flown" if result is None else "completed" if result.completed else "not completed"
        cells.append(
            CellView(
                scenario=cell.scenario,
                counted_s=cell.counted_cs / 100,
                state=state,
                attempt=cell.attempt.order if cell.attempt is not None else None,
                missing=len(result.missing) if result is not None else 0,
                tries=flown.get((row.team, cell.scenario), 0),
            )
        )
    return RowView(
        rank=row.rank,
        team=row.team,
        name=row.name,
        total_s=row.total_cs / 100,
        contacts=row.contacts,
        flown=sum(1 for cell in row.cells if cell.attempt is not None),
        cells=tuple(cells),
    )


def _try_view(
    judged: _Judged, names: Mapping[int, str], attempts: Mapping[int, int], rule: Rule, barrier: str
) -> TryView:
    row = judged.row
    return TryView(
        id=row.id,
        attempt=attempts.get(row.id, 0),
        round=row.round,
        team=row.team_id,
        team_name=names.get(row.team_id, "") if row.team_id is not None else "",
        scenario=row.scenario,
        drone_id=row.drone_id,
        frames=tuple(row.frames.split()),
        state=row.state,
        judged=judged.counts,
        barrier=barrier,
        verdict="" if judged.report is None else judged.report.verdict,
        reason="" if judged.report is None else from_wire(judged.report.reason, 500),
        source=row.source,
        final=row.final,
        referee=_result_view(judged.referee, rule),
        result=_result_view(judged.result, rule),
        corrected_by=judged.correction.who if judged.correction is not None else "",
        judgements=judged.judgements,
        started=row.started,
        ended=row.ended,
    )


def _result_view(result: TryScore, rule: Rule) -> ResultView:
    return ResultView(
        crossed=result.crossed,
        missing=result.missing,
        contacts=result.contacts,
        penalty_s=result.penalty_s,
        try_time_s=result.try_time_s,
        total_s=result.try_time_s + result.penalty_s,
        completed=result.completed,
        counted_s=counted_cs(result, rule) / 100,
    )


def _judgement_view(entry: tables.Judgement, names: Mapping[int, str]) -> JudgementView:
    return JudgementView(
        number=entry.number,
        kind=entry.kind,
        team_name=names.get(entry.team_id, "") if entry.team_id is not None else "",
        crossed=None if entry.crossed is None else tuple(entry.crossed.split()),
        contacts=entry.contacts,
        penalty_s=entry.penalty_s,
        try_time_s=entry.try_time_s,
        completed=entry.completed,
        remarks=entry.remarks,
        who=entry.who,
        at=entry.at,
    )


def _call_view(session: Session, names: Mapping[int, str]) -> CallView | None:
    row = current_call(session)
    if row is None or row.team_id is None:
        return None
    flying = flying_on(session, row)
    return CallView(
        id=row.id,
        team=row.team_id,
        team_name=names.get(row.team_id, ""),
        scenario=row.scenario,
        attempt=flying.id if flying is not None else None,
        who=row.who,
        at=row.at,
    )


def _last_call_view(session: Session, names: Mapping[int, str]) -> LastCallView | None:
    row = last_call(session)
    if row is None or row.team_id is None:
        return None
    tries = tuple(each.id for each in tries_of(session, row))
    return LastCallView(id=row.id, team=row.team_id, team_name=names.get(row.team_id, ""), tries=tries)


def _queue_view(session: Session, names: Mapping[int, str]) -> QueueView:
    teams = tuple(QueuedView(team=team, team_name=names.get(team, "")) for team in read_queue(session))
    return QueueView(number=queue_number(session), teams=teams)


def _rule_view(rule: Rule, row: tables.SettingsChange | None) -> RuleView:
    return RuleView(
        limit_s=rule.limit_s,
        missing_frame_s=rule.missing_frame_s,
        scenarios=rule.scenarios,
        counting=rule.counting,
        who=row.who if row is not None else "",
        at=row.at if row is not None else None,
    )
