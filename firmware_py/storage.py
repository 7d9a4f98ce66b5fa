"""Where a vehicle keeps its files: what the services need of it, and how paths are told.

Files are kept elsewhere (`sitl/storage.py` has a folder and a memory). A path is a tuple of names that was
checked once, so no keeper of files ever parses a text that came over a link.
"""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Protocol

Path = tuple[str, ...]

_LONGEST_NAME = 120  # bytes; a listing must hold one name in 239 bytes
_DEEPEST = 8
_ALIAS: Path = ("fs", "microsd")  # where PX4's boards have what its simulation has at the root
_FORBIDDEN = frozenset(chr(code) for code in (*range(32), 127)) | {"\\", "/"}


@dataclass(frozen=True, slots=True)
class Entry:
    """A file or a folder.

    Attributes:
        name: the last name of its path.
        size: in bytes; 0 for a folder.
        is_folder: a folder, else a file.
        modified_unix_s: seconds since 1970 of the last change; 0: not known.
    """

    name: str
    size: int = 0
    is_folder: bool = False
    modified_unix_s: int = 0


class Storage(Protocol):
    """Keeps files. The empty path is its root.

    Every method may raise OSError with an `errno`: ENOENT, EEXIST, EISDIR, ENOTDIR, ENOTEMPTY, EACCES, and
    ENOSPC or EFBIG where a limit is reached. Nothing has changed then.
    """

    def entry(self, path: Path) -> Entry:
        """What is there."""
        ...

    def entries(self, path: Path) -> list[Entry]:
        """What a folder holds, by name."""
        ...

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file; fewer at its end."""
        ...

    def write(self, path: Path, offset: int, data: bytes) -> None:
        """Write into a file that is there; a gap is filled with zeros."""
        ...

    def create(self, path: Path) -> None:
        """Make an empty file, or empty the one that is there."""
        ...

    def truncate(self, path: Path, size: int) -> None:
        """Make a file that long, with zeros where it grows."""
        ...

    def remove(self, path: Path) -> None:
        """Remove a file."""
        ...

    def make_folder(self, path: Path) -> None:
        """Make a folder in one that is there."""
        ...

    def remove_folder(self, path: Path) -> None:
        """Remove an empty folder."""
        ...

    def rename(self, old: Path, new: Path) -> None:
        """Give a file or folder another path; a file at the new path is replaced."""
        ...


def refuse(code: int, path: Path) -> OSError:
    """The error to raise for a path."""
    return OSError(code, errno.errorcode.get(code, str(code)), "/".join(path))


def parse_path(text: bytes) -> Path:
    """The names of a path as it comes over a link; it begins at the root, with a slash or without.

    Args:
        text: bytes without the final zero.

    Raises:
        OSError: EACCES for a path that could lead out of the root or cannot be told in a listing: `..`,
            control characters, backslashes, bytes that are no UTF-8, a name or path too long.
    """
    try:
        names = text.decode().split("/")
    except UnicodeDecodeError:
        raise refuse(errno.EACCES, ()) from None
    path = tuple(name for name in names if name not in ("", "."))
    if len(path) > _DEEPEST or not all(sound_name(name) for name in path):
        raise refuse(errno.EACCES, ())
    return path[2:] if path[:2] == _ALIAS else path


def sound_name(name: str) -> bool:
    """Whether a name can be kept and listed."""
    try:
        length = len(name.encode())
    except UnicodeEncodeError:  # bytes on a disk that are no UTF-8
        return False
    return 0 < length <= _LONGEST_NAME and name != ".." and _FORBIDDEN.isdisjoint(name)
