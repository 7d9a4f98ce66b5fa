"""A vehicle's files in a folder on disk that cannot be left.

Every name of a path is opened by itself, from the folder down, and none may be a symbolic link; so neither
a path nor a link that somebody put there leads out.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as DiskPath

from errors import UserError
from firmware_py.storage import Entry, Path, refuse, sound_name
from sitl.storage import StorageLimits, Usage


class StorageFolderError(UserError):
    """A folder that cannot be used; the message is one line for people."""


class FolderStorage:
    """Files in a folder on disk.

    Args:
        folder: made if it is not there.
        limits: how much; what is in the folder already counts.

    Raises:
        StorageFolderError: the folder cannot be made or opened.
    """

    def __init__(self, folder: DiskPath, limits: StorageLimits | None = None) -> None:
        limits = limits or StorageLimits()
        self._usage = Usage(limits)
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
                break  # more than will ever be added to; no need to count a whole disk

    def close(self) -> None:
        """Let the folder go."""
        os.close(self._root)

    def space(self) -> tuple[int, int]:
        """Bytes kept, and bytes that can be kept."""
        return self._usage.space

    def entry(self, path: Path) -> Entry:
        """What is there."""
        if not path:
            return Entry("", 0, True)
        with self._parent(path) as place:
            return _checked_entry(path[-1], os.stat(path[-1], dir_fd=place, follow_symlinks=False), path)

    def entries(self, path: Path) -> list[Entry]:
        """What a folder holds, by name; links, devices and names that cannot be listed are left out."""
        with self._folder(path) as place:
            found = []
            with os.scandir(place) as scan:
                for item in scan:
                    if sound_name(item.name) and (item.is_file(follow_symlinks=False) or _is_folder(item)):
                        found.append(_entry(item.name, item.stat(follow_symlinks=False)))
        return sorted(found, key=lambda each: each.name)

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file."""
        with self._file(path, os.O_RDONLY) as file:
            return os.pread(file, count, offset)

    def write(self, path: Path, offset: int, data: bytes) -> None:
        """Write into a file that is there."""
        with self._file(path, os.O_WRONLY) as file:
            before = os.fstat(file).st_size
            after = max(before, offset + len(data)) if data else before
            self._usage.resize(path, before, after)
            with self._counted(file):
                written = 0
                while written < len(data):  # a full disk takes a part; the next try says why
                    written += os.pwrite(file, data[written:], offset + written)

    def create(self, path: Path) -> None:
        """Make an empty file, or empty the one that is there."""
        try:
            self.truncate(path, 0)
        except FileNotFoundError:
            self._usage.one_more(path)
            with self._file(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL):
                self._usage.files += 1

    def truncate(self, path: Path, size: int) -> None:
        """Make a file that long."""
        with self._file(path, os.O_WRONLY) as file:
            before = os.fstat(file).st_size
            self._usage.resize(path, before, size)
            with self._counted(file):
                os.ftruncate(file, size)

    def remove(self, path: Path) -> None:
        """Remove a file."""
        with self._parent(path) as place:
            entry = _checked_entry(path[-1], os.stat(path[-1], dir_fd=place, follow_symlinks=False), path)
            if entry.is_folder:
                raise refuse(errno.EISDIR, path)
            os.unlink(path[-1], dir_fd=place)
            self._usage.files -= 1
            self._usage.bytes -= entry.size

    def make_folder(self, path: Path) -> None:
        """Make a folder."""
        with self._parent(path) as place:
            self._usage.one_more(path)
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
            moved = _checked_entry(old[-1], os.stat(old[-1], dir_fd=source, follow_symlinks=False), old)
            replaced = 0
            try:
                there = os.stat(new[-1], dir_fd=target, follow_symlinks=False)
            except FileNotFoundError:
                there = None
            if there is not None:
                if moved.is_folder or not stat.S_ISREG(there.st_mode):
                    raise refuse(errno.EEXIST, new)
                replaced = there.st_size
            os.rename(old[-1], new[-1], src_dir_fd=source, dst_dir_fd=target)
            if there is not None and old != new:
                self._usage.files -= 1
                self._usage.bytes -= replaced

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
        """A regular file; O_NONBLOCK, or opening a named pipe would wait for its other end."""
        with self._parent(path) as place:
            file = os.open(path[-1], flags | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644, dir_fd=place)
        try:
            mode = os.fstat(file).st_mode
            if not stat.S_ISREG(mode):
                raise refuse(errno.EISDIR if stat.S_ISDIR(mode) else errno.EACCES, path)
            yield file
        finally:
            os.close(file)


def _is_folder(item: os.DirEntry[str]) -> bool:
    return item.is_dir(follow_symlinks=False)


def _entry(name: str, found: os.stat_result) -> Entry:
    folder = stat.S_ISDIR(found.st_mode)
    return Entry(name, 0 if folder else found.st_size, folder, int(found.st_mtime))


def _checked_entry(name: str, found: os.stat_result, path: Path) -> Entry:
    """The entry of a file or folder; anything else is not for clients."""
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        raise refuse(errno.EACCES, path)
    return _entry(name, found)
