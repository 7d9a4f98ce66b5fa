"""Who is at a browser, and what they may do: log-ins of judges, kept over a restart."""

from __future__ import annotations

import asyncio
import hmac
import json
import logging
import secrets
import time
import unicodedata
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket

from errors import UserError
from errors.files import replace_file
from monitor.addresses import visitor_key

REFUSED_CODE = 4403  # closes a WebSocket, as 403 ends a request
SESSION_S = 12 * 3600.0
MAX_NAME_LENGTH = 60
TRIES_A_MINUTE = 10
FAILURE_DELAY_S = 0.5
_MAX_SESSIONS = 1000
_MAX_ADDRESSES = 1000
_MINUTE_S = 60.0
_INVISIBLE = ("C", "Zl", "Zp")  # Unicode categories: control and format characters, line ends
_SUFFIX = ".sessions"
_DEFAULT_FILE = "framerunner.db"  # beside which the file of sessions lies if the database is not a file
_MAX_FILE_BYTES = 1 << 20
_log = logging.getLogger(__name__)


class LoginRefusedError(UserError):
    """A log-in failed; the message is one line for people.

    Attributes:
        status: the HTTP status that fits.
    """

    def __init__(self, text: str, status: int = 403) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True, slots=True)
class Visitor:
    """The person at a browser.

    Attributes:
        name: as given at log-in; "" without one.
        may_judge: may change tries, teams and scenarios.
        may_fly: may take the sticks and command drones.
    """

    name: str
    may_judge: bool
    may_fly: bool


class StoredSession(BaseModel):
    """A judge's session in the file. Its secret cannot be computed from what is stored."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME_LENGTH)]
    ends_unix_s: Annotated[float, Field(allow_inf_nan=False)]


class _SessionFileContent(BaseModel):
    """For each cookie, which names a monitor's port, its sessions by digest."""

    cookies: dict[str, dict[str, StoredSession]] = {}


@dataclass(frozen=True, slots=True)
class SessionFile:
    """The sessions of one monitor on disk, so that a restart logs no judge out.

    A file that cannot be read or written is logged; the monitor works without it.

    Attributes:
        path: readable only by its owner.
        cookie: names the monitor; other monitors may have theirs in the same file.
        now_s: Unix time.
    """

    path: Path
    cookie: str
    now_s: Callable[[], float] = time.time

    def load(self) -> dict[str, StoredSession]:
        """The sessions that have not ended, by the digest of their secret."""
        return self._alive().get(self.cookie, {})

    def save(self, sessions: Mapping[str, StoredSession]) -> None:
        """Replace this monitor's sessions, atomically."""
        content = _SessionFileContent(cookies={**self._alive(), self.cookie: dict(sessions)})
        try:
            replace_file(self.path, content.model_dump_json(), new_mode=0o600)
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

    def _read(self) -> _SessionFileContent:
        try:
            with self.path.open("rb") as file:
                return _SessionFileContent.model_validate(json.loads(file.read(_MAX_FILE_BYTES)))
        except FileNotFoundError:
            return _SessionFileContent()
        except (OSError, ValueError, RecursionError, ValidationError) as error:
            _log.warning("judges' sessions in %s cannot be read: %s", self.path, type(error).__name__)
            return _SessionFileContent()


def session_path(database: str) -> Path | None:
    """Where sessions are kept: beside the contest's database.

    Args:
        database: its SQLAlchemy URL.

    Returns:
        The file; None for a database in memory.
    """
    scheme, _, place = database.partition("://")
    if not scheme.startswith("sqlite"):
        return Path(_DEFAULT_FILE + _SUFFIX)
    name = place.partition("?")[0].removeprefix("/")
    return None if name in {"", ":memory:"} else Path(name + _SUFFIX)


@dataclass(frozen=True, slots=True)
class _Session:
    name: str
    ends_s: float


class Access:
    """Log-ins of judges and what each visitor may do.

    Args:
        password: of the judges; None: each needs a one-time link.
        all_may_fly: only this machine's users can reach the monitor.
        cookie: name of the session's cookie.
        hear_invitation: called with the secret of each new one-time link.
        clock: seconds that never go back.
        kept: where sessions are kept over a restart; None: nowhere.
    """

    def __init__(
        self,
        password: str | None,
        *,
        all_may_fly: bool,
        cookie: str = "framerunner-judge",
        hear_invitation: Callable[[str], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
        kept: SessionFile | None = None,
    ) -> None:
        self.cookie = cookie
        self._password = password
        self._all_may_fly = all_may_fly
        self._hear_invitation = hear_invitation
        self._clock = clock
        self._kept = kept
        self._sessions = self._load()  # by digest
        self._tries: dict[str, deque[float]] = {}
        self._invitation = ""

    @property
    def needs_password(self) -> bool:
        """Whether judges log in with a password; otherwise with a one-time link."""
        return self._password is not None

    def invite(self) -> None:
        """Make a new one-time link, if those are used; the one before becomes invalid."""
        if self._password is None:
            self._invitation = secrets.token_urlsafe(32)
            self._hear_invitation(self._invitation)

    def visitor(self, connection: HTTPConnection) -> Visitor:
        """The person who sent a request or opened a WebSocket."""
        digest = self._digest(connection.cookies.get(self.cookie, ""))
        session = self._sessions.get(digest)
        if session is not None and session.ends_s <= self._clock():
            del self._sessions[digest]
            session = None
        if session is None:
            return Visitor("", may_judge=False, may_fly=self._all_may_fly)
        return Visitor(session.name, may_judge=True, may_fly=True)

    def require_judge(self, connection: HTTPConnection) -> Visitor:
        """The visitor; raises `HTTPException` 403 if they may not judge."""
        visitor = self.visitor(connection)
        if not visitor.may_judge:
            raise HTTPException(403, "only judges may do this; log in at /login")
        return visitor

    async def log_in(self, name: str, secret: str, address: str) -> str:
        """Start a session; a wrong secret is answered after a delay.

        Args:
            name: who it is, 1 to 60 characters.
            secret: the password, or that of the one-time link.
            address: of the visitor, for counting tries.

        Returns:
            The secret id of the session, for the cookie.

        Raises:
            LoginRefusedError: with one line.
        """
        name = _clean_name(name)
        self._count_try(address)
        expected = self._invitation if self._password is None else self._password
        if not expected or not hmac.compare_digest(secret.encode(), expected.encode()):
            await asyncio.sleep(FAILURE_DELAY_S)
            if self.needs_password:
                raise LoginRefusedError("This is not the password.")
            raise LoginRefusedError(
                "This link was used before or never valid; the newest one is on the console."
            )
        self._tries.pop(visitor_key(address), None)
        self._remove_old_sessions()
        session_id = secrets.token_urlsafe(32)
        self._sessions[self._digest(session_id)] = _Session(name, self._clock() + SESSION_S)
        self._save()
        self.invite()
        return session_id

    def log_out(self, connection: HTTPConnection) -> None:
        """End the visitor's session, if there is one."""
        if self._sessions.pop(self._digest(connection.cookies.get(self.cookie, "")), None) is not None:
            self._save()

    def _digest(self, session_id: str) -> str:
        """The key of a session: nobody can log in with it, and another password makes it invalid."""
        key = (self._password or "").encode()
        return hmac.new(key, session_id.encode("utf-8", "replace"), "sha256").hexdigest()

    def _load(self) -> dict[str, _Session]:
        if self._kept is None:
            return {}
        offset_s = self._clock() - self._kept.now_s()
        return {
            digest: _Session(each.name, min(each.ends_unix_s + offset_s, self._clock() + SESSION_S))
            for digest, each in self._kept.load().items()
        }

    def _save(self) -> None:
        if self._kept is None:
            return
        offset_s = self._kept.now_s() - self._clock()
        stored = {
            digest: StoredSession(name=each.name, ends_unix_s=each.ends_s + offset_s)
            for digest, each in self._sessions.items()
        }
        self._kept.save(stored)

    def _remove_old_sessions(self) -> None:
        now_s = self._clock()
        self._sessions = {key: each for key, each in self._sessions.items() if each.ends_s > now_s}
        while len(self._sessions) >= _MAX_SESSIONS:
            del self._sessions[next(iter(self._sessions))]

    def _count_try(self, address: str) -> None:
        """Count a try before its secret is checked, so that simultaneous tries count too."""
        now_s = self._clock()
        tries = self._tries.setdefault(visitor_key(address), deque())
        while tries and tries[0] <= now_s - _MINUTE_S:
            tries.popleft()
        if len(tries) >= TRIES_A_MINUTE:
            raise LoginRefusedError("Too many tries; wait a minute.", 429)
        tries.append(now_s)
        while len(self._tries) > _MAX_ADDRESSES:
            del self._tries[next(iter(self._tries))]


async def refuse(websocket: WebSocket, text: str) -> None:
    """Accept a WebSocket and close it with code 4403 and one short line, which the page can show."""
    await websocket.accept()
    await websocket.close(REFUSED_CODE, text)


def _clean_name(name: str) -> str:
    name = name.strip()
    if not name:
        raise LoginRefusedError("Who are you? Give a name; it stands beside what you change.", 400)
    if len(name) > MAX_NAME_LENGTH:
        raise LoginRefusedError(f"The name has {len(name)} characters; use at most {MAX_NAME_LENGTH}.", 400)
    if any(unicodedata.category(letter).startswith(_INVISIBLE) for letter in name):
        raise LoginRefusedError("The name has characters that cannot be seen; leave them out.", 400)
    return name
