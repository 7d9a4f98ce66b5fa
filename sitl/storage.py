"""A vehicle's files: in a folder on disk, or in a temporary one, gone with the program.

There are limits, so that a link cannot fill the machine. The folder cannot be left: every name of a
path is opened by itself, from the folder down, and none may be a symbolic link.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path as DiskPath
from tempfile import gettempdir

from firmware_py.storage import Path, StorageEntry, refuse, sound_name
from framerunner.errors import UserError
from sitl.temporary_folder import TemporaryFolder

MEBIBYTE = 1 << 20


class StorageFolderError(UserError):
    """A folder that cannot be used; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class StorageLimits:
    """How much is kept."""

    files: int = 1000  # files and folders together
    file_bytes: int = 64 * MEBIBYTE  # of one file
    total_bytes: int = 256 * MEBIBYTE  # of all files


class _Usage:
    """Counts files and folders together, and the bytes of all files; refuses what would be too much."""

    def __init__(self, limits: StorageLimits) -> None:
        self._limits = limits
        self.files = 0
        self.bytes = 0

    @property
    def space(self) -> tuple[int, int]:
        return self.bytes, self._limits.total_bytes

    def check_count(self, path: Path) -> None:
        """Refuse a file or folder beyond the limit."""
        if self.files >= self._limits.files:
            raise refuse(errno.ENOSPC, path)

    def check_size(self, path: Path, before: int, after: int) -> None:
        """Refuse a file's new size if it or the sum exceeds the limit."""
        if after > max(before, self._limits.file_bytes):
            raise refuse(errno.EFBIG, path)
        if after > before and self.bytes + after - before > self._limits.total_bytes:
            raise refuse(errno.ENOSPC, path)


def open_storage(folder: DiskPath | None, instance: int) -> FolderStorage:
    """The storage of an instance: a folder with its number, as PX4's simulations have, or a temporary one.

    Raises:
        StorageFolderError: the folder cannot be used.
    """
    return TemporaryStorage() if folder is None else FolderStorage(folder / str(instance))


class FolderStorage:
    """Files in a folder on disk. The methods are those of `firmware_py.storage.Storage`.

    Args:
        folder: made if it does not exist.
        limits: how much is kept; what is in the folder already counts.

    Raises:
        StorageFolderError: the folder cannot be made or opened.
    """

    def __init__(self, folder: DiskPath, limits: StorageLimits | None = None) -> None:
        limits = limits or StorageLimits()
        self._usage = _Usage(limits)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._root = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        except OSError as error:
            raise StorageFolderError(
                f"{folder}: cannot be used for the drone's files ({error.strerror}); name a folder"
            ) from error
        for _, folders, files, place in os.fwalk(dir_fd=self._root, follow_symlinks=False):
            self._usage.files += len(folders) + len(files)
            for name in files:
                self._usage.bytes += os.stat(name, dir_fd=place, follow_symlinks=False).st_size
            if self._usage.files > limits.files:
                break  # nothing more can be added; do not count a whole disk

    def close(self) -> None:
        """Close the folder."""
        os.close(self._root)

    def space(self) -> tuple[int, int]:
        """Bytes kept, and bytes that can be kept."""
        return self._usage.space

    def entry(self, path: Path) -> StorageEntry:
        """The file or folder at a path."""
        if not path:
            return StorageEntry("", 0, True)
        with self._parent(path) as place:
            return _entry_in(place, path)

    def entries(self, path: Path) -> list[StorageEntry]:
        """What a folder holds, by name; links, devices and names that cannot be listed are left out."""
        with self._folder(path) as place, os.scandir(place) as scan:
            found = [
                _entry(item.name, item.stat(follow_symlinks=False))
                for item in scan
                if sound_name(item.name)
                and (item.is_file(follow_symlinks=False) or item.is_dir(follow_symlinks=False))
            ]
        return sorted(found, key=lambda each: each.name)

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file."""
        with self._file(path, os.O_RDONLY) as file:
            return os.pread(file, count, offset)

    def write(self, path: Path, offset: int, data: bytes) -> None:
        """Write into an existing file."""
        with self._file(path, os.O_WRONLY) as file:
            before = os.fstat(file).st_size
            after = max(before, offset + len(data)) if data else before
            self._usage.check_size(path, before, after)
            with self._counted(file):
                written = 0
                while written < len(data):  # a full disk takes a part; the next call raises the reason
                    written += os.pwrite(file, data[written:], offset + written)

    def create(self, path: Path) -> None:
        """Make an empty file, or empty an existing one."""
        try:
            self.truncate(path, 0)
        except FileNotFoundError:
            self._usage.check_count(path)
            with self._file(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL):
                self._usage.files += 1

    def truncate(self, path: Path, size: int) -> None:
        """Set the size of a file."""
        with self._file(path, os.O_WRONLY) as file:
            self._usage.check_size(path, os.fstat(file).st_size, size)
            with self._counted(file):
                os.ftruncate(file, size)

    def remove(self, path: Path) -> None:
        """Remove a file."""
        with self._parent(path) as place:
            entry = _entry_in(place, path)
            if entry.is_folder:
                raise refuse(errno.EISDIR, path)
            os.unlink(path[-1], dir_fd=place)
            self._usage.files -= 1
            self._usage.bytes -= entry.size

    def make_folder(self, path: Path) -> None:
        """Make a folder."""
        with self._parent(path) as place:
            self._usage.check_count(path)
            os.mkdir(path[-1], dir_fd=place)
            self._usage.files += 1

    def remove_folder(self, path: Path) -> None:
        """Remove an empty folder."""
        with self._parent(path) as place:
            os.rmdir(path[-1], dir_fd=place)
            self._usage.files -= 1

    def rename(self, old: Path, new: Path) -> None:
        """Give a file or folder another path."""
        with self._parent(old) as source, self._parent(new) as target:
            moved = _entry_in(source, old)
            try:
                replaced = os.stat(new[-1], dir_fd=target, follow_symlinks=False)
            except FileNotFoundError:
                replaced = None
            if replaced is not None and (moved.is_folder or not stat.S_ISREG(replaced.st_mode)):
                raise refuse(errno.EEXIST, new)
            os.rename(old[-1], new[-1], src_dir_fd=source, dst_dir_fd=target)
            if replaced is not None and old != new:
                self._usage.files -= 1
                self._usage.bytes -= replaced.st_size

    @contextmanager
    def _counted(self, file: int) -> Iterator[None]:
        """Count by how much a file has really grown, also when the disk refused."""
        before = os.fstat(file).st_size
        try:
            yield
        finally:
            self._usage.bytes += os.fstat(file).st_size - before

    @contextmanager
    def _folder(self, path: Path) -> Iterator[int]:
        """A folder, opened name by name so that no link is followed."""
        place = os.dup(self._root)
        try:
            for name in path:
                deeper = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=place)
                os.close(place)
                place = deeper
            yield place
        finally:
            os.close(place)

    @contextmanager
    def _parent(self, path: Path) -> Iterator[int]:
        if not path:
            raise refuse(errno.EACCES, path)
        with self._folder(path[:-1]) as place:
            yield place

    @contextmanager
    def _file(self, path: Path, flags: int) -> Iterator[int]:
        """A regular file; O_NONBLOCK, as opening a named pipe would wait for its other end."""
        with self._parent(path) as place:
            file = os.open(path[-1], flags | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644, dir_fd=place)
        try:
            mode = os.fstat(file).st_mode
            if not stat.S_ISREG(mode):
                raise refuse(errno.EISDIR if stat.S_ISDIR(mode) else errno.EACCES, path)
            yield file
        finally:
            os.close(file)


class TemporaryStorage(FolderStorage):
    """Files in a folder that is removed when the program ends, at the latest by the next program.

    Args:
        limits: how much is kept.

    Raises:
        StorageFolderError: the folder cannot be made.
    """

    def __init__(self, limits: StorageLimits | None = None) -> None:
        try:
            self._temporary = TemporaryFolder("framerunner-storage-")
        except OSError as error:
            raise StorageFolderError(
                f"{gettempdir()}: cannot be used for the drone's files ({error.strerror}); name a folder"
            ) from error
        super().__init__(self._temporary.path, limits or StorageLimits(total_bytes=128 * MEBIBYTE))


def _entry(name: str, found: os.stat_result) -> StorageEntry:
    folder = stat.S_ISDIR(found.st_mode)
    return StorageEntry(name, 0 if folder else found.st_size, folder, int(found.st_mtime))


def _entry_in(place: int, path: Path) -> StorageEntry:
    """The entry of a file or folder in its parent; anything else is refused."""
    found = os.stat(path[-1], dir_fd=place, follow_symlinks=False)
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        raise refuse(errno.EACCES, path)
    return _entry(path[-1], found)
