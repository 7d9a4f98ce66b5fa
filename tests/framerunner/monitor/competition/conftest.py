import os
import uuid

import pytest
from sqlalchemy import create_engine, make_url, text

from framerunner.monitor.competition.database import Database
from framerunner.monitor.competition.store import Store

SERVER = "FRAMERUNNER_TEST_POSTGRESQL"  # URL of a database in which tests may make others


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request, tmp_path):
    """An empty database; PostgreSQL's only where a server is given."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'contest.db'}"
        return
    given = os.environ.get(SERVER)
    if not given:
        pytest.skip(f"no PostgreSQL server: name one in {SERVER}")
    name = f"framerunner_{uuid.uuid4().hex[:12]}"
    server = create_engine(given, isolation_level="AUTOCOMMIT")
    with server.connect() as connection:
        connection.execute(text(f"create database {name}"))
    yield make_url(given).set(database=name).render_as_string(hide_password=False)
    with server.connect() as connection:
        connection.execute(text(f"drop database {name} with (force)"))
    server.dispose()


@pytest.fixture
def store(database_url):
    store = Store(Database(database_url))
    yield store
    store.close()
