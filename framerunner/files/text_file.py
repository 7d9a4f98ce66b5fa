"""Files of users: one reader of texts that people write, and one writer that replaces a file or leaves it.

Windows' editors begin a text with a byte order mark, or save it as UTF-16; lines end as the system has it. So
no other module decodes such a text; `tests/test_house.py` looks for it. What others put into a folder that a
server shows neither stops the server nor leads it out: pipes, devices and links are refused.
"""

from __future__ import annotations

import contextlib
import os
import stat
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from errno import EINVAL, ELOOP, ENOSPC, EPERM
from pathlib import Path
from secrets import token_hex
from typing import Literal

from framerunner.errors import UserError

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
    part = file.with_name(f".{file.name}.{token_hex(4)}.part")  # others may be writing it, too
    mode = file.stat().st_mode if file.exists() else None
    if mode is not None and not stat.S_ISREG(mode):
        raise OSError(0, "not a regular file")
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
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


def make_file(path: Path, text: str) -> None:
    """Write a new file, as UTF-8, completely or not at all.

    Raises:
        FileExistsError: there is something already, which is left as it is.
        OSError: it cannot be written.
    """
    with path.open("xb") as file:
        try:
            file.write(text.encode())
            file.flush()
        except OSError:
            with contextlib.suppress(OSError):
                path.unlink()  # of a part, which would be taken for the whole
            raise


def resolved_in_folder(path: Path) -> Path:
    """Where a file of a folder lies, links followed; it need not exist.

    Raises:
        OSError: it leads out of the folder, or is no regular file, such as a pipe or a device.
    """
    real = Path(os.path.realpath(path))
    if not real.is_relative_to(os.path.realpath(path.parent)):
        raise OSError(EPERM, "it is a link that leads out of this folder")
    if real.is_symlink():
        raise OSError(ELOOP, "it is a link to itself")
    if real.exists() and not real.is_file():
        raise OSError(EINVAL, "it is no regular file")
    return real


def read_in_folder(path: Path, max_bytes: int) -> bytes:
    """The first bytes of a file of a folder, one more than `max_bytes` if it has more; it never waits.

    Raises:
        OSError: see `resolved_in_folder`, or it cannot be read.
    """
    real = resolved_in_folder(path)
    # It may have become a pipe meanwhile, which would wait for a writer.
    handle = os.open(real, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(EINVAL, "it is no regular file")
        return file.read(max_bytes + 1)


def append_in_folder(path: Path, data: bytes) -> None:
    """Add a line to a file of a folder with one call; it is made, for its owner only, if there is none.

    After a line that a full disk took in part, it begins a new one.

    Raises:
        OSError: see `resolved_in_folder`, or it cannot be written as a whole.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC
    handle = os.open(resolved_in_folder(path), flags, 0o600)
    try:
        size = os.fstat(handle).st_size
        if size and os.pread(handle, 1, size - 1) != b"\n":
            data = b"\n" + data
        if os.write(handle, data) < len(data):
            raise OSError(ENOSPC, os.strerror(ENOSPC))
    finally:
        os.close(handle)
