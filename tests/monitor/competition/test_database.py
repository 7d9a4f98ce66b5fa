import os
import sqlite3

import pytest
from sqlalchemy import create_engine, text

from monitor.competition.database import Database, DatabaseError
from monitor.competition.tables import SCHEMA_VERSION
from monitor.settings import MonitorError


def refusal(url):
    with pytest.raises(DatabaseError) as caught:
        Database(url)
    words = str(caught.value)
    assert isinstance(caught.value, MonitorError)
    assert words.startswith("database") and len(words.splitlines()) == 1 and len(words) < 400
    return words


@pytest.mark.parametrize("url", ["rubbish", "", "postgresql+psycopg://a:secret@h:port/x", "http//secret"])
def test_what_is_no_url_is_refused_without_repeating_it(url):
    words = refusal(url)
    assert "sqlite:///framerunner.db" in words and "secret" not in words


def test_an_unknown_kind_is_refused():
    assert "foo" in refusal("foo://somewhere/x")


def test_a_missing_driver_is_named():
    words = refusal("mysql+pymysql://a:secret@h/x")
    assert "'pymysql'" in words and "install" in words and "secret" not in words


def test_a_server_that_is_not_there_is_named_without_the_password():
    pytest.importorskip("psycopg")
    words = refusal("postgresql://a:secret@127.0.0.1:1/x")
    assert "127.0.0.1" in words and "secret" not in words and "refused" in words.lower()


def test_a_missing_folder_is_named(tmp_path):
    words = refusal(f"sqlite:///{tmp_path}/missing/x.db")
    assert "missing/x.db" in words and "folder" in words


def test_a_file_that_is_something_else_is_left_alone(tmp_path):
    file = tmp_path / "notes.txt"
    file.write_text("not a database, but precious\n" * 100)
    before = file.read_bytes()
    assert "not a database" in refusal(f"sqlite:///{file}")
    assert file.read_bytes() == before


def test_a_file_that_cannot_be_written_is_refused(tmp_path):
    file = tmp_path / "x.db"
    sqlite3.connect(file).execute("create table other (a)").connection.close()
    words = refusal(f"sqlite:///file:{file}?mode=ro&uri=true")
    assert "cannot be written" in words


def test_a_newer_version_is_refused_in_words(database_url):
    Database(database_url).close()
    engine = create_engine(database_url)
    with engine.begin() as connection:
        connection.execute(text("update competition_schema set version = 99"))
    engine.dispose()
    words = refusal(database_url)
    assert "version 99" in words and f"version {SCHEMA_VERSION}" in words and "update framerunner" in words


def test_tables_without_a_version_are_refused(tmp_path):
    file = tmp_path / "x.db"
    with sqlite3.connect(file) as connection:
        connection.execute("create table competition_teams (id)")
    assert "no version" in refusal(f"sqlite:///{file}")


def test_other_tables_of_a_database_are_left_alone(tmp_path):
    file = tmp_path / "x.db"
    with sqlite3.connect(file) as connection:
        connection.execute("create table teams (id)")
        connection.execute("insert into teams values (7)")
    Database(f"sqlite:///{file}").close()
    with sqlite3.connect(file) as connection:
        assert connection.execute("select id from teams").fetchall() == [(7,)]


def test_sqlite_keeps_what_it_committed_and_minds_its_references(tmp_path):
    database = Database(f"sqlite:///{tmp_path}/x.db")
    with database.transaction() as session:
        values = {
            name: session.execute(text(f"pragma {name}")).scalar()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        }
    assert values == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1, "busy_timeout": 5000}
    database.close()


def test_a_database_that_is_locked_is_told_in_words(tmp_path):
    url = f"sqlite:///{tmp_path}/x.db"
    database = Database(url)
    with database.transaction() as session:
        session.execute(text("pragma busy_timeout=50"))
    other = sqlite3.connect(tmp_path / "x.db")
    other.execute("begin exclusive")
    with (
        pytest.raises(DatabaseError, match="locked; another program is writing"),
        database.transaction() as session,
    ):
        session.execute(text("update competition_schema set version = 1"))
    other.rollback()
    other.close()
    database.close()


def test_a_database_in_memory_works():
    database = Database("sqlite://")
    with database.transaction() as session:
        assert session.execute(text("select version from competition_schema")).scalar() == SCHEMA_VERSION
    database.close()


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    try:
        assert "may you write there" in refusal(f"sqlite:///{tmp_path}/x.db")
    finally:
        tmp_path.chmod(0o700)
