"""The tables of the contest. Nothing in them is deleted, and what a judge says is only ever added."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import DateTime, Dialect, ForeignKey, String, Text, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator

PREFIX = "competition_"  # so that a database may hold other things too
SCHEMA_VERSION = 2


class UtcTime(TypeDecorator[datetime]):
    """A moment with its time zone, also in SQLite, which keeps none."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """As read: always UTC."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Table(DeclarativeBase):
    """Base of all tables."""

    type_annotation_map = {datetime: UtcTime()}  # noqa: RUF012 - SQLAlchemy's way


class Schema(Table):
    """Which version of these tables the database holds; one row."""

    __tablename__ = PREFIX + "schema"

    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)


class Team(Table):
    """A team.

    Attributes:
        name_key: the name as it is compared, so that no two differ by case or spaces only.
        members: free text; may be "".
        withdrawn: out of the contest; its tries are kept.
    """

    __tablename__ = PREFIX + "teams"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(60))
    name_key: Mapped[str] = mapped_column(String(300), unique=True)
    members: Mapped[str] = mapped_column(Text, default="")
    withdrawn: Mapped[bool] = mapped_column(default=False)


class TeamChange(Table):
    """A team as somebody wrote it: the first is its entry."""

    __tablename__ = PREFIX + "team_changes"

    id: Mapped[int] = mapped_column(primary_key=True)
    team_id: Mapped[int] = mapped_column(ForeignKey(Team.id), index=True)
    name: Mapped[str] = mapped_column(String(60))
    members: Mapped[str] = mapped_column(Text)
    withdrawn: Mapped[bool]
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]


class Draw(Table):
    """Scenarios drawn for a round; the last of a round is the one that holds.

    Attributes:
        scenarios: names, in the order drawn, one a line.
        pool: names that were in the pot, one a line.
    """

    __tablename__ = PREFIX + "draws"

    id: Mapped[int] = mapped_column(primary_key=True)
    round: Mapped[int] = mapped_column(index=True)
    scenarios: Mapped[str] = mapped_column(Text)
    pool: Mapped[str] = mapped_column(Text)
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]


class Call(Table):
    """A team called to the start, or the end of a call; the last row is the one that holds.

    Attributes:
        team_id: None when nobody is called any more.
        scenario: "" for whatever the drone flies.
        kind: "call"; "used" when a try was flown on it; "taken back" by a judge.
        queue_place: where in the queue the team stood when it was called, from 0; None if it stood in none.
        who: "" where nobody did it: the call was used.
    """

    __tablename__ = PREFIX + "next"

    id: Mapped[int] = mapped_column(primary_key=True)
    team_id: Mapped[int | None] = mapped_column(ForeignKey(Team.id))
    scenario: Mapped[str] = mapped_column(String(80))
    kind: Mapped[str] = mapped_column(String(20), server_default="call")
    queue_place: Mapped[int | None]
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]


class Queue(Table):
    """The order in which teams are to fly, as somebody set it; the last row is the one that holds.

    Attributes:
        teams: ids, the first flies first, separated by spaces.
    """

    __tablename__ = PREFIX + "queues"

    id: Mapped[int] = mapped_column(primary_key=True)
    teams: Mapped[str] = mapped_column(Text)
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]


class Try(Table):
    """A try.

    Attributes:
        key: the fleet's; names this try and no other.
        round: in which it was flown; 0 before the first draw.
        team_id: None until a judge says whose it was.
        call_id: the call on which it began; None if nobody was called.
        frames: colours to cross, in order, separated by spaces.
        state: "running", "ended", or "interrupted" when the monitor was stopped meanwhile.
        report: JSON as the referee gave it.
        source: what the referee saw by.
        final: the report is the app's result.
        started: when the monitor saw it begin.
        ended: when it saw its end.
    """

    __tablename__ = PREFIX + "tries"

    id: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(String(200), unique=True)
    drone_id: Mapped[int]
    round: Mapped[int] = mapped_column(index=True)
    team_id: Mapped[int | None] = mapped_column(ForeignKey(Team.id), index=True)
    call_id: Mapped[int | None] = mapped_column(ForeignKey(Call.id))
    scenario: Mapped[str] = mapped_column(String(80))
    frames: Mapped[str] = mapped_column(String(80))
    state: Mapped[str] = mapped_column(String(20), index=True)
    report: Mapped[str] = mapped_column(Text)
    source: Mapped[str] = mapped_column(String(40))
    final: Mapped[bool] = mapped_column(default=False)
    started: Mapped[datetime]
    ended: Mapped[datetime | None]


class Judgement(Table):
    """What a judge said of a try: a correction, or whose it was.

    Attributes:
        number: counts those of a try from 1; two judges cannot write the same.
        kind: "correction" or "team".
        team_id: whose it is, where `kind` is "team"; None for nobody's.
        crossed: colours crossed in their turn, separated by spaces; None, here and below, is "as the
            referee says".
        contacts: with frames.
        penalty_s: seconds.
        try_time_s: seconds.
        completed: all frames crossed and landed in time.
    """

    __tablename__ = PREFIX + "judgements"
    __table_args__ = (UniqueConstraint("try_id", "number"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    try_id: Mapped[int] = mapped_column(ForeignKey(Try.id), index=True)
    number: Mapped[int]
    kind: Mapped[str] = mapped_column(String(20))
    team_id: Mapped[int | None] = mapped_column(ForeignKey(Team.id))
    crossed: Mapped[str | None] = mapped_column(String(80))
    contacts: Mapped[int | None]
    penalty_s: Mapped[float | None]
    try_time_s: Mapped[float | None]
    completed: Mapped[bool | None]
    remarks: Mapped[str] = mapped_column(Text, default="")
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]


class SettingsChange(Table):
    """The rule as somebody set it; the last row holds, the defaults where there is none."""

    __tablename__ = PREFIX + "settings_changes"

    id: Mapped[int] = mapped_column(primary_key=True)
    limit_s: Mapped[float]
    missing_frame_s: Mapped[float]
    scenarios: Mapped[int]
    counting: Mapped[str] = mapped_column(String(10))
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]
