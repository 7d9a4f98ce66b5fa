"""MAVLink FTP on the wire: the payload of FILE_TRANSFER_PROTOCOL, its opcodes and errors."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct

PAYLOAD_BYTES = 251
DATA_BYTES = 239  # of one payload, after the header
# sequence, session, opcode, size, opcode asked for, burst complete, padding, offset
_HEADER = Struct("<HBBBBBBI")


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
