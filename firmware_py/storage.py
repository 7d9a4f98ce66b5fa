"""The interface to a vehicle's file storage, and the paths in it.

`sitl/storage.py` implements it in memory and in a folder. A path is a tuple of names
that was checked once, so no implementation parses text from a link.
"""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Protocol

Path = tuple[str, ...]

_MAX_NAME = 120  # bytes; a listing must hold one name in 239 bytes
LOG_SUFFIX = ".ulg"  # of flight logs; what else is in their folder is the user's
_MAX_DEPTH = 8
_ALIAS: Path = ("fs", "microsd")  # the root on PX4's boards
_FORBIDDEN = frozenset(chr(code) for code in (*range(32), 127)) | {"\\", "/"}


@dataclass(frozen=True, slots=True)
class StorageEntry:
    """A file or a folder.

    Attributes:
        name: the last name of its path.
        size: in bytes; 0 for a folder.
        is_folder: a folder, else a file.
        modified_unix_s: last change in seconds since 1970; 0: not known.
    """

    name: str
    size: int = 0
    is_folder: bool = False
    modified_unix_s: int = 0


class Storage(Protocol):
    """File storage. The empty path is its root.

    Every method may raise OSError with an `errno`: ENOENT, EEXIST, EISDIR, ENOTDIR, ENOTEMPTY, EACCES, and
    ENOSPC or EFBIG where a limit is reached. Nothing is changed then.
    """

    def entry(self, path: Path) -> StorageEntry:
        """The file or folder at a path."""

    def entries(self, path: Path) -> list[StorageEntry]:
        """The contents of a folder, sorted by name."""

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file; fewer at its end."""

    def write(self, path: Path, offset: int, data: bytes) -> None:
        """Write into an existing file; a gap is filled with zeros."""

    def create(self, path: Path) -> None:
        """Make an empty file, or empty an existing one."""

    def truncate(self, path: Path, size: int) -> None:
        """Set the size of a file; it grows by zeros."""

    def remove(self, path: Path) -> None:
        """Remove a file."""

    def make_folder(self, path: Path) -> None:
        """Make a folder in an existing one."""

    def remove_folder(self, path: Path) -> None:
        """Remove an empty folder."""

    def rename(self, old: Path, new: Path) -> None:
        """Move a file or folder; a file at the new path is replaced."""


def refuse(code: int, path: Path) -> OSError:
    """The error to raise for a path."""
    return OSError(code, errno.errorcode.get(code, str(code)), "/".join(path))


def parse_path(text: bytes) -> Path:
    """The path of a text from a link; it begins at the root, with or without a slash.

    Args:
        text: bytes without the final zero.

    Raises:
        OSError: EACCES for a path that could lead out of the root or cannot be shown in a listing: `..`,
            control characters, backslashes, bytes that are not UTF-8, a name or path too long.
    """
    try:
        names = text.decode().split("/")
    except UnicodeDecodeError:
        raise refuse(errno.EACCES, ()) from None
    path = tuple(name for name in names if name not in ("", "."))
    if len(path) > _MAX_DEPTH or not all(sound_name(name) for name in path):
        raise refuse(errno.EACCES, ())
    return path[2:] if path[:2] == _ALIAS else path


def sound_name(name: str) -> bool:
    """Whether a name can be stored and listed."""
    try:
        length = len(name.encode())
    except UnicodeEncodeError:  # bytes on a disk that are not UTF-8
        return False
    return 0 < length <= _MAX_NAME and name != ".." and _FORBIDDEN.isdisjoint(name)
