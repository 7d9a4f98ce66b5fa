"""What is written down about a contest, and by whom. All of it blocks: call it from a thread of its own."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from typing import Any

from sqlalchemy import func, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from monitor.competition import tables
from monitor.competition.board import (
    last_settings,
    present_round,
    read_board,
    read_detail,
    rule_of,
    stored_report,
)
from monitor.competition.calls import (
    Entry,
    call_team,
    current_call,
    flying_on,
    leave,
    queue_number,
    take_back,
    use_call,
    write_queue,
)
from monitor.competition.database import Database
from monitor.competition.rules import Correction, Rule, correct, read_report
from monitor.competition.views import Board, TryDetail
from monitor.competition.words import Refused, free_text, from_wire, name_key, shown, team_name
from monitor.vehicle.tries import TryEvent
from scenarios.result import RefereeReport

MOST_TEAMS = 500
MOST_JUDGEMENTS = 200  # of one try
MOST_REMARKS = 1000  # characters
MOST_MEMBERS = 300  # characters
_LONGEST_REPORT = 100_000  # characters of JSON


class Store:
    """Reads and writes the contest.

    Args:
        database: where it is kept.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._version = 0

    def close(self) -> None:
        """Let go of the database."""
        self._database.close()

    def board(self) -> Board:
        """The whole contest, with a higher version at each call."""
        self._version += 1
        with self._database.transaction() as session:
            return read_board(session, self._version)

    def everything(self) -> Board:
        """The whole contest with all tries, however many."""
        with self._database.transaction() as session:
            return read_board(session, self._version, sys.maxsize)

    def detail(self, try_id: int) -> TryDetail:
        """A try with its history. Raises `Refused` if there is no such."""
        with self._database.transaction() as session:
            detail = read_detail(session, try_id)
        if detail is None:
            raise _no_try(try_id)
        return detail

    def reports(self, try_ids: Iterable[int]) -> dict[int, RefereeReport | None]:
        """What the referee said of some tries, by their ids."""
        wanted = select(tables.Try.id, tables.Try.report).where(tables.Try.id.in_(list(try_ids)))
        with self._database.transaction() as session:
            return {number: stored_report(report) for number, report in session.execute(wanted)}

    def interrupt(self) -> int:
        """Say of tries that seem to run that the monitor was stopped meanwhile. Returns how many."""
        with self._database.transaction() as session:
            running = update(tables.Try).where(tables.Try.state == "running").values(state="interrupted")
            return int(session.execute(running).rowcount)  # type: ignore[attr-defined]

    def take(self, event: TryEvent, frames: Sequence[str], at: datetime) -> int:
        """Write down what the fleet tells of a try.

        Args:
            event: what it tells.
            frames: colours to cross in its scenario, in order.
            at: now.

        Returns:
            The try's id.
        """
        with self._database.transaction() as session:
            row = session.scalars(select(tables.Try).where(tables.Try.key == event.key)).first()
            if row is None:
                row = self._begin(session, event, frames, at)
            if (row.final and not event.final) or (row.state == "ended" and event.kind != "ended"):
                return row.id  # something older, come late
            row.report, row.source, row.final = _json(event.report), from_wire(event.source, 40), event.final
            if not row.scenario and event.scenario:
                row.scenario, row.frames = from_wire(event.scenario, 80), " ".join(frames)
            if event.kind != "ended":
                row.state = "running"
            elif row.state != "ended":
                row.state, row.ended = "ended", at
                use_call(session, row, event.report, at)
            return row.id

    def _begin(self, session: Session, event: TryEvent, frames: Sequence[str], at: datetime) -> tables.Try:
        scenario = from_wire(event.scenario, 80)
        call = current_call(session)
        if call is not None and (call.scenario not in {"", scenario} or flying_on(session, call) is not None):
            call = None  # it is for another scenario, or another drone flies on it already
        draws = list(session.scalars(select(tables.Draw)))
        row = tables.Try(
            key=event.key,
            drone_id=event.drone_id,
            round=present_round(draws),
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

    def add_team(self, name: str, members: str, entry: Entry) -> int:
        """Enter a team.

        Returns:
            Its id.

        Raises:
            Refused: the name is bad or taken, or there are too many.
        """
        name, members = team_name(name), free_text(members, "members", MOST_MEMBERS)
        try:
            with self._database.transaction() as session:
                if (session.scalar(select(func.count(tables.Team.id))) or 0) >= MOST_TEAMS:
                    raise Refused(
                        f"name {shown(name)} would be team {MOST_TEAMS + 1}; {MOST_TEAMS} is the most"
                    )
                team = tables.Team(name=name, name_key=name_key(name), members=members, withdrawn=False)
                session.add(team)
                session.flush()
                session.add(_team_change(team, entry))
                return team.id
        except IntegrityError as error:
            raise _name_taken(name) from error

    def change_team(
        self, team_id: int, name: str | None, members: str | None, withdrawn: bool | None, entry: Entry
    ) -> None:
        """Change what is known of a team; None leaves it.

        Raises:
            Refused: there is no such, or the name is bad or taken.
        """
        try:
            with self._database.transaction() as session:
                team = _team(session, team_id)
                if name is not None:
                    team.name = team_name(name)
                    team.name_key = name_key(team.name)
                if members is not None:
                    team.members = free_text(members, "members", MOST_MEMBERS)
                if withdrawn is not None:
                    team.withdrawn = withdrawn
                    if withdrawn:
                        leave(session, team, entry)
                session.add(_team_change(team, entry))
        except IntegrityError as error:
            raise _name_taken(name or "") from error

    def call(self, team_id: int | None, scenario: str, entry: Entry) -> None:
        """Call a team to the start; None for nobody. `scenario` "" is whatever the drone flies.

        Raises:
            Refused: there is no such team, or it is withdrawn.
        """
        with self._database.transaction() as session:
            if team_id is not None:
                _active_team(session, team_id)
            call_team(session, team_id, scenario, entry)

    def take_back(self, call_id: int, entry: Entry) -> None:
        """Take the last call back; its tries become nobody's. Raises `Refused` if it is another by now."""
        with _Quicker(), self._database.transaction() as session:
            take_back(session, call_id, entry)

    def set_queue(self, seen: int, teams: Sequence[int], entry: Entry) -> None:
        """Keep the order in which teams are to fly.

        Args:
            seen: number of the queue that the judge saw.
            teams: ids, the first flies first.
            entry: who and when.

        Raises:
            Refused: another judge was quicker, a team is named twice, not there or withdrawn.
        """
        with self._database.transaction() as session:
            if queue_number(session) != seen:
                raise Refused("the queue was changed meanwhile; look at it again", 409)
            for team_id in teams:
                _active_team(session, team_id)
                if teams.count(team_id) > 1:
                    raise Refused(f"team {team_id} stands in the queue twice; name each team once")
            write_queue(session, teams, entry)

    def draw(self, scenarios: Mapping[str, Sequence[str]], pool: Sequence[str], entry: Entry) -> int:
        """Keep a draw. A round that nobody has flown in yet is drawn again, else the next one begins.

        Args:
            scenarios: names drawn, in order, and the frames of each.
            pool: what was in the pot.
            entry: who and when.

        Returns:
            The round.
        """
        with self._database.transaction() as session:
            present = present_round(list(session.scalars(select(tables.Draw))))
            flown = select(tables.Try.id).where(tables.Try.round == present).limit(1)
            if present == 0 or session.scalars(flown).first() is not None:
                present += 1
            lines = [" ".join((name, *frames)) for name, frames in scenarios.items()]
            session.add(
                tables.Draw(
                    round=present,
                    scenarios="\n".join(lines),
                    pool="\n".join(pool),
                    who=entry.who,
                    at=entry.at,
                )
            )
            return present

    def set_rule(self, rule: Rule, entry: Entry) -> None:
        """Keep another rule."""
        with self._database.transaction() as session:
            session.add(tables.SettingsChange(**asdict(rule), who=entry.who, at=entry.at))

    def rule(self) -> Rule:
        """The present rule."""
        with self._database.transaction() as session:
            return rule_of(last_settings(session))

    def correct(self, try_id: int, seen: int, correction: Correction, remarks: str, entry: Entry) -> None:
        """Keep a judge's correction.

        Args:
            try_id: of the try.
            seen: the number of judgements that the judge saw.
            correction: takes the place of an earlier one.
            remarks: free text.
            entry: who and when.

        Raises:
            Refused: no such try, another judge was quicker, or values that contradict each other.
        """
        remarks = free_text(remarks, "remarks", MOST_REMARKS)
        crossed = None if correction.crossed is None else " ".join(correction.crossed)
        entries: dict[str, Any] = {**asdict(correction), "crossed": crossed, "remarks": remarks}
        with _Quicker(), self._database.transaction() as session:
            row = _try(session, try_id)
            _check(row, correction)
            self._judge(session, row, seen, entry, kind="correction", **entries)

    def assign(self, try_id: int, seen: int, team_id: int | None, entry: Entry) -> None:
        """Say whose try it was; None for nobody's. Raises as `correct` does."""
        with _Quicker(), self._database.transaction() as session:
            row = _try(session, try_id)
            if team_id is not None:
                _team(session, team_id)
            self._judge(session, row, seen, entry, kind="team", team_id=team_id)
            row.team_id = team_id

    @staticmethod
    def _judge(session: Session, row: tables.Try, seen: int, entry: Entry, **values: object) -> None:
        counted = select(func.count(tables.Judgement.id)).where(tables.Judgement.try_id == row.id)
        count = session.scalar(counted) or 0
        if count != seen:
            raise _quicker()
        if count >= MOST_JUDGEMENTS:
            raise Refused(f"try {row.id} was changed {count} times; {MOST_JUDGEMENTS} is the most")
        session.add(tables.Judgement(try_id=row.id, number=count + 1, who=entry.who, at=entry.at, **values))


class _Quicker:
    """Turns the clash of two judges into words."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, IntegrityError):
            raise _quicker() from error


def _quicker() -> Refused:
    return Refused("another judge changed this try meanwhile; look at it again, then save", 409)


def _check(row: tables.Try, correction: Correction) -> None:
    frames = row.frames.split()
    for colour in correction.crossed or ():
        if colour not in frames:
            known = ", ".join(frames) or "none"
            raise Refused(f"crossed {shown(colour)} is not a frame of this try; use {known}")
    if correction.completed:
        referee = read_report(stored_report(row.report), frames)
        missing = ", ".join(correct(referee, correction).missing)
        if missing:
            raise Refused(
                f"completed true contradicts the crossings: {missing} not crossed; "
                "tick them or take completed away"
            )


def _team(session: Session, team_id: int) -> tables.Team:
    team = session.get(tables.Team, team_id)
    if team is None:
        raise Refused(f"team {team_id} does not exist; choose one of the list", 404)
    return team


def _active_team(session: Session, team_id: int) -> tables.Team:
    team = _team(session, team_id)
    if team.withdrawn:
        raise Refused(f"team {team_id} is withdrawn; take it back in first")
    return team


def _try(session: Session, try_id: int) -> tables.Try:
    row = session.get(tables.Try, try_id)
    if row is None:
        raise _no_try(try_id)
    return row


def _no_try(try_id: int) -> Refused:
    return Refused(f"try {try_id} does not exist; choose one of the list", 404)


def _name_taken(name: str) -> Refused:
    return Refused(f"name {shown(name)} is taken, if only in other letters; choose another")


def _team_change(team: tables.Team, entry: Entry) -> tables.TeamChange:
    return tables.TeamChange(
        team_id=team.id,
        name=team.name,
        members=team.members,
        withdrawn=team.withdrawn,
        who=entry.who,
        at=entry.at,
    )


def _json(report: RefereeReport) -> str:
    """A report as JSON; one too long is left out."""
    text = json.dumps(report.as_json())
    return text if len(text) <= _LONGEST_REPORT else "{}"
