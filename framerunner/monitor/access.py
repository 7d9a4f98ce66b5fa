"""Who is at a browser, and what they may do: roles, and log-ins that are kept over a restart."""

from __future__ import annotations

import contextlib
import hmac
import json
import logging
import secrets
import time
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection

from framerunner.errors import UserError
from framerunner.files.text_file import replace_file
from framerunner.monitor.visitors.login_limit import LoginLimit
from framerunner.monitor.visitors.pupils import PupilBook, PupilError, owns

SESSION_S = 12 * 3600.0
MAX_NAME_LENGTH = 60
_MAX_SESSIONS = 1000  # of a role
_MAX_OWN_SESSIONS = 20  # of a pupil
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


class Role(StrEnum):
    """What somebody is; docs/monitor.md has the table of what each may do."""

    VIEWER = "viewer"
    PUPIL = "pupil"
    JUDGE = "judge"
    ORGANISER = "organiser"


@dataclass(frozen=True, slots=True)
class Visitor:
    """The person at a browser.

    Attributes:
        name: as given at log-in; "" without one.
        role: what they are; this machine's user is an organiser without a name.
        key: of a pupil, part of the names of the own files; else "".
    """

    name: str = ""
    role: Role = Role.VIEWER
    key: str = ""

    @property
    def may_fly(self) -> bool:
        """May take the sticks, and operate a real drone's flight."""
        return self.role in (Role.JUDGE, Role.ORGANISER)

    @property
    def may_judge(self) -> bool:
        """May correct tries; the name stands beside that."""
        return self.may_fly and self.name != ""

    @property
    def may_organise(self) -> bool:
        """May change teams, the queue, the draw and the rule; the name stands beside that."""
        return self.may_teach and self.name != ""

    @property
    def may_teach(self) -> bool:
        """May edit all missions, start flights in the simulator, and see and reset a class's progress."""
        return self.role is Role.ORGANISER

    @property
    def may_learn(self) -> bool:
        """May take part in the course, edit and have missions flown in lockstep."""
        return self.role in (Role.PUPIL, Role.ORGANISER)

    def may_edit(self, file: str) -> bool:
        """Whether they may see and change a mission's file; a pupil the own ones only."""
        if self.role is not Role.PUPIL:
            return self.may_teach
        return owns(self.key, file)


@dataclass(frozen=True, slots=True)
class Secrets:
    """With what people log in.

    Attributes:
        organiser: password; None: by one-time links.
        judge: likewise.
        class_code: with which pupils join; None: they cannot.
    """

    organiser: str | None = field(default=None, repr=False)
    judge: str | None = field(default=None, repr=False)
    class_code: str | None = field(default=None, repr=False)

    def of(self, role: Role) -> str | None:
        """The secret of a role."""
        return {Role.ORGANISER: self.organiser, Role.JUDGE: self.judge, Role.PUPIL: self.class_code}.get(role)


_BY_LINK = (Role.JUDGE, Role.ORGANISER)


class StoredSession(BaseModel):
    """A session in the file. Its secret cannot be computed from what is stored."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME_LENGTH)]
    role: Role = Role.VIEWER  # of an older program's, whose session is none any more
    key: str = ""
    ends_unix_s: Annotated[float, Field(allow_inf_nan=False)]


class _SessionFileContent(BaseModel):
    """For each cookie, which names a monitor's port, its sessions by digest."""

    cookies: dict[str, dict[str, StoredSession]] = {}


@dataclass(frozen=True, slots=True)
class SessionFile:
    """The sessions of one monitor on disk, so that a restart logs nobody out.

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
            _log.warning("log-ins are not kept in %s: %s", self.path, error.strerror)

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
            _log.warning("log-ins in %s cannot be read: %s", self.path, type(error).__name__)
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
    visitor: Visitor
    ends_s: float


class Access:
    """Log-ins, and what each visitor may do.

    Args:
        secrets: with what people log in.
        pupils: the class; None: there is none.
        is_user: whether this machine's user has sent a request, who is taken for an organiser.
        cookie: name of the session's cookie.
        hear_invitation: called with the role and the secret of each new one-time link.
        clock: seconds that never go back.
        kept: where sessions are kept over a restart; None: nowhere.
        limit: of tries to log in.
    """

    def __init__(
        self,
        secrets: Secrets,
        *,
        pupils: PupilBook | None = None,
        is_user: Callable[[HTTPConnection], bool] = lambda _: False,
        cookie: str = "framerunner-login",
        hear_invitation: Callable[[Role, str], None] = lambda _role, _secret: None,
        clock: Callable[[], float] = time.monotonic,
        kept: SessionFile | None = None,
        limit: LoginLimit | None = None,
    ) -> None:
        self.cookie = cookie
        self._secrets = secrets
        self._pupils = pupils
        self._is_user = is_user
        self._hear_invitation = hear_invitation
        self._clock = clock
        self._kept = kept
        self._limit = limit or LoginLimit(clock)
        self._sessions = self._load()  # by digest
        self._invitations: dict[Role, str] = {}

    @property
    def needs_password(self) -> bool:
        """Whether anybody logs in with a password or a code word; else only by one-time links."""
        return any(self._secrets.of(role) is not None for role in Role)

    def invite(self, *roles: Role) -> None:
        """Make new one-time links for roles that use them, by default all; the ones before become invalid."""
        for role in roles or _BY_LINK:
            if role in _BY_LINK and self._secrets.of(role) is None:
                self._invitations[role] = secrets.token_urlsafe(32)
                self._hear_invitation(role, self._invitations[role])

    def is_link(self, secret: str) -> bool:
        """Whether a secret is that of a one-time link which is still valid."""
        return self._by_secret("", secret, self._invitations) is not None

    def visitor(self, connection: HTTPConnection) -> Visitor:
        """The person who sent a request or opened a WebSocket, as things stand now."""
        session_id = connection.cookies.get(self.cookie, "")
        for digest in self._digests(session_id) if session_id else ():
            session = self._sessions.get(digest)
            if session is not None and session.ends_s > self._clock():
                return session.visitor
            self._sessions.pop(digest, None)
        return Visitor(role=Role.ORGANISER) if self._is_user(connection) else Visitor()

    def require_judge(self, connection: HTTPConnection) -> Visitor:
        """The visitor; raises `HTTPException` 403 if they may not judge."""
        visitor = self.visitor(connection)
        if not visitor.may_judge:
            raise HTTPException(403, "only judges and organisers may do this; log in at /login")
        return visitor

    def require_organiser(self, connection: HTTPConnection) -> Visitor:
        """The visitor; raises `HTTPException` 403 if they may not organise."""
        visitor = self.visitor(connection)
        if not visitor.may_organise:
            raise HTTPException(403, "only organisers may do this; log in at /login")
        return visitor

    def code_word(self, visitor: Visitor) -> str:
        """A pupil's own code word; "" of others, or if the class's file cannot be read."""
        pupil = None
        if self._pupils is not None and visitor.role is Role.PUPIL:
            with contextlib.suppress(PupilError):  # told at the log-in
                pupil = self._pupils.find(visitor.name)
        return "" if pupil is None else pupil.word

    async def log_in(self, name: str, secret: str, address: str) -> tuple[str, Visitor]:
        """Start a session. Tries that come too fast wait; a one-time link, which nobody can guess, does not.

        Args:
            name: who it is, 1 to 60 characters.
            secret: a password, a code word, or that of a one-time link.
            address: of the visitor, for counting tries.

        Returns:
            The secret id of the session, for the cookie, and who has logged in.

        Raises:
            LoginRefusedError: with one line.
        """
        name = _clean_name(name)
        visitor = self._by_secret(name, secret, self._invitations)
        if visitor is None:
            if not await self._limit.turn(address):
                raise LoginRefusedError("Too many tries; wait half a minute, then try again.", 429)
            visitor = self._by_secret(name, secret, self._passwords) or self._by_word(name, secret)
            if visitor is None:
                raise LoginRefusedError(self._wrong)
            self._limit.was_right(address)
        else:
            del self._invitations[visitor.role]
            self.invite(visitor.role)
        self._remove_old_sessions(visitor)
        session_id = secrets.token_urlsafe(32)
        digest = self._digest(visitor.role, session_id)
        self._sessions[digest] = _Session(visitor, self._clock() + SESSION_S)
        self._save()
        return session_id, visitor

    @property
    def _passwords(self) -> dict[Role, str]:
        given = {role: self._secrets.of(role) for role in _BY_LINK}
        return {role: secret for role, secret in given.items() if secret is not None}

    @property
    def _wrong(self) -> str:
        if self.needs_password:
            return "This is not the password or code word, or a link that was used before."
        return "This link was used before or never valid; the newest one is on the console."

    @staticmethod
    def _by_secret(name: str, secret: str, known: Mapping[Role, str]) -> Visitor | None:
        found = [role for role, each in known.items() if hmac.compare_digest(secret.encode(), each.encode())]
        return Visitor(name, found[0]) if found and secret else None

    def _by_word(self, name: str, word: str) -> Visitor | None:
        if self._pupils is None:
            return None
        try:
            pupil = self._pupils.log_in(name, word)
        except PupilError as error:
            raise LoginRefusedError(f"{error}.") from None
        return None if pupil is None else Visitor(pupil.name, Role.PUPIL, pupil.key)

    def log_out(self, connection: HTTPConnection) -> None:
        """End the visitor's session, if there is one."""
        session_id = connection.cookies.get(self.cookie, "")
        ended = [self._sessions.pop(digest, None) for digest in self._digests(session_id)]
        if any(ended):
            self._save()

    def _digests(self, session_id: str) -> tuple[str, ...]:
        return tuple(self._digest(role, session_id) for role in Role if role is not Role.VIEWER)

    def _digest(self, role: Role, session_id: str) -> str:
        """The key of a session: nobody can log in with it; another secret of its role makes it invalid."""
        key = f"{role}:{self._secrets.of(role) or ''}".encode()
        return hmac.new(key, session_id.encode("utf-8", "replace"), "sha256").hexdigest()

    def _load(self) -> dict[str, _Session]:
        if self._kept is None:
            return {}
        offset_s = self._clock() - self._kept.now_s()
        return {
            digest: _Session(
                Visitor(each.name, each.role, each.key),
                min(each.ends_unix_s + offset_s, self._clock() + SESSION_S),
            )
            for digest, each in self._kept.load().items()
        }

    def _save(self) -> None:
        if self._kept is None:
            return
        offset_s = self._kept.now_s() - self._clock()
        stored = {
            digest: StoredSession(
                name=each.visitor.name,
                role=each.visitor.role,
                key=each.visitor.key,
                ends_unix_s=each.ends_s + offset_s,
            )
            for digest, each in self._sessions.items()
        }
        self._kept.save(stored)

    def _remove_old_sessions(self, visitor: Visitor) -> None:
        """Make room for a session; many of one pupil end no other's, and many pupils' no judge's."""
        now_s = self._clock()
        self._sessions = {key: each for key, each in self._sessions.items() if each.ends_s > now_s}
        own = [key for key, each in self._sessions.items() if each.visitor == visitor]
        of_role = [key for key, each in self._sessions.items() if each.visitor.role is visitor.role]
        own_limit = _MAX_OWN_SESSIONS if visitor.role is Role.PUPIL else _MAX_SESSIONS
        role_limit = _MAX_SESSIONS if visitor.role is not Role.PUPIL else _MAX_SESSIONS * _MAX_OWN_SESSIONS
        ended = {*own[: max(0, len(own) - own_limit + 1)], *of_role[: max(0, len(of_role) - role_limit + 1)]}
        self._sessions = {key: each for key, each in self._sessions.items() if key not in ended}


def _clean_name(name: str) -> str:
    name = name.strip()
    if not name:
        raise LoginRefusedError("Who are you? Give a name; it stands beside what you change.", 400)
    if len(name) > MAX_NAME_LENGTH:
        raise LoginRefusedError(f"The name has {len(name)} characters; use at most {MAX_NAME_LENGTH}.", 400)
    if any(unicodedata.category(letter).startswith(_INVISIBLE) for letter in name):
        raise LoginRefusedError("The name has characters that cannot be seen; leave them out.", 400)
    return name
