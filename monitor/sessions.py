"""Judges' sessions on the disk, so that a restart of the monitor logs nobody out."""

from __future__ import annotations

import json
import logging
import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import time as wall_time_s
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

_SUFFIX = ".sessions"
_NO_FILE = "framerunner.db"  # beside which the file lies when the database is no file of its own
_MAX_BYTES = 1 << 20
_log = logging.getLogger(__name__)


class StoredSession(BaseModel):
    """A session as it is kept. Its secret cannot be computed from what is stored.

    Attributes:
        name: of the judge.
        ends_unix_s: when it ends, Unix time.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    name: Annotated[str, Field(min_length=1, max_length=60)]
    ends_unix_s: Annotated[float, Field(allow_inf_nan=False)]


class _Content(BaseModel):
    """The file: for each cookie, which names a monitor's port, its sessions by digest."""

    cookies: dict[str, dict[str, StoredSession]] = {}


@dataclass(frozen=True, slots=True)
class SessionFile:
    """Reads and writes the sessions of one monitor.

    A file that cannot be read or written is told once in the log; the monitor goes on without it.

    Attributes:
        path: of the file, which only its owner may read.
        cookie: names the monitor; others may keep theirs in the same file.
        now_s: Unix time.
    """

    path: Path
    cookie: str
    now_s: Callable[[], float] = wall_time_s

    def load(self) -> dict[str, StoredSession]:
        """The sessions that have not ended, by the digest of their secret."""
        return self._alive().get(self.cookie, {})

    def save(self, sessions: Mapping[str, StoredSession]) -> None:
        """Keep these and no others of this monitor; all of the file or nothing is written."""
        content = _Content(cookies={**self._alive(), self.cookie: dict(sessions)})
        try:
            handle, temporary = tempfile.mkstemp(dir=self.path.parent, prefix=self.path.name)  # mode 0600
            try:
                with os.fdopen(handle, "w", encoding="utf-8") as file:
                    file.write(content.model_dump_json())
                Path(temporary).replace(self.path)
            except OSError:
                Path(temporary).unlink(missing_ok=True)
                raise
        except OSError as error:
            _log.warning("judges' sessions are not kept in %s: %s", self.path, error.strerror)

    def _alive(self) -> dict[str, dict[str, StoredSession]]:
        """What the file holds, without sessions that have ended."""
        now_s = self.now_s()
        alive = {
            cookie: {digest: each for digest, each in sessions.items() if each.ends_unix_s > now_s}
            for cookie, sessions in self._read().cookies.items()
        }
        return {cookie: sessions for cookie, sessions in alive.items() if sessions}

    def _read(self) -> _Content:
        try:
            with self.path.open("rb") as file:
                return _Content.model_validate(json.loads(file.read(_MAX_BYTES)))
        except FileNotFoundError:
            return _Content()
        except (OSError, ValueError, RecursionError, ValidationError) as error:
            _log.warning("judges' sessions in %s cannot be read: %s", self.path, type(error).__name__)
            return _Content()


def session_path(database: str) -> Path | None:
    """Where sessions are kept: beside the contest's database.

    Args:
        database: its SQLAlchemy URL.

    Returns:
        The file; None for a database in memory, which keeps nothing either.
    """
    scheme, _, place = database.partition("://")
    if not scheme.startswith("sqlite"):
        return Path(_NO_FILE + _SUFFIX)
    name = place.partition("?")[0].removeprefix("/")
    return None if name in {"", ":memory:"} else Path(name + _SUFFIX)
