"""MAVLink FTP without the files: payloads with their opcodes and errors, and each client's open files."""

from __future__ import annotations

import errno
from dataclasses import dataclass, field
from struct import Struct

from firmware_py.storage import Path
from framerunner.wire.dialect import mavlink

PAYLOAD_BYTES = 251
DATA_BYTES = 239  # of one payload, after the header
# sequence, session, opcode, size, opcode of the request, burst complete, padding, offset
_HEADER = Struct("<HBBBBBBI")
_MAX_SESSIONS = 4  # open files of one client; PX4 has one a link
_MAX_CLIENTS = 16
_IDLE_US = 10_000_000  # as PX4: an unused session is closed
_TAKEOVER_US = 1_000_000
_TWIN_US = 2_000_000
_LATE_US = 1_000_000

ClientKey = tuple[str, int, int]  # link, system, component


class RefusalError(Exception):
    """A request that gets a NAK with an error, a MAV_FTP_ERR."""

    def __init__(self, error: int) -> None:
        super().__init__(error)
        self.error = error


_ERRORS = {
    errno.ENOENT: mavlink.MAV_FTP_ERR_FILENOTFOUND,
    errno.EEXIST: mavlink.MAV_FTP_ERR_FILEEXISTS,
    errno.EACCES: mavlink.MAV_FTP_ERR_FILEPROTECTED,
    errno.EPERM: mavlink.MAV_FTP_ERR_FILEPROTECTED,
    errno.EROFS: mavlink.MAV_FTP_ERR_FILEPROTECTED,
    errno.ELOOP: mavlink.MAV_FTP_ERR_FILEPROTECTED,
}


def nak_data(error: RefusalError | OSError) -> bytes:
    """A NAK's data; an error of storage without a code in FTP is sent as its errno, as PX4 does it."""
    if isinstance(error, RefusalError):
        return bytes((error.error,))
    number = error.errno or errno.EIO
    if number in _ERRORS:
        return bytes((_ERRORS[number],))
    return bytes((mavlink.MAV_FTP_ERR_FAILERRNO, number & 0xFF))


@dataclass(frozen=True, slots=True)
class FileRequest:
    """A client's request."""

    sequence: int  # the answer has the next one
    session: int  # number of one of the client's open files
    opcode: int  # may be an unknown one
    size: int  # of the data, as the client states it; at most 239 when it is valid
    offset: int  # in a file or listing, or a length
    data: bytes  # 239 bytes at most
    raw: bytes  # header and data; the same request has the same

    @property
    def strings(self) -> list[bytes]:
        """The data as zero-terminated strings; the last may lack its zero."""
        pieces = self.data.split(b"\0")
        return pieces[:-1] if pieces[-1] == b"" and len(pieces) > 1 else pieces

    @property
    def path(self) -> bytes:
        """The data up to the first zero."""
        return self.data.split(b"\0", 1)[0]


def parse(payload: bytes) -> FileRequest:
    """A request from the 251 bytes of a payload."""
    sequence, session, opcode, size, _, _, _, offset = _HEADER.unpack_from(payload)
    data = payload[_HEADER.size : _HEADER.size + min(size, DATA_BYTES)]
    return FileRequest(sequence, session, opcode, size, offset, data, payload[: _HEADER.size] + data)


@dataclass(frozen=True, slots=True)
class FileAnswer:
    """The answer to a request."""

    data: bytes = b""  # at most 239 bytes
    ack: bool = True  # else a NAK, with `nak_data`
    session: int = 0  # of the request, or just opened
    offset: int = 0  # of the data; in most answers the request's
    burst_complete: bool = False  # the last packet of a burst that did not reach the file's end

    def payload(self, sequence: int, opcode: int) -> bytes:
        """The 251 bytes of a payload that answers `opcode`."""
        kind = mavlink.MAV_FTP_OPCODE_ACK if self.ack else mavlink.MAV_FTP_OPCODE_NAK
        size = len(self.data)
        header = _HEADER.pack(
            sequence & 0xFFFF, self.session, kind, size, opcode, self.burst_complete, 0, self.offset
        )
        return (header + self.data).ljust(PAYLOAD_BYTES, b"\0")


@dataclass(slots=True)
class Burst:
    """A burst being sent; sequence and offset are the next packet's."""

    request: bytes  # `FileRequest.raw`
    sequence: int
    offset: int
    sent_bytes: int = 0


@dataclass(slots=True)
class FileSession:
    """An open file."""

    path: Path
    size: int  # when it was opened
    writable: bool  # opened for writing, else for reading
    opening: bytes  # `FileRequest.raw` of the request that opened it
    opened_us: int
    used_us: int
    burst: Burst | None = None
    closing: bool = False  # closed by a request that may be an old, late one: it can be read, or replaced


@dataclass(slots=True)
class Client:
    """One client."""

    key: ClientKey
    sessions: dict[int, FileSession] = field(default_factory=dict)  # by number; numbers are the client's own
    used_us: int = 0  # vehicle time of the last request
    last_request: bytes = b""  # `FileRequest.raw` of the last request if it changed something, else empty
    last_reply: bytes = b""  # payload of the answer to it
    last_closing: bytes = b""  # `FileRequest.raw` of the last request that closed a session
    closed_us: int = 0

    def session(self, number: int, time_us: int) -> FileSession:
        """An open file, which is now used.

        Raises:
            RefusalError: INVALIDSESSION.
        """
        session = self.sessions.get(number)
        if session is None:
            raise RefusalError(mavlink.MAV_FTP_ERR_INVALIDSESSION)
        session.used_us = time_us
        return session

    def twin(self, number: int, opening: bytes, time_us: int) -> FileSession | None:
        """A session that the same request opened a moment ago: the request was received twice."""
        session = self.sessions.get(number)
        if session is None or session.closing or session.opening != opening:
            return None
        return session if time_us - session.opened_us <= _TWIN_US else None

    def close(self, numbers: list[int], request: bytes, time_us: int) -> None:
        """Close sessions.

        The same request a moment later may be a late copy of the first, while the client has opened the next
        file with that number; or it is meant, as MAVSDK counts from 0 for each file. So it only marks the
        session, which can still be read or replaced.
        """
        late = request == self.last_closing and time_us - self.closed_us <= _LATE_US
        self.last_closing, self.closed_us = request, time_us
        for number in numbers:
            if late:
                self.sessions[number].closing = True
            else:
                del self.sessions[number]

    def free(self, number: int, time_us: int) -> None:
        """Make a session number free.

        MAVSDK uses number 0 whatever a vehicle answers, pymavlink counts up: so the requested number is the
        one that is opened. A session that a client has left open is taken over once it is unused.

        Raises:
            RefusalError: NOSESSIONSAVAILABLE.
        """
        session = self.sessions.get(number)
        if session is not None:
            if not session.closing and time_us - session.used_us < _TAKEOVER_US:
                raise RefusalError(mavlink.MAV_FTP_ERR_NOSESSIONSAVAILABLE)
            del self.sessions[number]
        if len(self.sessions) >= _MAX_SESSIONS:
            raise RefusalError(mavlink.MAV_FTP_ERR_NOSESSIONSAVAILABLE)


class Clients:
    """All clients, in a bounded number."""

    def __init__(self) -> None:
        self._clients: dict[ClientKey, Client] = {}

    def client(self, key: ClientKey, time_us: int) -> Client:
        """The client with that key, known or new; a new one replaces the one silent for longest."""
        client = self._clients.get(key)
        if client is None:
            if len(self._clients) >= _MAX_CLIENTS:
                del self._clients[min(self._clients.values(), key=lambda each: each.used_us).key]
            client = self._clients[key] = Client(key)
        client.used_us = time_us
        return client

    def bursting(self) -> list[tuple[Client, int, FileSession]]:
        """Clients and their sessions whose burst is being sent."""
        return [
            (client, number, session)
            for client in self._clients.values()
            for number, session in client.sessions.items()
            if session.burst is not None
        ]

    def close_idle(self, time_us: int) -> None:
        """Forget unused sessions and clients."""
        for key, client in list(self._clients.items()):
            for number, session in list(client.sessions.items()):
                if time_us - session.used_us > _IDLE_US:
                    del client.sessions[number]
            if not client.sessions and time_us - client.used_us > _IDLE_US:
                del self._clients[key]

    def __bool__(self) -> bool:
        return bool(self._clients)
