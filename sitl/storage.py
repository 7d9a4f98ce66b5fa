"""A vehicle's files in memory, so that a simulation leaves nothing behind; and the limits of all storage.

Limits keep whoever is on a link from filling the machine.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Callable
from dataclasses import dataclass

from firmware_py.storage import Entry, Path, refuse

MEBIBYTE = 1 << 20


@dataclass(frozen=True, slots=True)
class StorageLimits:
    """How much is kept.

    Attributes:
        files: files and folders together.
        file_bytes: of one file.
        total_bytes: of all files.
    """

    files: int = 1000
    file_bytes: int = 64 * MEBIBYTE
    total_bytes: int = 256 * MEBIBYTE


class Usage:
    """Counts what is kept and refuses what would be too much.

    Attributes:
        files: files and folders together.
        bytes: of all files.
    """

    def __init__(self, limits: StorageLimits) -> None:
        self._limits = limits
        self.files = 0
        self.bytes = 0

    @property
    def space(self) -> tuple[int, int]:
        """Bytes kept, and bytes that can be kept."""
        return self.bytes, self._limits.total_bytes

    def one_more(self, path: Path) -> None:
        """Refuse a file or folder beyond the limit."""
        if self.files >= self._limits.files:
            raise refuse(errno.ENOSPC, path)

    def resize(self, path: Path, before: int, after: int) -> None:
        """Refuse a file's new size if it or the sum goes beyond the limit."""
        if after > max(before, self._limits.file_bytes):
            raise refuse(errno.EFBIG, path)
        if after > before and self.bytes + after - before > self._limits.total_bytes:
            raise refuse(errno.ENOSPC, path)


@dataclass(slots=True)
class _File:
    data: bytearray
    modified_unix_s: int


class MemoryStorage:
    """Files in memory, gone with the process.

    Args:
        limits: how much.
        now: seconds since 1970.
    """

    def __init__(self, limits: StorageLimits | None = None, now: Callable[[], float] = time.time) -> None:
        self._usage = Usage(limits or StorageLimits(total_bytes=128 * MEBIBYTE))
        self._now = now
        self._files: dict[Path, _File] = {}
        self._folders: dict[Path, int] = {(): 0}  # with their time of birth

    def space(self) -> tuple[int, int]:
        """Bytes kept, and bytes that can be kept."""
        return self._usage.space

    def entry(self, path: Path) -> Entry:
        """What is there."""
        if path in self._folders:
            return Entry(path[-1] if path else "", 0, True, self._folders[path])
        file = self._file(path)
        return Entry(path[-1], len(file.data), False, file.modified_unix_s)

    def entries(self, path: Path) -> list[Entry]:
        """What a folder holds, by name."""
        self._need_folder(path)
        depth = len(path) + 1
        inside = (each for each in (*self._files, *self._folders) if len(each) == depth and each[:-1] == path)
        return [self.entry(each) for each in sorted(inside)]

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file."""
        return bytes(self._file(path).data[offset : offset + count])

    def write(self, path: Path, offset: int, data: bytes) -> None:
        """Write into a file that is there."""
        file = self._file(path)
        if not data:
            return
        if offset + len(data) > len(file.data):
            self._resize(path, file, offset + len(data))
        file.data[offset : offset + len(data)] = data
        file.modified_unix_s = int(self._now())

    def create(self, path: Path) -> None:
        """Make an empty file, or empty the one that is there."""
        if path in self._folders:
            raise refuse(errno.EISDIR, path)
        if path in self._files:
            self.truncate(path, 0)
            return
        self._need_folder(path[:-1])
        self._usage.one_more(path)
        self._usage.files += 1
        self._files[path] = _File(bytearray(), int(self._now()))

    def truncate(self, path: Path, size: int) -> None:
        """Make a file that long."""
        file = self._file(path)
        self._resize(path, file, size)
        file.modified_unix_s = int(self._now())

    def remove(self, path: Path) -> None:
        """Remove a file."""
        file = self._file(path)
        self._usage.files -= 1
        self._usage.bytes -= len(file.data)
        del self._files[path]

    def make_folder(self, path: Path) -> None:
        """Make a folder."""
        if path in self._folders or path in self._files:
            raise refuse(errno.EEXIST, path)
        self._need_folder(path[:-1])
        self._usage.one_more(path)
        self._usage.files += 1
        self._folders[path] = int(self._now())

    def remove_folder(self, path: Path) -> None:
        """Remove an empty folder."""
        self._need_folder(path)
        if not path:
            raise refuse(errno.EACCES, path)
        if self.entries(path):
            raise refuse(errno.ENOTEMPTY, path)
        self._usage.files -= 1
        del self._folders[path]

    def rename(self, old: Path, new: Path) -> None:
        """Give a file or folder another path."""
        self._need_folder(new[:-1])
        if old in self._files and new not in self._folders:
            if new in self._files and new != old:
                self.remove(new)
            self._files[new] = self._files.pop(old)
            return
        self._need_folder(old)
        if not old or new[: len(old)] == old:
            raise refuse(errno.EINVAL, new)
        if new in self._folders or new in self._files:
            raise refuse(errno.EEXIST, new)
        self._files = {_moved(path, old, new): file for path, file in self._files.items()}
        self._folders = {_moved(path, old, new): born for path, born in self._folders.items()}

    def _file(self, path: Path) -> _File:
        if path in self._folders:
            raise refuse(errno.EISDIR, path)
        if path not in self._files:
            raise refuse(errno.ENOENT, path)
        return self._files[path]

    def _need_folder(self, path: Path) -> None:
        if path in self._files:
            raise refuse(errno.ENOTDIR, path)
        if path not in self._folders:
            raise refuse(errno.ENOENT, path)

    def _resize(self, path: Path, file: _File, size: int) -> None:
        before = len(file.data)
        self._usage.resize(path, before, size)
        self._usage.bytes += size - before
        if size < before:
            del file.data[size:]
        else:
            file.data += bytes(size - before)


def _moved(path: Path, old: Path, new: Path) -> Path:
    """A path after the folder `old` became `new`."""
    return new + path[len(old) :] if path[: len(old)] == old else path
