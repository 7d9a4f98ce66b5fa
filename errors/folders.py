"""Files of a folder that a server shows: what others put there neither stops it nor leads it out."""

from __future__ import annotations

import os
import stat
from errno import EINVAL, ELOOP, EPERM
from pathlib import Path


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
    """Add bytes to a file of a folder with one call; it is made, for its owner only, if there is none.

    Raises:
        OSError: see `resolved_in_folder`, or it cannot be written.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC
    handle = os.open(resolved_in_folder(path), flags, 0o600)
    try:
        os.write(handle, data)
    finally:
        os.close(handle)
