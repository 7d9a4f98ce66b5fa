"""A temporary folder that does not remain: the next program removes one whose program was killed."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import weakref
from pathlib import Path
from tempfile import gettempdir, mkdtemp

_NEW = "framerunner-new-"  # until it is locked


class TemporaryFolder:
    """A temporary folder of this program's, removed by `close`, at the latest when the program ends.

    It is locked while the program lives, and the system unlocks it when the program is killed. So folders
    with the same prefix that are not locked are removed first. Only folders of this user are, and no link is
    followed.

    Args:
        prefix: of its name; it says what the folder is for.

    Attributes:
        path: of the folder.
    """

    def __init__(self, prefix: str) -> None:
        place = Path(gettempdir())
        with contextlib.suppress(OSError):  # it may not be listed
            for left in [each for each in place.iterdir() if each.name.startswith(prefix)]:
                _remove_if_left(left)
        new = Path(mkdtemp(prefix=_NEW))  # nobody removes it before it is locked
        lock = _locked(new)
        self.path = new.rename(place / new.name.replace(_NEW, prefix, 1))
        self.close = weakref.finalize(self, _remove, self.path, lock)


def _remove_if_left(path: Path) -> None:
    """Remove a folder that no program has locked."""
    with contextlib.suppress(OSError):  # it is another user's, no folder, or in use
        lock = _locked(path)
        try:
            found, listed = os.fstat(lock), path.lstat()
            is_own = found.st_uid == os.getuid() and (found.st_dev, found.st_ino) == (
                listed.st_dev,
                listed.st_ino,
            )
        except OSError:
            is_own = False
        if is_own:
            _remove(path, lock)
        else:
            os.close(lock)


def _locked(path: Path) -> int:
    """The descriptor that keeps a folder locked; OSError if it is locked, or no folder but a link."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _remove(path: Path, lock: int) -> None:
    shutil.rmtree(path, ignore_errors=True)  # which follows no links
    os.close(lock)
