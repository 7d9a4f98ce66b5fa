"""Calls to the start and the queue, as functions on an open session; the caller ends the transaction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from framerunner.monitor.competition import tables
from framerunner.monitor.competition.validation import RefusedError
from scenarios.result import RefereeReport

_MOVED_M = 0.3  # a try whose drone moved less uses no call


@dataclass(frozen=True, slots=True)
class Entry:
    """Who enters something, by the name that the visitor gave, and when (with time zone)."""

    who: str
    at: datetime


def current_call(session: Session) -> tables.Call | None:
    """The valid call, also while a try is flown on it; None if no team is called."""
    row = session.scalars(select(tables.Call).order_by(tables.Call.id.desc()).limit(1)).first()
    return row if row is not None and row.kind == "call" else None


def last_call(session: Session) -> tables.Call | None:
    """The call that can be taken back: the last one, also when it was used; None if it was taken back."""
    newest = select(tables.Call).order_by(tables.Call.id.desc())
    for row in session.scalars(newest.limit(2)):  # a call, and perhaps its end
        if row.kind != "used":
            return row if row.kind == "call" else None
    return None


def flying_on(session: Session, call: tables.Call) -> tables.Try | None:
    """The try that the called team is flying on a call."""
    return next((row for row in tries_of(session, call) if row.state == "running"), None)


def tries_of(session: Session, call: tables.Call) -> list[tables.Try]:
    """The tries flown on a call that are still the called team's, oldest first."""
    flown = select(tables.Try).where(tables.Try.call_id == call.id, tables.Try.team_id == call.team_id)
    return list(session.scalars(flown.order_by(tables.Try.id)))


def call_team(session: Session, team_id: int | None, scenario: str, entry: Entry) -> None:
    """Call a team to the start and remove it from the queue; None for no team.

    A team that was called before and has not flown returns to its place in the queue.
    """
    queue = read_queue(session)
    before = current_call(session)
    if before is not None and not _was_flown(session, before):
        _put_back(session, queue, before)
    place = queue.index(team_id) if team_id in queue else None
    write_queue(session, [each for each in queue if each != team_id], entry)
    if team_id is not None:
        session.add(
            tables.Call(team_id=team_id, scenario=scenario, kind="call", queue_place=place, **asdict(entry))
        )
    elif before is not None:
        _add_end(session, "taken back", entry)


def take_back(session: Session, call_id: int, entry: Entry) -> None:
    """Take a call back: its tries have no team then, and the team returns to its place in the queue.

    Raises:
        RefusedError: it is no longer the last call.
    """
    call = last_call(session)
    if call is None or call.id != call_id:
        raise RefusedError("this call is over or was taken back meanwhile; reload the page", 409)
    for row in tries_of(session, call):
        row.team_id = None
        number = count_judgements(session, row) + 1
        values = {"kind": "team", "team_id": None, "remarks": "the call was taken back"}
        session.add(tables.Judgement(try_id=row.id, number=number, **values, **asdict(entry)))
    queue = read_queue(session)
    _put_back(session, queue, call)
    write_queue(session, queue, entry)
    _add_end(session, "taken back", entry)


def use_call(session: Session, row: tables.Try, report: RefereeReport, at: datetime) -> None:
    """End the call that a try was flown on.

    A drone that did not move, or a try that a judge assigned to another team, uses no call.
    """
    call = current_call(session)
    moved = "path_length_m" not in report.model_fields_set or report.path_length_m >= _MOVED_M
    if call is not None and call.id == row.call_id and call.team_id == row.team_id and moved:
        _add_end(session, "used", Entry("", at))


def queue_number(session: Session) -> int:
    """Number of the present state of the queue; 0 before the first."""
    return session.scalar(select(func.max(tables.Queue.id))) or 0


def read_queue(session: Session) -> list[int]:
    """Ids of the teams in the queue, the first flies first."""
    row = session.scalars(select(tables.Queue).order_by(tables.Queue.id.desc()).limit(1)).first()
    return [int(team) for team in row.teams.split()] if row is not None else []


def write_queue(session: Session, teams: Sequence[int], entry: Entry) -> None:
    """Set the queue; nothing is written if it is the same."""
    if list(teams) != read_queue(session):
        text = " ".join(str(team) for team in teams)
        session.add(tables.Queue(teams=text, **asdict(entry)))
        session.flush()


def withdraw(session: Session, team: tables.Team, entry: Entry) -> None:
    """Remove a team from the queue, and take back a call that it has not flown."""
    write_queue(session, [each for each in read_queue(session) if each != team.id], entry)
    call = current_call(session)
    if call is not None and call.team_id == team.id and not _was_flown(session, call):
        _add_end(session, "taken back", entry)


def count_judgements(session: Session, row: tables.Try) -> int:
    """How often judges changed a try."""
    counted = select(func.count(tables.Judgement.id)).where(tables.Judgement.try_id == row.id)
    return session.scalar(counted) or 0


def _add_end(session: Session, kind: str, entry: Entry) -> None:
    """End the valid call."""
    session.add(tables.Call(team_id=None, scenario="", kind=kind, **asdict(entry)))


def _was_flown(session: Session, call: tables.Call) -> bool:
    """Whether a try on a valid call runs or was interrupted; a drone whose try ended did not move."""
    return any(row.state != "ended" for row in tries_of(session, call))


def _put_back(session: Session, queue: list[int], call: tables.Call) -> None:
    """Insert the team of a call at its place in the queue, unless it is withdrawn or in the queue again."""
    if call.queue_place is None or call.team_id is None or call.team_id in queue:
        return
    team = session.get(tables.Team, call.team_id)
    if team is not None and not team.withdrawn:
        queue.insert(call.queue_place, call.team_id)
