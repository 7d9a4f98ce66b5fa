"""One monitor at a time uses a database: each would take the other's running tries for interrupted ones."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

from sqlalchemy import URL, Engine, text

_SUFFIX = ".lock"
_POSTGRESQL_KEY = 0x6672616D65727562  # of the advisory lock, which is valid for one database
_MAX_NAME_BYTES = 63  # of a PostgreSQL connection's application_name
_MAX_HOLDER_BYTES = 200


def reserve(url: URL, engine: Engine, user: str) -> tuple[str, Callable[[], None]]:
    """Reserve a database until this program ends; other kinds than SQLite's files and PostgreSQL's never are.

    Args:
        url: of the database.
        engine: that connects to it.
        user: who reserves it, for people.

    Returns:
        The other one that uses it, for people, or ""; and a function that ends the reservation.

    Raises:
        OSError: the file that marks the reservation cannot be written.
        SQLAlchemyError: the server does not answer.
    """
    if engine.dialect.name == "postgresql":
        return _reserve_on_server(engine, user)
    file = database_file(url)
    if file is None:
        return "", lambda: None
    return _reserve_file(_mark(file), user)


def user_of(file: Path) -> str:
    """Who uses an SQLite database's file alone, for people, or "". Raises `OSError` as `reserve`."""
    user, release = _reserve_file(_mark(file), "")
    release()
    return user


def database_file(url: URL) -> Path | None:
    """The file of an SQLite database, by whatever name it was given; None: there is no file."""
    name = (url.database or "").removeprefix("file:")
    if url.get_backend_name() != "sqlite" or name in {"", ":memory:"}:
        return None
    return Path(name).resolve()


def _mark(file: Path) -> Path:
    return file.with_name(file.name + _SUFFIX)


def _reserve_file(mark: Path, user: str) -> tuple[str, Callable[[], None]]:
    descriptor = os.open(mark, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        other = os.pread(descriptor, _MAX_HOLDER_BYTES, 0).decode(errors="replace").strip()
        os.close(descriptor)
        return other or "another monitor", lambda: None
    except OSError as error:  # this file system knows no locks
        os.close(descriptor)
        raise OSError(error.errno, error.strerror, str(mark)) from None
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, f"{user}\n".encode()[:_MAX_HOLDER_BYTES], 0)
    return "", lambda: os.close(descriptor)


def _reserve_on_server(engine: Engine, user: str) -> tuple[str, Callable[[], None]]:
    connection = engine.connect().execution_options(isolation_level="AUTOCOMMIT")
    try:
        name = {"name": user.encode()[:_MAX_NAME_BYTES].decode(errors="ignore")}
        connection.execute(text("select set_config('application_name', :name, false)"), name)
        if connection.scalar(text(f"select pg_try_advisory_lock({_POSTGRESQL_KEY})")):
            return "", connection.close
        other = connection.scalar(
            text(
                "select application_name || coalesce(' from ' || host(client_addr), '')"
                " from pg_locks join pg_stat_activity using (pid) where locktype = 'advisory' and granted"
                " and database = (select oid from pg_database where datname = current_database())"
                f" and (classid::bigint << 32) + objid::bigint = {_POSTGRESQL_KEY}"
            )
        )
    except BaseException:
        connection.close()
        raise
    connection.close()
    return str(other or "another monitor"), lambda: None
