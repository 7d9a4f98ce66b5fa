"""The whole contest, read from the database at once and put together for the pages."""

from __future__ import annotations

import json
import shlex
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from framerunner.monitor.competition import calls, tables
from framerunner.monitor.competition.rules import (
    Attempt,
    Correction,
    Rule,
    TryScore,
    choose,
    correct,
    counted_cs,
    rank,
    read_report,
)
from framerunner.monitor.competition.validation import from_wire
from framerunner.monitor.competition.views import (
    Board,
    CallView,
    Counting,
    DrawView,
    JudgementView,
    LastCallView,
    QueuedView,
    QueueView,
    RankingView,
    ResultView,
    RivalView,
    RuleView,
    TeamView,
    TryDetail,
    TryView,
)
from scenarios.models import MissionClass
from scenarios.result import FlightResult, RefereeReport

MAX_TRIES_SHOWN = 500
OPEN_CLASS = "open class"  # a barrier: the try did not fly by the contest's limits


@dataclass(frozen=True, slots=True)
class _Judged:
    """A try with its results before and after the last correction."""

    row: tables.Try
    report: RefereeReport | None
    referee: TryScore
    result: TryScore
    correction: tables.Judgement | None  # the last one
    judgements: int  # how often judges changed it
    mission_class: MissionClass  # by the app's result; "contest" before

    @property
    def counts(self) -> bool:
        """Whether it has a result."""
        return self.row.state == "ended" or (self.row.state == "interrupted" and self.correction is not None)


def read_board(
    session: Session,
    version: int,
    max_tries: int = MAX_TRIES_SHOWN,
    argument: Callable[[str], str] = str,
) -> Board:
    """Read everything; of the tries the newest. `argument`: what `fly` is given to fly a scenario."""
    rule, rule_view = _read_rule(session)
    teams = {team.id: team for team in session.scalars(select(tables.Team).order_by(tables.Team.id))}
    tries = _read_tries(session)
    draws = list(session.scalars(select(tables.Draw).order_by(tables.Draw.id)))
    present = present_round(draws)
    rounds = sorted({present, *(draw.round for draw in draws), *(judged.row.round for judged in tries)})
    attempts = _attempt_numbers(tries)
    queue = tuple(QueuedView(team=each, team_name=_name(teams, each)) for each in calls.read_queue(session))
    countable = {number: _countable(number, draws, tries, rule) for number in rounds}
    return Board(
        version=version,
        round=present,
        rule=rule_view,
        teams=tuple(TeamView.of(team) for team in teams.values()),
        called=_call_view(session, teams),
        last_call=_last_call_view(session, teams),
        queue=QueueView(number=calls.queue_number(session), teams=queue),
        draws=tuple(_draw_view(draw, argument) for draw in reversed(draws)),
        tries=tuple(
            _try_view(judged, teams, attempts.get(judged.row.id, 0), rule, countable[judged.row.round])
            for judged in reversed(tries[-max_tries:])
        ),
        rankings=tuple(_ranking(number, teams, draws, tries, rule) for number in reversed(rounds)),
    )


def read_detail(session: Session, try_id: int) -> TryDetail | None:
    """Read a try with its history; None if it does not exist."""
    row = session.get(tables.Try, try_id)
    if row is None:
        return None
    teams = {team.id: team for team in session.scalars(select(tables.Team))}
    of_try = select(tables.Judgement).where(tables.Judgement.try_id == try_id)
    entries = list(session.scalars(of_try.order_by(tables.Judgement.number)))
    history = tuple(_judgement_view(entry, teams) for entry in reversed(entries))
    others: list[_Judged] = []
    number = 0
    if row.team_id is not None:
        columns = (tables.Try.round, tables.Try.team_id, tables.Try.scenario)
        values = (row.round, row.team_id, row.scenario)
        same = [column == value for column, value in zip(columns, values, strict=True)]
        others = _read_tries(session, *same, tables.Try.id != row.id)
        number = 1 + sum(1 for other in others if other.row.id < row.id)
    rule, rule_view = _read_rule(session)
    of_round = select(tables.Draw).where(tables.Draw.round == row.round).order_by(tables.Draw.id)
    draws = list(session.scalars(of_round))
    tries = [] if draws else _read_tries(session)
    countable = _countable(row.round, draws, tries, rule)
    return TryDetail(
        attempt=_try_view(_judge(row, entries), teams, number, rule, countable),
        rival=_rival_view(others, rule),
        correction=next((view for view in history if view.kind == "correction"), None),
        rule=rule_view,
        history=history,
    )


def present_round(draws: Iterable[tables.Draw]) -> int:
    """The round of the last draw; 0 before the first."""
    return max((draw.round for draw in draws), default=0)


def stored_report(text: str) -> RefereeReport | None:
    """Read a referee's report as the database has it; None if the try was not judged."""
    return RefereeReport.from_outside(_content(text))


def _content(text: str) -> object:
    """A stored report as plain data; None if it is no JSON."""
    try:
        content: object = json.loads(text)
    except ValueError:
        return None
    return content


def _read_rule(session: Session) -> tuple[Rule, RuleView]:
    """The rule as it was set last, else its defaults."""
    newest = select(tables.SettingsChange).order_by(tables.SettingsChange.id.desc()).limit(1)
    row = session.scalars(newest).first()
    if row is None:
        return Rule(), RuleView(**asdict(Rule()), who="", at=None)
    counting: Counting = "last" if row.counting == "last" else "best"
    rule = Rule(row.limit_s, row.missing_frame_s, row.scenarios, counting)
    return rule, RuleView(**asdict(rule), who=row.who, at=row.at)


def _read_tries(session: Session, *conditions: ColumnElement[bool]) -> list[_Judged]:
    """Read tries with their judgements, oldest first."""
    rows = list(session.scalars(select(tables.Try).where(*conditions).order_by(tables.Try.id)))
    of_these = select(tables.Judgement).join(tables.Try).where(*conditions)
    entries: defaultdict[int, list[tables.Judgement]] = defaultdict(list)
    for entry in session.scalars(of_these.order_by(tables.Judgement.number)):
        entries[entry.try_id].append(entry)
    return [_judge(row, entries[row.id]) for row in rows]


def _judge(row: tables.Try, entries: Sequence[tables.Judgement]) -> _Judged:
    """Apply the last correction to the referee's result. `entries`: oldest first."""
    report = stored_report(row.report)
    referee = read_report(report, row.frames.split())
    last = next((entry for entry in reversed(entries) if entry.kind == "correction"), None)
    correction = None
    if last is not None:
        crossed = None if last.crossed is None else tuple(last.crossed.split())
        correction = Correction(crossed, last.contacts, last.penalty_s, last.try_time_s, last.completed)
    told = FlightResult.from_outside(_content(row.report))
    mission_class = "contest" if told is None else told.mission_class
    return _Judged(row, report, referee, correct(referee, correction), last, len(entries), mission_class)


def _attempt_numbers(tries: Sequence[_Judged]) -> dict[int, int]:
    """For each try of a team, by id: which try of the team at this scenario in this round it is, from 1."""
    counter: Counter[tuple[int, int, str]] = Counter()
    numbers = {}
    for judged in tries:
        row = judged.row
        if row.team_id is not None:
            counter[row.round, row.team_id, row.scenario] += 1
            numbers[row.id] = counter[row.round, row.team_id, row.scenario]
    return numbers


def _attempts(tries: Iterable[_Judged]) -> list[Attempt]:
    """Those of the tries that have a team and a result, and flew by the contest's limits."""
    return [
        Attempt(judged.row.team_id, judged.row.scenario, judged.row.id, judged.result)
        for judged in tries
        if judged.row.team_id is not None and judged.counts and judged.mission_class == "contest"
    ]


def _round_attempts(number: int, tries: Iterable[_Judged]) -> list[Attempt]:
    """Those of the tries that can count in the ranking of a round."""
    return _attempts(judged for judged in tries if judged.row.round == number and judged.row.scenario)


def _scenarios(
    number: int, draws: Sequence[tables.Draw], attempts: Sequence[Attempt]
) -> list[tuple[str, tuple[str, ...]]]:
    """Names and gates of a round's scenarios: those drawn, or, where nothing was drawn, those flown."""
    draw = next((draw for draw in reversed(draws) if draw.round == number), None)
    if draw is not None:
        return _drawn(draw)
    frames = {attempt.scenario: attempt.result.frames for attempt in reversed(attempts)}
    return [(name, frames[name]) for name in dict.fromkeys(attempt.scenario for attempt in attempts)]


def _drawn(draw: tables.Draw) -> list[tuple[str, tuple[str, ...]]]:
    lines = [line.split() for line in draw.scenarios.splitlines()]
    return [(name, tuple(frames)) for name, *frames in lines]


def _countable(
    number: int, draws: Sequence[tables.Draw], tries: Sequence[_Judged], rule: Rule
) -> frozenset[str] | None:
    """The scenarios of a round; None while the next one flown would still be added to them."""
    names = [name for name, _ in _scenarios(number, draws, _round_attempts(number, tries))][: rule.scenarios]
    is_complete = len(names) == rule.scenarios or any(draw.round == number for draw in draws)
    return frozenset(names) if is_complete else None


def _barrier(judged: _Judged, teams: Mapping[int, tables.Team], countable: frozenset[str] | None) -> str:
    """See `TryView.barrier`; "" if a ranking has the try or may still have it."""
    row = judged.row
    if judged.mission_class == "open":
        return OPEN_CLASS
    team = None if row.team_id is None else teams.get(row.team_id)
    if team is None:
        return "no team"
    if team.withdrawn:
        return "withdrawn"
    if not row.scenario:
        return "no scenario"
    return "" if countable is None or row.scenario in countable else "not drawn"


def _ranking(
    number: int,
    teams: Mapping[int, tables.Team],
    draws: Sequence[tables.Draw],
    tries: Sequence[_Judged],
    rule: Rule,
) -> RankingView:
    attempts = _round_attempts(number, tries)
    scenarios = _scenarios(number, draws, attempts)
    names = [name for name, _ in scenarios][: rule.scenarios]
    return RankingView(
        round=number,
        scenarios=(*names, *[""] * (rule.scenarios - len(names))),
        rows=rank(
            {team.id: team.name for team in teams.values() if not team.withdrawn}, scenarios, attempts, rule
        ),
    )


def _name(teams: Mapping[int, tables.Team], team_id: int | None) -> str:
    team = None if team_id is None else teams.get(team_id)  # another process may have added it meanwhile
    return "" if team is None else team.name


def _try_view(
    judged: _Judged,
    teams: Mapping[int, tables.Team],
    attempt: int,
    rule: Rule,
    countable: frozenset[str] | None,
) -> TryView:
    row, report = judged.row, judged.report
    return TryView.of(
        row,
        attempt=attempt,
        team=row.team_id,
        team_name=_name(teams, row.team_id),
        frames=tuple(row.frames.split()),
        judged=judged.counts,
        barrier=_barrier(judged, teams, countable),
        verdict="" if report is None else report.verdict,
        reason="" if report is None else from_wire(report.reason, 500),
        referee=_result_view(judged.referee, rule),
        result=_result_view(judged.result, rule),
        corrected_by=judged.correction.who if judged.correction is not None else "",
        judgements=judged.judgements,
    )


def _result_view(result: TryScore, rule: Rule) -> ResultView:
    total_s = result.try_time_s + result.penalty_s
    return ResultView.of(result, total_s=total_s, counted_s=counted_cs(result, rule) / 100)


def _rival_view(others: Sequence[_Judged], rule: Rule) -> RivalView | None:
    rival = choose(_attempts(others), rule)
    if rival is None:
        return None
    counted_s = counted_cs(rival.result, rule) / 100
    return RivalView(attempt=rival.id, counted_s=counted_s, contacts=rival.result.contacts)


def _judgement_view(entry: tables.Judgement, teams: Mapping[int, tables.Team]) -> JudgementView:
    crossed = None if entry.crossed is None else tuple(entry.crossed.split())
    return JudgementView.of(entry, team_name=_name(teams, entry.team_id), crossed=crossed)


def _draw_view(draw: tables.Draw, argument: Callable[[str], str]) -> DrawView:
    names = tuple(name for name, _ in _drawn(draw))
    commands = tuple(f"framerunner fly {shlex.quote(argument(name))}" for name in names)
    return DrawView.of(draw, scenarios=names, commands=commands, pool=tuple(draw.pool.splitlines()))


def _call_view(session: Session, teams: Mapping[int, tables.Team]) -> CallView | None:
    row = calls.current_call(session)
    if row is None or row.team_id is None:
        return None
    flying = calls.flying_on(session, row)
    attempt = flying.id if flying is not None else None
    return CallView.of(row, team=row.team_id, team_name=_name(teams, row.team_id), attempt=attempt)


def _last_call_view(session: Session, teams: Mapping[int, tables.Team]) -> LastCallView | None:
    row = calls.last_call(session)
    if row is None or row.team_id is None:
        return None
    tries = tuple(each.id for each in calls.tries_of(session, row))
    return LastCallView(id=row.id, team=row.team_id, team_name=_name(teams, row.team_id), tries=tries)
