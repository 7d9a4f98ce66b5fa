"""Cuts an MJPEG stream into JPEG images, trusting nothing in it. Without sockets."""

from __future__ import annotations

import re
from dataclasses import dataclass

MAX_IMAGE_BYTES = 4 << 20
_MAX_HEAD_BYTES = 8 << 10
_END_OF_HEAD = re.compile(rb"\r?\n\r?\n")
_BOUNDARY = re.compile(r'boundary\s*=\s*(?:"([^"]{1,200})"|([^\s;"]{1,200}))', re.IGNORECASE)
_LENGTH = re.compile(rb"^content-length[ \t]*:[ \t]*(\d{1,9})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)
_TIME = re.compile(rb"^x-time-us[ \t]*:[ \t]*(\d{1,18})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)
_JPEG_START = b"\xff\xd8\xff"


class StreamBrokenError(ValueError):
    """The stream cannot be read on; the message is one line."""


@dataclass(frozen=True, slots=True)
class Shot:
    """An image as it came.

    Attributes:
        jpeg: its bytes.
        time_us: vehicle time of its exposure, microseconds; None if the drone does not tell.
    """

    jpeg: bytes
    time_us: int | None


class ShotCutter:
    """Takes bytes as they come and gives whole images.

    Args:
        content_type: of the stream; says what separates images.

    Raises:
        StreamBrokenError: it is no stream of images.
    """

    def __init__(self, content_type: str) -> None:
        found = _BOUNDARY.search(content_type)
        if not content_type.lower().lstrip().startswith("multipart/") or found is None:
            raise StreamBrokenError("it is no MJPEG stream")
        # Many cameras wrongly count the two dashes to the boundary.
        self._mark = b"--" + (found[1] or found[2]).removeprefix("--").encode("utf-8", "replace")
        self._buffer = bytearray()
        self._searched = 0  # the buffer has no mark before
        self._head: tuple[int | None, int | None] | None = None  # length and time of the image being read

    def feed(self, data: bytes) -> list[Shot]:
        """Take bytes; return the images that are whole with them. Parts that are no JPEG are dropped.

        Raises:
            StreamBrokenError: an image or its headers are too large.
        """
        self._buffer += data
        shots: list[Shot] = []
        while self._read_head():
            jpeg = self._read_body()
            if jpeg is None:
                break
            assert self._head is not None
            if jpeg.startswith(_JPEG_START):
                shots.append(Shot(jpeg, self._head[1]))
            self._head, self._searched = None, 0
        return shots

    def _read_head(self) -> bool:
        """Go past the next mark and the headers behind it; False if they are not all there yet."""
        if self._head is not None:
            return True
        buffer = self._buffer
        at = buffer.find(self._mark)
        if at < 0:
            del buffer[: max(0, len(buffer) - len(self._mark))]
            return False
        del buffer[:at]
        end = _END_OF_HEAD.search(buffer, 0, _MAX_HEAD_BYTES)
        if end is None:
            if len(buffer) > _MAX_HEAD_BYTES:
                raise StreamBrokenError(f"the headers of an image exceed {_MAX_HEAD_BYTES} bytes")
            return False
        head = bytes(buffer[: end.start()])
        del buffer[: end.end()]
        length = _number(_LENGTH, head)
        if length is not None and length > MAX_IMAGE_BYTES:
            raise StreamBrokenError(f"an image of {length} bytes exceeds {MAX_IMAGE_BYTES}")
        self._head = length, _number(_TIME, head)
        return True

    def _read_body(self) -> bytes | None:
        assert self._head is not None
        buffer, length = self._buffer, self._head[0]
        if length is None:
            length = buffer.find(self._mark, self._searched)
            if length < 0:
                if len(buffer) > MAX_IMAGE_BYTES:
                    raise StreamBrokenError(f"an image exceeds {MAX_IMAGE_BYTES} bytes")
                self._searched = max(0, len(buffer) - len(self._mark))
                return None
        elif len(buffer) < length:
            return None
        body = bytes(buffer[:length])
        del buffer[:length]
        return body


def _number(pattern: re.Pattern[bytes], head: bytes) -> int | None:
    found = pattern.search(head)
    return int(found[1]) if found else None
