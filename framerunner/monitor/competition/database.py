"""The contest's database: opened, with errors in one line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from sqlite3 import Connection
from typing import Any

from sqlalchemy import URL, Engine, create_engine, event, inspect, make_url
from sqlalchemy.exc import ArgumentError, IntegrityError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker
from sqlalchemy.pool import StaticPool

from framerunner.monitor.competition.sole_user import reserve
from framerunner.monitor.competition.tables import PREFIX, SCHEMA_VERSION, Schema, Table, migrate
from framerunner.monitor.settings import MonitorError

_ANSWER_S = 5  # after this a server counts as not reachable


class DatabaseError(MonitorError):
    """The database cannot be opened or does not answer; the message is one line for people."""


class Database:
    """An open database with the tables of the contest. Use it from one thread at a time.

    Args:
        url: any of SQLAlchemy's, such as "sqlite:///framerunner.db".
        sole_user: who uses it alone, for people; None: others may use it meanwhile.

    Raises:
        DatabaseError: it cannot be used, or another sole user does.
    """

    def __init__(self, url: str, sole_user: str | None = None) -> None:
        parsed = _parse(url)
        self.shown_url = parsed.render_as_string(hide_password=True)
        try:
            self._engine = _engine(parsed)
        except ModuleNotFoundError as error:
            raise DatabaseError(
                f"database {self.shown_url}: the Python package {error.name!r} that talks to it is missing; "
                f"install it (for PostgreSQL: pip install 'framerunner[postgresql]')"
            ) from error
        except (ArgumentError, NoSuchModuleError, SQLAlchemyError, TypeError, ValueError) as error:
            raise DatabaseError(f"database {self.shown_url}: {_one_line(error)}; {_EXAMPLES}") from error
        self._sessions = sessionmaker(self._engine, expire_on_commit=False)
        self._release: Callable[[], None] = lambda: None
        try:
            with self._explained():
                if sole_user is not None:
                    self._reserve(parsed, sole_user)
                self._prepare()
        except DatabaseError:
            self.close()
            raise

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """A transaction: all or nothing, and on the disk at its end.

        Raises:
            DatabaseError: the database does not answer or refuses. What a constraint refuses is raised as
                SQLAlchemy's `IntegrityError`.
        """
        with self._explained(), self._sessions.begin() as session:
            yield session

    def close(self) -> None:
        """Close all connections."""
        self._release()
        self._engine.dispose()

    def _reserve(self, url: URL, user: str) -> None:
        try:
            other, self._release = reserve(url, self._engine, user)
        except OSError as error:
            raise DatabaseError(
                f"database {self.shown_url}: {error.filename} cannot be written "
                f"({(error.strerror or str(error)).lower()}); does its folder exist, and may you write there?"
            ) from error
        if other:
            raise DatabaseError(
                f"database {self.shown_url}: {other} uses it; stop that one, or name another with --database"
            )

    def _prepare(self) -> None:
        """Create the tables, or bring older ones up to date: all or nothing."""
        with self._engine.begin() as connection:
            if connection.dialect.name == "sqlite":
                # Its driver begins no transaction before a change of tables.
                connection.exec_driver_sql("BEGIN IMMEDIATE")
            present = {name for name in inspect(connection).get_table_names() if name.startswith(PREFIX)}
            if not present:
                Table.metadata.create_all(connection)
                connection.execute(Schema.__table__.insert().values(version=SCHEMA_VERSION))  # type: ignore[attr-defined]
                return
            versions = (
                list(connection.execute(Schema.__table__.select()).scalars())
                if Schema.__tablename__ in present
                else []
            )
            if len(versions) == 1 and 1 <= versions[0] < SCHEMA_VERSION:
                migrate(connection, versions[0])
                versions = [SCHEMA_VERSION]
        if versions != [SCHEMA_VERSION]:
            held = f"version {versions[0]}" if len(versions) == 1 else "no version that is known here"
            raise DatabaseError(
                f"database {self.shown_url}: its contest has tables of {held}, this framerunner uses "
                f"version {SCHEMA_VERSION}; update framerunner or name another database"
            )

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except IntegrityError:
            raise
        except SQLAlchemyError as error:
            text = str(error).lower()
            hint = next((f"; {hint}" for part, hint in _HINTS if part in text), "")
            raise DatabaseError(f"database {self.shown_url}: {_one_line(error)}{hint}") from error


_HINTS = (  # part of the driver's message, what to do
    ("unable to open database file", "does its folder exist, and may you write there?"),
    ("readonly", "it cannot be written; name another file or change its permissions"),
    ("not a database", "the file is something else; name another"),
    ("disk is full", "free some space; writing is retried"),
    ("disk i/o error", "is the disk full or gone? Writing is retried"),
    ("database is locked", "another program is writing to it"),
    ("could not translate host", "is the host's name right?"),
    ("connection refused", "is the server running there?"),
    ("timeout expired", "is the server reachable?"),
    ("password authentication", "are user and password right?"),
)
_EXAMPLES = 'give a URL such as "sqlite:///framerunner.db" or "postgresql+psycopg://user:password@host/name"'


def _parse(url: str) -> URL:
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError) as error:
        # A text that cannot be parsed may hold a password: it is not repeated.
        raise DatabaseError(f"database: what was given is not the URL of a database; {_EXAMPLES}") from error
    # psycopg is what the package's extra installs; SQLAlchemy's own choice depends on its version.
    plain = parsed.drivername in {"postgresql", "postgres"}
    return parsed.set(drivername="postgresql+psycopg") if plain else parsed


def _engine(url: URL) -> Engine:
    if url.get_backend_name() == "sqlite":
        options: dict[str, Any] = {"connect_args": {"check_same_thread": False}}
        if url.database in {None, "", ":memory:"}:
            options["poolclass"] = StaticPool  # each connection would be a database of its own
        engine = create_engine(url, **options)
        event.listen(engine, "connect", _set_up_sqlite)
        return engine
    options = {"pool_pre_ping": True}
    if url.drivername == "postgresql+psycopg" and not url.query:
        options["connect_args"] = {
            "connect_timeout": _ANSWER_S,
            "tcp_user_timeout": _ANSWER_S * 1000,
            "options": f"-c statement_timeout={_ANSWER_S * 1000}",
        }
    return create_engine(url, **options)


def _set_up_sqlite(connection: Connection, record: object) -> None:
    """Write each commit to the disk before it returns; readers never wait for the writer."""
    cursor = connection.cursor()
    try:
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", "busy_timeout=5000"):
            cursor.execute(f"PRAGMA {pragma}")
    finally:
        cursor.close()


def _one_line(error: Exception) -> str:
    """The driver's message, without SQLAlchemy's additions and the values of a statement."""
    cause = getattr(error, "orig", None) or error
    text = " ".join(re.sub(r"\(Background on this error.*", "", str(cause), flags=re.DOTALL).split())
    return text[:200].rstrip(" .;:") or type(cause).__name__
