"""What MAVLink FTP clients see: a vehicle's storage, and in it the firmware's files, not to be changed."""

from __future__ import annotations

import errno
from collections.abc import Mapping

from firmware_py.mavlink.file_transfer_wire import DATA_BYTES
from firmware_py.storage import Entry, Path, Storage, parse_path, refuse, sound_name


class FileTree:
    """Storage and the firmware's own files as one tree. Its methods raise OSError as `Storage` does.

    Args:
        storage: what clients may change; None: nothing can be kept.
        firmware_files: path to content, such as `etc/extras/parameters.json.xz`. Their top folders belong to
            the firmware whole. Content is asked for when a client wants it.
    """

    def __init__(self, storage: Storage | None, firmware_files: Mapping[str, bytes]) -> None:
        self._storage = storage
        self._files = firmware_files
        self._firmware = {parse_path(name.encode()): name for name in firmware_files}
        self._folders = {path[:depth] for path in self._firmware for depth in range(1, len(path))}
        self._tops = {path[0] for path in self._firmware}

    def entry(self, path: Path) -> Entry:
        """What is there."""
        if not self._is_firmware(path):
            return self._need_storage(path).entry(path)
        if path in self._firmware:
            return Entry(path[-1], len(self._files[self._firmware[path]]))
        if path in self._folders:
            return Entry(path[-1], 0, True)
        raise refuse(errno.ENOENT, path)

    def entries(self, path: Path) -> list[Entry]:
        """What a folder holds, by name."""
        if self._is_firmware(path):
            if path in self._firmware:
                raise refuse(errno.ENOTDIR, path)
            self.entry(path)
            return self._firmware_entries(path)
        kept = [] if self._storage is None and not path else self._need_storage(path).entries(path)
        if path:
            return kept
        own = self._firmware_entries(())
        return sorted(
            [each for each in kept if each.name not in self._tops] + own, key=lambda each: each.name
        )

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file."""
        if not self._is_firmware(path):
            return self._need_storage(path).read(path, offset, count)
        if path not in self._firmware:
            raise refuse(errno.EISDIR if path in self._folders else errno.ENOENT, path)
        return self._files[self._firmware[path]][offset : offset + count]

    def writable(self, path: Path) -> Storage:
        """The storage, for a path that a client may change.

        Raises:
            OSError: EACCES, the path is the firmware's or the root, or nothing can be kept.
        """
        if not path or self._is_firmware(path) or self._storage is None:
            raise refuse(errno.EACCES, path)
        return self._storage

    def listing(self, path: Path, first: int) -> bytes:
        """A page of a listing, as ListDirectory sends it: zero-terminated `Dname`, `Fname<tab>size` or `S`.

        Args:
            path: of a folder.
            first: how many entries to leave out.

        Returns:
            As many as fit into one answer; empty: there are no more.
        """
        page = bytearray()
        for entry in self.entries(path)[first:]:
            line = _line(entry)
            if len(page) + len(line) > DATA_BYTES:
                break
            page += line
        return bytes(page)

    def _is_firmware(self, path: Path) -> bool:
        return bool(path) and path[0] in self._tops

    def _need_storage(self, path: Path) -> Storage:
        if self._storage is None:
            raise refuse(errno.ENOENT, path)
        return self._storage

    def _firmware_entries(self, path: Path) -> list[Entry]:
        depth = len(path) + 1
        inside = [each for each in (*self._firmware, *self._folders) if len(each) == depth]
        return [self.entry(each) for each in sorted(inside) if each[:-1] == path]


def _line(entry: Entry) -> bytes:
    if not sound_name(entry.name):
        return b"S\0"
    if entry.is_folder:
        return b"D" + entry.name.encode() + b"\0"
    return f"F{entry.name}\t{entry.size}\0".encode()
