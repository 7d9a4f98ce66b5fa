"""MAVLink FTP without the files: payloads with their opcodes and errors, and who has which files open."""

from __future__ import annotations

import errno
from dataclasses import dataclass, field
from enum import IntEnum
from struct import Struct

from firmware_py.storage import Path

PAYLOAD_BYTES = 251
DATA_BYTES = 239  # of one payload, after the header
# sequence, session, opcode, size, opcode asked for, burst complete, padding, offset
_HEADER = Struct("<HBBBBBBI")
_SESSIONS = 4  # open files of one client; PX4 has one a link
_CLIENTS = 16
_IDLE_US = 10_000_000  # PX4 closes a session unused so long
_TAKEOVER_US = 1_000_000
_TWIN_US = 2_000_000
_LATE_US = 1_000_000

ClientKey = tuple[str, int, int]  # link, system, component


class Opcode(IntEnum):
    """What a client asks for; ACK and NAK are answers."""

    NONE = 0
    TERMINATE_SESSION = 1
    RESET_SESSIONS = 2
    LIST_DIRECTORY = 3
    OPEN_FILE_RO = 4
    READ_FILE = 5
    CREATE_FILE = 6
    WRITE_FILE = 7
    REMOVE_FILE = 8
    CREATE_DIRECTORY = 9
    REMOVE_DIRECTORY = 10
    OPEN_FILE_WO = 11
    TRUNCATE_FILE = 12
    RENAME = 13
    CALC_FILE_CRC32 = 14
    BURST_READ_FILE = 15
    ACK = 128
    NAK = 129


class FtpError(IntEnum):
    """Why not: the first byte of a NAK's data."""

    FAIL = 1
    FAIL_ERRNO = 2
    INVALID_DATA_SIZE = 3
    INVALID_SESSION = 4
    NO_SESSIONS_AVAILABLE = 5
    EOF = 6
    UNKNOWN_COMMAND = 7
    FILE_EXISTS = 8
    FILE_PROTECTED = 9
    FILE_NOT_FOUND = 10


class RefusalError(Exception):
    """A request that gets a NAK.

    Attributes:
        error: why.
    """

    def __init__(self, error: FtpError) -> None:
        super().__init__(error.name)
        self.error = error


_ERRORS = {
    errno.ENOENT: FtpError.FILE_NOT_FOUND,
    errno.EEXIST: FtpError.FILE_EXISTS,
    errno.EACCES: FtpError.FILE_PROTECTED,
    errno.EPERM: FtpError.FILE_PROTECTED,
    errno.EROFS: FtpError.FILE_PROTECTED,
    errno.ELOOP: FtpError.FILE_PROTECTED,
}


def reason(error: RefusalError | OSError) -> bytes:
    """A NAK's data; an error of storage without a code of its own goes with its number, as PX4 does it."""
    if isinstance(error, RefusalError):
        return bytes((error.error,))
    number = error.errno or errno.EIO
    if number in _ERRORS:
        return bytes((_ERRORS[number],))
    return bytes((FtpError.FAIL_ERRNO, number & 0xFF))


@dataclass(frozen=True, slots=True)
class Request:
    """A client's request.

    Attributes:
        sequence: the answer carries the next one.
        session: which of the client's open files.
        opcode: what for; it need not be a known one.
        size: of the data, as the client says; at most 239 when it is sound.
        offset: into a file or listing, or a length.
        data: 239 bytes at most, `size` of them meant.
        raw: header and data, to know it again.
    """

    sequence: int
    session: int
    opcode: int
    size: int
    offset: int
    data: bytes
    raw: bytes

    @property
    def strings(self) -> list[bytes]:
        """The data as zero-terminated strings; the last may lack its zero."""
        pieces = self.data.split(b"\0")
        return pieces[:-1] if pieces[-1] == b"" and len(pieces) > 1 else pieces

    @property
    def path(self) -> bytes:
        """The data up to the first zero."""
        return self.data.split(b"\0", 1)[0]


def parse(payload: bytes) -> Request:
    """A request from the 251 bytes of a payload."""
    sequence, session, opcode, size, _, _, _, offset = _HEADER.unpack_from(payload)
    data = payload[_HEADER.size : _HEADER.size + min(size, DATA_BYTES)]
    return Request(sequence, session, opcode, size, offset, data, payload[: _HEADER.size] + data)


@dataclass(frozen=True, slots=True)
class Answer:
    """What is answered to a request.

    Attributes:
        data: at most 239 bytes.
        ack: else a NAK, and the data says why.
        session: the one meant or just opened.
        offset: of the data; in most answers the request's.
        burst_complete: the last packet of a burst, and the file goes on.
    """

    data: bytes = b""
    ack: bool = True
    session: int = 0
    offset: int = 0
    burst_complete: bool = False

    def payload(self, sequence: int, opcode: int) -> bytes:
        """The 251 bytes of a payload that answers `opcode`."""
        kind = Opcode.ACK if self.ack else Opcode.NAK
        header = _HEADER.pack(
            sequence & 0xFFFF,
            self.session,
            kind,
            len(self.data),
            opcode,
            self.burst_complete,
            0,
            self.offset,
        )
        return (header + self.data).ljust(PAYLOAD_BYTES, b"\0")


@dataclass(slots=True)
class Burst:
    """A burst under way.

    Attributes:
        request: header and data of the request that started it.
        sequence: of the next packet.
        offset: of the next packet.
        sent: bytes sent since the request.
    """

    request: bytes
    sequence: int
    offset: int
    sent: int = 0


@dataclass(slots=True)
class Session:
    """An open file.

    Attributes:
        path: of the file.
        size: when it was opened.
        writable: opened for writing, else for reading.
        opening: header and data of the request that opened it.
        opened_us: vehicle time of that.
        used_us: vehicle time of the last use.
        burst: under way, if any.
        closing: asked to be closed, perhaps by an old request that came late: it can be read, or replaced.
    """

    path: Path
    size: int
    writable: bool
    opening: bytes
    opened_us: int
    used_us: int
    burst: Burst | None = None
    closing: bool = False


@dataclass(slots=True)
class Client:
    """One client.

    Attributes:
        key: link, system and component it speaks from.
        sessions: open files by number; numbers are the client's own.
        used_us: vehicle time of its last request.
        last_request: header and data of the last request if it changed something, else empty.
        last_reply: payload of the answer to it.
        last_closing: header and data of the last request that closed a session.
        closed_us: vehicle time of that.
    """

    key: ClientKey
    sessions: dict[int, Session] = field(default_factory=dict)
    used_us: int = 0
    last_request: bytes = b""
    last_reply: bytes = b""
    last_closing: bytes = b""
    closed_us: int = 0

    def session(self, number: int, time_us: int) -> Session:
        """An open file that is now used.

        Raises:
            RefusalError: INVALID_SESSION.
        """
        session = self.sessions.get(number)
        if session is None:
            raise RefusalError(FtpError.INVALID_SESSION)
        session.used_us = time_us
        return session

    def twin(self, number: int, opening: bytes, time_us: int) -> Session | None:
        """A session that the very same request opened a moment ago: the request came twice."""
        session = self.sessions.get(number)
        if session is None or session.closing or session.opening != opening:
            return None
        return session if time_us - session.opened_us <= _TWIN_US else None

    def close(self, numbers: list[int], request: bytes, time_us: int) -> None:
        """Close sessions.

        The same request a moment later may be the first one that took a detour, while the client has opened
        the next file by that number; or MAVSDK, which counts from 0 for each file, and means it. So it leaves
        the session to be read or replaced.
        """
        late = request == self.last_closing and time_us - self.closed_us <= _LATE_US
        self.last_closing, self.closed_us = request, time_us
        for number in numbers:
            if late:
                self.sessions[number].closing = True
            else:
                del self.sessions[number]

    def make_room(self, number: int, time_us: int) -> None:
        """Have a session number free.

        MAVSDK uses number 0 whatever a vehicle answers, pymavlink counts up: so the number asked for is the
        number opened. One that a client has left open is taken over once it rests.

        Raises:
            RefusalError: NO_SESSIONS_AVAILABLE.
        """
        session = self.sessions.get(number)
        if session is not None:
            if not session.closing and time_us - session.used_us < _TAKEOVER_US:
                raise RefusalError(FtpError.NO_SESSIONS_AVAILABLE)
            del self.sessions[number]
        if len(self.sessions) >= _SESSIONS:
            raise RefusalError(FtpError.NO_SESSIONS_AVAILABLE)


class Clients:
    """All clients, few enough whatever comes over the links."""

    def __init__(self) -> None:
        self._clients: dict[ClientKey, Client] = {}

    def client(self, key: ClientKey, time_us: int) -> Client:
        """The client with that key, known or new; the one longest silent makes room."""
        client = self._clients.get(key)
        if client is None:
            if len(self._clients) >= _CLIENTS:
                del self._clients[min(self._clients.values(), key=lambda each: each.used_us).key]
            client = self._clients[key] = Client(key)
        client.used_us = time_us
        return client

    def bursting(self) -> list[tuple[Client, int, Session]]:
        """Clients and their sessions with a burst under way."""
        return [
            (client, number, session)
            for client in self._clients.values()
            for number, session in client.sessions.items()
            if session.burst is not None
        ]

    def close_idle(self, time_us: int) -> None:
        """Forget sessions and clients that rest."""
        for key, client in list(self._clients.items()):
            client.sessions = {
                number: session
                for number, session in client.sessions.items()
                if time_us - session.used_us <= _IDLE_US
            }
            if not client.sessions and time_us - client.used_us > _IDLE_US:
                del self._clients[key]

    def __bool__(self) -> bool:
        return bool(self._clients)
