import os
import sqlite3
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text

from framerunner.monitor.competition import tables
from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import Database, DatabaseError
from framerunner.monitor.competition.store import Store
from framerunner.monitor.competition.tables import SCHEMA_VERSION
from framerunner.monitor.settings import MonitorError


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


def test_one_monitor_at_a_time_uses_a_database_and_the_other_is_told_which(database_url):
    first = Database(database_url, "the monitor at http://a:8080/ (process 7)")
    with pytest.raises(
        DatabaseError,
        match=r": the monitor at http://a:8080/ \(process 7\)[^;]* uses it; stop that one, or name another",
    ):
        Database(database_url, "the monitor at http://b:8090/ (process 8)")
    first.close()
    second = Database(database_url, "the monitor at http://b:8090/ (process 8)")
    with pytest.raises(DatabaseError, match="b:8090"):
        Database(database_url, "the monitor at http://a:8080/ (process 7)")
    second.close()


def test_another_name_of_a_file_is_the_same_database(tmp_path):
    (tmp_path / "y.db").symlink_to(tmp_path / "x.db")
    first = Database(f"sqlite:///{tmp_path}/x.db", "the first")
    with pytest.raises(DatabaseError, match="the first uses it"):
        Database(f"sqlite:///{tmp_path}/y.db", "the second")
    first.close()


def test_a_missing_folder_is_named(tmp_path):
    words = refusal(f"sqlite:///{tmp_path}/missing/x.db")
    assert "missing/x.db" in words and "folder" in words
    with pytest.raises(DatabaseError, match=r"missing/x.db.* does its folder exist"):
        Database(f"sqlite:///{tmp_path}/missing/x.db", "the monitor")


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


def test_a_newer_version_is_refused_in_one_line(database_url):
    Database(database_url).close()
    engine = create_engine(database_url)
    with engine.begin() as connection:
        connection.execute(text("update competition_schema set version = 99"))
    engine.dispose()
    words = refusal(database_url)
    assert "version 99" in words and f"version {SCHEMA_VERSION}" in words and "update framerunner" in words


VERSION_1 = Path(__file__).with_name("version_1.sql")


def version_1(file):
    """A contest that an older framerunner wrote: one team flew, another is called."""
    with sqlite3.connect(file) as connection:
        connection.executescript(VERSION_1.read_text())
    connection.close()


def test_an_older_contest_is_migrated(tmp_path):
    file = tmp_path / "x.db"
    version_1(file)
    database = Database(f"sqlite:///{file}")
    store = Store(database)
    board = store.board()
    assert [team.name for team in board.teams] == ["Falken", "Adler"]
    assert (board.called.team_name, board.called.scenario, board.called.who) == ("Adler", "case-2", "Ada")
    assert board.tries[0].result.counted_s == 70.0 and board.tries[0].team_name == "Falken"
    assert board.queue.teams == ()
    store.set_queue(0, [1, 2], Entry("Ada", board.called.at))
    store.take_back(board.called.id, Entry("Ada", board.called.at))
    assert store.board().called is None
    with database.transaction() as session:
        kinds = session.execute(text("select kind from competition_next order by id")).scalars().all()
    assert kinds == ["call", "used", "call", "taken back", "call", "taken back"]
    store.close()
    assert columns(file) == columns_of_new(tmp_path)


def columns(file):
    """Name, type and whether it may be null, of every column of every table."""
    with sqlite3.connect(file) as connection:
        names = [row[0] for row in connection.execute("select name from sqlite_master where type = 'table'")]
        return {
            name: sorted(row[1:4] for row in connection.execute(f"pragma table_info({name})"))
            for name in names
        }


def columns_of_new(folder):
    Database(f"sqlite:///{folder}/new.db").close()
    return columns(folder / "new.db")


def test_an_older_contest_is_brought_up_to_date_as_a_whole_or_not_at_all(tmp_path, monkeypatch):
    file = tmp_path / "x.db"
    version_1(file)
    before = columns(file)
    monkeypatch.setitem(tables._STATEMENTS, 1, (*tables._STATEMENTS[1], "select * from nowhere"))
    assert "nowhere" in refusal(f"sqlite:///{file}")
    assert columns(file) == before
    monkeypatch.undo()
    Database(f"sqlite:///{file}").close()
    assert columns(file) == columns_of_new(tmp_path)


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


def test_sqlite_writes_commits_to_disk_and_checks_foreign_keys(tmp_path):
    database = Database(f"sqlite:///{tmp_path}/x.db")
    with database.transaction() as session:
        values = {
            name: session.execute(text(f"pragma {name}")).scalar()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        }
    assert values == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1, "busy_timeout": 5000}
    database.close()


def test_a_locked_database_gives_one_line(tmp_path):
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


def test_a_full_disk_gives_one_line_and_later_writes_succeed(tmp_path):
    database = Database(f"sqlite:///{tmp_path}/x.db")
    fill = text("create table filling as select zeroblob(100000) as bytes")
    with database.transaction() as session:
        session.execute(text("pragma max_page_count=1"))  # as large as it is, and no larger
    with (
        pytest.raises(DatabaseError, match="disk is full; free some space"),
        database.transaction() as session,
    ):
        session.execute(fill)
    with database.transaction() as session:
        session.execute(text("pragma max_page_count=1000000"))
        session.execute(fill)
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
