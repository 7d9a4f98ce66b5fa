"""Reads and writes the contest, with who entered what. All of it blocks: call it from a thread."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from datetime import datetime
from typing import Any

from sqlalchemy import func, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from framerunner.monitor.competition import calls, tables
from framerunner.monitor.competition.board import present_round, read_board, read_detail, stored_report
from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import Database
from framerunner.monitor.competition.rules import Correction, Rule, correct, read_report
from framerunner.monitor.competition.validation import (
    RefusedError,
    free_text,
    from_wire,
    name_key,
    shown,
    team_name,
)
from framerunner.monitor.competition.views import Board, TryDetail
from framerunner.monitor.vehicle.tries import TryEvent
from scenarios.result import RefereeReport

MAX_TEAMS = 500
MAX_JUDGEMENTS = 200  # of one try
MAX_REMARKS = 1000  # characters
MAX_MEMBERS = 300  # characters
_MAX_REPORT = 100_000  # characters of JSON


class Store:
    """Reads and writes the contest.

    Methods that take an `Entry` record who did it and when. Those that take `seen` refuse a request if the
    number that the judge saw has changed meanwhile.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._version = 0

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def board(self, argument: Callable[[str], str] = str) -> Board:
        """The whole contest, with a higher version at each call; `argument`: of `fly` for a scenario."""
        self._version += 1
        with self._database.transaction() as session:
            return read_board(session, self._version, argument=argument)

    def everything(self) -> Board:
        """The whole contest with all tries, however many."""
        with self._database.transaction() as session:
            return read_board(session, self._version, sys.maxsize)

    def detail(self, try_id: int) -> TryDetail:
        """A try with its history. Raises `RefusedError` if it does not exist."""
        with self._database.transaction() as session:
            detail = read_detail(session, try_id)
        if detail is None:
            raise _no_try(try_id)
        return detail

    def reports(self, try_ids: Iterable[int]) -> dict[int, RefereeReport | None]:
        """The referee's reports on some tries, by their ids."""
        wanted = select(tables.Try.id, tables.Try.report).where(tables.Try.id.in_(list(try_ids)))
        with self._database.transaction() as session:
            return {number: stored_report(report) for number, report in session.execute(wanted)}

    def interrupt(self) -> int:
        """Mark tries that seem to run as interrupted: the monitor was stopped meanwhile. Returns how many."""
        with self._database.transaction() as session:
            running = update(tables.Try).where(tables.Try.state == "running").values(state="interrupted")
            return int(session.execute(running).rowcount)  # type: ignore[attr-defined]

    def take(self, event: TryEvent, frames: Sequence[str], at: datetime) -> int:
        """Record an event of the fleet; `frames` are those of its scenario. Returns the try's id."""
        with self._database.transaction() as session:
            row = session.scalars(select(tables.Try).where(tables.Try.key == event.key)).first()
            if row is None:
                row = _add_try(session, event, frames, at)
            if (row.final and not event.final) or (row.state == "ended" and event.kind != "ended"):
                return row.id  # the event is late
            row.report, row.source, row.final = _json(event.report), from_wire(event.source, 40), event.final
            if not row.scenario and event.scenario:
                row.scenario, row.frames = from_wire(event.scenario, 80), " ".join(frames)
            if event.kind != "ended":
                row.state = "running"
            elif row.state != "ended":
                row.state, row.ended = "ended", at
                calls.use_call(session, row, event.report, at)
            return row.id

    def add_team(self, name: str, members: str, entry: Entry) -> int:
        """Add a team. Returns its id.

        Raises:
            RefusedError: the name is bad or taken, or there are too many.
        """
        name, members = team_name(name), free_text(members, "members", MAX_MEMBERS)
        with _unique_name(name), self._database.transaction() as session:
            if (session.scalar(select(func.count(tables.Team.id))) or 0) >= MAX_TEAMS:
                raise RefusedError(f"name {shown(name)} cannot be added; {MAX_TEAMS} teams is the limit")
            team = tables.Team(name=name, name_key=name_key(name), members=members, withdrawn=False)
            session.add(team)
            session.flush()
            session.add(_team_change(team, entry))
            return team.id

    def change_team(
        self, team_id: int, name: str | None, members: str | None, withdrawn: bool | None, entry: Entry
    ) -> None:
        """Change a team; None leaves a field as it is.

        Raises:
            RefusedError: the team does not exist, or the name is bad or taken.
        """
        with _unique_name(name or ""), self._database.transaction() as session:
            team = _team(session, team_id)
            if name is not None:
                team.name = team_name(name)
                team.name_key = name_key(team.name)
            if members is not None:
                team.members = free_text(members, "members", MAX_MEMBERS)
            if withdrawn is not None:
                team.withdrawn = withdrawn
                if withdrawn:
                    calls.withdraw(session, team, entry)
            session.add(_team_change(team, entry))

    def call(self, team_id: int | None, scenario: str, entry: Entry) -> None:
        """Call a team to the start; None for none. `scenario` "" is whatever the drone flies.

        Raises:
            RefusedError: the team does not exist, or it is withdrawn.
        """
        with self._database.transaction() as session:
            if team_id is not None:
                _active_team(session, team_id)
            calls.call_team(session, team_id, scenario, entry)

    def take_back(self, call_id: int, entry: Entry) -> None:
        """Take the last call back; its tries lose their team. Raises `RefusedError` if it is not the last."""
        with _one_judge(), self._database.transaction() as session:
            calls.take_back(session, call_id, entry)

    def set_queue(self, seen: int, teams: Sequence[int], entry: Entry) -> None:
        """Set the order in which teams are to fly: their ids, the first flies first.

        Raises:
            RefusedError: the queue is no longer number `seen`; a team is named twice, does not exist or is
                withdrawn.
        """
        with self._database.transaction() as session:
            if calls.queue_number(session) != seen:
                raise RefusedError("the queue was changed meanwhile; look at it again", 409)
            for team_id in teams:
                _active_team(session, team_id)
                if teams.count(team_id) > 1:
                    raise RefusedError(f"team {team_id} is in the queue twice; name each team once")
            calls.write_queue(session, teams, entry)

    def draw(self, scenarios: Mapping[str, Sequence[str]], pool: Sequence[str], entry: Entry) -> int:
        """Record a draw: names and gates of the scenarios drawn, and the names that could be drawn.

        It replaces that of a round without tries, else the next round begins. Returns the round.
        """
        with self._database.transaction() as session:
            present = present_round(session.scalars(select(tables.Draw)))
            flown = select(tables.Try.id).where(tables.Try.round == present).limit(1)
            if present == 0 or session.scalars(flown).first() is not None:
                present += 1
            lines = "\n".join(" ".join((name, *frames)) for name, frames in scenarios.items())
            session.add(tables.Draw(round=present, scenarios=lines, pool="\n".join(pool), **asdict(entry)))
            return present

    def set_rule(self, rule: Rule, entry: Entry) -> None:
        """Set the rule."""
        with self._database.transaction() as session:
            session.add(tables.SettingsChange(**asdict(rule), **asdict(entry)))

    def correct(self, try_id: int, seen: int, correction: Correction, remarks: str, entry: Entry) -> None:
        """Record a judge's correction, which replaces an earlier one.

        Raises:
            RefusedError: the try does not exist, its judgements are no longer `seen`, or values contradict.
        """
        remarks = free_text(remarks, "remarks", MAX_REMARKS)
        crossed = None if correction.crossed is None else " ".join(correction.crossed)
        values: dict[str, Any] = {**asdict(correction), "crossed": crossed, "remarks": remarks}
        with _one_judge(), self._database.transaction() as session:
            row = _try(session, try_id)
            _check(row, correction)
            _add_judgement(session, row, seen, entry, kind="correction", **values)

    def assign(self, try_id: int, seen: int, team_id: int | None, entry: Entry) -> None:
        """Record which team flew a try; None for none. Raises as `correct` does."""
        with _one_judge(), self._database.transaction() as session:
            row = _try(session, try_id)
            if team_id is not None:
                _team(session, team_id)
            _add_judgement(session, row, seen, entry, kind="team", team_id=team_id)
            row.team_id = team_id


@contextmanager
def _one_judge() -> Iterator[None]:
    """Refuse what violates a constraint because two judges wrote at once."""
    try:
        yield
    except IntegrityError as error:
        raise _changed_meanwhile() from error


@contextmanager
def _unique_name(name: str) -> Iterator[None]:
    """Refuse what violates a constraint because another team has this name."""
    try:
        yield
    except IntegrityError as error:
        raise RefusedError(f"name {shown(name)} is taken, in upper or lower case; choose another") from error


def _changed_meanwhile() -> RefusedError:
    return RefusedError("another judge changed this try meanwhile; look at it again, then save", 409)


def _add_try(session: Session, event: TryEvent, frames: Sequence[str], at: datetime) -> tables.Try:
    scenario = from_wire(event.scenario, 80)
    call = calls.current_call(session)
    if call is not None and (
        call.scenario not in {"", scenario} or calls.flying_on(session, call) is not None
    ):
        call = None  # it is for another scenario, or another drone flies on it already
    row = tables.Try(
        key=event.key,
        drone_id=event.drone_id,
        round=present_round(session.scalars(select(tables.Draw))),
        team_id=call.team_id if call is not None else None,
        call_id=call.id if call is not None else None,
        scenario=scenario,
        frames=" ".join(frames),
        state="running",
        report="{}",
        source="",
        final=False,
        started=at,
        ended=None,
    )
    session.add(row)
    session.flush()
    return row


def _add_judgement(session: Session, row: tables.Try, seen: int, entry: Entry, **values: object) -> None:
    count = calls.count_judgements(session, row)
    if count != seen:
        raise _changed_meanwhile()
    if count >= MAX_JUDGEMENTS:
        raise RefusedError(f"try {row.id} was changed {count} times; {MAX_JUDGEMENTS} is the limit")
    session.add(tables.Judgement(try_id=row.id, number=count + 1, **values, **asdict(entry)))


def _check(row: tables.Try, correction: Correction) -> None:
    frames = row.frames.split()
    for colour in correction.crossed or ():
        if colour not in frames:
            known = ", ".join(frames) or "none"
            raise RefusedError(f"crossed {shown(colour)} is not a frame of this try; use {known}")
    if correction.completed:
        referee = read_report(stored_report(row.report), frames)
        missing = ", ".join(correct(referee, correction).missing)
        if missing:
            raise RefusedError(
                f"completed true contradicts the crossings: {missing} not crossed; "
                "tick them or take completed away"
            )


def _team(session: Session, team_id: int) -> tables.Team:
    team = session.get(tables.Team, team_id)
    if team is None:
        raise RefusedError(f"team {team_id} does not exist; choose one of the list", 404)
    return team


def _active_team(session: Session, team_id: int) -> None:
    if _team(session, team_id).withdrawn:
        raise RefusedError(f"team {team_id} is withdrawn; take it back in first")


def _try(session: Session, try_id: int) -> tables.Try:
    row = session.get(tables.Try, try_id)
    if row is None:
        raise _no_try(try_id)
    return row


def _no_try(try_id: int) -> RefusedError:
    return RefusedError(f"try {try_id} does not exist; choose one of the list", 404)


def _team_change(team: tables.Team, entry: Entry) -> tables.TeamChange:
    values = {"name": team.name, "members": team.members, "withdrawn": team.withdrawn}
    return tables.TeamChange(team_id=team.id, **values, **asdict(entry))


def _json(report: RefereeReport) -> str:
    """A report as JSON; one that is too long is left out."""
    text = json.dumps(report.as_json())
    return text if len(text) <= _MAX_REPORT else "{}"
