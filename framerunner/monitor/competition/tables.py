"""The tables of the contest, and how those of an older framerunner are brought up to date.

No row is ever deleted, and what judges enter is only added. Lists in a text are separated by spaces.
"""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import Connection, DateTime, Dialect, ForeignKey, String, Text, UniqueConstraint, text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator

from framerunner.monitor.competition.views import Counting

PREFIX = "competition_"  # so that a database may hold other things too
SCHEMA_VERSION = 2


class UtcTime(TypeDecorator[datetime]):
    """A moment with its time zone, also in SQLite, which stores none."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Return a value that was read in UTC."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Table(DeclarativeBase):
    """Base of all tables."""

    type_annotation_map = {datetime: UtcTime()}  # noqa: RUF012 - SQLAlchemy's form


class Entered:
    """The columns of what is only added: `who` entered it, "" for the monitor itself, and when."""

    id: Mapped[int] = mapped_column(primary_key=True, sort_order=-1)
    who: Mapped[str] = mapped_column(String(100), sort_order=1)
    at: Mapped[datetime] = mapped_column(sort_order=1)


class Schema(Table):
    """Which version of these tables the database holds; one row."""

    __tablename__ = PREFIX + "schema"

    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)


class Team(Table):
    """A team."""

    __tablename__ = PREFIX + "teams"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(60))
    name_key: Mapped[str] = mapped_column(String(300), unique=True)  # see `validation.name_key`
    members: Mapped[str] = mapped_column(Text, default="")  # free text
    withdrawn: Mapped[bool] = mapped_column(default=False)  # out of the contest; its tries are kept


class TeamChange(Entered, Table):
    """A team after it was added or changed."""

    __tablename__ = PREFIX + "team_changes"

    team_id: Mapped[int] = mapped_column(ForeignKey(Team.id), index=True)
    name: Mapped[str] = mapped_column(String(60))
    members: Mapped[str] = mapped_column(Text)
    withdrawn: Mapped[bool]


class Draw(Entered, Table):
    """Scenarios drawn for a round; the last row of a round is valid."""

    __tablename__ = PREFIX + "draws"

    round: Mapped[int] = mapped_column(index=True)
    scenarios: Mapped[str] = mapped_column(Text)  # in order, one a line: name and gates
    pool: Mapped[str] = mapped_column(Text)  # names that could be drawn, one a line


class Call(Entered, Table):
    """A team called to the start, or the end of a call; the last row is valid."""

    __tablename__ = PREFIX + "next"

    team_id: Mapped[int | None] = mapped_column(ForeignKey(Team.id))  # None at the end of a call
    scenario: Mapped[str] = mapped_column(String(80))  # "" for whatever the drone flies
    # "call"; its end: "used" when a try was flown on it, "taken back" by a judge
    kind: Mapped[str] = mapped_column(String(20), server_default="call")
    queue_place: Mapped[int | None]  # index in the queue before the call; None if it was not in the queue


class Queue(Entered, Table):
    """The order in which teams are to fly; the last row is valid."""

    __tablename__ = PREFIX + "queues"

    teams: Mapped[str] = mapped_column(Text)  # ids, the first flies first


class Try(Table):
    """A try; more in `TryView`."""

    __tablename__ = PREFIX + "tries"

    id: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(String(200), unique=True)  # see `TryEvent`
    drone_id: Mapped[int]
    round: Mapped[int] = mapped_column(index=True)
    team_id: Mapped[int | None] = mapped_column(ForeignKey(Team.id), index=True)
    call_id: Mapped[int | None] = mapped_column(ForeignKey(Call.id))  # on which it began
    scenario: Mapped[str] = mapped_column(String(80))
    frames: Mapped[str] = mapped_column(String(80))  # colours to cross, in order
    state: Mapped[str] = mapped_column(String(20), index=True)
    report: Mapped[str] = mapped_column(Text)  # the referee's, as JSON
    source: Mapped[str] = mapped_column(String(40))
    final: Mapped[bool] = mapped_column(default=False)
    started: Mapped[datetime]  # when the monitor saw it begin
    ended: Mapped[datetime | None]


class Judgement(Entered, Table):
    """A judge's entry on a try: a correction, in which None is "as the referee says", or its team."""

    __tablename__ = PREFIX + "judgements"
    __table_args__ = (UniqueConstraint("try_id", "number"),)

    try_id: Mapped[int] = mapped_column(ForeignKey(Try.id), index=True)
    number: Mapped[int]  # counts those of a try from 1; two judges cannot write the same
    kind: Mapped[str] = mapped_column(String(20))  # "correction" or "team"
    team_id: Mapped[int | None] = mapped_column(ForeignKey(Team.id))
    crossed: Mapped[str | None] = mapped_column(String(80))  # colours
    contacts: Mapped[int | None]
    penalty_s: Mapped[float | None]
    try_time_s: Mapped[float | None]
    completed: Mapped[bool | None]
    remarks: Mapped[str] = mapped_column(Text, default="")


class SettingsChange(Entered, Table):
    """The rule as a judge set it; the last row is valid, the defaults where there is none."""

    __tablename__ = PREFIX + "settings_changes"

    limit_s: Mapped[float]
    missing_frame_s: Mapped[float]
    scenarios: Mapped[int]
    counting: Mapped[Counting] = mapped_column(String(10))


# By the version that they start from. They must be valid for SQLite and PostgreSQL.
_ADDED_TABLES: dict[int, tuple[type[Table], ...]] = {1: (Queue,)}
_STATEMENTS: dict[int, tuple[str, ...]] = {
    1: (
        f"ALTER TABLE {PREFIX}next ADD COLUMN kind VARCHAR(20) DEFAULT 'call' NOT NULL",
        f"ALTER TABLE {PREFIX}next ADD COLUMN queue_place INTEGER",
        f"ALTER TABLE {PREFIX}tries ADD COLUMN call_id INTEGER REFERENCES {PREFIX}next (id)",
        # Version 1 wrote the end of a call as a call of no team: by nobody when a try had used it.
        f"UPDATE {PREFIX}next SET kind = 'used' WHERE team_id IS NULL AND who = ''",
        f"UPDATE {PREFIX}next SET kind = 'taken back' WHERE team_id IS NULL AND who <> ''",
    ),
}


def migrate(connection: Connection, version: int) -> None:
    """Bring tables of a version from 1 up to date, within the connection's transaction; no data is lost."""
    for older in range(version, SCHEMA_VERSION):
        for table in _ADDED_TABLES[older]:
            Table.metadata.tables[table.__tablename__].create(connection)
        for statement in _STATEMENTS[older]:
            connection.execute(text(statement))
    connection.execute(Schema.__table__.update().values(version=SCHEMA_VERSION))  # type: ignore[attr-defined]
