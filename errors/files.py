"""Files of users: one reader of texts that people write, and one writer that replaces a file or leaves it.

Windows' editors begin a text with a byte order mark, or save it as UTF-16; lines end as the system has it. So
no other module decodes such a text; `tests/test_house.py` looks for it.
"""

from __future__ import annotations

import contextlib
import os
import stat
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path
from typing import Literal

from errors import UserError

MAX_TEXT_BYTES = 1_000_000  # a page or two; whoever reads more says so

TextFault = Literal["missing", "unreadable", "too_large", "utf16", "not_utf8"]


class TextError(UserError):
    """A text cannot be read; the message is one line for people, without the file's name.

    Attributes:
        fault: what is wrong.
        reason: the system's, of a file that cannot be read.
        line: the first that is not UTF-8, from 1; 0: it has nothing to do with a line.
    """

    def __init__(self, text: str, fault: TextFault, reason: str = "", line: int = 0) -> None:
        super().__init__(text)
        self.fault, self.reason, self.line = fault, reason, line


def read_text(path: str | os.PathLike[str], max_bytes: int = MAX_TEXT_BYTES) -> str:
    """The text of a file, see `decode_text`.

    Raises:
        TextError: it cannot be read, is larger, or is not UTF-8.
    """
    return decode_text(read_bytes(path, max_bytes))


def read_bytes(path: str | os.PathLike[str], max_bytes: int = MAX_TEXT_BYTES) -> bytes:
    """The content of a file, which may grow or have no end, such as a device.

    Raises:
        TextError: it cannot be read or is larger.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(max_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        fault: TextFault = "missing" if isinstance(error, FileNotFoundError) else "unreadable"
        raise TextError(f"cannot be read ({reason})", fault, reason) from None
    if len(data) > max_bytes:
        raise TextError(f"is larger than {max_bytes / 1e6:g} MB", "too_large")
    return data


def decode_text(data: bytes) -> str:
    """A text in UTF-8, without its byte order mark; its lines end with a line feed.

    Raises:
        TextError: it is UTF-16, or not UTF-8.
    """
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) or b"\0" in data:
        raise TextError("is UTF-16 text, or no text; save it as UTF-8", "utf16")
    try:
        text = data.removeprefix(BOM_UTF8).decode("utf-8")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise TextError(f"is not UTF-8 text (line {line}); save it as UTF-8", "not_utf8", "", line) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def replace_file(path: str | os.PathLike[str], content: str | bytes, new_mode: int = 0o666) -> None:
    """Write a file completely or not at all: nobody reads half of it, and a failure leaves the old one.

    A link stays one, and the file keeps its permissions.

    Args:
        path: of the file.
        content: a text is written as UTF-8.
        new_mode: permissions of a new file; the user's mask takes some away.

    Raises:
        OSError: it cannot be written, or is there and is no regular file.
    """
    file = Path(os.path.realpath(path))
    part = file.with_name(f".{file.name}.part")
    mode = file.stat().st_mode if file.exists() else None
    if mode is not None and not stat.S_ISREG(mode):
        raise OSError(0, "not a regular file")
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW
        with open(os.open(part, flags, new_mode), "wb") as target:
            target.write(content.encode() if isinstance(content, str) else content)
            target.flush()
            if mode is not None:
                os.fchmod(target.fileno(), stat.S_IMODE(mode))
            os.fsync(target.fileno())
        part.replace(file)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise
