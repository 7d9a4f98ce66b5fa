"""Who is at a browser: anybody, or a judge who logged in."""

from __future__ import annotations

import asyncio
import hmac
import secrets
import time
import unicodedata
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket

from errors import UserError
from monitor.addresses import visitor_key
from monitor.sessions import SessionFile, StoredSession

REFUSED_CODE = 4403  # closes a WebSocket, as 403 ends a request
SESSION_S = 12 * 3600.0
LONGEST_NAME = 60
TRIES_A_MINUTE = 10
FAILURE_DELAY_S = 0.5
_MOST_SESSIONS = 1000
_MOST_ADDRESSES = 1000
_MINUTE_S = 60.0
_INVISIBLE = ("C", "Zl", "Zp")  # control and format characters, line ends


class LoginRefusedError(UserError):
    """A log-in failed; the message is one line for people.

    Attributes:
        status: the HTTP status that fits.
    """

    def __init__(self, words: str, status: int = 403) -> None:
        super().__init__(words)
        self.status = status


@dataclass(frozen=True, slots=True)
class Visitor:
    """Somebody at a browser.

    Attributes:
        name: as given at log-in; "" for those who did not.
        may_judge: may change tries, teams and scenarios.
        may_fly: may take the sticks and command drones.
    """

    name: str
    may_judge: bool
    may_fly: bool


@dataclass(frozen=True, slots=True)
class _Session:
    name: str
    ends_s: float


class Access:
    """Log-ins of judges and what each visitor may do.

    Args:
        password: of the judges; None: each needs a one-time link.
        all_may_fly: nobody but this machine's users can reach the monitor.
        cookie: name of the session's cookie.
        hear_invitation: told the secret of the next one-time link, now and whenever one was used.
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
        self._sessions = self._load()
        self._tries: dict[str, deque[float]] = {}
        self._invitation = ""

    @property
    def wants_password(self) -> bool:
        """Whether judges log in with a password; else with a one-time link."""
        return self._password is not None

    def invite(self) -> None:
        """Make a one-time link, if those are used; the one before is void."""
        if self._password is None:
            self._invitation = secrets.token_urlsafe(32)
            self._hear_invitation(self._invitation)

    def visitor(self, connection: HTTPConnection) -> Visitor:
        """Say who is at the other end of a request or WebSocket."""
        session = self._session(connection.cookies.get(self.cookie, ""))
        if session is None:
            return Visitor("", may_judge=False, may_fly=self._all_may_fly)
        return Visitor(session.name, may_judge=True, may_fly=True)

    def require_judge(self, connection: HTTPConnection) -> Visitor:
        """Return the visitor if they may judge.

        Raises:
            HTTPException: 403; they may not.
        """
        visitor = self.visitor(connection)
        if not visitor.may_judge:
            raise HTTPException(403, "only judges may do this; log in at /login")
        return visitor

    def require_pilot(self, connection: HTTPConnection) -> Visitor:
        """Return the visitor if they may fly.

        Raises:
            HTTPException: 403; they may not.
        """
        visitor = self.visitor(connection)
        if not visitor.may_fly:
            raise HTTPException(403, "flying from another machine needs a log-in; log in at /login")
        return visitor

    async def log_in(self, name: str, secret: str, address: str) -> str:
        """Begin a session. A failure takes its time.

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
        if not self._is_right(secret):
            await asyncio.sleep(FAILURE_DELAY_S)
            if self.wants_password:
                raise LoginRefusedError("This is not the password.")
            raise LoginRefusedError(
                "This link was used before or never valid; the newest one is on the console."
            )
        self._tries.pop(visitor_key(address), None)
        self._forget_old()
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
        """What a session is known by here: useless to whoever reads it, void with another password."""
        key = (self._password or "").encode()
        return hmac.new(key, session_id.encode("utf-8", "replace"), "sha256").hexdigest()

    def _load(self) -> dict[str, _Session]:
        if self._kept is None:
            return {}
        offset_s = self._clock() - self._kept.now_s()
        stored = self._kept.load().items()
        return {
            digest: _Session(each.name, min(each.ends_unix_s + offset_s, self._clock() + SESSION_S))
            for digest, each in stored
        }

    def _save(self) -> None:
        if self._kept is None:
            return
        offset_s = self._kept.now_s() - self._clock()
        items = self._sessions.items()
        self._kept.save(
            {
                digest: StoredSession(name=each.name, ends_unix_s=each.ends_s + offset_s)
                for digest, each in items
            }
        )

    def _is_right(self, secret: str) -> bool:
        expected = self._invitation if self._password is None else self._password
        return bool(expected) and hmac.compare_digest(secret.encode(), expected.encode())

    def _session(self, session_id: str) -> _Session | None:
        digest = self._digest(session_id)
        session = self._sessions.get(digest)
        if session is not None and session.ends_s <= self._clock():
            del self._sessions[digest]
            return None
        return session

    def _forget_old(self) -> None:
        now_s = self._clock()
        for session_id in [key for key, session in self._sessions.items() if session.ends_s <= now_s]:
            del self._sessions[session_id]
        while len(self._sessions) >= _MOST_SESSIONS:
            del self._sessions[next(iter(self._sessions))]

    def _count_try(self, address: str) -> None:
        """Count a try before it is looked at, so that many at once are no way around."""
        now_s = self._clock()
        tries = self._tries.setdefault(visitor_key(address), deque())
        while tries and tries[0] <= now_s - _MINUTE_S:
            tries.popleft()
        if len(tries) >= TRIES_A_MINUTE:
            raise LoginRefusedError("Too many tries; wait a minute.", 429)
        tries.append(now_s)
        while len(self._tries) > _MOST_ADDRESSES:
            del self._tries[next(iter(self._tries))]


async def refuse(websocket: WebSocket, words: str) -> None:
    """Refuse a WebSocket so that its page can say why: accept it and close it with code 4403.

    Args:
        websocket: not accepted yet.
        words: one short line.
    """
    await websocket.accept()
    await websocket.close(REFUSED_CODE, words)


def _clean_name(name: str) -> str:
    name = name.strip()
    if not name:
        raise LoginRefusedError("Who are you? Give a name; it stands beside what you change.", 400)
    if len(name) > LONGEST_NAME:
        raise LoginRefusedError(f"The name has {len(name)} characters; use at most {LONGEST_NAME}.", 400)
    if any(unicodedata.category(letter).startswith(_INVISIBLE) for letter in name):
        raise LoginRefusedError("The name has characters that cannot be seen; leave them out.", 400)
    return name
