"""MJPEG over HTTP, JPEG images as parts of one multipart response: reader and writer, without sockets.

Many cameras send wrong boundaries and lengths, and a stream from a network is not to be trusted:
`MjpegReader` accepts common faults, keeps no more than one part, and reports what it cannot accept.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

MAX_PART_BYTES = 8 * 1024 * 1024
JPEG_START = b"\xff\xd8\xff"
_BOUNDARY = "frame"
STREAM_HEADERS = {
    "Content-Type": f"multipart/x-mixed-replace; boundary={_BOUNDARY}",
    "Cache-Control": "no-store",
    "Connection": "close",
}
STREAM_START = f"--{_BOUNDARY}\r\n".encode()
_MAX_HEAD_BYTES = 16 * 1024
_END_OF_HEAD = re.compile(rb"\r?\n\r?\n")
_STREAM_TYPE = re.compile(
    r"""\s*multipart/.*?boundary\s*=\s*(?:"([^"]{1,200})"|([^\s;"]{1,200}))""", re.IGNORECASE | re.DOTALL
)


class StreamError(ValueError):
    """The stream cannot be read further; the message is one line."""


@dataclass(frozen=True, slots=True)
class MjpegPart:
    """One part of the stream."""

    data: bytes  # its body as received, normally a JPEG
    time_us: int | None  # vehicle time of exposure, the header `X-Time-Us`; None: missing or invalid


def write_part(jpeg: bytes, time_us: int | None) -> bytes:
    """One image of a stream and its vehicle time, with the boundary after it: so a browser shows it at once.

    The response has `STREAM_HEADERS`, and `STREAM_START` before the first part.
    """
    stamp = "" if time_us is None else f"X-Time-Us: {time_us}\r\n"
    head = f"Content-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n{stamp}\r\n"
    return b"".join((head.encode(), jpeg, b"\r\n", STREAM_START))


class MjpegReader:
    """Splits a multipart stream into its parts, by the response's Content-Type.

    Raises:
        StreamError: it is another kind of response, or has no boundary.
    """

    def __init__(self, content_type: str, max_part_bytes: int = MAX_PART_BYTES) -> None:
        found = _STREAM_TYPE.match(content_type)
        if found is None:
            raise StreamError(
                f"not an MJPEG stream: Content-Type is {content_type[:60]!r}, "
                "need multipart/x-mixed-replace with a boundary"
            )
        boundary = str(found[1] or found[2]).removeprefix("--")  # many cameras wrongly include the two dashes
        self._delimiter = b"--" + boundary.encode("utf-8", "replace")
        self._max = max_part_bytes
        self._buffer = bytearray()
        self._searched = 0  # up to here, the buffer has no delimiter
        self._head: tuple[int | None, int | None] | None = None  # length and time of the part being read

    def feed(self, data: bytes) -> list[MjpegPart]:
        """Take bytes and return the parts that are complete with them.

        Raises:
            StreamError: a part or its headers are too large.
        """
        self._buffer += data
        parts: list[MjpegPart] = []
        while True:
            if self._head is None and not self._read_head():
                return parts
            part = self._read_body()
            if part is None:
                return parts
            if part.data:
                parts.append(part)

    def _read_head(self) -> bool:
        """Skip the next delimiter and read its headers; False if they are incomplete."""
        buffer = self._buffer
        at = buffer.find(self._delimiter)
        if at < 0:  # noise between parts is dropped
            del buffer[: max(0, len(buffer) - len(self._delimiter))]
            return False
        del buffer[:at]
        end = _END_OF_HEAD.search(buffer, 0, _MAX_HEAD_BYTES)
        if end is None:
            if len(buffer) > _MAX_HEAD_BYTES:
                raise StreamError(f"the headers of a part exceed {_MAX_HEAD_BYTES} bytes")
            return False
        head = bytes(buffer[: end.start()])
        del buffer[: end.end()]
        length = _number(head, b"content-length")
        if length is not None and length > self._max:
            raise StreamError(f"a part of {length} bytes is refused; the limit is {self._max}")
        self._head, self._searched = (length, _number(head, b"x-time-us")), 0
        return True

    def _read_body(self) -> MjpegPart | None:
        """Return the part whose headers were read; None if it is incomplete."""
        assert self._head is not None
        length, time_us = self._head
        buffer = self._buffer
        if length is None:
            length = buffer.find(self._delimiter, self._searched)
            if length < 0:
                if len(buffer) > self._max:
                    raise StreamError(f"a part of more than {self._max} bytes is refused")
                self._searched = max(0, len(buffer) - len(self._delimiter))
                return None
        elif len(buffer) < length:
            return None
        data = bytes(buffer[:length])
        del buffer[:length]
        self._head = None
        return MjpegPart(data.removesuffix(b"\r\n"), time_us)


def _number(head: bytes, name: bytes) -> int | None:
    """A header's value if it is an integer of up to 18 digits."""
    found = re.search(
        rb"^[ \t]*" + name + rb"[ \t]*:[ \t]*(\d{1,18})[ \t]*\r?$", head, re.IGNORECASE | re.MULTILINE
    )
    return int(found.group(1)) if found else None
