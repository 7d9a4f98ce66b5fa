"""Brings the tables of an older framerunner up to date; what they hold is kept."""

from __future__ import annotations

from sqlalchemy import Connection, text

from monitor.competition.tables import PREFIX, SCHEMA_VERSION, Queue, Schema, Table

# Statements by the version that they start from. They must hold for SQLite and PostgreSQL.
_ADDED_TABLES: dict[int, tuple[type[Table], ...]] = {1: (Queue,)}
_STATEMENTS: dict[int, tuple[str, ...]] = {
    1: (
        f"ALTER TABLE {PREFIX}next ADD COLUMN kind VARCHAR(20) DEFAULT 'call' NOT NULL",
        f"ALTER TABLE {PREFIX}next ADD COLUMN queue_place INTEGER",
        f"ALTER TABLE {PREFIX}tries ADD COLUMN call_id INTEGER REFERENCES {PREFIX}next (id)",
        # Version 1 wrote the end of a call as a call of nobody: by nobody when a try had used it up.
        f"UPDATE {PREFIX}next SET kind = 'used' WHERE team_id IS NULL AND who = ''",
        f"UPDATE {PREFIX}next SET kind = 'taken back' WHERE team_id IS NULL AND who <> ''",
    ),
}


def migrate(connection: Connection, version: int) -> None:
    """Bring the tables up to date, within the transaction of the connection.

    Args:
        connection: to the database.
        version: of its tables; from 1 to before `SCHEMA_VERSION`.
    """
    for older in range(version, SCHEMA_VERSION):
        for table in _ADDED_TABLES[older]:
            Table.metadata.tables[table.__tablename__].create(connection)
        for statement in _STATEMENTS[older]:
            connection.execute(text(statement))
    connection.execute(Schema.__table__.update().values(version=SCHEMA_VERSION))  # type: ignore[attr-defined]
